//! The lights of a scene, and which of them a point looks at.

use super::{
    Light,
    distribution::{choose, probability, running_sums},
};

/// Most lights that a point looks at.
pub const MOST_DRAWN: usize = 8;

/// How often a point draws the only light, if that is wide and all places of the point see it alike: in swatches of denim
/// under a lamp 17° wide and the sky that takes half the noise off, for a fifth more time.
const DRAWS_OF_ONE: usize = 4;

/// Lights, of which a point looks at all or at some, chosen by their power.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Lights {
    lights: Vec<Light>,
    /// Of their powers.
    sums: Vec<u32>,
    /// How many are chosen; `None` if all are looked at.
    chosen: Option<usize>,
    /// How often each of them is looked at on average.
    expected: Vec<f32>,
    looked_at: usize,
    draws: usize,
    are_narrow: bool,
    has_sky: bool,
}

impl Lights {
    /// The `lights` of a scene within `scene_radius` metres of its middle.
    pub fn new(lights: Vec<Light>, scene_radius: f32) -> Self {
        let weights = lights.iter().map(|light| {
            let power = light.power(scene_radius);
            // What is too bright for a number is still brightest; what is not a number shines not.
            if power > 0.0 { f64::from(power.min(f32::MAX)) } else { 0.0 }
        });
        let sums: Vec<u32> = running_sums(weights).collect();
        let shining = (0..lights.len()).filter(|&index| probability(&sums, index) > 0.0).count();
        let chosen = match shining {
            // To look at both takes a fifth more time and an eighth off the variance.
            2 => Some(1),
            0..=MOST_DRAWN => None,
            _ => Some(MOST_DRAWN),
        };
        let expected = |index| {
            let probability = probability(&sums, index) as f32;
            match chosen {
                Some(count) => count as f32 * probability,
                None => f32::from(u8::from(probability > 0.0)),
            }
        };
        let expected: Vec<_> = (0..lights.len()).map(expected).collect();
        let looked_at = chosen.unwrap_or(shining);
        let are_narrow =
            lights.iter().zip(&expected).all(|(light, &drawn)| drawn == 0.0 || light.is_narrow());
        let has_sky = lights.iter().any(|light| matches!(light, Light::Sky(_)));
        let draws = if shining == 1 && !are_narrow { DRAWS_OF_ONE } else { looked_at };
        Self { lights, sums, chosen, expected, looked_at, draws, are_narrow, has_sky }
    }

    /// All of them.
    pub fn as_slice(&self) -> &[Light] {
        &self.lights
    }

    /// How many a point looks at, at most.
    pub fn looked_at(&self) -> usize {
        self.looked_at
    }

    /// How many lights a point looks at, at most, if its places are so close together that the direction to a light
    /// matters more than which of them looks at it: the only one several times if it is not narrow.
    pub fn draws(&self) -> usize {
        self.draws
    }

    /// The lights that a point looks at, by index: all that shine of three to eight, eight of more,
    /// some twice, and one of two. A choice is by power, and by the number that `xi` returns, in [0, 1), which
    /// is asked for then alone.
    pub fn draw(&self, xi: impl FnOnce() -> f32) -> impl Iterator<Item = usize> {
        let xi = if self.chosen.is_some() { xi() } else { 0.0 };
        let count = self.chosen.unwrap_or(self.lights.len());
        (0..count).filter_map(move |k| {
            if self.chosen.is_some() {
                // Below 1 after rounding, too.
                let xi = ((k as f32 + xi) / count as f32).min(1.0 - f32::EPSILON);
                choose(&self.sums, xi).map(|choice| choice.index)
            } else {
                (self.expected(k) > 0.0).then_some(k)
            }
        })
    }

    /// Whether all that are drawn are [narrow](Light::is_narrow).
    pub fn are_narrow(&self) -> bool {
        self.are_narrow
    }

    /// Whether there is one that is never drawn, but found along rays alone.
    pub fn has_sky(&self) -> bool {
        self.has_sky
    }

