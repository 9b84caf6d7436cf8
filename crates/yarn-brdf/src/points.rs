//! The greatest albedo of a point of a yarn, for the factor of equation 2 at every point.
//!
//! It lies in places that points spread evenly over the segment and the directions seldom meet:
//!
//! - at the edges of the yarn, where the arcsine map's dv/dx = 1/cos v is steep. There cos v is even in
//!   its logarithm;
//! - within 2δ of the ends of the window's axis. Drawn highlights stay on the segment, so that up to half
//!   as many again cover those points. Half of the search is there;
//! - where a spine that is no circle has most of its length, which is a peak of S(u) in the middle of a
//!   flat one and at the ends of a sharp one. Two charts of three are even along the spine;
//! - at grazing directions, at which a sharp forward peak leaves the cloth again. There they crowd in
//!   the same two charts, and in one of them about those in the plane of the yarn's surface as well,
//!   past which such a peak goes.

use core::f64::consts::FRAC_PI_2;

use selvedge_normalize::glam::{DVec2, DVec3};
use selvedge_normalize::scale::{Normalization, Options, ScaleError};
use selvedge_normalize::search::Search;

use crate::albedo::Integrals;
use crate::segment::{COS_V_MIN, Mapping, Spread, normal};

/// A way to lay the unit square on a segment and the hemisphere on itself.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Chart {
    /// Even along the map of the segment and over the hemisphere.
    Even,
    /// Even along the spine, unless that is a circle, and crowded at grazing directions.
    Grazing,
    /// As that, and crowded where directions graze the yarn as well.
    Tangent,
}

impl Chart {
    pub(crate) const ALL: [Self; 3] = [Self::Even, Self::Grazing, Self::Tangent];

    /// The point (x, y) of the segment in [−1, 1]² for one of the unit square, and the direction for
    /// one of the hemisphere with z ≥ 10⁻⁶.
    pub(crate) fn at(self, integrals: &Integrals, square: DVec2, wo: DVec3) -> ([f64; 2], DVec3) {
        let optics = &integrals.optics;
        let DVec2 { x, y } = 2.0 * square - 1.0;
        let is_steep =
            !matches!(optics.spread, Spread::Staple { .. }) && optics.mapping == Mapping::Arcsine;
        let x = match optics.spread {
            Spread::Staple { delta, .. } => within_window(x, delta),
            _ if is_steep => {
                let cos_v = COS_V_MIN.powf(x.abs());
                (1.0 - cos_v * cos_v).sqrt().copysign(x)
            }
            _ => x,
        };
        let y = match (self, optics.spread) {
            (Self::Grazing | Self::Tangent, _) if !optics.is_circle() => {
                let length = optics.spine_of_u(integrals.u_max);
                let (u, _) = optics.u_of_spine(length * y);
                optics.y_of_u(u.sin()).clamp(-1.0, 1.0)
            }
            (_, Spread::Filament { delta, .. }) => within_window(y, delta),
            _ => y,
        };
        let azimuth = DVec2::new(wo.x, wo.y).normalize_or(DVec2::X);
        let azimuth = match self {
            Self::Even => return ([x, y], wo),
            Self::Grazing => azimuth,
            Self::Tangent => {
                let (sin_u, cos_u, _) = optics.along(y);
                let (sin_v, cos_v, _) = optics.across(x);
                let n = normal(sin_u, cos_u, sin_v, cos_v);
                // From the normal's azimuth, crowded at right angles to it.
                let beyond = azimuth.to_angle().abs() / FRAC_PI_2 - 1.0;
                let angle = (FRAC_PI_2 * (1.0 + beyond.powi(3))).copysign(azimuth.y);
                DVec2::from_angle(angle).rotate(DVec2::new(n.x, n.y).normalize_or(DVec2::X))
            }
        };
        let z = wo.z.powi(3).max(1e-6);
        ([x, y], (((1.0 - z) * (1.0 + z)).sqrt() * azimuth).extend(z))
    }
}

/// The coordinate along the axis of a window for one in [−1, 1] of which at least half is in the outer
/// 2δ at either end.
fn within_window(c: f64, delta: f64) -> f64 {
    let inner = (1.0 - 2.0 * delta).max(0.5);
    let c_abs = c.abs();
    let outer = 1.0 - inner;
    let place = if c_abs < 0.5 { 2.0 * inner * c_abs } else { inner + outer * (2.0 * c_abs - 1.0) };
    place.copysign(c)
}

