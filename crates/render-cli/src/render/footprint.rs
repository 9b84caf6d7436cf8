//! The patch of cloth that a ray stands for.
//!
//! A highlight shows on a small part of each thread, so at one point the cloth scatters much or
//! little by chance, and it takes a hundred rays to find its mean. But only the thread changes
//! from point to point: over the width of a pixel, light, view and normal stay the same. So
//! scattering is averaged over a few points for each ray, which costs less than more rays do.
//!
//! What a pixel shows of cloth is a mean over threads, of which its rays and their points are a sample. Were the
//! points spread about each ray, those of different rays would fall by chance. So they lie about the middle of the
//! pixel, and the rays shift one pattern of them.

use std::f32::consts::TAU;

use glam::{DVec2, Vec2, Vec3};

use super::intersect::Ray;
use crate::scene::mesh::SurfacePoint;

/// A ray with a width.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Beam {
    /// Its middle.
    pub ray: Ray,
    /// Standard deviation of its Gaussian profile over the distance from the origin: rad.
    pub spread: f32,
    /// Of which beams it is one, from the same origin; `None` if it stands for itself.
    pub bundle: Option<Bundle>,
}

/// All beams that a pixel might have from one point of the lens.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bundle {
    /// Unit length.
    pub middle: Vec3,
    /// Standard deviation of all together: rad.
    pub spread: f32,
}

/// Points spread over the place where a beam meets cloth.
#[derive(Clone, Copy, Debug)]
pub struct Footprint {
    /// uv in metres.
    middle: DVec2,
    /// From there, metres: in half the room of places.
    offsets: [Vec2; MOST_POINTS],
    count: usize,
    draws: usize,
}

/// Most points of a footprint.
pub const MOST_POINTS: usize = 16;

/// Fewest points.
pub const POINTS: usize = 4;

/// Standard deviations of a footprint, in cells, up to which it has [`POINTS`], and twice as many; beyond, it
/// has [`MOST_POINTS`].
///
/// At these limits twice as many take about a fifth off the noise of denim and of a tartan; where a footprint
/// is wider than a thread, twice as many as eight take a third off.
const FEW: f64 = 0.2;
const MORE: f64 = 0.35;

/// Cosine between beam and normal below which a footprint does not grow any longer.
const GRAZING: f32 = 0.1;

impl Footprint {
    /// Points about `centre`, uv in metres, of a Gaussian with these two `axes`, each as long as a standard
    /// deviation: no two close together. `cells` are the standard deviations of the beam along weft and warp, in
    /// cells of the draft.
    ///
    /// So many `draws` of lights share the points: if several, there are as many as all the usual numbers of them share
    /// evenly, and fewer, since the guides to the diffuse that they have from each other take off more noise.
    ///
    /// `start` turns and shifts the pattern, in units of 2⁻³² of its periods. When it is uniform, each point by
    /// itself is distributed like the Gaussian.
    pub fn new(
        centre: Vec2,
        [a, b]: [Vec2; 2],
        cells: DVec2,
        draws: usize,
        start: [u32; 2],
    ) -> Self {
        let offset = |point: Vec2| a * point.x + b * point.y;
        let mut offsets = [Vec2::ZERO; MOST_POINTS];
        // A number of points that is known where they are made takes fewer instructions.
        let count = match cells.max_element() {
            _ if draws > 1 && is_narrow(cells) && 8 % draws == 0 => {
                fill(&mut offsets, gaussian_points::<8>(start).map(offset))
            }
            _ if draws > 1 && is_narrow(cells) => {
                fill(&mut offsets, gaussian_points::<6>(start).map(offset))
            }
            _ if draws > 1 => fill(&mut offsets, gaussian_points::<12>(start).map(offset)),
            _ if is_narrow(cells) => {
                fill(&mut offsets, gaussian_points::<POINTS>(start).map(offset))
            }
            width if width < MORE => fill(&mut offsets, gaussian_points::<8>(start).map(offset)),
            _ => fill(&mut offsets, gaussian_points::<MOST_POINTS>(start).map(offset)),
        };
        Self { middle: centre.as_dvec2(), offsets, count, draws }
    }

    /// Forgets the points that are not cloth, but in a gap: those whose bits are 0. Where all are, `centre` stands for
    /// them.
    pub fn keep(&mut self, centre: Vec2, is_cloth: u16) {
        let bits = u16::MAX >> (MOST_POINTS - self.count);
        if is_cloth & bits == bits {
            return;
        }
        let all = self.count;
        self.count = 0;
        for k in 0..all {
            if is_cloth >> k & 1 != 0 {
                self.offsets[self.count] = self.offsets[k];
                self.count += 1;
            }
        }
        if self.count == 0 {
            (self.middle, self.offsets[0], self.count) = (centre.as_dvec2(), Vec2::ZERO, 1);
        }
    }

