//! Near and far field in one, for who has a single answer to give for a footprint of any size.
//!
//! ```text
//! f(wi, wo) = (1 − w) f_near(uv, wi, wo) + w f_far(wi, wo)      w = far_weight
//! ```
//!
//! Densities, albedos and opacities are mixed likewise, so that draws, densities and values belong
//! together. Where w is 0 or 1, all is that of the one field, bit for bit.

use core::ops::{Add, Mul};

use glam::{DVec2, Vec3};

use crate::sampling::Sample;
use crate::shader::{Lobes, Shader};

use super::Footprint;

impl Shader {
    /// The BRDF as a beam of this footprint sees it, in sr⁻¹, without the cosine, linear RGB:
    /// [`Shader::eval`] where threads can be told apart, [`Shader::far_eval`] where they cannot, and a
    /// mixture between by [`Shader::far_weight`]. The mean over the cloth is that of each of them.
    #[must_use]
    #[inline]
    pub fn mixed_eval(&self, footprint: &Footprint, wi: Vec3, wo: Vec3) -> Vec3 {
        let lobes = self.mixed_eval_lobes(footprint, wi, wo);
        lobes.specular + lobes.diffuse
    }

    /// The lobes of [`Shader::mixed_eval`] apart.
    #[must_use]
    #[inline]
    pub fn mixed_eval_lobes(&self, footprint: &Footprint, wi: Vec3, wo: Vec3) -> Lobes {
        self.mixed(
            footprint,
            || self.eval_lobes(footprint.uv, wi, wo),
            || self.far_eval_lobes(footprint, wi, wo),
        )
    }

    /// The density, sr⁻¹, with which [`Shader::mixed_sample`] draws `wi` for `wo` at `footprint`.
    #[must_use]
    pub fn mixed_pdf(&self, footprint: &Footprint, wi: Vec3, wo: Vec3) -> f32 {
        self.mixed(footprint, || self.pdf(footprint.uv, wi, wo), || self.far_pdf(footprint, wi, wo))
    }

    /// A direction for light to `wo` at `footprint`, drawn from the near or the far field by the three
    /// numbers `xi` in [0, 1), the first of which chooses; its density and weight are those of the mixture.
    ///
    /// `None` where nothing is reflected, or the drawn direction is below the surface: such a draw
    /// counts as a sample that reflects nothing.
    #[must_use]
    pub fn mixed_sample(&self, footprint: &Footprint, wo: Vec3, xi: [f32; 3]) -> Option<Sample> {
        let weight = self.weight_at(footprint);
        let near = |xi| self.sample(footprint.uv, wo, xi);
        let far = |xi| self.far_sample(footprint, wo, xi);
        if weight == 0.0 {
            return near(xi);
        }
        if weight == 1.0 {
            return far(xi);
        }
        let [choice, a, b] = xi;
        // What is left of the number that chose is as even.
        let drawn = if choice < weight {
            far([choice / weight, a, b])
        } else {
            near([(choice - weight) / (1.0 - weight), a, b])
        };
        let wi = drawn?.wi;
        let pdf = self.mixed_pdf(footprint, wi, wo);
        let weight = self.mixed_eval(footprint, wi, wo) * wi.z.abs() / pdf;
        (pdf > 0.0 && weight.is_finite()).then_some(Sample { wi, weight, pdf })
    }

    /// Directional albedo for `wo` at `footprint`, linear RGB: [`Shader::albedo`] and
    /// [`Shader::far_albedo`], as accurate as these.
    #[must_use]
    pub fn mixed_albedo(&self, footprint: &Footprint, wo: Vec3) -> Vec3 {
        self.mixed(footprint, || self.albedo(footprint.uv, wo), || self.far_albedo(footprint, wo))
    }

    /// The share of the light that does not pass straight through the cloth at `footprint`, in [0, 1]:
    /// [`Shader::opacity`] and [`Shader::far_opacity`].
    #[must_use]
    pub fn mixed_opacity(&self, footprint: &Footprint) -> f32 {
        self.mixed(footprint, || self.opacity(footprint.uv), || self.far_opacity(footprint))
    }

    /// What is between both fields; the one that does not count is not computed.
    #[inline]
    fn mixed<T>(
        &self,
        footprint: &Footprint,
        near: impl FnOnce() -> T,
        far: impl FnOnce() -> T,
    ) -> T
    where
        T: Mul<f32, Output = T> + Add<Output = T>,
    {
        match self.weight_at(footprint) {
            0.0 => near(),
            1.0 => far(),
            weight => near() * (1.0 - weight) + far() * weight,
        }
    }

    /// [`Shader::far_weight`]; 0 nowhere, where the near field reflects nothing.
    #[inline]
    fn weight_at(&self, footprint: &Footprint) -> f32 {
        // Most callers ask for points, and quickly.
        if footprint.deviation == DVec2::ZERO || !footprint.uv.is_finite() {
            return 0.0;
        }
        self.far_weight(footprint.deviation)
    }
}
