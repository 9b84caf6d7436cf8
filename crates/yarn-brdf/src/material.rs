//! What the shading of one type of yarn needs, worked out once.

use core::cell::RefCell;
use core::f64::consts::PI;
use std::sync::Arc;

use fearless_simd::{Simd, f32x16, prelude::*, u32x16};
use glam::DVec3;
use selvedge_normalize::scale::Mode;

use crate::albedo::Affine;
use crate::azimuth::AzimuthSampler;
use crate::cloth::{Cloth, ClothError, Steep};
use crate::frame::Vector;
use crate::lanes::quadruples;
use crate::place::Look;
use crate::real::Scalar;
use crate::reflectance::{Reflectance, SHAPES};
use crate::segment::{Optics, normal};
use crate::texture::{Target, Texture};
use crate::variants::{Tables, Variants};
use crate::yarn::{Diffuse, Noise, Yarn};

/// Greatest (w/l) sin u_max: the spine would have no length at 1.
const STEEPEST: f64 = 0.999;

/// One type of yarn in one precision.
#[derive(Debug)]
pub(crate) struct Material<R> {
    pub(crate) look: Look<R>,
    /// Segments up to a limit of w/l, and those up to each further limit in turn.
    bent: (f64, Piece<R>),
    lowered: Vec<(f64, Piece<R>)>,
    straight: Piece<R>,
}

/// What the shading of one kind of segment needs.
#[derive(Clone, Debug)]
pub(crate) struct Piece<R> {
    pub(crate) optics: Optics<R>,
    pub(crate) sampler: AzimuthSampler,
    pub(crate) reflectance: Arc<Reflectance>,
    /// Ē of the unnormalised highlight over w/l.
    pub(crate) mean: Affine<R>,
    /// The greatest u_max that segments of this shape have room for, rad.
    pub(crate) u_max_limit: f64,
    /// What makes the diffuse by the yarn's normal as bright as it may be; `None` if it is flat.
    pub(crate) diffuse_scale: Option<R>,
    /// k, the greatest component of the specular colours.
    pub(crate) amount: R,
    /// Whether k is above 0: then there is a highlight to compute.
    pub(crate) has_highlight: bool,
}

/// What one type of yarn needs in either precision.
#[derive(Debug)]
pub(crate) struct Kind {
    pub(crate) yarn: Yarn,
    pub(crate) textures: Vec<(Target, Arc<dyn Texture>)>,
    /// Whether a parameter that shapes the highlight changes from segment to segment.
    pub(crate) is_reshaped: bool,
    /// Whether the yarn looks the same everywhere.
    pub(crate) is_uniform: bool,
    /// Whether it differs by more than the grains of its highlight and the lightness of its threads.
    pub(crate) is_apart: bool,
}

/// A type of yarn whose u_max was lowered because its shortest segments are too short to bend so far.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lowered {
    /// Index of the type of yarn.
    pub yarn: u16,
    /// Whether as an end.
    pub is_warp: bool,
    /// The greatest width over length of its segments.
    pub ratio: f64,
    /// The u_max of the yarn, rad.
    pub u_max: f64,
    /// The u_max of its shortest segments, rad.
    pub lowered_to: f64,
}

impl core::fmt::Display for Lowered {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let side = if self.is_warp { "warp" } else { "weft" };
        write!(
            f,
            "yarn {}: u_max {:.3} is too steep for {side} segments {:.2} times as wide as long, \
             lowered to {:.3} rad there",
            self.yarn, self.u_max, self.ratio, self.lowered_to
        )
    }
}

/// The materials of a cloth.
#[derive(Debug, Default)]
pub(crate) struct Materials {
    pub(crate) kinds: Vec<Kind>,
    pub(crate) single: Vec<Material<f32>>,
    pub(crate) double: Vec<Material<f64>>,
    pub(crate) lowered: Vec<Lowered>,
    pub(crate) side_by_side: SideBySide,
}

/// What many points at a time need of the types of yarn, by index.
#[derive(Debug, Default)]
pub(crate) struct SideBySide {
    /// The key of the bent piece; that of the straight one is greater by 1, and those of the lowered
    /// ones follow. Types that differ in colour alone have the same.
    pub(crate) keys: Vec<u32>,
    /// Colour, opacity, both specular colours, each followed by a 0.
    looks: Vec<[f32; 12]>,
    /// Whether some type looks different from place to place by more than grains and lightness.
    pub(crate) is_irregular: bool,
    /// For each type how much threads differ in lightness; one for all if they have the same, and empty if no
    /// type has any.
    pub(crate) lightness: Vec<f64>,
    /// The strength of the grains of the highlight and their number per cell, in the same way.
    pub(crate) grains: Vec<[f64; 2]>,
    /// Whether some type has lowered pieces.
    pub(crate) is_lowered: bool,
    /// Whether some type cannot be seen at all.
    pub(crate) is_hidden: bool,
}

