//! A bent yarn of filaments, each a thin cylinder along a true curve.
//!
//! Lengths are in radii of the yarn. The origin is the centre of the arc that the middle of the yarn
//! follows; x runs across the yarn, y along it at its crown, and z up.

use core::f64::consts::{PI, TAU};

use glam::DVec3;

/// The shape of a yarn and how its fibres are laid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shape {
    /// Greatest inclination u_max, rad, in (0, π/2).
    pub u_max: f64,
    /// Angle ψ of the fibres to the yarn at its crown, rad, in (−π/2, π/2).
    pub psi: f64,
    /// Length over width of the piece that is seen from above, 1, above sin u_max.
    pub aspect: f64,
}

impl Shape {
    /// The radius of the arc that the middle of the yarn follows: the surface then ends, at its crown,
    /// `aspect` radii from the middle of the piece.
    pub fn bend_radius(&self) -> f64 {
        self.aspect / self.u_max.sin() - 1.0
    }

    /// Turns of the fibres about the yarn, in rad to the rad of inclination.
    ///
    /// A yarn is twisted evenly along its length, before it is bent. At the crown, where it is
    /// longest, a fibre passes R + 1 along the yarn while it turns by 1.
    pub fn twist(&self) -> f64 {
        self.psi.tan() * (self.bend_radius() + 1.0)
    }
}

/// Filaments side by side around a yarn, all at the same depth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ring {
    /// Distance of their axes from that of the yarn.
    pub distance: f64,
    /// How many there are.
    pub count: u32,
    /// The angle v at which the first of them passes the middle of the piece, rad.
    pub phase: f64,
}

/// A yarn of filaments in rings, from its surface inwards.
#[derive(Clone, Debug, PartialEq)]
pub struct Strand {
    /// Its shape.
    pub shape: Shape,
    /// The radius of every filament.
    pub filament_radius: f64,
    /// The rings, the outermost first, [`Strand::pitch`] apart.
    pub rings: Vec<Ring>,
    bend_radius: f64,
    twist: f64,
}

/// A place on the axis of a filament.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Foot {
    /// Index of the ring.
    pub ring: usize,
    /// Which of its filaments.
    pub filament: u32,
    /// Inclination of the yarn there, rad.
    pub u: f64,
    /// The place.
    pub place: DVec3,
    /// Where the filament goes, unit.
    pub tangent: DVec3,
    /// Away from the axis of the yarn, unit.
    pub normal: DVec3,
}

impl Strand {
    /// A yarn with `count` filaments around its surface, which touch at the crown and there reach out
    /// to a radius of 1, and with so many rings of the same filaments, turned against each other at
    /// random; fewer if there is no room for more. At least 4 filaments and one ring.
    pub fn new(shape: Shape, count: u32, rings: usize, mut random: impl FnMut() -> f64) -> Self {
        let (count, rings) = (count.max(4), rings.max(1));
        // Around the section, a filament is 1/cos ψ as wide as it is thick.
        let half_width = |psi: f64, count: u32| PI * psi.cos() / f64::from(count);
        let outer = half_width(shape.psi, count);
        let filament_radius = outer / (1.0 + outer);
        let twist = shape.twist();
        let bend_radius = shape.bend_radius();
        let rings = (0..rings)
            .map(|k| 1.0 - filament_radius * (2 * k + 1) as f64)
            .enumerate()
            // Further in, they would meet across the axis.
            .take_while(|(k, distance)| *k == 0 || *distance > 2.0 * filament_radius)
            .map(|(k, distance)| {
                let psi = (distance * twist / (bend_radius + distance)).atan();
                let fitting = PI * distance * psi.cos() / filament_radius;
                let count = if k == 0 { count } else { fitting.floor() as u32 };
                Ring { distance, count, phase: random() * TAU / f64::from(count) }
            })
            .collect();
        Self { shape, filament_radius, rings, bend_radius, twist }
    }

    /// The distance between two rings.
    pub fn pitch(&self) -> f64 {
        2.0 * self.filament_radius
    }

    /// Height of the crown at the middle of the piece.
    pub fn top(&self) -> f64 {
        self.bend_radius + 1.0
    }

    /// The distance of a point from the axis of the yarn, which is bent all around.
    pub fn depth(&self, point: DVec3) -> f64 {
        (point.y.hypot(point.z) - self.bend_radius).hypot(point.x)
    }