    /// The points, uv in metres, as so many look at them in turn, each at an equal number of them: the first ones twice
    /// where they do not come out even. At most [`MOST_POINTS`] where eight look at twelve, the most of those that are
    /// shared.
    pub fn in_turn(&self, among: usize) -> impl ExactSizeIterator<Item = DVec2> {
        let count = self.count;
        // Mostly none is looked at twice.
        (0..among * count.div_ceil(among))
            .map(move |k| self.place(if k < count { k } else { k % count }))
    }

    /// The bits of the points, given those of as many that are looked at [in turn](Self::in_turn).
    pub fn bits(&self, in_turn: u16) -> u16 {
        let all = u16::MAX >> (MOST_POINTS - self.count);
        let (mut bits, mut rest) = (0, u32::from(in_turn));
        while rest != 0 {
            bits |= rest as u16 & all;
            rest >>= self.count;
        }
        bits
    }

    /// How many draws of lights share the points.
    pub fn draws(&self) -> usize {
        self.draws
    }

    /// How many points there are, at least one.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Point `k`, uv in metres.
    ///
    /// # Panics
    ///
    /// If there could never be so many.
    pub fn place(&self, k: usize) -> DVec2 {
        self.middle + self.offsets[k].as_dvec2()
    }

    /// The points: uv in metres.
    pub fn places(&self) -> impl ExactSizeIterator<Item = DVec2> {
        self.offsets[..self.count].iter().map(|offset| self.middle + offset.as_dvec2())
    }
}

/// How a beam casts what is beside its middle onto a surface.
#[derive(Clone, Copy, Debug)]
pub struct Cast {
    direction: Vec3,
    normal: Vec3,
    /// Of the angle between them, as far as footprints grow.
    cos: f32,
    dp_du: Vec3,
    dp_dv: Vec3,
}

impl Cast {
    /// Of a beam in `direction`, unit length, onto the surface at `point`.
    pub fn new(point: &SurfacePoint, direction: Vec3) -> Self {
        let SurfacePoint { geometric_normal: normal, dp_du, dp_dv, .. } = *point;
        let cos = normal.dot(direction);
        let cos = cos.abs().max(GRAZING).copysign(cos);
        Self { direction, normal, cos, dp_du, dp_dv }
    }

    /// The uv, metres, of two perpendicular vectors across the beam, each `length` metres long.
    pub fn axes(&self, length: f32) -> [Vec2; 2] {
        let (x, y) = self.direction.any_orthonormal_pair();
        [x, y].map(|across| self.uv(across * length))
    }

    /// The uv, metres, from where the beam arrives after `distance` to where `middle` does, which starts
    /// where the beam does.
    pub fn offset(&self, middle: Vec3, distance: f32) -> Vec2 {
        self.uv((middle / middle.dot(self.direction) - self.direction) * distance)
    }

    /// The uv, metres, of a vector `across` the beam; 0 where the surface has none.
    fn uv(&self, across: Vec3) -> Vec2 {
        let Self { direction, normal, cos, dp_du, dp_dv } = *self;
        let cast = across - direction * (across.dot(normal) / cos);
        // Cramer's rule for cast = ∂P/∂u · u + ∂P/∂v · v.
        let area = dp_du.cross(dp_dv).dot(normal);
        let uv = Vec2::new(cast.cross(dp_dv).dot(normal), dp_du.cross(cast).dot(normal)) / area;
        if uv.is_finite() { uv } else { Vec2::ZERO }
    }
}

/// Whether a beam with such standard deviations, in cells along weft and warp, hardly sees more than one thread.
pub fn is_narrow(cells: DVec2) -> bool {
    cells.max_element() < FEW
}

/// Puts `points` first, and returns how many they are.
fn fill<const COUNT: usize>(offsets: &mut [Vec2; MOST_POINTS], points: [Vec2; COUNT]) -> usize {
    offsets[..COUNT].copy_from_slice(&points);
    COUNT
}

/// Points of a Gaussian of standard deviation 1, by the map of Box & Muller 1958 from those of a lattice (Korobov
/// 1959), whose generator is the best one for so few. Each by itself is distributed exactly so when `start` is uniform.
fn gaussian_points<const COUNT: usize>([radius, angle]: [u32; 2]) -> [Vec2; COUNT] {
    let generator: usize = match COUNT {
        4 | 6 => 2,
        8 => 3,
        12 => 5,
        _ => 6,
    };
    let turn = Vec2::from_angle(TAU * generator as f32 / COUNT as f32);
    let mut angle = Vec2::from_angle(TAU * unit(angle));
    std::array::from_fn(|k| {
        let share = unit(radius.wrapping_add(((k << 32) / COUNT) as u32));
        let point = angle * (-2.0 * (1.0 - share).ln()).sqrt();
        angle = turn.rotate(angle);
        point
    })
}