/// Bits of a key that tell the piece of a type; the others tell the type.
const PIECE_BITS: u32 = 8;

/// The greatest w/l of the segments of one type of yarn, as warp and as weft; 0 if it has none.
pub(crate) type Shapes = [f64; 2];

impl Materials {
    /// The materials of `cloth`, whose parameters have been checked; `shapes` by type of yarn.
    ///
    /// `None` if nobody wants the `tables` any more.
    pub(crate) fn new(
        cloth: &Cloth,
        shapes: &[Shapes],
        straight_shows: bool,
        tables: &mut Tables<'_>,
    ) -> Result<Option<Self>, ClothError> {
        let mut materials = Self::default();
        let scales = NormalScales::new(cloth);
        for (index, yarn) in cloth.yarns.iter().enumerate() {
            let of_yarn = |t: &&crate::texture::Textured| usize::from(t.yarn) == index;
            let textures: Vec<_> = cloth
                .textures
                .iter()
                .filter(of_yarn)
                .map(|textured| (textured.target, textured.texture.clone()))
                .collect();
            let is_reshaped = yarn.noise.u_max > 0.0
                || textures.iter().any(
                    |(target, _)| matches!(target, Target::Parameter(name) if *name != "opacity"),
                );
            let noise = &yarn.noise;
            let is_apart = is_reshaped || !textures.is_empty();
            let kind = Kind {
                is_uniform: !is_apart && noise.intensity == 0.0 && noise.color == 0.0,
                is_apart,
                yarn: yarn.clone(),
                textures,
                is_reshaped,
            };
            let variants = Variants::of(yarn, &kind.textures);
            let limit = STEEPEST / variants.steepest().sin();
            let widest = shapes[index][0].max(shapes[index][1]);
            materials.note_steep(cloth, index, yarn, shapes[index], limit)?;
            let failed = |source| ClothError::Normalization { index, source };
            let mut find = |variants: &Variants, is_straight, ratio_max| {
                tables.find(variants, is_straight, ratio_max).map_err(failed)
            };
            let ratio_max = widest.max(1.0).min(limit);
            let Some(table) = find(&variants, false, ratio_max)? else { return Ok(None) };
            let mut bent = vec![(limit, table, kind.yarn.clone())];
            // Steps of √2 in shape, each with the inclination that the next allows.
            let mut reach = limit;
            while reach < widest {
                reach *= core::f64::consts::SQRT_2;
                let u_max = (STEEPEST / reach).asin();
                let lowered = variants.lowered_to(u_max);
                let Some(table) = find(&lowered, false, reach)? else { return Ok(None) };
                bent.push((reach, table, Yarn { u_max: yarn.u_max.min(u_max), ..yarn.clone() }));
            }
            let straight = if straight_shows {
                let Some(table) = find(&variants, true, 0.0)? else { return Ok(None) };
                table
            } else {
                // Never looked at.
                bent[0].1.clone()
            };
            materials.single.push(material(&scales, yarn, &variants.grid, &bent, &straight));
            materials.double.push(material(&scales, yarn, &variants.grid, &bent, &straight));
            materials.kinds.push(kind);
        }
        materials.side_by_side = SideBySide::new(&materials.single, &materials.kinds);
        Ok(Some(materials))
    }

    /// The piece with the `key` that one of the types has.
    #[inline]
    pub(crate) fn piece_of(&self, key: u32) -> &Piece<f32> {
        let material = &self.single[(key >> PIECE_BITS) as usize];
        match key % (1 << PIECE_BITS) {
            0 => &material.bent.1,
            1 => &material.straight,
            beyond => &material.lowered[beyond as usize - 2].1,
        }
    }

    /// Their memory, in bytes. Tables that they share count once.
    pub(crate) fn bytes(&self) -> usize {
        let pieces = self.single.iter().map(|material| material.lowered.len()).sum::<usize>();
        let lowered = size_of::<(f64, Piece<f32>)>() + size_of::<(f64, Piece<f64>)>();
        let tables = self.single.iter().flat_map(Material::reflectances);
        let mut tables: Vec<_> = tables.map(|table| (Arc::as_ptr(table), table.bytes())).collect();
        tables.sort_by_key(|(at, _)| at.addr());
        tables.dedup_by_key(|(at, _)| at.addr());
        size_of_val(self.kinds.as_slice())
            + size_of_val(self.single.as_slice())
            + size_of_val(self.double.as_slice())
            + pieces * lowered
            + tables.iter().map(|(_, bytes)| bytes).sum::<usize>()
    }

