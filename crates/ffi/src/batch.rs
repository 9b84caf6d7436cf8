//! Many points at a time: what the shader makes of a block of them, side by side.

use glam::{DVec2, Vec3};
use selvedge_yarn_brdf::{Batch, Colors, Draws, Samples, Shader};

use crate::points::Lobes;

/// Points that are shaded together: enough to pay for the call, and few enough for the nearest cache.
pub(crate) const BLOCK: usize = 256;

/// One component of a vector, of each point.
pub(crate) type Plane = [f32; BLOCK];

/// Points by component: all slices are equally long.
#[derive(Clone, Copy)]
pub(crate) struct Inputs<'a> {
    pub(crate) uv: [&'a [f64]; 2],
    /// Empty, as are the next two, where they are not needed.
    pub(crate) wi: [&'a [f32]; 3],
    pub(crate) wo: [&'a [f32]; 3],
    pub(crate) xi: [&'a [f32]; 3],
    /// Which points are active; all are without. What is found at the others means nothing.
    pub(crate) active: Option<&'a [bool]>,
    pub(crate) lobes: Lobes,
}

/// Where goes what is found at each point: slices as long as those of the points.
pub(crate) struct Outputs<'a> {
    pub(crate) vectors: [Colors<'a>; 2],
    pub(crate) numbers: &'a mut [f32],
}

impl<'a> Inputs<'a> {
    /// The active points.
    pub(crate) fn points(&self) -> impl Iterator<Item = usize> + 'a {
        let active = self.active;
        (0..self.uv[0].len()).filter(move |&i| active.is_none_or(|active| active[i]))
    }

    pub(crate) fn uv(&self, i: usize) -> DVec2 {
        DVec2::new(self.uv[0][i], self.uv[1][i])
    }

    fn batch(&self) -> Batch<'a> {
        Batch { uv: self.uv, wi: self.wi, wo: self.wo, active: self.active }
    }
}

/// All slices of a call are equally long.
const EQUAL: &str = "slices of one call have one length";

/// f of the lobes asked for, as the first vector.
pub(crate) fn eval(shader: &Shader, points: &Inputs<'_>, to: Outputs<'_>) {
    let [first, second] = to.vectors;
    let result = match points.lobes {
        Lobes::Both => shader.eval_batch(&points.batch(), first),
        Lobes::Specular => shader.eval_lobes_batch(&points.batch(), first, second),
        Lobes::Diffuse => shader.eval_lobes_batch(&points.batch(), second, first),
    };
    result.expect(EQUAL);
}

/// f of the highlight and of the diffuse, as two vectors.
pub(crate) fn eval_lobes(shader: &Shader, points: &Inputs<'_>, to: Outputs<'_>) {
    let [specular, diffuse] = to.vectors;
    shader.eval_lobes_batch(&points.batch(), specular, diffuse).expect(EQUAL);
}

/// The density of `wi` for `wo`, as numbers.
pub(crate) fn pdf(shader: &Shader, points: &Inputs<'_>, to: Outputs<'_>) {
    let Outputs { numbers, .. } = to;
    shader.pdf_batch(&points.batch(), numbers).expect(EQUAL);
}

/// The density of `wo` for `wi`, as numbers.
pub(crate) fn reverse_pdf(shader: &Shader, points: &Inputs<'_>, to: Outputs<'_>) {
    pdf(shader, &Inputs { wi: points.wo, wo: points.wi, ..*points }, to);
}

/// Both [`eval`] and [`pdf`].
pub(crate) fn eval_pdf(shader: &Shader, points: &Inputs<'_>, to: Outputs<'_>) {
    let Outputs { vectors: [mut first, mut second], numbers } = to;
    {
        let [a, b] = [&mut first, &mut second].map(|v| v.each_mut().map(|plane| &mut **plane));
        let (specular, diffuse) = if points.lobes == Lobes::Diffuse { (b, a) } else { (a, b) };
        shader.eval_lobes_pdf_batch(&points.batch(), specular, diffuse, numbers).expect(EQUAL);
    }
    if points.lobes == Lobes::Both {
        for (first, second) in first.iter_mut().zip(&second) {
            for (sum, part) in first.iter_mut().zip(second.iter()) {
                *sum += part;
            }
        }
    }
}

/// Directions and weights as two vectors, densities as numbers.
pub(crate) fn sample(shader: &Shader, points: &Inputs<'_>, to: Outputs<'_>) {
    let Outputs { vectors: [mut wi, mut weight], numbers } = to;
    let Inputs { uv, wo, xi, active, .. } = *points;
    let samples = Samples {
        wi: wi.each_mut().map(|plane| &mut **plane),
        weight: weight.each_mut().map(|plane| &mut **plane),
        pdf: &mut *numbers,
    };
    shader.sample_batch(&Draws { uv, wo, xi, active }, samples).expect(EQUAL);
    for i in points.points() {
        let pdf = numbers[i];
        if pdf == 0.0 {
            put(&mut wi, i, Vec3::Z);
        } else if points.lobes != Lobes::Both {
            // Drawn for both lobes, weighted for one: right on average.
            let direction = Vec3::from_array(wi.each_ref().map(|plane| plane[i]));
            let lobes = shader.eval_lobes(points.uv(i), direction, vector(wo, i));
            let is_specular = points.lobes == Lobes::Specular;
            let f = if is_specular { lobes.specular } else { lobes.diffuse };
            put(&mut weight, i, f * (direction.z.abs() / pdf));
        }
    }
}

/// Albedos, as the first vector.
pub(crate) fn albedo(shader: &Shader, points: &Inputs<'_>, to: Outputs<'_>) {
    let [mut albedo, _] = to.vectors;
    for i in points.points() {
        put(&mut albedo, i, shader.albedo(points.uv(i), vector(points.wo, i)));
    }
}

/// Opacities, as numbers.
pub(crate) fn opacity(shader: &Shader, points: &Inputs<'_>, to: Outputs<'_>) {
    let Outputs { numbers, .. } = to;
    shader.opacity_batch(points.uv, numbers).expect(EQUAL);
}

fn vector(planes: [&[f32]; 3], i: usize) -> Vec3 {
    Vec3::from_array(planes.map(|plane| plane[i]))
}

fn put(planes: &mut Colors<'_>, i: usize, value: Vec3) {
    for (plane, component) in planes.iter_mut().zip(value.to_array()) {
        plane[i] = component;
    }
}
