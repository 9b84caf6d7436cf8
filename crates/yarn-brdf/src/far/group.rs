//! Classes of pieces of yarn that are shaded as one, and the sums over them.

use std::sync::Arc;

use glam::Vec3;

use crate::albedo::Affine;
use crate::cloth::Combination;
use crate::frame::Vector;
use crate::material::{Kind, Piece};
use crate::noise::Line;
use crate::segment::{Optics, normal};
use crate::shader::Shader;
use crate::texture::Target;
use crate::yarn::Yarn;

use super::Footprint;
use super::classes::Class;
use super::rule::{Rule, Rules};
use super::sample::{Trapezium, lit};

/// Classes that share everything but type of yarn, w/l and factor.
#[derive(Debug)]
pub(super) struct Group {
    pub(super) is_warp: bool,
    pub(super) piece: Piece<f32>,
    /// For steep directions and for grazing ones.
    pub(super) rules: [Rule; 2],
    /// Where its fibres reflect, for sampling.
    pub(super) inclinations: Trapezium,
    /// Normals of the yarn at even places, each times its share of the light, for its albedo.
    normals: Vec<Vec3>,
    /// The type of yarn whose shape is what textures tell at the footprint, and whether it is straight.
    pub(super) reshaped: Option<(usize, bool)>,
    /// Its only (amount/divisor, w/l), if the highlight may reflect more than it receives.
    clamp: Option<[f32; 2]>,
    /// Sums over classes that look the same everywhere.
    pub(super) plain: Tinted,
    /// Those over the classes of each type that textures colour.
    pub(super) textured: Vec<(usize, Weights)>,
}

/// Sums over classes, as if they were white and opaque.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Weights {
    /// Share of the area.
    area: f64,
    /// That over divisor, and that times w/l.
    highlight: [f64; 2],
    /// With the share of the diffuse, a polynomial: the coefficients of 1; of B and of S (base and slope
    /// of the albedo) of either direction; of B B, of B S and of S S of both.
    diffuse: [f64; 6],
}

/// Sums over classes times their colours.
#[derive(Clone, Debug, Default)]
pub(super) struct Tinted {
    pub(super) area: f32,
    pub(super) peak: [Vec3; 2],
    pub(super) uniform: [Vec3; 2],
    diffuse: [Vec3; 6],
}

/// The mean colours of a type of yarn.
#[derive(Clone, Copy, Debug)]
struct FarLook {
    color: Vec3,
    specular: [Vec3; 2],
    opacity: f32,
    /// Mean of the irregular intensity.
    intensity: f32,
}

/// Nodes and weights over an irregular inclination, in amplitudes: those of Gauss and Legendre.
const INCLINATIONS: [(f64, f64); 2] =
    [(-0.577_350_269_189_625_8, 0.5), (0.577_350_269_189_625_8, 0.5)];

impl Group {
    /// Its memory, in bytes.
    pub(super) fn bytes(&self) -> usize {
        size_of::<Self>()
            + size_of_val(self.textured.as_slice())
            + size_of_val(self.normals.as_slice())
            + self.rules.iter().map(Rule::bytes).sum::<usize>()
    }

    /// The directional albedo of the highlight for `wo`, in the yarn frame, with the brighter colour.
    pub(super) fn highlight_albedo(&self, tinted: &Tinted, wo: Vector<f32>) -> Vec3 {
        if !self.piece.has_highlight {
            return Vec3::ZERO;
        }
        let albedo = self.piece.reflectance.at(wo);
        let of = |part: [Vec3; 2]| part[0] * albedo.base - part[1] * albedo.slope;
        of(tinted.peak).max(of(tinted.uniform)).max(Vec3::ZERO)
    }

    /// The directional albedo of the diffuse for `wo`, in the yarn frame.
    pub(super) fn diffuse_albedo(&self, tinted: &Tinted, wo: Vector<f32>) -> Vec3 {
        let shape = match self.piece.diffuse_scale {
            None => 1.0,
            Some(scale) => {
                let wo = Vec3::new(wo.x, wo.y, wo.z);
                scale * self.normals.iter().map(|n| n.dot(wo).max(0.0)).sum::<f32>()
            }
        };
        // Over all wi, the albedos of wi have the mean of the table.
        let shares = if self.piece.has_highlight {
            self.shares(tinted, [self.piece.mean, self.piece.reflectance.at(wo)])
        } else {
            tinted.diffuse[0]
        };
        shares.max(Vec3::ZERO) * shape
    }

    /// The sum of the shares of the diffuse times colour, of directions in the yarn frame.
    #[inline(always)]
    pub(super) fn diffuse(&self, tinted: &Tinted, wi: Vector<f32>, wo: Vector<f32>) -> Vec3 {
        if !self.piece.has_highlight {
            return tinted.diffuse[0];
        }
        self.shares(tinted, self.piece.reflectance.of_both([wi, wo]))
    }