    /// What the highlight of a type of yarn is divided by; see [`Shader::divisors`](crate::Shader::divisors).
    pub(crate) fn divisors(&self, yarn: usize) -> Option<Vec<f32>> {
        let tables = self.single.get(yarn)?.reflectances();
        Some(tables.flat_map(|table| table.divisors()).copied().collect())
    }

    /// Sets what [`Materials::divisors`] tells; there are as many.
    pub(crate) fn set_divisors(&mut self, yarn: usize, divisors: &[f32]) {
        let (single, double) = (&mut self.single[yarn], &mut self.double[yarn]);
        let tables = single.reflectances_mut().zip(double.reflectances_mut());
        let (divisors, _) = divisors.as_chunks::<SHAPES>();
        for ((single, double), divisors) in tables.zip(divisors) {
            if single.divisors() != divisors {
                *single = Arc::new(single.with_divisors(*divisors));
                *double = single.clone();
            }
        }
        // Types that were alike may no longer be.
        self.side_by_side = SideBySide::new(&self.single, &self.kinds);
    }

    /// Records that segments are too short for their yarn's u_max, or refuses them.
    fn note_steep(
        &mut self,
        cloth: &Cloth,
        index: usize,
        yarn: &Yarn,
        shapes: Shapes,
        limit: f64,
    ) -> Result<(), ClothError> {
        for (is_warp, ratio) in [(true, shapes[0]), (false, shapes[1])] {
            if ratio <= limit {
                continue;
            }
            let lowered = Lowered {
                yarn: index as u16,
                is_warp,
                ratio,
                u_max: yarn.u_max,
                lowered_to: (STEEPEST / ratio).asin().min(yarn.u_max),
            };
            match cloth.steep {
                Steep::Lower => self.lowered.push(lowered),
                Steep::Reject => return Err(ClothError::Steep(lowered)),
            }
        }
        Ok(())
    }
}

/// What `of` finds for each type, or `none`: one for all if they have the same, and nothing if no type has any.
fn for_types<T: Copy + PartialEq>(
    kinds: &[Kind],
    of: impl Fn(&Noise) -> Option<T>,
    none: T,
) -> Vec<T> {
    let found = kinds.iter().map(|kind| of(&kind.yarn.noise));
    if found.clone().all(|one| one.is_none()) {
        return vec![];
    }
    let mut all: Vec<T> = found.map(|one| one.unwrap_or(none)).collect();
    if all.iter().all(|one| *one == all[0]) {
        all.truncate(1);
    }
    all
}

impl SideBySide {
    fn new(materials: &[Material<f32>], kinds: &[Kind]) -> Self {
        let mut keys = Vec::<u32>::new();
        for (index, material) in materials.iter().enumerate() {
            let alike = |other: &Material<f32>| other.has_pieces_of(material);
            // A cloth of many colours has few kinds of yarn, which are found soon.
            let first = materials[..index].iter().position(alike).unwrap_or(index);
            keys.push((first as u32) << PIECE_BITS);
        }
        let look = |material: &Material<f32>| {
            let Look { color: [r, g, b], specular: [p, q], opacity, .. } = material.look;
            [r, g, b, opacity, p[0], p[1], p[2], 0.0, q[0], q[1], q[2], 0.0]
        };
        Self {
            keys,
            looks: materials.iter().map(look).collect(),
            is_irregular: kinds.iter().any(|kind| kind.is_apart),
            lightness: for_types(kinds, |noise| (noise.color > 0.0).then_some(noise.color), 0.0),
            grains: for_types(
                kinds,
                |noise| {
                    (noise.intensity > 0.0).then_some([noise.intensity, noise.fineness.round()])
                },
                [0.0, 1.0],
            ),
            is_lowered: materials.iter().any(|material| !material.lowered.is_empty()),
            is_hidden: materials.iter().any(|material| material.look.opacity == 0.0),
        }
    }

