//! Many points at a time: what the shader makes of a block of them, side by side.

use glam::{DVec2, Vec3};
use selvedge_yarn_brdf::{Batch, Colors, Draws, Footprint, Samples, Shader};

use crate::point::drawn;
use crate::points::Lobes;

/// Points that are shaded together: enough to pay for the call, and few enough for the nearest cache.
pub(crate) const BLOCK: usize = 1024;

/// Points by component: all slices are equally long.
#[derive(Clone, Copy)]
pub(crate) struct Inputs<'a> {
    pub(crate) uv: [&'a [f64]; 2],
    /// Empty, as are the next two, where they are not needed.
    pub(crate) wi: [&'a [f32]; 3],
    pub(crate) wo: [&'a [f32]; 3],
    pub(crate) xi: [&'a [f32]; 3],
    /// Widths of what is seen, m; all are 0 without.
    pub(crate) footprint: Option<&'a [f32]>,
    /// Which points are active; all are without. What is found at the others means nothing.
    pub(crate) active: Option<&'a [bool]>,
    /// Points that count although they are not active: those shaded by the far field, if only in part.
    pub(crate) wide: &'a [(usize, Footprint)],
    pub(crate) lobes: Lobes,
}

/// Room to tell points that are shaded as such from those that are seen as part of something wider.
pub(crate) struct Split {
    is_near: [bool; BLOCK],
    wide: Vec<(usize, Footprint)>,
}

impl Split {
    pub(crate) fn new() -> Self {
        Self { is_near: [false; BLOCK], wide: Vec::new() }
    }

    /// The same points, those with a footprint that matters as wide ones; no more than [`BLOCK`] if there
    /// are footprints.
    pub(crate) fn of<'a>(&'a mut self, shader: &Shader, points: &Inputs<'a>) -> Inputs<'a> {
        let Some(widths) = points.footprint else { return *points };
        self.wide.clear();
        self.is_near.fill(false);
        for i in points.points() {
            let at = Footprint::square(points.uv(i), widths[i].into());
            self.is_near[i] = shader.far_weight(at.deviation) == 0.0;
            if !self.is_near[i] {
                self.wide.push((i, at));
            }
        }
        if self.wide.is_empty() {
            return *points;
        }
        let active = Some(&self.is_near[..widths.len()]);
        Inputs { active, wide: &self.wide, ..*points }
    }
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

    /// The wide points and their directions to the light and to the viewer.
    fn wide_pairs(&self) -> impl Iterator<Item = (usize, &'a Footprint, Vec3, Vec3)> {
        let Self { wi, wo, wide, .. } = *self;
        wide.iter().map(move |(i, at)| (*i, at, vector(wi, *i), vector(wo, *i)))
    }

    fn batch(&self) -> Batch<'a> {
        Batch { uv: self.uv, wi: self.wi, wo: self.wo, active: self.active }
    }
}

/// All slices of a call are equally long.
const EQUAL: &str = "slices of one call have one length";

/// f of the lobes asked for, as the first vector.
pub(crate) fn eval(shader: &Shader, points: &Inputs<'_>, to: Outputs<'_>) {
    let [mut first, second] = to.vectors;
    let f = reborrow(&mut first);
    let result = match points.lobes {
        Lobes::Both => shader.eval_batch(&points.batch(), f),
        Lobes::Specular => shader.eval_lobes_batch(&points.batch(), f, second),
        Lobes::Diffuse => shader.eval_lobes_batch(&points.batch(), second, f),
    };
    result.expect(EQUAL);
    for (i, at, wi, wo) in points.wide_pairs() {
        put(&mut first, i, points.lobes.of(shader.mixed_eval_lobes(at, wi, wo)));
    }
}

/// f of the highlight and of the diffuse, as two vectors.
pub(crate) fn eval_lobes(shader: &Shader, points: &Inputs<'_>, to: Outputs<'_>) {
    let [mut specular, mut diffuse] = to.vectors;
    let both = (reborrow(&mut specular), reborrow(&mut diffuse));
    shader.eval_lobes_batch(&points.batch(), both.0, both.1).expect(EQUAL);
    for (i, at, wi, wo) in points.wide_pairs() {
        let lobes = shader.mixed_eval_lobes(at, wi, wo);
        put(&mut specular, i, lobes.specular);
        put(&mut diffuse, i, lobes.diffuse);
    }
}

/// The density of `wi` for `wo`, as numbers.
pub(crate) fn pdf(shader: &Shader, points: &Inputs<'_>, to: Outputs<'_>) {
    let Outputs { numbers, .. } = to;
    shader.pdf_batch(&points.batch(), numbers).expect(EQUAL);
    for (i, at, wi, wo) in points.wide_pairs() {
        numbers[i] = shader.mixed_pdf(at, wi, wo);
    }
}

/// The density of `wo` for `wi`, as numbers.
pub(crate) fn reverse_pdf(shader: &Shader, points: &Inputs<'_>, to: Outputs<'_>) {
    pdf(shader, &Inputs { wi: points.wo, wo: points.wi, ..*points }, to);
}

/// Both [`eval`] and [`pdf`].
pub(crate) fn eval_pdf(shader: &Shader, points: &Inputs<'_>, to: Outputs<'_>) {
    let Outputs { vectors: [mut first, mut second], numbers } = to;
    {
        let [a, b] = [&mut first, &mut second].map(reborrow);
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
    for (i, at, wi, wo) in points.wide_pairs() {
        put(&mut first, i, points.lobes.of(shader.mixed_eval_lobes(at, wi, wo)));
        numbers[i] = shader.mixed_pdf(at, wi, wo);
    }
}

/// Directions and weights as two vectors, densities as numbers.
pub(crate) fn sample(shader: &Shader, points: &Inputs<'_>, to: Outputs<'_>) {
    let Outputs { vectors: [mut wi, mut weight], numbers } = to;
    let Inputs { uv, wo, xi, active, .. } = *points;
    let samples =
        Samples { wi: reborrow(&mut wi), weight: reborrow(&mut weight), pdf: &mut *numbers };
    shader.sample_batch(&Draws { uv, wo, xi, active }, samples).expect(EQUAL);
    for i in points.points() {
        if numbers[i] == 0.0 {
            put(&mut wi, i, Vec3::Z);
        }
    }
    for &(i, at) in points.wide {
        let found = drawn(shader.mixed_sample(&at, vector(wo, i), vector(xi, i).to_array()));
        put(&mut wi, i, found.0);
        put(&mut weight, i, found.1);
        numbers[i] = found.2;
    }
    if points.lobes == Lobes::Both {
        return;
    }
    // Drawn for both lobes, weighted for one: right on average.
    let near = points.points().map(|i| (i, Footprint { uv: points.uv(i), ..Footprint::default() }));
    for (i, at) in near.chain(points.wide.iter().copied()).filter(|&(i, _)| numbers[i] > 0.0) {
        let direction = Vec3::from_array(wi.each_ref().map(|plane| plane[i]));
        let f = points.lobes.of(shader.mixed_eval_lobes(&at, direction, vector(wo, i)));
        put(&mut weight, i, f * (direction.z.abs() / numbers[i]));
    }
}

/// Albedos, as the first vector.
pub(crate) fn albedo(shader: &Shader, points: &Inputs<'_>, to: Outputs<'_>) {
    let [mut albedo, _] = to.vectors;
    for i in points.points() {
        put(&mut albedo, i, shader.albedo(points.uv(i), vector(points.wo, i)));
    }
    for (i, at) in points.wide {
        put(&mut albedo, *i, shader.mixed_albedo(at, vector(points.wo, *i)));
    }
}

/// Opacities, as numbers.
pub(crate) fn opacity(shader: &Shader, points: &Inputs<'_>, to: Outputs<'_>) {
    let Outputs { numbers, .. } = to;
    shader.opacity_batch(points.uv, numbers).expect(EQUAL);
    for (i, at) in points.wide {
        numbers[*i] = shader.mixed_opacity(at);
    }
}

impl Lobes {
    /// f of these.
    fn of(self, found: selvedge_yarn_brdf::Lobes) -> Vec3 {
        match self {
            Self::Both => found.specular + found.diffuse,
            Self::Specular => found.specular,
            Self::Diffuse => found.diffuse,
        }
    }
}

/// The same planes, for a while.
fn reborrow<'a>(planes: &'a mut Colors<'_>) -> Colors<'a> {
    planes.each_mut().map(|plane| &mut **plane)
}

fn vector(planes: [&[f32]; 3], i: usize) -> Vec3 {
    Vec3::from_array(planes.map(|plane| plane[i]))
}

fn put(planes: &mut Colors<'_>, i: usize, value: Vec3) {
    for (plane, component) in planes.iter_mut().zip(value.to_array()) {
        plane[i] = component;
    }
}