/// The factor that bounds the albedo of every point of segments with the width over length `ratio`, at
/// places in [0, 1]².
pub(crate) fn greatest_of_points(
    integrals: &Integrals,
    ratio: f64,
) -> Result<Normalization, ScaleError> {
    let explore = 2048.try_into().expect("2048 is not 0");
    let options =
        Options { search: Search { explore, refine: 8, steps: 200 }, ..Options::default() };
    let of_chart = |chart: Chart| {
        let albedo = |square, wo| {
            let ([x, y], wo) = chart.at(integrals, square, wo);
            integrals.at_point(x, y, wo).at(ratio).max(0.0)
        };
        let mut found = Normalization::pointwise(albedo, &options)?;
        if let (Some(square), Some(wo)) = (found.at.point, found.at.direction) {
            let (point, wo) = chart.at(integrals, square, wo);
            found.at.point = Some(0.5 * (DVec2::from(point) + 1.0));
            found.at.direction = Some(wo);
        }
        Ok(found)
    };
    let mut greatest = of_chart(Chart::Even)?;
    for chart in [Chart::Grazing, Chart::Tangent] {
        let found = of_chart(chart)?;
        let evaluations = greatest.evaluations.saturating_add(found.evaluations);
        let greater = if found.max_albedo > greatest.max_albedo { found } else { greatest };
        greatest = Normalization { evaluations, ..greater };
    }
    Ok(greatest)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::albedo::Nodes;
    use crate::phase::Phase;
    use crate::yarn::{Highlight, Yarn};

    /// Yarns with a place and a direction of theirs at which hardly any point of an even search is near
    /// the greatest albedo: (u_max, ψ, κ), mapping, (x, y) and direction.
    #[test]
    fn places_that_are_easily_missed_are_bounded() {
        let forward = |beta| Phase::VonMises { alpha: 0.0, beta };
        let spatial = |alpha, beta| Phase::VonMises3d { alpha, beta };
        let backward = |rho| Phase::WrappedCauchy { rho, is_backward: true };
        let rough = |sigma| Highlight::Rough { sigma };
        let window = |delta| Highlight::Window { delta };
        let (arcsine, linear) = (Mapping::Arcsine, Mapping::Linear);
        let cases = [
            (
                [1.267, -0.168, 100.0],
                rough(0.193),
                forward(1793.0),
                arcsine,
                [1.0, 0.0],
                [0.00213, -1.0, 0.0],
            ),
            (
                [0.47, 0.032, 100.0],
                rough(0.382),
                forward(2692.0),
                arcsine,
                [1.0, -0.000215],
                [0.00043, 1.0, 0.0],
            ),
            (
                [1.383, -0.085, -0.7],
                window(0.0052),
                spatial(0.354, 15.0),
                arcsine,
                [0.9896, -1.0],
                [0.57518, -0.81803, 0.0],
            ),
            (
                [1.096, -0.217, 0.0],
                window(0.004415),
                spatial(0.737, 10.5),
                arcsine,
                [-0.99118, 1.0],
                [-0.65652, 0.75431, 0.0],
            ),
            (
                [0.247, 0.1, -0.99],
                window(0.00855),
                backward(0.775),
                linear,
                [0.00483, -1.0],
                [0.029, -0.369, 0.929],
            ),
            (
                [1.324, 0.0, -0.99],
                window(0.0026966),
                backward(0.883),
                linear,
                [0.0, 0.99577],
                [0.0, 1.0, 0.0],
            ),
        ];
        for ([u_max, psi, kappa], highlight, phase, mapping, [x, y], wo) in cases {
            let yarn = Yarn { u_max, psi, kappa, highlight, phase, ..Yarn::default() };
            let integrals =
                |density| Integrals::new(&yarn, false, mapping, Nodes::resolving(&yarn, density));
            let (quick, fine) = (integrals(1.0), integrals(3.0));
            let wo = DVec3::from_array(wo).normalize();
            for ratio in [0.0, 1.0] {
                let bound = greatest_of_points(&quick, ratio).unwrap().upper_bound;
                let found = fine.at_point(x, y, wo).at(ratio);
                assert!(
                    found <= bound * (1.0 + 1e-3),
                    "{yarn:?} {mapping:?} at ({x}, {y}) for {wo}, w/l {ratio}: {found}, at most {bound}"
                );
            }
        }
    }
}