    /// The ring whose axes are about as far from the axis of the yarn as a point at `depth`.
    pub fn nearest_ring(&self, depth: f64) -> usize {
        let k = (1.0 - depth) / self.pitch();
        (k.max(0.0) as usize).min(self.rings.len() - 1)
    }

    /// The nearest place on the nearest filament of a ring.
    ///
    /// The filament is chosen by its angle about the yarn, and the place by a step along the tangent
    /// from there and one of Newton's method: right to the order of the filament's radius squared.
    pub fn foot(&self, ring: usize, point: DVec3) -> Foot {
        let Ring { distance, count, phase } = self.rings[ring];
        let arm = point.y.hypot(point.z);
        let u = point.y.atan2(point.z);
        let v = point.x.atan2(arm - self.bend_radius);
        let step = TAU / f64::from(count);
        let index = ((v + self.twist * u - phase) / step).round();
        let of_filament = index * step + phase;
        let filament = (index as i64).rem_euclid(i64::from(count)) as u32;

        let off = distance * (v + self.twist * u - of_filament);
        let along = self.bend_radius + distance * v.cos();
        let around = self.twist * distance;
        let u = u - around * off / (along * along + around * around);
        let (place, derivative) = self.curve(distance, of_filament, u);
        let correction = (point - place).dot(derivative) / derivative.length_squared();
        let u = u + correction.clamp(-0.1, 0.1);
        let (place, derivative) = self.curve(distance, of_filament, u);
        let (sin, cos) = (of_filament - self.twist * u).sin_cos();
        let normal = DVec3::new(sin, u.sin() * cos, u.cos() * cos);
        Foot { ring, filament, u, place, tangent: derivative.normalize(), normal }
    }

    /// A filament of a ring at `distance` at the inclination u: the place, and how it changes with u.
    fn curve(&self, distance: f64, of_filament: f64, u: f64) -> (DVec3, DVec3) {
        let (sin_u, cos_u) = u.sin_cos();
        let (sin_v, cos_v) = (of_filament - self.twist * u).sin_cos();
        let arm = self.bend_radius + distance * cos_v;
        let place = DVec3::new(distance * sin_v, arm * sin_u, arm * cos_u);
        let along = DVec3::new(0.0, cos_u, -sin_u) * arm;
        let around = DVec3::new(cos_v, -sin_u * sin_v, -cos_u * sin_v);
        (place, along - around * (self.twist * distance))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SHAPE: Shape = Shape { u_max: 0.5, psi: 0.4, aspect: 4.0 };

    fn strand(count: u32) -> Strand {
        Strand::new(SHAPE, count, 3, || 0.3)
    }

    #[test]
    fn filaments_make_the_twist_with_the_yarn_at_its_crown() {
        let strand = strand(4096);
        let foot = strand.foot(0, DVec3::Z * strand.top());
        let (along, across) = (foot.tangent.y, foot.tangent.x);
        let found = (-across / along).atan();
        assert!((found - SHAPE.psi).abs() < 2e-3, "{found}, expected {}", SHAPE.psi);
    }

    #[test]
    fn nearest_place_is_no_further_than_any_other() {
        let strand = strand(24);
        let radius = strand.filament_radius;
        for k in 0..200 {
            let t = f64::from(k) / 200.0;
            let (u, v) = (0.9 * (t - 0.5), 3.0 * ((7.0 * t).fract() - 0.5));
            let normal = DVec3::new(v.sin(), u.sin() * v.cos(), u.cos() * v.cos());
            let spine = DVec3::new(0.0, u.sin(), u.cos()) * strand.bend_radius;
            let point = spine + normal * (1.0 + radius * (3.0 * t - 2.0));
            let foot = strand.foot(0, point);
            let found = foot.place.distance(point);
            let Ring { distance, count, phase } = strand.rings[0];
            let nearest = (0..count).flat_map(|j| {
                let of = phase + TAU * f64::from(j) / f64::from(count);
                (-2000..=2000).map(move |i| (of, u + 1e-4 * f64::from(i)))
            });
            let nearest = nearest
                .map(|(of, u)| strand.curve(distance, of, u).0.distance(point))
                .fold(f64::INFINITY, f64::min);
            assert!((found - nearest).abs() < 0.03 * radius, "{k}: {found}, expected {nearest}");
        }
    }
}
