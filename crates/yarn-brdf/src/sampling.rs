//! Directions drawn in proportion to the BRDF, with the exact density they are drawn with.
//!
//! The diffuse lobe draws from the cosine. The highlight draws a place of the yarn whose highlight
//! covers the point (an angle v of twisted or u of untwisted fibres, evenly; for rough fibres the
//! point itself and an inclination about the fibre) and an azimuth about its fibre on the side that the
//! yarn faces; the change of variables to the direction is the geometry factor, so its density is
//!
//! ```text
//! staple    p(φ) / (Δv (p+q) |sin ψ|)      filament   p(φ) / (Δu √(H_y² + H_z²))      rough   p(φ) M
//! ```
//!
//! and f cos θ over it is bounded. A direction that leaves through the cloth is no sample: it is not
//! folded back, which would add a second branch to the density. One of the lobes is chosen at random
//! and the density is that of both (Veach 1997, section 9.2.4).

use glam::{DVec2, Vec3};

use crate::density::{Drawing, density};
use crate::draw::draw;
use crate::frame::{Vector, from_yarn, to_yarn};
use crate::place::Place;
use crate::shader::Shader;
use crate::weave::Side;

/// A direction drawn by [`Shader::sample`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// The direction, unit, in the shading frame, on the side of `wo`.
    pub wi: Vec3,
    /// f cos θi / pdf, linear RGB.
    pub weight: Vec3,
    /// The density with which it was drawn, sr⁻¹.
    pub pdf: f32,
}

impl Shader {
    /// A direction for light to `wo` at `uv` (m), drawn nearly in proportion to f cos θ by the three
    /// numbers `xi` in [0, 1).
    ///
    /// `None` in a gap, on a yarn of opacity 0 and where the drawn direction is below the surface: such a draw
    /// counts as a sample that reflects nothing.
    #[must_use]
    pub fn sample(&self, uv: DVec2, wo: Vec3, xi: [f32; 3]) -> Option<Sample> {
        self.with_seen(uv, wo, |seen| {
            let (place, drawing) = (seen.place, self.drawing_of(seen));
            let wi = draw(place.piece, place.at, &drawing, seen.wo, xi);
            // Rounded as whoever asks for its density has it.
            let wi = (wi.z > 0.0).then(|| self.to_surface(seen, wi))?;
            let wi_yarn = self.to_yarn(seen, wi)?;
            let pdf = density(place.piece, place.at, &drawing, wi_yarn, seen.wo);
            let [specular, diffuse] = self.lobes_at(place, wi_yarn, seen.wo).map(Vec3::from);
            let weight = (specular + diffuse) * wi.z.abs() / pdf;
            (pdf > 0.0 && weight.is_finite()).then_some(Sample { wi, weight, pdf })
        })?
    }

    /// The density, sr⁻¹, with which [`Shader::sample`] draws `wi` for `wo` at `uv` (m).
    ///
    /// Its integral over `wi` is at most 1, and less by the draws that are not samples. It is above 0 for all
    /// directions on the side of `wo`, but in a gap and on a yarn of opacity 0, where it is 0.
    #[must_use]
    pub fn pdf(&self, uv: DVec2, wi: Vec3, wo: Vec3) -> f32 {
        let pdf = self.with_seen(uv, wo, |seen| {
            let (place, wi) = (seen.place, self.to_yarn(seen, wi)?);
            Some(density(place.piece, place.at, &self.drawing_of(seen), wi, seen.wo))
        });
        pdf.flatten().unwrap_or(0.0)
    }

    /// Directional albedo for `wo`, linear RGB: the share of the light to `wo` that [`Shader::eval`]
    /// reflects, from tables and closed forms, for little more than a look-up.
    ///
    /// That of the highlight is averaged over the segment that shows at `uv` (m), an upper bound that is
    /// good to a few hundredths, with the brighter of both its colours. That of the diffuse is exact if
    /// it is [`Diffuse::Flat`](crate::Diffuse::Flat); by the yarn's normal it is that of the point.
    /// [`Shader::albedo_of_segment`] takes longer and is a yardstick.
    #[must_use]
    pub fn albedo(&self, uv: DVec2, wo: Vec3) -> Vec3 {
        let albedo = self.with_seen(uv, wo, |seen| {
            let place = seen.place;
            let [specular, diffuse] = self
                .lobe_albedos(place.piece, place.at, seen.wo)
                .map(|lobe| lobe * place.look.opacity);
            let [of_peak, of_uniform] = place.look.specular.map(Vec3::from);
            of_peak.max(of_uniform) * specular + Vec3::from(place.look.color) * diffuse
        });
        albedo.unwrap_or(Vec3::ZERO)
    }

    /// What `use_it` makes of what `wo` sees at `uv`; `None` if that is nothing.
    pub(crate) fn with_seen<T>(
        &self,
        uv: DVec2,
        wo: Vec3,
        use_it: impl FnOnce(&Seen<'_>) -> T,
    ) -> Option<T> {
        let wo = Vector::<f32>::of(wo);
        let (side, wo, _) = self.oriented(wo, wo)?;
        let seen = self.with_place(&self.materials.single, uv, side, |place| {
            let wo = to_yarn(wo, place.segment.is_warp);
            (place.look.opacity > 0.0).then(|| use_it(&Seen { side, place, wo }))
        });
        seen.flatten()
    }

    /// How directions are drawn there.
    fn drawing_of(&self, seen: &Seen<'_>) -> Drawing<f32> {
        let place = seen.place;
        self.drawing(place.piece, place.at, seen.wo, place.look.bright())
    }

    /// A direction of the yarn frame in the shading frame.
    pub(crate) fn to_surface(&self, seen: &Seen<'_>, w: Vector<f32>) -> Vec3 {
        let w = from_yarn(w, seen.place.segment.is_warp);
        let w = if seen.side == Side::Back { w.turned_over() } else { w };
        let w = self.frame.turned_back(w);
        Vec3::new(w.x, w.y, w.z)
    }

    /// A direction of the shading frame in the yarn frame, if it is on the side of `wo`.
    fn to_yarn(&self, seen: &Seen<'_>, w: Vec3) -> Option<Vector<f32>> {
        let w = Vector::<f32>::of(w);
        let (side, w, _) = self.oriented(w, w)?;
        (side == seen.side).then(|| to_yarn(w, seen.place.segment.is_warp))
    }
}

/// What a direction sees at a position.
pub(crate) struct Seen<'a> {
    side: Side,
    pub(crate) place: &'a Place<'a, f32>,
    /// In the yarn frame.
    pub(crate) wo: Vector<f32>,
}
