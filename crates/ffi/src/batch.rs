//! Many points at a time: what the shader makes of a block of them.

use selvedge_yarn_brdf::{Lobes as Both, Shader};

use glam::{DVec2, Vec3};

use crate::point::drawn;
use crate::points::Lobes;

/// Points that are shaded together: enough to pay for the call, and few enough for the nearest cache.
pub(crate) const BLOCK: usize = 64;

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

    fn wi(&self, i: usize) -> Vec3 {
        vector(&self.wi, i)
    }

    fn wo(&self, i: usize) -> Vec3 {
        vector(&self.wo, i)
    }
}

impl Found {
    pub(crate) const NOTHING: Self =
        Self { vectors: [[[0.0; BLOCK]; 3]; 2], numbers: [0.0; BLOCK] };
}

/// f of the lobes asked for, as the first vector.
pub(crate) fn eval(shader: &Shader, block: &Block, found: &mut Found) {
    for i in block.points() {
        let f = chosen(shader, block.lobes, block.uv(i), block.wi(i), block.wo(i));
        put(&mut found.vectors[0], i, f);
    }
}

/// f of the highlight and of the diffuse, as two vectors.
pub(crate) fn eval_lobes(shader: &Shader, block: &Block, found: &mut Found) {
    for i in block.points() {
        let Both { specular, diffuse } = shader.eval_lobes(block.uv(i), block.wi(i), block.wo(i));
        put(&mut found.vectors[0], i, specular);
        put(&mut found.vectors[1], i, diffuse);
    }
}

/// The density of `wi` for `wo`, as numbers.
pub(crate) fn pdf(shader: &Shader, block: &Block, found: &mut Found) {
    for i in block.points() {
        found.numbers[i] = shader.pdf(block.uv(i), block.wi(i), block.wo(i));
    }
}

/// The density of `wo` for `wi`, as numbers.
pub(crate) fn reverse_pdf(shader: &Shader, block: &Block, found: &mut Found) {
    for i in block.points() {
        found.numbers[i] = shader.pdf(block.uv(i), block.wo(i), block.wi(i));
    }
}

/// Both [`eval`] and [`pdf`].
pub(crate) fn eval_pdf(shader: &Shader, block: &Block, found: &mut Found) {
    eval(shader, block, found);
    pdf(shader, block, found);
}

/// Directions and weights as two vectors, densities as numbers.
pub(crate) fn sample(shader: &Shader, block: &Block, found: &mut Found) {
    for i in block.points() {
        let (uv, wo, xi) = (block.uv(i), block.wo(i), vector(&block.xi, i));
        let (wi, mut weight, pdf) = drawn(shader.sample(uv, wo, xi.to_array()));
        if block.lobes != Lobes::Both && pdf > 0.0 {
            // Drawn for both lobes, weighted for one: right on average.
            weight = chosen(shader, block.lobes, uv, wi, wo) * (wi.z.abs() / pdf);
        }
        put(&mut found.vectors[0], i, wi);
        put(&mut found.vectors[1], i, weight);
        found.numbers[i] = pdf;
    }
}

/// Albedos, as the first vector.
pub(crate) fn albedo(shader: &Shader, block: &Block, found: &mut Found) {
    for i in block.points() {
        put(&mut found.vectors[0], i, shader.albedo(block.uv(i), block.wo(i)));
    }
}

/// Opacities, as numbers.
pub(crate) fn opacity(shader: &Shader, block: &Block, found: &mut Found) {
    for i in block.points() {
        found.numbers[i] = shader.opacity(block.uv(i));
    }
}

/// f of the lobes asked for. Inlined, so that vectors stay in registers: through memory they would be read
/// in pieces other than they were written in, which stalls.
#[inline(always)]
fn chosen(shader: &Shader, lobes: Lobes, uv: DVec2, wi: Vec3, wo: Vec3) -> Vec3 {
    match lobes {
        Lobes::Both => shader.eval(uv, wi, wo),
        Lobes::Specular => shader.eval_lobes(uv, wi, wo).specular,
        Lobes::Diffuse => shader.eval_lobes(uv, wi, wo).diffuse,
    }
}

fn vector(planes: &[Plane; 3], i: usize) -> Vec3 {
    Vec3::new(planes[0][i], planes[1][i], planes[2][i])
}

fn put(planes: &mut [Plane; 3], i: usize, value: Vec3) {
    for (plane, component) in planes.iter_mut().zip(value.to_array()) {
        plane[i] = component;
    }
}
