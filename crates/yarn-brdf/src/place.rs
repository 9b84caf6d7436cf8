//! `Place`: what shows at a position of the cloth, with every irregularity and texture applied.

use glam::DVec2;

use crate::azimuth::AzimuthSampler;
use crate::material::{Kind, Material, Piece};
use crate::moving::Moving;
use crate::noise::{Line, Use};
use crate::phase::Parts;
use crate::real::{Real, Scalar};
use crate::segment::Optics;
use crate::shader::{Shader, White};
use crate::texture::Target;
use crate::threads::{Constant, Fill};
use crate::weave::{Position, Segment, Side, Touching};
use crate::yarn::{Noise, Yarn};

/// What shows at a position, ready to be shaded.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place<'a, R> {
    pub(crate) segment: Segment,
    /// Index of the type of yarn.
    pub(crate) yarn: usize,
    pub(crate) piece: &'a Piece<R>,
    /// x and y in [−1, 1], and w/l.
    pub(crate) at: [R; 3],
    pub(crate) look: &'a Look<R>,
}

/// Colours of a place.
#[derive(Clone, Debug)]
pub(crate) struct Look<R> {
    pub(crate) color: [R; 3],
    /// Of the peak and of the uniform part.
    pub(crate) specular: [[R; 3]; 2],
    pub(crate) opacity: R,
    /// Factor of the highlight's irregularity.
    pub(crate) intensity: R,
}

impl<R: Real> Look<R> {
    /// The greatest components of the colours of the highlight and of the diffuse.
    #[inline(always)]
    pub(crate) fn bright(&self) -> [R; 2] {
        let [[a, b, c], [d, e, f]] = self.specular;
        let [r, g, blue] = self.color;
        [a.max(b).max(c).max(d).max(e).max(f), r.max(g).max(blue)]
    }

    /// Makes the diffuse so many times as bright, but reflect no more than it receives.
    #[inline(always)]
    pub(crate) fn lighten(&mut self, factor: R) {
        let [r, g, b] = self.color;
        let one = factor.one();
        self.color = [(r * factor).min(one), (g * factor).min(one), (b * factor).min(one)];
    }

    /// The colour of the diffuse with the share of the place that is opaque.
    #[inline(always)]
    pub(crate) fn matte(&self) -> [R; 3] {
        let [r, g, b] = self.color;
        [r * self.opacity, g * self.opacity, b * self.opacity]
    }

    /// Both lobes, highlight and diffuse, of a place that reflects `white` if it is white and opaque.
    #[inline(always)]
    pub(crate) fn lobes(&self, white: &White<R>) -> [[R; 3]; 2] {
        let Parts { peak, uniform } = white.highlight;
        let gain = self.intensity * self.opacity;
        let (peak, uniform) = (peak * gain, uniform * gain);
        let diffuse = white.diffuse * self.opacity;
        let [[a, b, c], [d, e, f]] = self.specular;
        let specular = [a * peak + d * uniform, b * peak + e * uniform, c * peak + f * uniform];
        let [r, g, b] = self.color;
        [specular, [r * diffuse, g * diffuse, b * diffuse]]
    }
}