    /// The keys of the bent pieces of types of yarn.
    #[inline(always)]
    pub(crate) fn keys_of<S: Simd>(&self, yarns: u32x16<S>) -> u32x16<S> {
        /// Types among which it is faster to choose than to look them up.
        const FEW: usize = 8;
        let simd = yarns.token();
        if self.keys.len() > FEW {
            return u32x16::from_fn(simd, |lane| self.keys[yarns[lane] as usize]);
        }
        let mut keys = u32x16::splat(simd, self.keys[0]);
        for (yarn, &key) in (0..).zip(&self.keys).skip(1) {
            keys = yarns.simd_eq(yarn).select(u32x16::splat(simd, key), keys);
        }
        keys
    }

    /// The looks of types of yarn that look the same everywhere.
    #[inline(always)]
    pub(crate) fn look<S: Simd>(&self, simd: S, yarns: &[u32]) -> Look<f32x16<S>> {
        let [r, g, b, opacity] = self.look_part(simd, yarns, 0);
        let [p, q, s, _] = self.look_part(simd, yarns, 4);
        let [t, v, w, _] = self.look_part(simd, yarns, 8);
        let intensity = <f32x16<S> as SimdBase<S>>::splat(simd, 1.0);
        Look { color: [r, g, b], specular: [[p, q, s], [t, v, w]], opacity, intensity }
    }

    /// Four numbers of the looks from `first` on.
    #[inline(always)]
    fn look_part<S: Simd>(&self, simd: S, yarns: &[u32], first: usize) -> [f32x16<S>; 4] {
        if let [look] = self.looks.as_slice() {
            let [a, b] = [f32x16::splat(simd, look[first]), f32x16::splat(simd, look[first + 1])];
            let c = f32x16::splat(simd, look[first + 2]);
            [a, b, c, f32x16::splat(simd, look[first + 3])]
        } else {
            quadruples(simd, |lane| &self.looks[yarns[lane] as usize][first..first + 4])
        }
    }
}

impl Material<f32> {
    /// Whether all pieces are those of `other`.
    fn has_pieces_of(&self, other: &Self) -> bool {
        let pairs = self.lowered.iter().zip(&other.lowered);
        self.bent.0 == other.bent.0
            && self.bent.1.is_like(&other.bent.1)
            && self.straight.is_like(&other.straight)
            && self.lowered.len() == other.lowered.len()
            && pairs.into_iter().all(|(a, b)| a.0 == b.0 && a.1.is_like(&b.1))
    }

    /// What is to be added to the key of the bent piece for a bent segment of the shape `ratio` = w/l.
    pub(crate) fn lowered_key(&self, ratio: f64) -> u32 {
        if ratio <= self.bent.0 {
            return 0;
        }
        let fitting = self.lowered.iter().position(|&(limit, _)| ratio <= limit);
        match fitting.or(self.lowered.len().checked_sub(1)) {
            Some(index) => 2 + index as u32,
            None => 0,
        }
    }
}

impl Piece<f32> {
    /// Whether `other` reflects the same, colours aside.
    fn is_like(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.reflectance, &other.reflectance)
            && self.optics == other.optics
            && self.amount == other.amount
            && self.diffuse_scale == other.diffuse_scale
            && self.u_max_limit == other.u_max_limit
    }
}

impl<R> Material<R> {
    /// The tables of all its pieces.
    fn reflectances(&self) -> impl Iterator<Item = &Arc<Reflectance>> {
        let lowered = self.lowered.iter().map(|(_, piece)| &piece.reflectance);
        [&self.bent.1.reflectance, &self.straight.reflectance].into_iter().chain(lowered)
    }

    /// [`Material::reflectances`] to be replaced.
    fn reflectances_mut(&mut self) -> impl Iterator<Item = &mut Arc<Reflectance>> {
        let lowered = self.lowered.iter_mut().map(|(_, piece)| &mut piece.reflectance);
        [&mut self.bent.1.reflectance, &mut self.straight.reflectance].into_iter().chain(lowered)
    }

    /// The piece for a segment of the shape `ratio` = w/l.
    #[inline]
    pub(crate) fn piece(&self, is_straight: bool, ratio: f64) -> &Piece<R> {
        let (limit, piece) = &self.bent;
        if is_straight {
            &self.straight
        } else if ratio <= *limit {
            piece
        } else {
            self.lowered_piece(ratio)
        }
    }

    #[cold]
    fn lowered_piece(&self, ratio: f64) -> &Piece<R> {
        let fits = |(limit, _): &&(f64, Piece<R>)| ratio <= *limit;
        let fitting = self.lowered.iter().find(fits).or(self.lowered.last());
        fitting.map_or(&self.bent.1, |(_, piece)| piece)
    }
}

