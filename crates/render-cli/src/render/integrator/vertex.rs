//! What happens where paths meet surfaces.

mod bounce;
mod scattering;

use glam::{DVec2, Mat3, Vec2, Vec3};
use selvedge_yarn_brdf::Shader;

pub(super) use self::{bounce::bounces, scattering::scattering};
use super::{Choice, Estimator, cloth::ClothPoints, shaded::Scattering};
use crate::{
    render::{
        exposure::{FirstHit, YarnSeen},
        footprint::{self, Beam, Cast, Footprint, POINTS},
        intersect::{Hit, Ray},
        sampler::Sample,
    },
    scene::{
        Material, Scene,
        mesh::{Mesh, SurfacePoint},
        standard::StandardPoint,
    },
};

/// Least share of a cloth that is not gaps where one of its threads was hit.
const LEAST_COVER: f32 = 1e-3;

/// Steps between the squares by which one light is drawn several times: those of the generalised golden ratio, by
/// which few points are spread evenly in two dimensions (Roberts 2018).
const STEPS: Vec2 = Vec2::new(0.754_877_7, 0.569_840_3);

/// Something of each lobe of a surface.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Lobes {
    pub(super) diffuse: Vec3,
    pub(super) other: Vec3,
}

impl Lobes {
    pub(super) fn scaled(self, by: Vec3) -> Self {
        Self { diffuse: self.diffuse * by, other: self.other * by }
    }

    /// The share of the diffuse lobe in each component.
    pub(super) fn diffuse_share(self) -> Vec3 {
        let all = self.diffuse + self.other;
        Vec3::select(all.cmpgt(Vec3::ZERO), self.diffuse / all, Vec3::ZERO)
    }
}

/// Light from one of the scene's lights, drawn at random.
pub(super) struct Lit {
    /// The index of the vertex that it falls on.
    pub(super) vertex: usize,
    /// The index of the light.
    pub(super) light: usize,
    /// Towards it, unit, in the shading frame.
    wi: Vec3,
    /// And in world space.
    direction: Vec3,
    distance: f32,
    /// With which it was found, sr⁻¹; infinite if nothing else finds it.
    density: f32,
    /// Of f: radiance and cosine over that density.
    pub(super) weight: Vec3,
}

/// A point where a path meets a surface.
pub(super) struct Vertex<'a> {
    scatterer: Scatterer<'a>,
    point: SurfacePoint,
    hit: Hit,
    /// Shading frame to world space.
    frame: Mat3,
    /// To where the path comes from.
    wo: Vec3,
}