    /// [`Group::diffuse`] of directions with these albedos.
    #[inline(always)]
    fn shares(&self, tinted: &Tinted, [i, o]: [Affine<f32>; 2]) -> Vec3 {
        let [one, base, slope, base_base, base_slope, slope_slope] = tinted.diffuse;
        if let Some([scale, ratio]) = self.clamp {
            let left = |albedo: f32| (1.0 - scale * albedo).max(0.0);
            return one * left(i.at(ratio)) * left(o.at(ratio));
        }
        one + base * (i.base + o.base)
            + slope * (i.slope + o.slope)
            + base_base * (i.base * o.base)
            + base_slope * (i.base * o.slope + i.slope * o.base)
            + slope_slope * (i.slope * o.slope)
    }
}

impl Weights {
    fn add(&mut self, other: &Self) {
        self.area += other.area;
        for (sum, value) in self.highlight.iter_mut().zip(other.highlight) {
            *sum += value;
        }
        for (sum, value) in self.diffuse.iter_mut().zip(other.diffuse) {
            *sum += value;
        }
    }

    fn times(mut self, factor: f64) -> Self {
        self.area *= factor;
        self.highlight = self.highlight.map(|value| value * factor);
        self.diffuse = self.diffuse.map(|value| value * factor);
        self
    }
}

impl Tinted {
    fn add(&mut self, weights: &Weights, look: &FarLook) {
        self.area += weights.area as f32 * look.opacity;
        for (k, weight) in weights.highlight.iter().enumerate() {
            let gain = *weight as f32 * look.opacity * look.intensity;
            self.peak[k] += look.specular[0] * gain;
            self.uniform[k] += look.specular[1] * gain;
        }
        for (sum, weight) in self.diffuse.iter_mut().zip(weights.diffuse) {
            *sum += look.color * (weight as f32 * look.opacity);
        }
    }
}

impl Shader {
    /// The groups of `classes`, with the rules that `rules` finds; those that are `known` lend them theirs, which may take
    /// long to find.
    pub(super) fn groups(&self, classes: &[Class], known: &[Group], rules: Rules) -> Vec<Group> {
        let mut groups = Vec::new();
        for class in classes {
            self.add_class(class, &mut groups, known, rules);
        }
        groups
    }

    /// The shape of a group's yarn where textures tell it.
    #[cold]
    pub(super) fn optics_at(
        &self,
        group: &Group,
        (yarn, is_straight): (usize, bool),
        footprint: &Footprint,
    ) -> Optics<f32> {
        let kind = &self.materials.kinds[yarn];
        let textured = self.textured_yarn(kind, footprint.uv, footprint.width());
        let u_max = textured.u_max.min(group.piece.u_max_limit);
        Optics::new(&Yarn { u_max, ..textured }, is_straight, self.mapping)
    }

    /// The sums over all classes of a group of which textures colour some.
    #[cold]
    pub(super) fn retinted(&self, group: &Group, footprint: &Footprint) -> Tinted {
        let mut tinted = group.plain.clone();
        for (yarn, weights) in &group.textured {
            tinted.add(weights, &self.far_look(*yarn, Some(footprint)));
        }
        tinted
    }

    /// The mean look of a type of yarn, with what textures tell at a footprint.
    fn far_look(&self, yarn: usize, footprint: Option<&Footprint>) -> FarLook {
        let look = &self.materials.single[yarn].look;
        let kind = &self.materials.kinds[yarn];
        let noise = &kind.yarn.noise;
        let mut far = FarLook {
            color: look.color.into(),
            specular: look.specular.map(Vec3::from),
            opacity: look.opacity,
            intensity: (1.0 - noise.intensity + noise.intensity * Line::mean_intensity()) as f32,
        };
        if let Some(footprint) = footprint {
            for (target, texture) in &kind.textures {
                let value = texture.value(footprint.uv, footprint.width());
                let color = Vec3::from(value).clamp(Vec3::ZERO, Vec3::ONE);
                match *target {
                    Target::Color => far.color = color,
                    Target::Specular => {
                        far.specular[0] = color;
                        if kind.yarn.specular_uniform.is_none() {
                            far.specular[1] = color;
                        }
                    }
                    Target::Parameter("opacity") => far.opacity = color.x,
                    Target::Parameter(_) => {}
                }
            }
        }
        far.color = far.color.map(|value| mean_lightness(value, noise.color as f32));
        far
    }