fn material<R: Scalar>(
    scales: &NormalScales<'_>,
    yarn: &Yarn,
    variants: &[Yarn],
    bent: &[(f64, Arc<Reflectance>, Yarn)],
    straight: &Arc<Reflectance>,
) -> Material<R> {
    let amount = yarn.specular_amount();
    let color = |c: [f32; 3]| c.map(|component| R::from_f64(component.into()));
    let piece = |yarn: &Yarn, limit: f64, is_straight: bool, table: &Arc<Reflectance>| {
        let u_max_limit = (STEEPEST / limit).min(1.0).asin();
        let diffuse_scale = |variant: &Yarn| {
            let u_max = variant.u_max.min(u_max_limit);
            scales.of(&Yarn { u_max, ..variant.clone() }, is_straight)
        };
        Piece {
            u_max_limit,
            optics: Optics::new(yarn, is_straight, scales.cloth.mapping),
            sampler: AzimuthSampler::new(&yarn.phase),
            reflectance: table.clone(),
            mean: Affine {
                base: R::from_f64(table.mean.base),
                slope: R::from_f64(table.mean.slope),
            },
            diffuse_scale: (yarn.diffuse == Diffuse::YarnNormal).then(|| {
                R::from_f64(variants.iter().map(diffuse_scale).fold(f64::INFINITY, f64::min))
            }),
            amount: R::from_f64(amount.into()),
            has_highlight: amount > 0.0,
        }
    };
    let bent_piece = |(limit, table, yarn): &(f64, Arc<Reflectance>, Yarn)| {
        (*limit, piece(yarn, *limit, false, table))
    };
    Material {
        look: Look {
            color: color(yarn.color),
            specular: yarn.specular_colors().map(color),
            opacity: R::from_f64(yarn.opacity),
            intensity: R::from_f64(1.0),
        },
        bent: bent_piece(&bent[0]),
        lowered: bent[1..].iter().map(bent_piece).collect(),
        straight: piece(yarn, 1.0, true, straight),
    }
}

/// The scales of the diffuse of yarns by their normals, each found once.
struct NormalScales<'a> {
    cloth: &'a Cloth,
    known: RefCell<Vec<(Optics<f64>, f64)>>,
}

impl<'a> NormalScales<'a> {
    fn new(cloth: &'a Cloth) -> Self {
        Self { cloth, known: RefCell::default() }
    }

    /// That of `yarn`; 1 where no point may reflect more than it receives.
    fn of(&self, yarn: &Yarn, is_straight: bool) -> f64 {
        if self.cloth.normalization == Mode::Pointwise {
            return 1.0;
        }
        let optics = Optics::new(yarn, is_straight, self.cloth.mapping);
        let mut known = self.known.borrow_mut();
        if let Some((_, scale)) = known.iter().find(|(of, _)| *of == optics) {
            return *scale;
        }
        let scale = normal_scale(&optics);
        known.push((optics, scale));
        scale
    }
}

/// 1 over the greatest albedo, over directions, of `(n·wi)(n·wo)/π` averaged over a segment.
fn normal_scale(optics: &Optics<f64>) -> f64 {
    let side = 24;
    let at = |k: usize| 2.0 * (k as f64 + 0.5) / side as f64 - 1.0;
    let points: Vec<(Vector<f64>, f64)> = (0..side * side)
        .map(|i| {
            let (sin_u, cos_u, _) = optics.along(at(i % side));
            let (sin_v, cos_v, _) = optics.across(at(i / side));
            let n = normal(sin_u, cos_u, sin_v, cos_v);
            // ∫ (n·wi)⁺ cos θi dwi / π for a normal at the angle γ.
            let gamma = n.z.clamp(-1.0, 1.0).acos();
            (n, 2.0 / (3.0 * PI) * (gamma.sin() + (PI - gamma) * gamma.cos()))
        })
        .collect();
    let albedo = |wo: DVec3| {
        let wo = Vector::new(wo.x, wo.y, wo.z);
        let sum: f64 = points.iter().map(|(n, received)| n.dot(wo).max(0.0) * received).sum();
        sum / points.len() as f64
    };
    let mut greatest: f64 = 0.0;
    for i in 0..24 {
        let (sin, cos) = (0.5 * PI * f64::from(i) / 24.0).sin_cos();
        for j in 0..24 {
            let (y, x) = (2.0 * PI * f64::from(j) / 24.0).sin_cos();
            greatest = greatest.max(albedo(DVec3::new(sin * x, sin * y, cos)));
        }
    }
    // The sums over points and directions are that close.
    0.99 / greatest
}
