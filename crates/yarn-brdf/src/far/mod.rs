//! The far field: what a cloth reflects on average over its repeat.
//!
//! ```text
//! f_far(wi, wo) = Σ share · mean over the segment of (k a T + diffuse)
//! ```
//!
//! over the classes of pieces of yarn that a side shows. The mean of the highlight over a segment is an
//! integral of its own ([`highlight`]) that is affine in w/l and does not depend on colour, and the share
//! of the diffuse is a polynomial in two tabulated albedos of each direction. So all classes whose yarn
//! bends, twists and scatters alike, in the warp or in the weft, are one [`Group`]: one quadrature,
//! multiplied with sums over its classes that are found once.
//!
//! What is irregular is replaced by its mean: the intensity of grains, the lightness of threads, the size
//! of threads (so that areas and w/l are those of mean sizes), u_max by a rule over its range. Shifts of
//! threads change nothing on average. What textures tell is read at the footprint.

mod classes;
mod diffuse;
mod group;
mod highlight;
mod level;
mod mixed;
mod rule;
mod sample;

use core::f32::consts::FRAC_1_PI;

use fearless_simd::{Simd, f32x16, prelude::*};
use glam::{DVec2, Vec3};

use crate::frame::{Vector, to_yarn};
use crate::lanes::{LANES, dispatch};
use crate::shader::{Lobes, Shader};
use crate::weave::Side;

use diffuse::Along;
use group::Group;
use level::Transition;
use rule::{Row, Rule, Rules, grazes};

/// A part of the cloth that is seen as one.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Footprint {
    /// Its middle, m along u and v.
    pub uv: DVec2,
    /// Standard deviations along u and along v, m.
    pub deviation: DVec2,
}

impl Footprint {
    /// A square around `uv`, `width` metres wide; the point itself if that is not above 0.
    #[must_use]
    pub fn square(uv: DVec2, width: f64) -> Self {
        let width = if width > 0.0 { width } else { 0.0 };
        Self { uv, deviation: DVec2::splat(width / WIDTH_OF_BOX) }
    }

    /// The side, m, of a square as wide as the footprint is at its widest.
    fn width(&self) -> f64 {
        WIDTH_OF_BOX * self.deviation.max_element()
    }
}

/// Of a box with a standard deviation of 1: √12.
const WIDTH_OF_BOX: f64 = 3.464_101_615_137_754_6;

/// The far field of both sides.
#[derive(Debug, Default)]
pub(crate) struct Far {
    sides: [Vec<Group>; 2],
    along: Along,
    transition: Transition,
}

impl Far {
    /// That of `shader`; if `is_sketch`, by rules that nobody has tried.
    pub(crate) fn new(shader: &Shader, is_sketch: bool) -> Self {
        let rules: Rules = if is_sketch { Rule::usual } else { Rule::resolving };
        let face = shader.groups(&shader.classes(Side::Face), &[], rules);
        let back = shader.groups(&shader.classes(Side::Back), &face, rules);
        Self { sides: [face, back], along: Along::default(), transition: shader.transition() }
    }

    /// Its memory, in bytes.
    pub(crate) fn bytes(&self) -> usize {
        self.sides.iter().flatten().map(Group::bytes).sum()
    }
}

impl Shader {
    /// The BRDF of the whole repeat at `footprint`, in sr⁻¹, without the cosine, linear RGB: the mean of
    /// [`Shader::eval`] over the repeat and over all irregularities, gaps included, which reflect
    /// nothing. Finite, ≥ 0 and reciprocal.
    ///
    /// The place of the footprint matters only to textures.
    #[must_use]
    pub fn far_eval(&self, footprint: &Footprint, wi: Vec3, wo: Vec3) -> Vec3 {
        let lobes = self.far_eval_lobes(footprint, wi, wo);
        lobes.specular + lobes.diffuse
    }

    /// The lobes of [`Shader::far_eval`] apart.
    #[must_use]
    pub fn far_eval_lobes(&self, footprint: &Footprint, wi: Vec3, wo: Vec3) -> Lobes {
        let (wi, wo) = (Vector::<f32>::of(wi), Vector::<f32>::of(wo));
        let Some((side, wi, wo)) = self.oriented(wi, wo) else { return Lobes::default() };
        dispatch!(self.level, simd => self.far_lobes(simd, side, footprint, wi, wo))
    }

    /// The share of the surface at `footprint` that yarn covers, each with its opacity: the mean of
    /// [`Shader::opacity`]. The rest of the light goes straight on.
    #[must_use]
    pub fn far_opacity(&self, footprint: &Footprint) -> f32 {
        let groups = &self.far.sides[Side::Face as usize];
        groups.iter().map(|group| self.coverage(group, footprint)).sum::<f32>().min(1.0)
    }

    #[inline(always)]
    fn far_lobes<S: Simd>(
        &self,
        simd: S,
        side: Side,
        footprint: &Footprint,
        wi: Vector<f32>,
        wo: Vector<f32>,
    ) -> Lobes {
        let mut lobes = Lobes::default();
        for group in &self.far.sides[side as usize] {
            let (wi, wo) = (to_yarn(wi, group.is_warp), to_yarn(wo, group.is_warp));
            let of_group = self.group_lobes(simd, group, footprint, wi, wo);
            lobes.specular += of_group.specular;
            lobes.diffuse += of_group.diffuse;
        }
        lobes
    }

    /// What one group adds to both lobes; directions in the yarn frame.
    #[inline(always)]
    fn group_lobes<S: Simd>(
        &self,
        simd: S,
        group: &Group,
        footprint: &Footprint,
        wi: Vector<f32>,
        wo: Vector<f32>,
    ) -> Lobes {
        let piece = &group.piece;
        let reshaped;
        let optics = match group.reshaped {
            None => &piece.optics,
            Some(of) => {
                reshaped = self.optics_at(group, of, footprint);
                &reshaped
            }
        };
        let retinted;
        let tinted = if group.textured.is_empty() {
            &group.plain
        } else {
            retinted = self.retinted(group, footprint);
            &retinted
        };
        let load = |row: &Row| f32x16::simd_from(simd, *row);
        let mut lobes = Lobes::default();
        if piece.has_highlight {
            let rule = &group.rules[usize::from(grazes(wi, wo))];
            let [base, slope] = highlight::mean(simd, optics, rule, wi, wo);
            let color = |part: [Vec3; 2], base: f32, slope: f32| part[0] * base - part[1] * slope;
            let specular = color(tinted.peak, sum(base.peak), sum(slope.peak))
                + color(tinted.uniform, sum(base.uniform), sum(slope.uniform));
            lobes.specular = specular.max(Vec3::ZERO);
        }
        let shape = match piece.diffuse_scale {
            None => 1.0,
            Some(scale) => scale * sum(diffuse::mean(optics, &self.far.along, load, wi, wo)),
        };
        lobes.diffuse = group.diffuse(tinted, wi, wo).max(Vec3::ZERO) * (shape * FRAC_1_PI);
        lobes
    }
}

/// The sum over the lanes.
#[inline(always)]
fn sum<S: Simd>(lanes: f32x16<S>) -> f32 {
    let mut values: [f32; LANES] = lanes.into();
    for half in [8, 4, 2, 1] {
        for lane in 0..half {
            values[lane] += values[lane + half];
        }
    }
    values[0]
}
