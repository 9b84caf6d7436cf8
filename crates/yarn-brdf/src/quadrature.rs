//! `Shader`'s albedo by quadrature, for checks.

use core::f64::consts::PI;

use glam::{DVec2, DVec3};

use crate::albedo::{Affine, Integrals, Nodes};
use crate::frame::{Vector, to_yarn};
use crate::phase::Phase;
use crate::shader::Shader;
use crate::table::cosine_mean;
use crate::weave::{Segment, Side};
use crate::yarn::Yarn;

impl Shader {
    /// Directional albedo at `uv` (m) for `wo` on the face: `∫ f cos θi dwi`, linear RGB, by a
    /// quadrature of its own in f64, whose error is about 10⁻³.
    ///
    /// Textures and irregularities are left out. 0 in a gap and for `wo` not above the surface.
    #[must_use]
    pub fn albedo_at(&self, uv: DVec2, wo: DVec3) -> DVec3 {
        self.albedo_with(uv, wo, |integrals, segment, wo| {
            integrals.at_point(segment.x, segment.y, wo)
        })
    }

    /// Directional albedo for `wo` on the face, averaged over the segment that shows at `uv` (m);
    /// otherwise as [`Shader::albedo_at`].
    #[must_use]
    pub fn albedo_of_segment(&self, uv: DVec2, wo: DVec3) -> DVec3 {
        self.albedo_with(uv, wo, |integrals, _, wo| integrals.mean(wo))
    }

    fn albedo_with(
        &self,
        uv: DVec2,
        wo: DVec3,
        highlight: impl Fn(&Integrals, &Segment, DVec3) -> Affine<f64>,
    ) -> DVec3 {
        if !(wo.is_finite() && wo.z > 0.0) {
            return DVec3::ZERO;
        }
        let albedo = self.with_place(&self.materials.double, uv, Side::Face, |place| {
            let kind = &self.materials.kinds[place.yarn];
            let u_max = kind.yarn.u_max.min(place.piece.u_max_limit);
            let yarn = &Yarn { u_max, ..kind.yarn.clone() };
            let ratio = place.at[2];
            let wo = to_yarn(self.frame.turned(Vector::<f64>::of(wo)), place.segment.is_warp);
            let divisor = place.piece.reflectance.divisor(ratio);
            let specular = |yarn: &Yarn| {
                let is_straight = place.segment.is_straight();
                let nodes = Nodes::resolving(yarn, 2.0);
                let integrals = Integrals::new(yarn, is_straight, self.mapping, nodes);
                let wo = DVec3::new(wo.x, wo.y, wo.z);
                highlight(&integrals, &place.segment, wo).at(ratio) / divisor
            };
            // The uniform part may have a colour of its own.
            let phase = Phase::VonMises { alpha: 1.0, beta: 0.0 };
            let uniform = match yarn.phase.uniform_integral() {
                0.0 => 0.0,
                share => share * specular(&Yarn { phase, ..yarn.clone() }),
            };
            let peak = specular(yarn) - uniform;
            let [of_peak, of_uniform] = place.specular.map(DVec3::from_array);
            let diffuse = PI * cosine_mean(1.0, |wi| self.diffuse(place, divisor, wi, wo));
            place.opacity
                * (of_peak * peak + of_uniform * uniform + DVec3::from_array(place.color) * diffuse)
        });
        albedo.unwrap_or(DVec3::ZERO)
    }
}
