//! `Shader`'s albedo by quadrature, for checks.

use core::f64::consts::PI;

use glam::{DVec2, DVec3};

use crate::albedo::{Integrals, Nodes};
use crate::frame::{Vector, to_yarn};
use crate::phase::Phase;
use crate::place::Place;
use crate::shader::Shader;
use crate::table::cosine_mean;
use crate::weave::Side;
use crate::yarn::Yarn;

/// Points along and across a segment for the mean of its diffuse reflection by the yarn's normal.
const POINTS: i32 = 16;

impl Shader {
    /// Directional albedo at `uv` (m) for `wo` on the face: `∫ f cos θi dwi`, linear RGB, by a
    /// quadrature of its own in f64, whose error is about 10⁻³.
    ///
    /// 0 in a gap and for `wo` not above the surface.
    #[must_use]
    pub fn albedo_at(&self, uv: DVec2, wo: DVec3) -> DVec3 {
        self.albedo_with(uv, wo, false)
    }

    /// Directional albedo for `wo` on the face, averaged over the segment that shows at `uv` (m), with
    /// the colours and the width that it has there, but with the mean of its irregular intensity;
    /// otherwise as [`Shader::albedo_at`].
    #[must_use]
    pub fn albedo_of_segment(&self, uv: DVec2, wo: DVec3) -> DVec3 {
        self.albedo_with(uv, wo, true)
    }

    fn albedo_with(&self, uv: DVec2, wo: DVec3, is_mean: bool) -> DVec3 {
        if !(wo.is_finite() && wo.z > 0.0) {
            return DVec3::ZERO;
        }
        let albedo = self.with_place(&self.materials.double, uv, Side::Face, |place| {
            let kind = &self.materials.kinds[place.yarn];
            let yarn = &self.yarn_of(kind, &place.segment, place.piece.u_max_limit);
            let [x, y, ratio] = place.at;
            let wo = to_yarn(self.frame.turned(Vector::<f64>::of(wo)), place.segment.is_warp);
            let divisor = place.piece.reflectance.divisor(ratio);
            let specular = |yarn: &Yarn| {
                let is_straight = place.segment.is_straight();
                let nodes = Nodes::resolving(yarn, 2.0);
                let integrals = Integrals::new(yarn, is_straight, self.mapping, nodes);
                let wo = DVec3::new(wo.x, wo.y, wo.z);
                if is_mean {
                    integrals.mean(wo).at(ratio) / divisor
                } else {
                    integrals.at_point(x, y, wo).at(ratio) / divisor * place.look.intensity
                }
            };
            // The uniform part may have a colour of its own.
            let [of_peak, of_uniform] = place.look.specular.map(DVec3::from_array);
            let highlight = if of_peak == of_uniform {
                of_peak * specular(yarn)
            } else {
                let phase = Phase::VonMises { alpha: 1.0, beta: 0.0 };
                let share = yarn.phase.uniform_integral();
                let uniform = share * specular(&Yarn { phase, ..yarn.clone() });
                of_peak * (specular(yarn) - uniform) + of_uniform * uniform
            };
            let diffuse = if is_mean && place.piece.diffuse_scale.is_some() {
                let at = |k: i32| 2.0 * (f64::from(k) + 0.5) / f64::from(POINTS) - 1.0;
                let points = (0..POINTS * POINTS).map(|k| [at(k % POINTS), at(k / POINTS)]);
                let sum: f64 = points
                    .map(|[x, y]| {
                        self.diffuse_albedo(&Place { at: [x, y, ratio], ..*place }, wo, 0.5)
                    })
                    .sum();
                sum / f64::from(POINTS * POINTS)
            } else {
                self.diffuse_albedo(place, wo, 1.0)
            };
            place.look.opacity * (highlight + DVec3::from_array(place.look.color) * diffuse)
        });
        albedo.unwrap_or(DVec3::ZERO)
    }

    /// Directional albedo of the diffuse lobe of an opaque white yarn.
    fn diffuse_albedo(&self, place: &Place<'_, f64>, wo: Vector<f64>, density: f64) -> f64 {
        let inv_divisor = 1.0 / place.piece.reflectance.divisor(place.at[2]);
        PI * cosine_mean(density, |wi| self.diffuse(place.piece, place.at, inv_divisor, wi, wo))
    }
}
