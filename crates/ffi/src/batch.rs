//! Many points at a time: what the shader makes of a block of them, side by side.

use glam::{DVec2, Vec3};
use selvedge_yarn_brdf::{Batch, Colors, Draws, Samples, Shader};

use crate::points::Lobes;

/// Points that are shaded together: enough to pay for the call, and few enough for the nearest cache.
pub(crate) const BLOCK: usize = 256;

/// One component of a vector, of each point.
pub(crate) type Plane = [f32; BLOCK];

/// Points by component; what a point lacks, or an inactive one has, is 0.
pub(crate) struct Block {
    /// The first `len` are points.
    pub(crate) len: usize,
    pub(crate) active: [bool; BLOCK],
    pub(crate) uv: [[f64; BLOCK]; 2],
    pub(crate) wi: [Plane; 3],
    pub(crate) wo: [Plane; 3],
    pub(crate) xi: [Plane; 3],
    pub(crate) lobes: Lobes,
}

/// What is found at each point; that of an inactive one means nothing.
pub(crate) struct Found {
    pub(crate) vectors: [[Plane; 3]; 2],
    pub(crate) numbers: Plane,
}

impl Block {
    pub(crate) const EMPTY: Self = Self {
        len: 0,
        active: [false; BLOCK],
        uv: [[0.0; BLOCK]; 2],
        wi: [[0.0; BLOCK]; 3],
        wo: [[0.0; BLOCK]; 3],
        xi: [[0.0; BLOCK]; 3],
        lobes: Lobes::Both,
    };

    /// The active points.
    pub(crate) fn points(&self) -> impl Iterator<Item = usize> {
        (0..self.len).filter(|&i| self.active[i])
    }

    pub(crate) fn uv(&self, i: usize) -> DVec2 {
        DVec2::new(self.uv[0][i], self.uv[1][i])
    }

    /// What the shader takes.
    fn batch(&self) -> Batch<'_> {
        let Self { wi, wo, .. } = self;
        Batch { uv: self.part(&self.uv), wi: self.part(wi), wo: self.part(wo), active: self.mask() }
    }

    /// As much of the planes as there are points.
    fn part<'a, T, const N: usize>(&self, planes: &'a [[T; BLOCK]; N]) -> [&'a [T]; N] {
        planes.each_ref().map(|plane| &plane[..self.len])
    }

    /// Which points are active; `None` if all are, which is quicker.
    fn mask(&self) -> Option<&[bool]> {
        let active = &self.active[..self.len];
        (!active.iter().all(|&active| active)).then_some(active)
    }
}

impl Found {
    pub(crate) const NOTHING: Self =
        Self { vectors: [[[0.0; BLOCK]; 3]; 2], numbers: [0.0; BLOCK] };
}

/// All planes of a block are equally long.
const EQUAL: &str = "slices of one block have one length";

/// f of the lobes asked for, as the first vector.
pub(crate) fn eval(shader: &Shader, block: &Block, found: &mut Found) {
    let [first, second] = &mut found.vectors;
    let (first, second) = (part(first, block), part(second, block));
    let result = match block.lobes {
        Lobes::Both => shader.eval_batch(&block.batch(), first),
        Lobes::Specular => shader.eval_lobes_batch(&block.batch(), first, second),
        Lobes::Diffuse => shader.eval_lobes_batch(&block.batch(), second, first),
    };
    result.expect(EQUAL);
}

/// f of the highlight and of the diffuse, as two vectors.
pub(crate) fn eval_lobes(shader: &Shader, block: &Block, found: &mut Found) {
    let [specular, diffuse] = &mut found.vectors;
    let (specular, diffuse) = (part(specular, block), part(diffuse, block));
    shader.eval_lobes_batch(&block.batch(), specular, diffuse).expect(EQUAL);
}

/// The density of `wi` for `wo`, as numbers.
pub(crate) fn pdf(shader: &Shader, block: &Block, found: &mut Found) {
    shader.pdf_batch(&block.batch(), &mut found.numbers[..block.len]).expect(EQUAL);
}

/// The density of `wo` for `wi`, as numbers.
pub(crate) fn reverse_pdf(shader: &Shader, block: &Block, found: &mut Found) {
    let batch = block.batch();
    let batch = Batch { wi: batch.wo, wo: batch.wi, ..batch };
    shader.pdf_batch(&batch, &mut found.numbers[..block.len]).expect(EQUAL);
}

/// Both [`eval`] and [`pdf`].
pub(crate) fn eval_pdf(shader: &Shader, block: &Block, found: &mut Found) {
    let Found { vectors: [first, second], numbers } = found;
    let pdf = &mut numbers[..block.len];
    let (a, b) = (part(first, block), part(second, block));
    let (specular, diffuse) = if block.lobes == Lobes::Diffuse { (b, a) } else { (a, b) };
    shader.eval_lobes_pdf_batch(&block.batch(), specular, diffuse, pdf).expect(EQUAL);
    if block.lobes == Lobes::Both {
        for (sum, part) in first.as_flattened_mut().iter_mut().zip(second.as_flattened()) {
            *sum += part;
        }
    }
}

/// Directions and weights as two vectors, densities as numbers.
pub(crate) fn sample(shader: &Shader, block: &Block, found: &mut Found) {
    let Found { vectors: [wi, weight], numbers } = found;
    let pdf = &mut numbers[..block.len];
    let (uv, wo, xi) = (block.part(&block.uv), block.part(&block.wo), block.part(&block.xi));
    let draws = Draws { uv, wo, xi, active: block.mask() };
    let samples = Samples { wi: part(wi, block), weight: part(weight, block), pdf };
    shader.sample_batch(&draws, samples).expect(EQUAL);
    for i in block.points() {
        let pdf = numbers[i];
        if pdf == 0.0 {
            put(wi, i, Vec3::Z);
        } else if block.lobes != Lobes::Both {
            // Drawn for both lobes, weighted for one: right on average.
            let direction = vector(wi, i);
            let lobes = shader.eval_lobes(block.uv(i), direction, vector(&block.wo, i));
            let is_specular = block.lobes == Lobes::Specular;
            let f = if is_specular { lobes.specular } else { lobes.diffuse };
            put(weight, i, f * (direction.z.abs() / pdf));
        }
    }
}

/// Albedos, as the first vector.
pub(crate) fn albedo(shader: &Shader, block: &Block, found: &mut Found) {
    for i in block.points() {
        put(&mut found.vectors[0], i, shader.albedo(block.uv(i), vector(&block.wo, i)));
    }
}

/// Opacities, as numbers.
pub(crate) fn opacity(shader: &Shader, block: &Block, found: &mut Found) {
    let opacity = &mut found.numbers[..block.len];
    shader.opacity_batch(block.part(&block.uv), opacity).expect(EQUAL);
}

/// As much of a vector's planes as there are points.
fn part<'a>(planes: &'a mut [Plane; 3], block: &Block) -> Colors<'a> {
    planes.each_mut().map(|plane| &mut plane[..block.len])
}

fn vector(planes: &[Plane; 3], i: usize) -> Vec3 {
    Vec3::new(planes[0][i], planes[1][i], planes[2][i])
}

fn put(planes: &mut [Plane; 3], i: usize, value: Vec3) {
    for (plane, component) in planes.iter_mut().zip(value.to_array()) {
        plane[i] = component;
    }
}