impl Shader {
    /// What `look` makes of the place that `side` shows at `uv` (m); `None` in a gap or where `uv` is
    /// not finite.
    #[inline(always)]
    pub(crate) fn with_place<R: Scalar, T>(
        &self,
        materials: &[Material<R>],
        uv: DVec2,
        side: Side,
        look: impl FnOnce(&Place<'_, R>) -> T,
    ) -> Option<T> {
        let (position, segment) = self.segment_at(uv, side)?;
        let yarn = usize::from(self.threads.yarn(&segment));
        let ratio = self.shape(&segment);
        let material = &materials[yarn];
        let piece = material.piece(segment.is_straight(), ratio);
        let kind = &self.materials.kinds[yarn];
        let irregular;
        let (look_of, piece) = if kind.is_uniform {
            (&material.look, piece)
        } else {
            irregular = self.irregular(kind, (&material.look, piece), segment, uv, position);
            (&irregular.0, irregular.1.as_ref().unwrap_or(piece))
        };
        let at = [segment.x, segment.y, ratio].map(R::from_f64);
        Some(look(&Place { segment, yarn, piece, at, look: look_of }))
    }

    /// The piece of yarn that `side` shows at `uv` (m), and its position; `None` in a gap or where `uv`
    /// is not finite.
    #[inline(always)]
    pub(crate) fn segment_at(&self, uv: DVec2, side: Side) -> Option<(Position, Segment)> {
        if !uv.is_finite() {
            return None;
        }
        let position = Position::new(self.frame.cells(uv));
        // One copy for each way to fill the pitch, so that what is not needed is left out.
        let segment = match &self.threads.fill {
            Fill::Touching => self.weave.segment_at(side, position, &Touching),
            Fill::Constant(sizes) => {
                let sizes = Constant { threads: &self.threads, sizes };
                self.weave.segment_at(side, position, &sizes)
            }
            Fill::Varying(types) => {
                let sizes = Moving { threads: &self.threads, types };
                self.weave.segment_at(side, position, &sizes)
            }
        }?;
        Some((position, segment))
    }

    /// Width over length of a segment in metres; 0 for a straight piece, which has no curvature to
    /// change.
    #[inline]
    pub(crate) fn shape(&self, segment: &Segment) -> f64 {
        if segment.is_straight() {
            return 0.0;
        }
        // By what the place along the segment is found with.
        segment.width * self.frame.aspects[usize::from(segment.is_warp)] * (1.0 / segment.length)
    }

    /// The factor of the highlight's irregularity.
    pub(crate) fn grains<R: Scalar>(
        &self,
        noise: &Noise,
        segment: &Segment,
        position: Position,
    ) -> R {
        if noise.intensity == 0.0 {
            return R::from_f64(1.0);
        }
        let line = Line { seed: self.seed, is_warp: segment.is_warp, index: segment.line };
        let axis = usize::from(segment.is_warp);
        let fraction = position.fraction[axis];
        // Whole grains along each cell, so that equal cells and fractions give equal grains.
        let grains = noise.fineness.round();
        let along = (position.cell[axis].wrapping_mul(grains as i64))
            .wrapping_add((fraction * grains) as i64);
        let across = (0.5 * (segment.x + 1.0) * grains) as i64;
        let grain: R = line.intensity(along, across);
        grain * R::from_f64(noise.intensity) + R::from_f64(1.0 - noise.intensity)
    }

    /// The factor of the colour of the thread `line`.
    pub(crate) fn lightness<R: Scalar>(&self, noise: &Noise, is_warp: bool, line: i64) -> R {
        if noise.color == 0.0 {
            return R::from_f64(1.0);
        }
        let line = Line { seed: self.seed, is_warp, index: line };
        R::from_f64(1.0 + noise.color * line.signed(Use::Lightness, 0))
    }

    /// What textures and noise make of a segment: of its colours, and of its shape if they change it.
    #[inline(never)]
    fn irregular<R: Scalar>(
        &self,
        kind: &Kind,
        (look, piece): (&Look<R>, &Piece<R>),
        segment: Segment,
        uv: DVec2,
        position: Position,
    ) -> (Look<R>, Option<Piece<R>>) {
        let mut look = look.clone();
        let noise = &kind.yarn.noise;
        let color = |c: [f32; 3]| c.map(|value| R::from_f64(f64::from(value).clamp(0.0, 1.0)));
        for (target, texture) in &kind.textures {
            match *target {
                Target::Color => look.color = color(texture.value(uv, 0.0)),
                Target::Specular => {
                    look.specular[0] = color(texture.value(uv, 0.0));
                    if kind.yarn.specular_uniform.is_none() {
                        look.specular[1] = look.specular[0];
                    }
                }
                Target::Parameter("opacity") => {
                    let value = texture.value(self.middle(&segment), 0.0)[0];
                    look.opacity = R::from_f64(f64::from(value).clamp(0.0, 1.0));
                }
                Target::Parameter(_) => {}
            }
        }
        if noise.intensity > 0.0 {
            look.intensity = self.grains(noise, &segment, position);
        }
        if noise.color > 0.0 {
            look.lighten(self.lightness(noise, segment.is_warp, segment.line));
        }
        let reshaped = kind.is_reshaped.then(|| self.reshaped(kind, piece, &segment));
        (look, reshaped)
    }

    /// The piece that textures and noise make of that of a segment.
    #[cold]
    fn reshaped<R: Scalar>(&self, kind: &Kind, piece: &Piece<R>, segment: &Segment) -> Piece<R> {
        let yarn = self.yarn_of(kind, segment, piece.u_max_limit);
        let optics = Optics::new(&yarn, segment.is_straight(), self.mapping);
        let sampler = AzimuthSampler::new(&yarn.phase);
        Piece { optics, sampler, ..piece.clone() }
    }

    /// The yarn that textures and noise make of a segment.
    pub(crate) fn yarn_of(&self, kind: &Kind, segment: &Segment, u_max_limit: f64) -> Yarn {
        let mut yarn = self.textured_yarn(kind, self.middle(segment), 0.0);
        let amplitude = yarn.noise.u_max;
        if amplitude > 0.0 {
            let line = Line { seed: self.seed, is_warp: segment.is_warp, index: segment.line };
            let change = amplitude * line.signed(Use::Inclination, segment.first);
            yarn.u_max = (yarn.u_max + change).clamp(0.0, 1.5);
        }
        // Never steeper than the piece that is shaded allows.
        yarn.u_max = yarn.u_max.min(u_max_limit);
        yarn
    }

    /// The yarn that textures make of a type where it is seen at `uv` over about `footprint`, both in m.
    pub(crate) fn textured_yarn(&self, kind: &Kind, uv: DVec2, footprint: f64) -> Yarn {
        let mut yarn = kind.yarn.clone();
        for (target, texture) in &kind.textures {
            let Target::Parameter(name) = *target else { continue };
            let Some(parameter) = Yarn::parameter(name) else { continue };
            let value = f64::from(texture.value(uv, footprint)[0]);
            parameter.set(&mut yarn, value.clamp(parameter.low, parameter.high));
        }
        yarn
    }

    /// The middle of a segment, m along the cloth.
    fn middle(&self, segment: &Segment) -> DVec2 {
        let across = segment.line as f64 + 0.5;
        let along = segment.first as f64 + 0.5 * f64::from(segment.crossings.max(1));
        let (u, v) = if segment.is_warp { (across, along) } else { (along, across) };
        self.frame.uv(DVec2::new(u, v))
    }
}
