//! Light along rays through a yarn of filaments.

use glam::DVec3;

use super::{
    fibre::{Fibre, seeliger},
    strand::{Foot, Strand},
};

/// What becomes of light on its way to a fibre and from there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Interior {
    /// The mean over endlessly many fibres: Seeliger's law for the normal of the yarn. The filament
    /// that is seen first stands for those below it.
    Mean,
    /// What the filaments leave of it on rays through them: each takes this share of the light that
    /// crosses it, 1, in (0, 1].
    Traced(f64),
}

/// A ray that crosses a yarn, filament by filament.
#[derive(Debug)]
pub struct Walk<'a> {
    strand: &'a Strand,
    origin: DVec3,
    /// Unit.
    direction: DVec3,
    /// Distance so far.
    t: f64,
    /// Ring and filament that the ray has left last, and where.
    left: Option<(usize, u32, f64)>,
}

/// How a ray that crosses no more filaments goes on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// It has left the yarn.
    Outside,
    /// It has come below the innermost ring.
    Inside,
}

impl<'a> Walk<'a> {
    /// From `origin` along the unit vector `direction`.
    pub fn new(strand: &'a Strand, origin: DVec3, direction: DVec3) -> Self {
        Self { strand, origin, direction, t: 0.0, left: None }
    }

    /// Goes on from inside a filament that was crossed, from its axis: it is not crossed again.
    pub fn from_inside(strand: &'a Strand, foot: &Foot, direction: DVec3) -> Self {
        let along = direction.dot(foot.tangent);
        let sine = (1.0 - along * along).max(1e-6).sqrt();
        let exit = strand.filament_radius / sine;
        let left = Some((foot.ring, foot.filament, exit));
        Self { strand, origin: foot.place, direction, t: exit, left }
    }

    /// The next filament that the ray crosses.
    ///
    /// # Errors
    ///
    /// [`End`] when there is none.
    pub fn next_crossing(&mut self) -> Result<Foot, End> {
        let radius = self.strand.filament_radius;
        let least = 0.02 * radius;
        let deepest = 1.0 - self.strand.pitch() * self.strand.rings.len() as f64;
        loop {
            let point = self.origin + self.direction * self.t;
            let depth = self.strand.depth(point);
            if depth > 1.0 {
                let is_leaving = point.dot(self.direction) > 0.0;
                if self.t > 4.0 * self.strand.top() || (is_leaving && point.z > self.strand.top()) {
                    return Err(End::Outside);
                }
                // Nothing is nearer than the surface that all filaments touch from inside.
                self.t += (depth - 1.0).max(least);
                continue;
            }
            if depth < deepest {
                return Err(End::Inside);
            }
            let ring = self.strand.nearest_ring(depth);
            let foot = self.strand.foot(ring, point);
            let gap = foot.place.distance(point) - radius;
            let is_left = self.left.is_some_and(|(ring, filament, at)| {
                (ring, filament) == (foot.ring, foot.filament) && self.t < at + 2.0 * radius
            });
            if gap < least && !is_left {
                let exit = self.exit(&foot);
                self.left = Some((foot.ring, foot.filament, exit));
                self.t = exit.max(self.t) + least;
                return Ok(foot);
            }
            // Other rings begin where this one ends.
            let offset = (depth - self.strand.rings[ring].distance).abs();
            let to_ring = (radius - offset).abs();
            self.t += (0.9 * gap.abs().min(to_ring)).max(least);
        }
    }

    /// How far along the ray it leaves a filament, which is straight as far as it goes through it.
    fn exit(&self, foot: &Foot) -> f64 {
        let radius = self.strand.filament_radius;
        let across = |w: DVec3| w - foot.tangent * w.dot(foot.tangent);
        let start = across(self.origin + self.direction * self.t - foot.place);
        let step = across(self.direction);
        let square = step.length_squared().max(1e-6);
        let half = start.dot(step) / square;
        let rest = (half * half - (start.length_squared() - radius * radius) / square).max(0.0);
        self.t + rest.sqrt() - half
    }
}

/// The radiance that a yarn shows a viewer far above the point (x, y), for an irradiance of 1 across
/// the direction `wi` to the light, sr⁻¹. `random` gives numbers in [0, 1).
pub fn radiance(
    strand: &Strand,
    fibre: &Fibre,
    interior: Interior,
    [x, y]: [f64; 2],
    wi: DVec3,
    mut random: impl FnMut() -> f64,
) -> f64 {
    let wo = DVec3::Z;
    let mut walk = Walk::new(strand, DVec3::new(x, y, strand.top() + 1.0), -wo);
    while let Ok(foot) = walk.next_crossing() {
        if foot.u.abs() > strand.shape.u_max {
            return 0.0;
        }
        match interior {
            Interior::Mean => {
                return fibre.scatter(foot.tangent, wi, wo) * seeliger(foot.normal, wi, wo);
            }
            Interior::Traced(taken) => {
                if random() < taken {
                    let arriving = transmittance(strand, &foot, taken, wi);
                    return arriving * fibre.scatter(foot.tangent, wi, wo);
                }
            }
        }
    }
    0.0
}

/// The share of light from `wi` that comes through all other filaments to the one at `foot`.
fn transmittance(strand: &Strand, foot: &Foot, taken: f64, wi: DVec3) -> f64 {
    let mut walk = Walk::from_inside(strand, foot, wi);
    let mut share = 1.0;
    while share > 1e-3 {
        match walk.next_crossing() {
            Ok(_) => share *= 1.0 - taken,
            Err(End::Outside) => return share,
            Err(End::Inside) => return 0.0,
        }
    }
    0.0
}
