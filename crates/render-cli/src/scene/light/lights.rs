//! The lights of a scene, and a choice among them.

use super::{
    Light,
    distribution::{choose, probability, running_sums},
};

/// Lights, of which one can be chosen by its power.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Lights {
    lights: Vec<Light>,
    /// Of their powers.
    sums: Vec<u32>,
}

impl Lights {
    /// The `lights` of a scene within `scene_radius` metres of its middle.
    pub fn new(lights: Vec<Light>, scene_radius: f32) -> Self {
        let weights = lights.iter().map(|light| {
            let power = light.power(scene_radius);
            // What is too bright for a number is still brightest; what is not a number shines not.
            if power > 0.0 { f64::from(power.min(f32::MAX)) } else { 0.0 }
        });
        let sums = running_sums(weights).collect();
        Self { lights, sums }
    }

    /// All of them.
    pub fn as_slice(&self) -> &[Light] {
        &self.lights
    }

    /// The index of the light that `xi` in [0, 1) names, and the probability with which it does: the
    /// light's part in the power of all. `None` when there is no power.
    pub fn choose(&self, xi: f32) -> Option<(usize, f32)> {
        choose(&self.sums, xi).map(|choice| (choice.index, choice.probability as f32))
    }

    /// The probability with which [`Lights::choose`] names the light `index`.
    ///
    /// # Panics
    ///
    /// When there is no such light.
    pub fn probability(&self, index: usize) -> f32 {
        probability(&self.sums, index) as f32
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::scene::light::{Constant, Distant, Sphere};

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
    fn lights_are_chosen_by_their_power() {
        let lights = Lights::new(lights(), 1.0);
        // π, π², 0 and π² of π + 2π².
        let pi = std::f32::consts::PI;
        let expected = [1.0, pi, 0.0, pi].map(|power| power / (1.0 + 2.0 * pi));
        for (index, expected) in expected.into_iter().enumerate() {
            let found = lights.probability(index);
            assert!((found - expected).abs() < 1e-6, "{index}: {found}, expected {expected}");
        }
        let mut counts = [0.0; 4];
        let n = 10_000;
        for k in 0..n {
            let (index, probability) = lights.choose((k as f32 + 0.5) / n as f32).unwrap();
            assert_eq!(probability, lights.probability(index));
            counts[index] += 1.0 / n as f32;
        }
        for (count, expected) in counts.into_iter().zip(expected) {
            assert!((count - expected).abs() < 2e-4, "{counts:?}, expected {expected}");
        }
    }

    #[test]
    fn nothing_is_chosen_where_nothing_shines() {
        assert_eq!(Lights::new(vec![], 1.0).choose(0.5), None);
        assert_eq!(Lights::new(lights()[2..3].to_vec(), 1.0).choose(0.5), None);
        // A radius that makes the power overflow, and one that is not a number.
        assert!(Lights::new(lights(), 1e30).choose(0.5).is_some());
        assert_eq!(Lights::new(lights(), f32::NAN).choose(0.5).unwrap().0, 1);
    }
}