    /// Adds a class to the group that it is of, or to one for each of the shapes that it has.
    fn add_class(&self, class: &Class, groups: &mut Vec<Group>, known: &[Group], rules: Rules) {
        let yarn = usize::from(class.yarn);
        let kind = &self.materials.kinds[yarn];
        let piece = self.materials.single[yarn].piece(class.is_straight, class.ratio);
        let is_shape =
            |target: &Target| matches!(target, Target::Parameter(name) if *name != "opacity");
        let shapes = kind.textures.iter().any(|(target, _)| is_shape(target));
        let tints = kind.textures.iter().any(|(target, _)| !is_shape(target));
        let reshaped = shapes.then_some((yarn, class.is_straight));
        let (weights, clamp) = self.weights(class, piece);
        for (piece, share) in self.inclined(kind, piece, class.is_straight || shapes) {
            let found = groups.iter().position(|group| {
                group.is_warp == class.is_warp
                    && group.clamp == clamp
                    && group.reshaped == reshaped
                    && Arc::ptr_eq(&group.piece.reflectance, &piece.reflectance)
                    && group.piece.optics == piece.optics
                    && group.piece.diffuse_scale == piece.diffuse_scale
                    && group.piece.has_highlight == piece.has_highlight
            });
            let index = found.unwrap_or_else(|| {
                let mut all = groups.iter().chain(known);
                let alike = all.find(|group| group.piece.optics == piece.optics);
                let lent = alike.map(|group| group.rules.clone());
                groups.push(Group {
                    is_warp: class.is_warp,
                    rules: lent.unwrap_or_else(|| rules(self.level, &piece.optics)),
                    inclinations: Trapezium::of(&piece.optics),
                    normals: normals(&piece.optics),
                    piece,
                    reshaped,
                    clamp,
                    plain: Tinted::default(),
                    textured: Vec::new(),
                });
                groups.len() - 1
            });
            let (group, weights) = (&mut groups[index], weights.times(share));
            if !tints {
                group.plain.add(&weights, &self.far_look(yarn, None));
            } else if let Some((_, sum)) = group.textured.iter_mut().find(|(of, _)| *of == yarn) {
                sum.add(&weights);
            } else {
                group.textured.push((yarn, weights));
            }
        }
    }

    /// What one class weighs, and what its diffuse is clamped by.
    fn weights(&self, class: &Class, piece: &Piece<f32>) -> (Weights, Option<[f32; 2]>) {
        let &Class { ratio, share, .. } = class;
        let table = &piece.reflectance;
        let inv_divisor = 1.0 / table.divisor::<f64>(ratio);
        let highlight = [share * inv_divisor, share * inv_divisor * ratio];
        let amount = f64::from(piece.amount);
        let of = |one: f64| [one, 0.0, 0.0, 0.0, 0.0, 0.0];
        let (diffuse, clamp) = if !piece.has_highlight {
            (of(share), None)
        } else if self.combination == Combination::Lerp {
            (of(share * (1.0 - amount)), None)
        } else {
            let scale = amount * inv_divisor;
            let of_all = if piece.diffuse_scale.is_some() {
                1.0
            } else {
                (1.0 - scale * table.mean.at(ratio)).max(1e-3)
            };
            let share = share / of_all;
            let greatest = table.greatest().into_iter().fold(0.0, f64::max);
            if scale * greatest > 1.0 + 1e-6 {
                (of(share), Some([scale as f32, ratio as f32]))
            } else {
                // (1 − scale (B − ratio S)) of both directions.
                let (b, s) = (-scale, scale * ratio);
                ([1.0, b, s, b * b, b * s, s * s].map(|term| term * share), None)
            }
        };
        (Weights { area: share, highlight, diffuse }, clamp)
    }

    /// The pieces that irregular inclinations make of one, and their shares.
    fn inclined(&self, kind: &Kind, piece: &Piece<f32>, is_fixed: bool) -> Vec<(Piece<f32>, f64)> {
        let amplitude = kind.yarn.noise.u_max;
        if is_fixed || amplitude == 0.0 {
            return vec![(piece.clone(), 1.0)];
        }
        let inclined = |(node, weight): (f64, f64)| {
            let u_max = (kind.yarn.u_max + amplitude * node).clamp(0.0, 1.5);
            let yarn = Yarn { u_max: u_max.min(piece.u_max_limit), ..kind.yarn.clone() };
            let optics = Optics::new(&yarn, false, self.mapping);
            (Piece { optics, ..piece.clone() }, weight)
        };
        INCLINATIONS.into_iter().map(inclined).collect()
    }

    /// The share of the area that the yarns of a group hide.
    pub(super) fn coverage(&self, group: &Group, footprint: &Footprint) -> f32 {
        if group.textured.is_empty() {
            group.plain.area
        } else {
            self.retinted(group, footprint).area
        }
    }
}

/// Normals of the yarn at even places of a segment, each times the light that it receives, over their
/// number.
fn normals(optics: &Optics<f32>) -> Vec<Vec3> {
    const SIDE: u16 = 6;
    let at = |k: u16| 2.0 * (f32::from(k) + 0.5) / f32::from(SIDE) - 1.0;
    let normal = |k: u16| {
        let (sin_u, cos_u, _) = optics.along(at(k % SIDE));
        let (sin_v, cos_v, _) = optics.across(at(k / SIDE));
        let n = normal(sin_u, cos_u, sin_v, cos_v);
        Vec3::new(n.x, n.y, n.z) * (lit(n.z.into()) / f64::from(SIDE * SIDE)) as f32
    };
    (0..SIDE * SIDE).map(normal).collect()
}

/// The mean of `value` times even numbers within `amplitude` of 1, none of which makes it more than 1.
fn mean_lightness(value: f32, amplitude: f32) -> f32 {
    if value * (1.0 + amplitude) <= 1.0 {
        return value;
    }
    // Up to where it is 1, and beyond.
    let (least, full) = (1.0 - amplitude, 1.0 / value);
    let below = 0.5 * value * (full * full - least * least);
    (below + (1.0 + amplitude - full)) / (2.0 * amplitude)
}