/// A material at a point.
enum Scatterer<'a> {
    Matte(Vec3),
    Cloth(&'a Shader, Footprint),
    /// Cloth so far away that its threads cannot be told apart, and the share of it that is not gaps.
    FarCloth(&'a Shader, selvedge_yarn_brdf::Footprint, f32),
    Standard(StandardPoint),
}

impl<'a> Vertex<'a> {
    pub(super) fn new(scene: &'a Scene, hit: Hit, beam: &Beam, sample: &mut Sample) -> Self {
        let surface = scene.surface(&hit);
        let wo_world = -beam.ray.direction;
        let point = facing_alike(&surface.mesh, &hit, wo_world);
        let frame = point.frame();
        let scatterer = match &surface.material {
            Material::Matte(reflectance) => Scatterer::Matte(*reflectance),
            Material::Cloth { shader, is_open } => {
                let cast = Cast::new(&point, beam.ray.direction);
                let axes = cast.axes(beam.spread * hit.t);
                let [a, b] = axes;
                let deviation = (a * a + b * b).map(f32::sqrt).as_dvec2();
                let far = scene.detail.far_weight(shader, deviation);
                if far > 0.0 && (far >= 1.0 || sample.next_1d() < far) {
                    let footprint =
                        selvedge_yarn_brdf::Footprint { uv: point.uv.as_dvec2(), deviation };
                    let cover = if *is_open { shader.far_opacity(&footprint) } else { 1.0 };
                    Scatterer::FarCloth(shader, footprint, cover.max(LEAST_COVER))
                } else {
                    let cells = shader.cells(deviation);
                    let lights = &scene.lights;
                    let draws = if footprint::is_narrow(cells) {
                        lights.draws()
                    } else {
                        lights.looked_at()
                    };
                    let footprint = if let Some(bundle) = beam.bundle {
                        let centre = point.uv + cast.offset(bundle.middle, hit.t);
                        let axes = axes.map(|axis| axis * (bundle.spread / beam.spread));
                        Footprint::new(centre, axes, cells, draws, sample.start())
                    } else {
                        let start =
                            sample.next_2d().to_array().map(|x| (x * 4_294_967_296.0) as u32);
                        Footprint::new(point.uv, axes, cells, draws, start)
                    };
                    Scatterer::Cloth(shader, footprint)
                }
            }
            Material::Standard { standard, size } => {
                // Of even width, with the beam's deviation.
                let width = 12.0_f32.sqrt();
                let axes = Cast::new(&point, beam.ray.direction).axes(beam.spread * hit.t);
                let footprint = axes.map(|axis| axis * width / *size);
                Scatterer::Standard(standard.at(point.uv / *size, footprint))
            }
        };
        Self { scatterer, point, hit, frame, wo: frame.transpose() * wo_world }
    }

    /// Whether a direction is on the side seen from `wo`, of the shading normal and the triangle.
    fn is_in_front(&self, wi: Vec3, wi_world: Vec3) -> bool {
        let side = self.wo.z.signum();
        side * wi.z > 0.0 && side * self.point.geometric_normal.dot(wi_world) > 0.0
    }

    /// Whether narrow lights are left to those who draw them.
    fn is_rough(&self) -> bool {
        matches!(self.scatterer, Scatterer::Cloth(..) | Scatterer::FarCloth(..))
    }

    /// Of a direction with this density, sr⁻¹.
    pub(super) fn choice(&self, scene: &Scene, density: f32) -> Choice {
        Choice { density: density / self.repeats(scene) as f32, is_rough: self.is_rough() }
    }

    /// How often it draws each light that it looks at: the only one, or all once.
    fn repeats(&self, scene: &Scene) -> usize {
        match &self.scatterer {
            Scatterer::Cloth(_, footprint) if scene.lights.looked_at() == 1 => footprint.draws(),
            _ => 1,
        }
    }

    /// Adds light from each of the lights that the vertex, whose index is `vertex`, looks at, if it is in
    /// front.
    ///
    /// They light the places of cloth [in turn](Footprint::in_turn): so many places in the light of all have less noise
    /// than all in the light of one, and take as long.
    fn draw_lights(&self, vertex: usize, scene: &Scene, sample: &mut Sample, lit: &mut Vec<Lit>) {
        let first = sample.next_2d();
        let repeats = self.repeats(scene);
        let is_rough = self.is_rough();
        for k in 0..repeats {
            // Shared by all lights.
            let square = (first + STEPS * k as f32).fract().into();
            for index in scene.lights.draw(|| sample.next_1d()) {
                let light = &scene.lights.as_slice()[index];
                let is_only_drawn = is_rough && light.is_narrow();
                let Some(light) = light.sample(self.point.position, &square) else { continue };
                let wi = self.frame.transpose() * light.direction;
                let expected = scene.lights.expected(index) * repeats as f32;
                let density = if is_only_drawn { f32::INFINITY } else { light.density * expected };
                if self.is_in_front(wi, light.direction) {
                    lit.push(Lit {
                        vertex,
                        light: index,
                        wi,
                        direction: light.direction,
                        distance: light.distance,
                        density,
                        weight: wi.z.abs() * light.irradiance / expected,
                    });
                }
            }
        }
    }

    /// The ray to the light and how far that is, in metres: where nothing may be for it to shine here.
    pub(super) fn shadow(&self, scene: &Scene, light: &Lit) -> (Ray, f32) {
        let direction = light.direction;
        (Ray { origin: self.leave(scene, direction), direction }, light.distance)
    }

    /// What shows here.
    pub(super) fn seen(&self) -> FirstHit {
        let side = self.wo.z.signum();
        let (albedo, tangent, yarn) = match &self.scatterer {
            Scatterer::Matte(reflectance) => (*reflectance, self.frame.x_axis, None),
            Scatterer::Cloth(shader, footprint) => {
                // A few tell it almost as well as all: it depends on the lie of the yarn, but has no highlights.
                let places = footprint.places().step_by(footprint.count().div_ceil(POINTS));
                let count = places.len() as f32;
                let albedo: Vec3 = places.map(|place| shader.albedo(place, self.wo)).sum();
                let yarn = shader.yarn_at(footprint.place(0));
                let tangent = yarn.map_or(Vec3::X, |yarn| yarn.tangent.as_vec3());
                let yarn = yarn.map(|yarn| YarnSeen {
                    id: (yarn.segment.line as u32) << 1 | u32::from(yarn.segment.is_warp),
                    kind: yarn.yarn,
                });
                (albedo / count, (self.frame * tangent).normalize(), yarn)
            }
            Scatterer::FarCloth(shader, footprint, cover) => {
                let albedo = shader.far_albedo(footprint, self.wo) / *cover;
                (albedo, self.frame.x_axis, None)
            }
            Scatterer::Standard(point) => (point.albedo(self.wo), self.frame.x_axis, None),
        };
        FirstHit {
            albedo,
            normal: self.frame.z_axis * side,
            tangent,
            distance: self.hit.t,
            uv: self.point.uv,
            yarn,
        }
    }

    /// Where a ray in `direction` starts.
    pub(super) fn leave(&self, scene: &Scene, direction: Vec3) -> Vec3 {
        scene.geometry().offset(self.point.position, self.point.geometric_normal, direction)
    }
}

/// At how many of `vertices` cloth is shaded near, and at how many far.
pub(super) fn shades(vertices: &[Vertex<'_>]) -> [u64; 2] {
    let count = |is: fn(&Scatterer<'_>) -> bool| {
        vertices.iter().filter(|vertex| is(&vertex.scatterer)).count() as u64
    };
    [
        count(|scatterer| matches!(scatterer, Scatterer::Cloth(..))),
        count(|scatterer| matches!(scatterer, Scatterer::FarCloth(..))),
    ]
}

/// Light from all lights that each of the `vertices` looks at, in their order.
pub(super) fn lights<'a>(
    vertices: &[Vertex<'_>],
    samples: impl Iterator<Item = &'a mut Sample>,
    scene: &Scene,
) -> Vec<Lit> {
    if scene.estimator == Estimator::Directions {
        return Vec::new();
    }
    let mut lit = Vec::with_capacity(vertices.len() * scene.lights.as_slice().len());
    for (index, (vertex, sample)) in vertices.iter().zip(samples).enumerate() {
        vertex.draw_lights(index, scene, sample, &mut lit);
    }
    lit
}

/// How the places of a vertex on cloth draw ways on.
#[derive(Clone, Copy)]
struct Drawing {
    /// Directions that are drawn, at most; fewer where they cannot be shared evenly by the places.
    directions: usize,
    /// Whether a direction is the work of the one place that drew it. Else any of the places might have drawn it.
    is_alone: bool,
}

/// Most directions that a vertex draws.
const MOST_DIRECTIONS: usize = 8;

impl Drawing {
    fn of(scene: &Scene, footprint: &Footprint) -> Self {
        let directions = Self::directions(scene);
        Self { directions, is_alone: directions > 1 || footprint.draws() > 1 }
    }

    /// Most directions that a vertex of the `scene` draws.
    ///
    /// Of what is found along rays alone, several tell much more than one; where every light is drawn, too, they take
    /// more time than they save.
    fn directions(scene: &Scene) -> usize {
        if scene.lights.has_sky() { MOST_DIRECTIONS } else { 1 }
    }

    /// Where each direction is drawn, from place number `first` of the `footprint` on: at each of them as many, or at
    /// some of them one. If any is the first as likely, each draws as many on average.
    fn places(self, footprint: &Footprint, first: usize) -> impl ExactSizeIterator<Item = DVec2> {
        let count = footprint.count();
        let (step, turns) = match self.directions {
            most if count > most => (count.div_ceil(most), 1),
            most => (1, most / count),
        };
        let drawn = count.div_ceil(step) * turns;
        (0..drawn).map(move |k| footprint.place((first + k / turns * step) % count))
    }

    /// The mean lobes of `places`, weighed by what `weight` makes of the density with which they draw.
    fn lobes(self, places: &Scattering<'_>, weight: impl Fn(f32) -> f32) -> Lobes {
        let count = (places.count() as f32).recip();
        let [diffuse, other] = if self.is_alone {
            places.weighed(|pdf| weight(pdf) * count)
        } else {
            let weight = weight(places.density()) * count;
            places.sums().map(|sum| sum * weight)
        };
        Lobes { diffuse, other }
    }
}

/// The surface at `hit`. Where the shading normal says that `wo_world` looks at the other side than
/// the triangle does, as happens at silhouettes, the triangle is right.
fn facing_alike(mesh: &Mesh, hit: &Hit, wo_world: Vec3) -> SurfacePoint {
    let point = mesh.surface(hit.triangle, hit.barycentrics);
    if point.normal.dot(wo_world) * point.geometric_normal.dot(wo_world) > 0.0 {
        point
    } else {
        SurfacePoint { normal: point.geometric_normal, ..point }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_draw_as_many_directions_on_average() {
        for directions in [1, MOST_DIRECTIONS] {
            let drawing = Drawing { directions, is_alone: true };
            for count in 1..=16 {
                // Of sixteen places, those that are in no gap.
                let axes = [Vec2::X, Vec2::Y];
                let mut footprint = Footprint::new(Vec2::ZERO, axes, DVec2::ONE, 1, [0; 2]);
                footprint.keep(Vec2::ZERO, u16::MAX >> (16 - count));
                let number = |place| footprint.places().position(|own| own == place);
                let mut drawn = vec![0; count];
                for first in 0..count {
                    let places = drawing.places(&footprint, first);
                    assert!((1..=directions).contains(&places.len()), "{directions} {count}");
                    places.for_each(|place| drawn[number(place).expect("it is one")] += 1);
                }
                assert_eq!(drawn, vec![drawn[0]; count], "{directions} {count}");
            }
        }
    }
}