    /// How often [`Lights::draw`] names the light `index` on average.
    ///
    /// # Panics
    ///
    /// When there is no such light.
    pub fn expected(&self, index: usize) -> f32 {
        self.expected[index]
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::scene::light::{Constant, Distant, Sky, Sphere};

    fn lights() -> Vec<Light> {
        let sphere = |radiance| Sphere { centre: Vec3::ZERO, radius: 0.5, radiance };
        vec![
            Light::Distant(Distant::new(Vec3::Z, Vec3::ONE, 0.01)),
            Light::Sphere(sphere(Vec3::ONE)),
            Light::Sphere(sphere(Vec3::ZERO)),
            Light::Constant(Constant { radiance: Vec3::splat(0.25) }),
        ]
    }

    #[test]
    fn all_of_a_few_lights_are_looked_at_but_those_that_do_not_shine() {
        let lights = Lights::new(lights(), 1.0);
        let drawn: Vec<_> = lights.draw(|| panic!("there is no choice")).collect();
        assert_eq!(drawn, [0, 1, 3]);
        assert_eq!([0, 1, 2, 3].map(|index| lights.expected(index)), [1.0, 1.0, 0.0, 1.0]);
    }

    #[test]
    fn all_are_narrow_if_those_that_are_drawn_are() {
        let narrow = |angle| Light::Distant(Distant::new(Vec3::Z, Vec3::ONE, angle));
        let sky = Light::Sky(Sky { zenith: Vec3::ONE, horizon: Vec3::ONE });
        let are_narrow = |lights: &[Light]| Lights::new(lights.to_vec(), 1.0).are_narrow();
        // 6° and 7°.
        assert!(are_narrow(&[narrow(0.0), narrow(0.105), sky.clone(), lights()[2].clone()]));
        assert!(!are_narrow(&[narrow(0.0), narrow(0.122)]));
        assert!(!are_narrow(&[narrow(0.105), lights()[1].clone(), sky]));
    }

    #[test]
    fn the_only_light_is_drawn_several_times_if_it_is_wide() {
        let [narrow, wide, black, even] = lights().try_into().expect("they are four");
        let sky = Light::Sky(Sky { zenith: Vec3::ONE, horizon: Vec3::ONE });
        let draws = |lights: &[&Light]| {
            let lights = lights.iter().map(|&light| light.clone()).collect();
            let lights = Lights::new(lights, 1.0);
            (lights.looked_at(), lights.draws())
        };
        assert_eq!(draws(&[&wide]), (1, DRAWS_OF_ONE));
        assert_eq!(draws(&[&sky, &black, &wide]), (1, DRAWS_OF_ONE));
        assert_eq!(draws(&[&sky, &narrow]), (1, 1));
        assert_eq!(draws(&[&wide, &narrow]), (1, 1));
        assert_eq!(draws(&[&wide, &even, &narrow]), (3, 3));
        assert_eq!(draws(&[&sky, &black]), (0, 0));
    }

    #[test]
    fn one_of_two_lights_is_chosen_by_its_power() {
        let lights = Lights::new(lights()[..3].to_vec(), 1.0);
        let part = 1.0 / (1.0 + std::f32::consts::PI);
        for (index, expected) in [part, 1.0 - part, 0.0].into_iter().enumerate() {
            assert!((lights.expected(index) - expected).abs() < 1e-6, "{index}");
        }
        let drawn = |xi| lights.draw(|| xi).collect::<Vec<_>>();
        assert_eq!([0.0, part - 0.01, part + 0.01].map(drawn), [[0], [0], [1]]);
    }

    #[test]
    fn many_lights_are_chosen_by_their_power() {
        let lights = Lights::new([lights(), lights(), lights()].concat(), 1.0);
        // 1, π, 0 and π of 1 + 2π, three times.
        let pi = std::f32::consts::PI;
        let powers = [1.0, pi, 0.0, pi].map(|power| power / (3.0 + 6.0 * pi));
        let n = 10_000;
        let mut counts = [0.0; 12];
        for k in 0..n {
            let drawn: Vec<_> = lights.draw(|| (k as f32 + 0.5) / n as f32).collect();
            assert_eq!(drawn.len(), MOST_DRAWN);
            drawn.iter().for_each(|&index| counts[index] += 1.0 / n as f32);
        }
        for (index, count) in counts.into_iter().enumerate() {
            let (found, expected) = (lights.expected(index), 8.0 * powers[index % 4]);
            assert!((found - expected).abs() < 1e-5, "{index}: {found}, expected {expected}");
            assert!((count - expected).abs() < 1e-3, "{counts:?}, expected {expected}");
        }
        // The greatest number below 1.
        assert_eq!(lights.draw(|| 1.0 - f32::EPSILON / 2.0).count(), MOST_DRAWN);
    }

    #[test]
    fn nothing_is_looked_at_where_nothing_shines() {
        let none = |lights: Vec<Light>| Lights::new(lights, 1.0).draw(|| 0.5).next();
        assert_eq!(none(vec![]), None);
        assert_eq!(none(lights()[2..3].to_vec()), None);
        assert_eq!(none(vec![lights()[2].clone(); 20]), None);
        // A radius that makes the power overflow, and one that is not a number.
        assert!(Lights::new(lights(), 1e30).draw(|| 0.5).next().is_some());
        assert_eq!(Lights::new(lights(), f32::NAN).draw(|| 0.5).next(), Some(1));
    }
}