/// In [0, 1).
fn unit(start: u32) -> f32 {
    (start >> 8) as f32 / (1 << 24) as f32
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    #[test]
    fn points_have_the_variance_of_the_beam() {
        let [radii, angles] = [1024, 8];
        let middle = |k: u64, count: u64| (((2 * k + 1) << 32) / (2 * count)) as u32;
        let share = ((radii * angles) as f32 * MOST_POINTS as f32).recip();
        let mut variance = Vec2::ZERO;
        let mut mean = Vec2::ZERO;
        for k in 0..radii * angles {
            let start = [middle(k / angles, radii), middle(k % angles, angles)];
            for point in gaussian_points::<MOST_POINTS>(start) {
                mean += point * share;
                variance += point * point * share;
            }
        }
        assert!(mean.length() < 1e-4, "{mean}");
        // The midpoint rule cuts the tail off.
        assert!(variance.abs_diff_eq(Vec2::ONE, 5e-3), "{variance}, expected 1");
    }

    #[test]
    fn wide_footprints_have_more_points() {
        let count = |cells: DVec2, draws: usize| {
            let axes = [0.1 * Vec2::X, 0.1 * Vec2::Y];
            let footprint = Footprint::new(Vec2::ONE, axes, cells, draws, [u32::MAX; 2]);
            let far = footprint.places().map(|place| place.distance(DVec2::ONE));
            assert!(far.fold(0.0, f64::max) > 0.1);
            footprint.count()
        };
        let counts = |draws| [0.0, 0.3, 0.4].map(|v| count(DVec2::new(0.1, v), draws));
        let expected = [[4, 8, 16], [6, 12, 12], [8, 12, 12], [6, 12, 12], [8, 12, 12]];
        assert_eq!([1, 3, 4, 6, 8].map(counts), expected);
        assert_eq!([1, 3, 8].map(|draws| count(DVec2::NAN, draws)), [16, 12, 12]);
    }

    #[test]
    fn points_in_gaps_do_not_count() {
        let places = [[1.0, 1.0], [-1.0, 1.0], [2.0, 1.0], [0.0, 0.0]].map(Vec2::from_array);
        let mean = |is_cloth: u16| {
            let mut offsets = [Vec2::NAN; MOST_POINTS];
            offsets[..4].copy_from_slice(&places);
            let mut footprint = Footprint { middle: DVec2::ZERO, offsets, count: 4, draws: 1 };
            footprint.keep(Vec2::Y, is_cloth);
            footprint.places().sum::<DVec2>() / footprint.count() as f64
        };
        assert_eq!(mean(0b0101), DVec2::new(1.5, 1.0));
        assert_eq!(mean(0b1111), DVec2::new(0.5, 0.75));
        assert_eq!(mean(0), DVec2::Y);
    }

    #[test]
    fn lights_look_at_all_points_in_turn() {
        let offsets = std::array::from_fn(|k| Vec2::splat(k as f32));
        let of = |count| Footprint { middle: DVec2::ZERO, offsets, count, draws: 1 };
        for count in 1..=12 {
            let footprint = of(count);
            for among in 1..=8 {
                let places: Vec<_> =
                    footprint.in_turn(among).map(|place| place.x as usize).collect();
                assert_eq!(places.len() % among, 0, "{count} {among}");
                assert!(places.len() < count + among && places.len() <= MOST_POINTS);
                let (first, again) = places.split_at(count);
                assert_eq!(first, (0..count).collect::<Vec<_>>());
                for (k, place) in places.iter().enumerate() {
                    assert_eq!(footprint.bits(1 << k), 1 << place, "{count} {among}");
                }
                assert!(again.iter().all(|&place| place < count));
            }
        }
        assert_eq!(of(MOST_POINTS).bits(0x8001), 0x8001);
    }

    #[test]
    fn footprint_is_the_beam_cut_by_the_surface() {
        // Weft along x, warp along y, as a plane stretched by 2 along the warp.
        let point = SurfacePoint {
            position: Vec3::ZERO,
            geometric_normal: Vec3::Z,
            normal: Vec3::Z,
            uv: Vec2::ZERO,
            dp_du: Vec3::X,
            dp_dv: 2.0 * Vec3::Y,
        };
        // At 60° from the normal, in the plane of y and z.
        let direction = Vec3::new(0.0, 0.75_f32.sqrt(), -0.5);
        let cast = Cast::new(&point, direction);
        let [a, b] = cast.axes(0.01);
        // a aᵀ + b bᵀ is the covariance, whatever the pair: 0.01 across and 0.01/cos 60° along.
        let (u, v, uv) = (a.x * a.x + b.x * b.x, a.y * a.y + b.y * b.y, a.x * a.y + b.x * b.y);
        assert!((u.sqrt() - 0.01).abs() < 1e-6, "{u}");
        assert!((v.sqrt() - 0.02 / 2.0).abs() < 1e-6, "{v}");
        assert!(uv.abs() < 1e-8, "{uv}");
        // From 2 m away, where the surface is met, to 0.02 m along the warp, which 0.01 of v is.
        let middle = (2.0 * direction + 0.02 * Vec3::Y).normalize();
        let offset = cast.offset(middle, 2.0);
        assert!(offset.abs_diff_eq(Vec2::new(0.0, 0.01), 2e-4), "{offset}");
    }
}
