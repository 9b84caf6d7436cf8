//! Many points at a time: the kernel of [`Shader::eval`] on sixteen lanes, with the instructions of the
//! processor that it runs on.
//!
//! Every lane has the bits that [`Shader::eval`] returns, whatever the instructions: nothing is fused,
//! and no function comes from a library. Points are taken in chunks that stay in the first cache. First
//! their places are looked up, side by side; then those on the same kind of yarn are gathered and go
//! through the kernel together, so that a cloth of several yarns takes no more branches than one of a
//! single yarn.

mod chunk;
mod places;
mod points;

use core::ops::Range;

use fearless_simd::{Level, Simd};
use glam::{DVec2, Vec3};

use crate::frame::Vector;
use crate::guide::Guide;
use crate::lanes::dispatch;
use crate::sampling::Sample;
use crate::shader::{Lobes, Shader};
use chunk::{Chunk, NOTHING, Wanted};
use points::CHUNK;

/// Points to be shaded, component by component: all slices are equally long.
#[derive(Clone, Copy, Debug)]
pub struct Batch<'a> {
    /// u and v, m along the cloth.
    pub uv: [&'a [f64]; 2],
    /// x, y and z of the directions to the light, as for [`Shader::eval`].
    pub wi: [&'a [f32]; 3],
    /// x, y and z of the directions to the viewer.
    pub wo: [&'a [f32]; 3],
    /// Whether a point is wanted; all are without. The others are set to 0.
    pub active: Option<&'a [bool]>,
}

/// Slices of a batch that differ in length.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{what}: {found} values, expected {expected} as in u")]
pub struct BatchError {
    /// The name of the slice.
    pub what: &'static str,
    /// Its length.
    pub found: usize,
    /// That of the slice of u.
    pub expected: usize,
}

/// Instructions for many numbers at a time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Instructions {
    /// Of every x86-64 processor.
    Sse2,
    /// x86-64-v3.
    Avx2,
    /// AVX-512 as of Ice Lake and Zen 4.
    Avx512,
    /// Of every 64-bit ARM processor.
    Neon,
    /// None that this crate knows of: one number after the other, as far as the compiler does no better.
    Plain,
}

impl Instructions {
    /// Those that this processor has, the best one last.
    pub fn available() -> Vec<Self> {
        const ALL: [Instructions; 5] = [
            Instructions::Plain,
            Instructions::Neon,
            Instructions::Sse2,
            Instructions::Avx2,
            Instructions::Avx512,
        ];
        ALL.into_iter().filter(|instructions| instructions.level().is_some()).collect()
    }

    /// The level of these, if this processor has them.
    pub(crate) fn level(self) -> Option<Level> {
        let best = Level::new();
        match self {
            #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
            Self::Sse2 => best.as_sse2().map(Simd::level),
            #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
            Self::Avx2 => best.as_avx2().map(Simd::level),
            #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
            Self::Avx512 => best.as_avx512().map(Simd::level),
            #[cfg(target_arch = "aarch64")]
            Self::Neon => best.as_neon().map(Simd::level),
            Self::Plain => best.is_fallback().then_some(best),
            _ => None,
        }
    }
}

/// Points at which directions are to be drawn: all slices are equally long.
#[derive(Clone, Copy, Debug)]
pub struct Draws<'a> {
    /// u and v, m along the cloth.
    pub uv: [&'a [f64]; 2],
    /// x, y and z of the directions to the viewer, as for [`Shader::sample`].
    pub wo: [&'a [f32]; 3],
    /// Three numbers in [0, 1).
    pub xi: [&'a [f32]; 3],
    /// Whether a point is wanted; all are without.
    pub active: Option<&'a [bool]>,
}

/// Where the [`Guide`]s of points go: all slices are equally long.
#[derive(Debug)]
pub struct Guides<'a> {
    /// Linear RGB.
    pub color: Colors<'a>,
    /// x, y and z in the shading frame, sr⁻¹.
    pub facing: [&'a mut [f32]; 3],
}

/// Where the samples of points go: all slices are as long as those of the [`Draws`].
#[derive(Debug)]
pub struct Samples<'a> {
    /// x, y and z of the directions, unit, on the side of `wo`.
    pub wi: [&'a mut [f32]; 3],
    /// f cos θi / pdf, linear RGB.
    pub weight: Colors<'a>,
    /// The density with which each was drawn, sr⁻¹: 0, as is all else, where there is no sample.
    pub pdf: &'a mut [f32],
}

/// Where the yarns at points go: all slices are equally long. All numbers are 0 in a gap.
#[derive(Debug)]
pub struct YarnPoints<'a> {
    /// Whether there is a yarn.
    pub is_hit: &'a mut [bool],
    /// Index of its type.
    pub yarn: &'a mut [u16],
    /// Inclination along the arc, rad, in [−u_max, u_max].
    pub u: &'a mut [f32],
    /// Angle around the section, rad, in [−π/2, π/2].
    pub v: &'a mut [f32],
    /// x, y and z of the normal of the yarn, unit, in the shading frame.
    pub normal: [&'a mut [f32]; 3],
    /// x, y and z of the tangent of the fibres, unit, in the shading frame.
    pub tangent: [&'a mut [f32]; 3],
}

/// The components of a colour, of all points.
pub type Colors<'a> = [&'a mut [f32]; 3];

impl Shader {
    /// Uses these instructions for batches instead of the best ones, and returns whether the processor
    /// has them; if not, nothing changes. For measurements: no value depends on it.
    pub fn use_instructions(&mut self, instructions: Instructions) -> bool {
        let level = instructions.level();
        self.level = level.unwrap_or(self.level);
        level.is_some()
    }

    /// [`Shader::eval`] of each point: `f` is set to red, green and blue, sr⁻¹.
    ///
    /// # Errors
    ///
    /// Slices of different lengths.
    pub fn eval_batch(&self, points: &Batch<'_>, mut f: Colors<'_>) -> Result<(), BatchError> {
        points.check(&[("f", lengths(&f))])?;
        self.for_each_chunk(points, Wanted::Sum, |range, chunk| {
            for (f, sum) in f.iter_mut().zip(&chunk.specular) {
                f[range.clone()].copy_from_slice(&sum[..range.len()]);
            }
        });
        Ok(())
    }

    /// [`Shader::eval_lobes`] of each point: both lobes are set to red, green and blue, sr⁻¹.
    ///
    /// # Errors
    ///
    /// Slices of different lengths.
    pub fn eval_lobes_batch(
        &self,
        points: &Batch<'_>,
        mut specular: Colors<'_>,
        mut diffuse: Colors<'_>,
    ) -> Result<(), BatchError> {
        points.check(&[("specular", lengths(&specular)), ("diffuse", lengths(&diffuse))])?;
        self.for_each_chunk(points, Wanted::Lobes, |range, chunk| {
            for c in 0..3 {
                specular[c][range.clone()].copy_from_slice(&chunk.specular[c][..range.len()]);
                diffuse[c][range.clone()].copy_from_slice(&chunk.diffuse[c][..range.len()]);
            }
        });
        Ok(())
    }

    /// [`Shader::pdf`] of each point, sr⁻¹.
    ///
    /// # Errors
    ///
    /// Slices of different lengths.
    pub fn pdf_batch(&self, points: &Batch<'_>, pdf: &mut [f32]) -> Result<(), BatchError> {
        points.check(&[("pdf", [pdf.len()])])?;
        self.for_each_chunk(points, Wanted::Density, |range, chunk| {
            pdf[range.clone()].copy_from_slice(&chunk.pdf[..range.len()]);
        });
        Ok(())
    }

    /// [`Shader::eval_lobes_batch`] and [`Shader::pdf_batch`] in one pass: all that a path tracer asks of a
    /// direction towards a light.
    ///
    /// # Errors
    ///
    /// Slices of different lengths.
    pub fn eval_lobes_pdf_batch(
        &self,
        points: &Batch<'_>,
        specular: Colors<'_>,
        diffuse: Colors<'_>,
        pdf: &mut [f32],
    ) -> Result<(), BatchError> {
        self.eval_wanted(points, Wanted::Both, [specular, diffuse], pdf, None)
    }

    /// [`Shader::eval_lobes_pdf_batch`] and [`Shader::guide`] of each point in one pass, for little more than the
    /// first takes.
    ///
    /// # Errors
    ///
    /// Slices of different lengths.
    pub fn eval_lobes_pdf_guide_batch(
        &self,
        points: &Batch<'_>,
        specular: Colors<'_>,
        diffuse: Colors<'_>,
        pdf: &mut [f32],
        guides: Guides<'_>,
    ) -> Result<(), BatchError> {
        self.eval_wanted(points, Wanted::Guided, [specular, diffuse], pdf, Some(guides))
    }

    /// [`Shader::eval_lobes_batch`] and [`Shader::guide`] of each point in one pass: all that a path tracer asks of a
    /// direction towards a light that nothing else finds. `is_lit` is set to 1 where there is yarn that the light and the
    /// viewer are in front of, and else to 0.
    ///
    /// # Errors
    ///
    /// Slices of different lengths.
    pub fn eval_lobes_guide_batch(
        &self,
        points: &Batch<'_>,
        specular: Colors<'_>,
        diffuse: Colors<'_>,
        is_lit: &mut [f32],
        guides: Guides<'_>,
    ) -> Result<(), BatchError> {
        points.check(&[("is_lit", [is_lit.len()])])?;
        self.eval_wanted(points, Wanted::Lit, [specular, diffuse], is_lit, Some(guides))
    }

    /// Both lobes of each point, the density or what stands in its place, and the guides if there is a place for them.
    fn eval_wanted(
        &self,
        points: &Batch<'_>,
        wanted: Wanted,
        [mut specular, mut diffuse]: [Colors<'_>; 2],
        pdf: &mut [f32],
        mut guides: Option<Guides<'_>>,
    ) -> Result<(), BatchError> {
        points.check(&[("specular", lengths(&specular)), ("diffuse", lengths(&diffuse))])?;
        points.check(&[("pdf", [pdf.len()])])?;
        if let Some(Guides { color, facing }) = &guides {
            points.check(&[("color", lengths(color)), ("facing", lengths(facing))])?;
        }
        self.for_each_chunk(points, wanted, |range, chunk| {
            let put = |to: &mut Colors<'_>, from: &[[f32; CHUNK]; 3]| {
                for (to, from) in to.iter_mut().zip(from) {
                    to[range.clone()].copy_from_slice(&from[..range.len()]);
                }
            };
            put(&mut specular, &chunk.specular);
            put(&mut diffuse, &chunk.diffuse);
            pdf[range.clone()].copy_from_slice(&chunk.pdf[..range.len()]);
            if let Some(Guides { color, facing }) = &mut guides {
                put(color, &chunk.color);
                put(facing, &chunk.facing);
            }
        });
        Ok(())
    }

    /// [`Shader::opacity`] at each `uv` (m).
    ///
    /// # Errors
    ///
    /// Slices of different lengths.
    pub fn opacity_batch(&self, uv: [&[f64]; 2], opacity: &mut [f32]) -> Result<(), BatchError> {
        let expected = uv[0].len();
        same_length(expected, [("v", uv[1].len()), ("opacity", opacity.len())].into_iter())?;
        // The face shows the same places for all directions.
        let up = [[0.0; CHUNK], [0.0; CHUNK], [1.0; CHUNK]];
        Chunk::with(|chunk| {
            for first in (0..expected).step_by(CHUNK) {
                let range = first..expected.min(first + CHUNK);
                let w = up.each_ref().map(|part| &part[..range.len()]);
                let uv = uv.map(|part| &part[range.clone()]);
                let points = Batch { uv, wi: w, wo: w, active: None };
                dispatch!(self.level, simd => self.find_all(simd, &points, chunk));
                for (k, opacity) in opacity[range].iter_mut().enumerate() {
                    let is_finite = uv[0][k].is_finite() && uv[1][k].is_finite();
                    *opacity = if chunk.is_apart[k] || !is_finite {
                        self.opacity(DVec2::new(uv[0][k], uv[1][k]))
                    } else if chunk.piece[k] == NOTHING {
                        0.0
                    } else {
                        self.materials.single[chunk.points.yarn[k] as usize].look.opacity
                    };
                }
            }
        });
        Ok(())
    }

    /// [`Shader::sample`] of each point.
    ///
    /// # Errors
    ///
    /// Slices of different lengths.
    pub fn sample_batch(&self, draws: &Draws<'_>, samples: Samples<'_>) -> Result<(), BatchError> {
        let Samples { wi, weight, pdf } = samples;
        let Draws { uv, wo, xi, active } = *draws;
        let all = Batch { uv, wi: xi, wo, active };
        all.check(&[("wi", lengths(&wi)), ("weight", lengths(&weight)), ("pdf", [pdf.len(); 3])])?;
        Chunk::with(|chunk| {
            for first in (0..all.len()).step_by(CHUNK) {
                self.draw_chunk(&all.part(first, CHUNK), chunk, |k, sample| {
                    for c in 0..3 {
                        wi[c][first + k] = sample.wi[c];
                        weight[c][first + k] = sample.weight[c];
                    }
                    pdf[first + k] = sample.pdf;
                });
            }
        });
        Ok(())
    }

    /// Calls `each` with what is drawn at each point of `part`, whose numbers stand in the place of the directions to
    /// the light: zeros where it is nothing.
    fn draw_chunk(&self, part: &Batch<'_>, chunk: &mut Chunk, mut each: impl FnMut(usize, Sample)) {
        let mut drawn = [[0.0; CHUNK]; 3];
        let is_short = part.len() < self.fewest();
        if !is_short {
            dispatch!(self.level, simd => self.draw_lanes(simd, part, &mut drawn, chunk));
        }
        let is_irregular = self.materials.side_by_side.is_irregular;
        for k in 0..part.len() {
            let sample = if is_short || (is_irregular && chunk.is_apart[k]) {
                let is_wanted = part.active.is_none_or(|active| active[k]);
                let wo = Vec3::from_array(part.wo.map(|c| c[k]));
                let uv = DVec2::new(part.uv[0][k], part.uv[1][k]);
                is_wanted.then(|| self.sample(uv, wo, part.wi.map(|c| c[k]))).flatten()
            } else {
                let of = |all: &[[f32; CHUNK]; 3]| Vec3::from_array(all.each_ref().map(|c| c[k]));
                let (wi, pdf) = (of(&drawn), chunk.pdf[k]);
                let weight = (of(&chunk.specular) + of(&chunk.diffuse)) * wi.z.abs() / pdf;
                (pdf > 0.0 && weight.is_finite()).then_some(Sample { wi, weight, pdf })
            };
            each(k, sample.unwrap_or(Sample { wi: Vec3::ZERO, weight: Vec3::ZERO, pdf: 0.0 }));
        }
    }

    /// [`Shader::yarn_at`] of each point at `uv` (m), in single precision.
    ///
    /// # Errors
    ///
    /// Slices of different lengths.
    pub fn yarn_at_batch(&self, uv: [&[f64]; 2], points: YarnPoints<'_>) -> Result<(), BatchError> {
        let YarnPoints { is_hit, yarn, u, v, normal, tangent } = points;
        let expected = uv[0].len();
        let found = [("v", uv[1].len()), ("is_hit", is_hit.len()), ("yarn", yarn.len())]
            .into_iter()
            .chain([("u", u.len()), ("v", v.len())])
            .chain(lengths(&normal).map(|length| ("normal", length)))
            .chain(lengths(&tangent).map(|length| ("tangent", length)));
        same_length(expected, found)?;
        for k in 0..expected {
            let found = self.yarn_at(DVec2::new(uv[0][k], uv[1][k]));
            is_hit[k] = found.is_some();
            yarn[k] = found.map_or(0, |found| found.yarn);
            u[k] = found.map_or(0.0, |found| found.u as f32);
            v[k] = found.map_or(0.0, |found| found.v as f32);
            for c in 0..3 {
                normal[c][k] = found.map_or(0.0, |found| found.normal[c] as f32);
                tangent[c][k] = found.map_or(0.0, |found| found.tangent[c] as f32);
            }
        }
        Ok(())
    }

    /// How many points it takes for all lanes to be faster than one point after the other, measured.
    fn fewest(&self) -> usize {
        match self.level {
            #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
            Level::Avx512(_) => 3,
            #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
            Level::Avx2(_) => 6,
            _ => 9,
        }
    }

    /// Calls `take` with the range of each chunk of `points` and what is `wanted` of them.
    fn for_each_chunk(
        &self,
        points: &Batch<'_>,
        wanted: Wanted,
        mut take: impl FnMut(Range<usize>, &Chunk),
    ) {
        Chunk::with(|chunk| {
            for first in (0..points.len()).step_by(CHUNK) {
                let part = points.part(first, CHUNK);
                self.shade(&part, wanted, chunk);
                take(first..first + part.len(), chunk);
            }
        });
    }

    /// Sets what is `wanted` of `points` in `chunk`.
    fn shade(&self, points: &Batch<'_>, wanted: Wanted, chunk: &mut Chunk) {
        if points.len() < self.fewest() {
            let colors = chunk.specular.iter_mut().chain(&mut chunk.diffuse);
            let guides = chunk.color.iter_mut().chain(&mut chunk.facing);
            for part in colors.chain(guides).chain([&mut chunk.pdf]) {
                part[..points.len()].fill(0.0);
            }
            for k in 0..points.len() {
                chunk.is_apart[k] = points.active.is_none_or(|active| active[k]);
            }
            self.shade_apart(points, wanted, chunk);
            return;
        }
        dispatch!(self.level, simd => self.shade_lanes(simd, points, wanted, chunk));
        if self.materials.side_by_side.is_irregular {
            self.shade_apart(points, wanted, chunk);
        }
    }

    /// The same of those points that are not shaded side by side.
    fn shade_apart(&self, points: &Batch<'_>, wanted: Wanted, chunk: &mut Chunk) {
        for k in (0..points.len()).filter(|&k| chunk.is_apart[k]) {
            let [wi, wo] = [points.wi, points.wo].map(|w| Vec3::from_array(w.map(|part| part[k])));
            let uv = DVec2::new(points.uv[0][k], points.uv[1][k]);
            if wanted.has_lobes() {
                let Lobes { specular, diffuse } = self.eval_lobes(uv, wi, wo);
                let first = if wanted == Wanted::Sum { specular + diffuse } else { specular };
                for c in 0..3 {
                    (chunk.specular[c][k], chunk.diffuse[c][k]) = (first[c], diffuse[c]);
                }
            }
            if wanted.has_density() {
                chunk.pdf[k] = self.pdf(uv, wi, wo);
            }
            if wanted.has_guides() {
                // As side by side, where nothing is lit nothing is found.
                let is_lit = self.oriented(Vector::<f32>::of(wi), Vector::<f32>::of(wo)).is_some();
                let guide = if is_lit { self.guide(uv, wo) } else { Guide::default() };
                if wanted == Wanted::Lit {
                    chunk.pdf[k] = f32::from(u8::from(self.pdf(uv, wi, wo) > 0.0));
                }
                for c in 0..3 {
                    (chunk.color[c][k], chunk.facing[c][k]) = (guide.color[c], guide.facing[c]);
                }
            }
        }
    }
}

/// An error if one of the lengths that were `found` is not the `expected` one.
fn same_length(
    expected: usize,
    mut found: impl Iterator<Item = (&'static str, usize)>,
) -> Result<(), BatchError> {
    match found.find(|&(_, found)| found != expected) {
        Some((what, found)) => Err(BatchError { what, found, expected }),
        None => Ok(()),
    }
}

/// The lengths of the parts of a colour.
fn lengths(colors: &Colors<'_>) -> [usize; 3] {
    colors.each_ref().map(|part| part.len())
}

impl Batch<'_> {
    /// How many points there are.
    pub(crate) fn len(&self) -> usize {
        self.uv[0].len()
    }

    /// At most `count` points from `first` on.
    #[inline(always)]
    fn part(&self, first: usize, count: usize) -> Self {
        let range = first..self.len().min(first + count);
        Self {
            uv: self.uv.map(|part| &part[range.clone()]),
            wi: self.wi.map(|part| &part[range.clone()]),
            wo: self.wo.map(|part| &part[range.clone()]),
            active: self.active.map(|part| &part[range.clone()]),
        }
    }

    /// Whether all slices, and those of the `outputs`, are equally long.
    fn check<const N: usize>(
        &self,
        outputs: &[(&'static str, [usize; N])],
    ) -> Result<(), BatchError> {
        let inputs = [("u", self.uv[0].len()), ("v", self.uv[1].len())]
            .into_iter()
            .chain(self.wi.map(|part| ("wi", part.len())))
            .chain(self.wo.map(|part| ("wo", part.len())))
            .chain(self.active.map(|part| ("active", part.len())));
        let outputs =
            outputs.iter().flat_map(|&(what, lengths)| lengths.map(|length| (what, length)));
        same_length(self.len(), inputs.chain(outputs))
    }
}
