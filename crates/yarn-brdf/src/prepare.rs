//! `Preparer`: from one cloth after the other to its shader.

use crate::cloth::{Cloth, ClothError};
use crate::shader::Shader;
use crate::variants::{Known, Tables};

/// Prepares cloths one after the other, as while somebody changes one, and remembers what it found: a
/// type of yarn of which nothing but the colour has changed takes no time.
///
/// Shaders are the same, bit for bit, whatever was prepared before; but for [sketches](Preparer::sketch).
///
/// # Examples
///
/// ```
/// use selvedge_yarn_brdf::{Cloth, Preparer, Thread, Weave, Yarn, glam::DVec2};
///
/// let plain = Weave::new(2, 2, |end, pick| end == pick)?;
/// let thread = Thread { color: [0.5, 0.1, 0.1], ..Thread::default() };
/// let mut cloth = Cloth::from_threads(plain, &[thread; 2], &[thread; 2], &Yarn::default())?;
/// let mut preparer = Preparer::default();
/// let first = preparer.prepare(&cloth, &|| true)?.expect("it goes on to the end");
/// cloth.yarns[0].psi = 0.6;
/// let quick = preparer.sketch(&cloth, &|| true)?.expect("it goes on to the end");
/// let [before, after] = [first, quick].map(|shader| shader.yarn_at(DVec2::splat(0.1e-3)));
/// // The fibres run another way round the yarn.
/// assert!(before.zip(after).is_some_and(|(before, after)| before.tangent != after.tangent));
/// # Ok::<(), selvedge_yarn_brdf::ClothError>(())
/// ```
#[derive(Debug, Default)]
pub struct Preparer {
    known: Known,
}

impl Preparer {
    /// The shader of `cloth`, as [`Cloth::prepare`] makes it. `None` as soon as `goes_on` returns false,
    /// which it is asked every few milliseconds; what was found until then is remembered.
    ///
    /// # Errors
    ///
    /// As for [`Cloth::prepare`].
    pub fn prepare(
        &mut self,
        cloth: &Cloth,
        goes_on: &dyn Fn() -> bool,
    ) -> Result<Option<Shader>, ClothError> {
        self.shader(cloth, goes_on, false)
    }

    /// A shader much like that of `cloth`, in much less time where similar cloth was prepared before:
    /// albedos and factors are those of the most similar yarn that is known. So highlights may be
    /// brighter or darker by what these differ, and the cloth may reflect somewhat more than it
    /// receives; all else is as it should be. For pictures that are shown for a moment.
    ///
    /// # Errors
    ///
    /// As for [`Cloth::prepare`].
    pub fn sketch(
        &mut self,
        cloth: &Cloth,
        goes_on: &dyn Fn() -> bool,
    ) -> Result<Option<Shader>, ClothError> {
        self.shader(cloth, goes_on, true)
    }

    fn shader(
        &mut self,
        cloth: &Cloth,
        goes_on: &dyn Fn() -> bool,
        is_sketch: bool,
    ) -> Result<Option<Shader>, ClothError> {
        cloth.check()?;
        let (mapping, mode, known) = (cloth.mapping, cloth.normalization, &mut self.known);
        let shader = Shader::new(cloth, &mut Tables { mapping, mode, known, is_sketch, goes_on });
        self.known.forget_old();
        shader
    }
}

#[cfg(test)]
mod tests {
    use core::cell::Cell;

    use glam::{DVec2, Vec3};

    use super::*;
    use crate::{Highlight, Thread, Weave, Yarn};

    fn cloth(psi: f64, color: f32) -> Cloth {
        let weave = Weave::new(3, 3, |end, pick| (end + pick) % 3 == 0).unwrap();
        let thread = Thread { color: [color; 3], pitch: Some(1e-3), ..Thread::default() };
        let yarn = Yarn { psi, highlight: Highlight::Rough { sigma: 0.2 }, ..Yarn::default() };
        Cloth::from_threads(weave, &[thread; 3], &[thread; 3], &yarn).unwrap()
    }

    fn values(shader: &Shader) -> Vec<Vec3> {
        let light = Vec3::new(0.48, 0.36, 0.8);
        let uv = |k: u32| DVec2::new(f64::from(k % 7) * 0.43e-3, f64::from(k / 7) * 0.41e-3);
        (0..49).map(|k| shader.eval(uv(k), light, Vec3::Z)).collect()
    }

    #[test]
    fn what_was_prepared_before_changes_no_bit() {
        let mut preparer = Preparer::default();
        for (psi, color) in [(0.2, 0.5), (0.2, 0.1), (0.3, 0.1), (0.2, 0.5)] {
            let cloth = cloth(psi, color);
            let found = preparer.prepare(&cloth, &|| true).unwrap().unwrap();
            let expected = cloth.prepare().unwrap();
            assert_eq!(values(&found), values(&expected), "{psi} {color}");
            assert_eq!(found.normalization(0), expected.normalization(0));
        }
        assert_eq!(preparer.known.len(), 2, "colours share a table");
    }

    #[test]
    fn sketch_is_near_the_shader_and_is_not_taken_for_it() {
        let mut preparer = Preparer::default();
        preparer.prepare(&cloth(0.3, 0.5), &|| true).unwrap().unwrap();
        let changed = cloth(0.33, 0.5);
        let sketch = values(&preparer.sketch(&changed, &|| true).unwrap().unwrap());
        let exact = preparer.prepare(&changed, &|| true).unwrap().unwrap();
        assert_eq!(exact.normalization(0), changed.prepare().unwrap().normalization(0));
        let exact = values(&exact);
        assert!(sketch != exact, "a similar table was taken");
        let sum = |values: &[Vec3]| values.iter().map(|value| value.x).sum::<f32>();
        let difference = sum(&sketch) / sum(&exact) - 1.0;
        assert!(difference.abs() < 0.02, "{difference}");
    }

    #[test]
    fn nobody_waits_for_what_nobody_wants() {
        let asked = Cell::new(0);
        let goes_on = || {
            asked.set(asked.get() + 1);
            asked.get() < 100
        };
        let mut preparer = Preparer::default();
        assert!(preparer.prepare(&cloth(0.2, 0.5), &goes_on).unwrap().is_none());
        let shader = preparer.prepare(&cloth(0.2, 0.5), &|| true).unwrap().unwrap();
        assert_eq!(values(&shader), values(&cloth(0.2, 0.5).prepare().unwrap()));
    }
}
