//! Places of sixteen points at a time.

use fearless_simd::{Simd, f32x16, mask32x16, prelude::*, u32x16};
use glam::DVec2;

use super::Batch;
use super::chunk::{Chunk, NOTHING};
use crate::frame::Vector;
use crate::lanes::{LANES, Wide, WideMask, put};
use crate::moving::Moving;
use crate::noise::{Lines, Use};
use crate::real::Real;
use crate::shader::Shader;
use crate::threads::{Constant, Fill};
use crate::weave::{Positions, Segments, Side, Touching};

impl Shader {
    /// Sets the places of a block of points, those from `first` on in `chunk`.
    #[inline(always)]
    pub(super) fn find<S: Simd>(
        &self,
        simd: S,
        block: &Block<'_>,
        first: usize,
        chunk: &mut Chunk,
    ) {
        let &Block { points: Batch { uv: [u, v], wi, wo, .. }, from, is_wanted } = block;
        let (wi, wo) = (vector(simd, wi, from), vector(simd, wo, from));
        let u = Wide::load(simd, &u[from..from + LANES]);
        let v = Wide::load(simd, &v[from..from + LANES]);
        let is_wanted = mask32x16::from_bitmask(simd, is_wanted.into());
        let Oriented { is_lit, is_back, wi, wo } = self.oriented_lanes(wi, wo);
        let is_lit = is_wanted & is_lit;
        let found = self.segments(is_lit, is_back, [u, v], first, chunk);
        let Found { is_hit, is_warp, at } = found;
        let (wi, wo) = (to_yarn(wi, is_warp), to_yarn(wo, is_warp));
        chunk.is_warp[first / LANES] = is_warp.to_bitmask() as u16;
        chunk.is_back[first / LANES] = is_back.to_bitmask() as u16;
        let lanes = first..first + LANES;
        put(at, &mut chunk.points.at, first);
        put([wi.x, wi.y, wi.z], &mut chunk.points.wi, first);
        put([wo.x, wo.y, wo.z], &mut chunk.points.wo, first);
        let pieces = u32x16::from_slice(simd, &chunk.piece[lanes.clone()]);
        let nothing = u32x16::splat(simd, NOTHING);
        is_hit.select(pieces, nothing).store_slice(&mut chunk.piece[lanes]);
        if self.materials.side_by_side.is_irregular {
            self.set_apart(first, chunk);
        }
    }

    /// The directions `w` of the yarn frames of the block of points from `first` on, in the shading
    /// frame; sets those that they are again in the yarn frames. Points where there is none, or one
    /// that rounding has taken to the other side, have no yarn any more.
    #[inline(always)]
    pub(super) fn settle<S: Simd>(
        &self,
        w: Vector<f32x16<S>>,
        first: usize,
        chunk: &mut Chunk,
    ) -> Vector<f32x16<S>> {
        let simd = w.x.token();
        let mask = |bits: u16| mask32x16::from_bitmask(simd, bits.into());
        let is_warp = mask(chunk.is_warp[first / LANES]);
        let was_back = mask(chunk.is_back[first / LANES]);
        let is_drawn = w.z.is_positive();
        let drawn = self.shown(w, first, chunk);
        let Oriented { is_lit, is_back, wi, .. } = self.oriented_lanes(drawn, drawn);
        let wi = to_yarn(wi, is_warp);
        put([wi.x, wi.y, wi.z], &mut chunk.points.wi, first);
        let pieces = u32x16::from_slice(simd, &chunk.piece[first..first + LANES]);
        let is_sample = is_drawn & is_lit & !(is_back ^ was_back);
        let nothing = u32x16::splat(simd, NOTHING);
        is_sample.select(pieces, nothing).store_slice(&mut chunk.piece[first..first + LANES]);
        drawn
    }

    /// Vectors of the yarn frames of the block of points from `first` on, in the shading frame.
    #[inline(always)]
    pub(super) fn shown<S: Simd>(
        &self,
        w: Vector<f32x16<S>>,
        first: usize,
        chunk: &Chunk,
    ) -> Vector<f32x16<S>> {
        let mask = |bits: u16| mask32x16::from_bitmask(w.x.token(), bits.into());
        let is_warp = mask(chunk.is_warp[first / LANES]);
        let is_back = mask(chunk.is_back[first / LANES]);
        let turned = Vector::new(is_warp.select(w.x, w.y), is_warp.select(w.y, -w.x), w.z);
        self.frame.turned_back(turned_over(turned, is_back))
    }

    /// Takes points on yarn that looks different from place to place out of those that are shaded
    /// together.
    fn set_apart(&self, first: usize, chunk: &mut Chunk) {
        for lane in first..first + LANES {
            let yarn = chunk.points.yarn[lane] as usize;
            chunk.is_apart[lane] =
                chunk.piece[lane] != NOTHING && { self.materials.kinds[yarn].is_apart };
            if chunk.is_apart[lane] {
                chunk.piece[lane] = NOTHING;
            }
        }
    }

    /// [`Shader::oriented`] side by side.
    #[inline(always)]
    fn oriented_lanes<S: Simd>(&self, wi: Vector<f32x16<S>>, wo: Vector<f32x16<S>>) -> Oriented<S> {
        let is_finite = (wi.dot(wi) + wo.dot(wo)).lt(Real::splat(wi.x, f32::INFINITY));
        let (wi, wo) = (self.frame.turned(wi), self.frame.turned(wo));
        let is_face = wi.z.is_positive() & wo.z.is_positive();
        let is_back = wi.z.lt(wi.z.zero()) & wo.z.lt(wi.z.zero());
        let (wi, wo) = (turned_over(wi, is_back), turned_over(wo, is_back));
        Oriented { is_lit: is_finite & (is_face | is_back), is_back, wi, wo }
    }

    /// What shows at `uv`; sets the pieces and yarns in `chunk`.
    #[inline(always)]
    fn segments<S: Simd>(
        &self,
        is_lit: mask32x16<S>,
        is_back: mask32x16<S>,
        uv: [Wide<S>; 2],
        first: usize,
        chunk: &mut Chunk,
    ) -> Found<S> {
        let (position, is_near) = self.weave.positions(self.frame.cells_lanes(uv));
        let segments = match &self.threads.fill {
            Fill::Touching if is_near => self.weave.segments_at(is_back, &position, &Touching),
            Fill::Constant(sizes) if is_near => {
                let sizes = Constant { threads: &self.threads, sizes };
                self.weave.segments_at(is_back, &position, &sizes)
            }
            Fill::Varying(types) if is_near && types.are_long() => {
                let sizes = Moving { threads: &self.threads, types };
                self.weave.segments_at(is_back, &position, &sizes)
            }
            _ => return self.one_by_one(is_lit, is_back, uv, first, chunk),
        };
        let found = self.found(is_lit, &segments, first, chunk);
        if !self.materials.side_by_side.grains.is_empty() {
            self.set_grains(&position, &segments, first, chunk);
        }
        if !self.materials.side_by_side.lightness.is_empty() {
            self.set_lightness(&position, segments.is_warp, first, chunk);
        }
        found
    }

    /// Sets the factors of the colours of threads.
    #[inline(always)]
    fn set_lightness<S: Simd>(
        &self,
        position: &Positions<S>,
        is_warp: mask32x16<S>,
        first: usize,
        chunk: &mut Chunk,
    ) {
        let lanes = first..first + LANES;
        let [end, pick] = position.cell;
        let wide = WideMask::of(is_warp);
        let lines = Lines { seed: self.seed, is_warp: wide, index: end.or(wide, pick) };
        let all = &self.materials.side_by_side.lightness;
        let amount = if let [amount] = all.as_slice() {
            end.of(*amount)
        } else {
            let yarns = &chunk.points.yarn[lanes.clone()];
            Wide::from_fn(end.token(), |lane| all[yarns[lane] as usize])
        };
        let lightness = amount * lines.signed(Use::Lightness) + 1.0;
        lightness.narrow().store_slice(&mut chunk.points.lightness[lanes]);
    }

    /// Sets the factors of the highlight's grains.
    #[inline(always)]
    fn set_grains<S: Simd>(
        &self,
        position: &Positions<S>,
        segments: &Segments<S>,
        first: usize,
        chunk: &mut Chunk,
    ) {
        let (simd, lanes) = (segments.thread.token(), first..first + LANES);
        let &Segments { is_warp, x, is_mirrored, .. } = segments;
        let x = (-x).or(WideMask::of(is_mirrored[0]), x);
        let yarns = u32x16::from_slice(simd, &chunk.points.yarn[lanes.clone()]);
        let all = &self.materials.side_by_side.grains;
        let part = |k: usize| Wide::from_fn(simd, |lane| all[yarns[lane] as usize][k]);
        let (amount, fineness) = if let [[amount, fineness]] = all.as_slice() {
            (x.of(*amount), x.of(*fineness))
        } else {
            (part(0), part(1))
        };
        let Positions { cell: [end, pick], fraction: [u, v], .. } = *position;
        // Along an end, picks follow each other.
        let wide = WideMask::of(is_warp);
        let (line, cell, fraction) = (end.or(wide, pick), pick.or(wide, end), v.or(wide, u));
        let along = cell * fineness + (fraction * fineness).floor();
        let across = ((x + 1.0) * 0.5 * fineness).floor();
        let lines = Lines { seed: self.seed, is_warp: wide, index: line };
        let grain = lines.intensity(along, across);
        let intensity = grain * amount.narrow() + (-amount + 1.0).narrow();
        intensity.store_slice(&mut chunk.intensity[lanes]);
    }

    /// What shows where these `segments` are; sets the pieces and yarns in `chunk`.
    #[inline(always)]
    fn found<S: Simd>(
        &self,
        is_lit: mask32x16<S>,
        segments: &Segments<S>,
        first: usize,
        chunk: &mut Chunk,
    ) -> Found<S> {
        let &Segments {
            is_hit,
            is_warp,
            is_straight,
            thread,
            x,
            y,
            is_mirrored,
            inv_length,
            width,
        } = segments;
        let simd = thread.token();
        let [of_pick, of_end] = self.frame.aspects;
        let aspect = x.of(of_end).or(WideMask::of(is_warp), x.of(of_pick));
        let ratio = x.of(0.0).or(WideMask::of(is_straight), width * aspect * inv_length);
        let lanes = first..first + LANES;
        let common = &self.materials.side_by_side;
        let straight = is_straight.select(u32x16::splat(simd, 1), u32x16::splat(simd, 0));
        let mut pieces = straight;
        if common.keys.len() > 1 {
            // Where there is no yarn, any will do.
            let yarns = self.threads.yarns_of(is_warp, thread);
            yarns.store_slice(&mut chunk.points.yarn[lanes.clone()]);
            pieces = common.keys_of(yarns) | straight;
        }
        if common.is_lowered {
            let ratio = ratio.to_array();
            for lane in 0..LANES {
                if !is_straight.test(lane) {
                    let yarn = chunk.points.yarn[first + lane] as usize;
                    pieces[lane] += self.materials.single[yarn].lowered_key(ratio[lane]);
                }
            }
        }
        pieces.store_slice(&mut chunk.piece[lanes]);
        let [x, y] = [x.narrow(), y.narrow()];
        let at = [is_mirrored[0].select(-x, x), is_mirrored[1].select(-y, y), ratio.narrow()];
        Found { is_hit: is_hit & is_lit, is_warp, at }
    }

    /// The same for each point on its own.
    #[inline(never)]
    fn one_by_one<S: Simd>(
        &self,
        is_lit: mask32x16<S>,
        is_back: mask32x16<S>,
        uv: [Wide<S>; 2],
        first: usize,
        chunk: &mut Chunk,
    ) -> Found<S> {
        let simd = is_lit.token();
        let [u, v] = uv.map(Wide::to_array);
        let mut at = [[0.0; LANES]; 3];
        let (mut is_hit, mut is_warp) = (0_u64, 0_u64);
        for lane in (0..LANES).filter(|&lane| is_lit.test(lane)) {
            let side = if is_back.test(lane) { Side::Back } else { Side::Face };
            let uv = DVec2::new(u[lane], v[lane]);
            let Some((position, segment)) = self.segment_at(uv, side) else { continue };
            let (yarn, ratio) = (self.threads.yarn(&segment), self.shape(&segment));
            let key = if segment.is_straight() {
                1
            } else {
                self.materials.single[usize::from(yarn)].lowered_key(ratio)
            };
            chunk.points.yarn[first + lane] = yarn.into();
            chunk.piece[first + lane] = self.materials.side_by_side.keys[usize::from(yarn)] + key;
            let noise = &self.materials.kinds[usize::from(yarn)].yarn.noise;
            chunk.intensity[first + lane] = self.grains(noise, &segment, position);
            chunk.points.lightness[first + lane] =
                self.lightness(noise, segment.is_warp, segment.line);
            for (part, value) in at.iter_mut().zip([segment.x, segment.y, ratio]) {
                part[lane] = value as f32;
            }
            is_hit |= 1 << lane;
            is_warp |= u64::from(segment.is_warp) << lane;
        }
        let mask = |bits| mask32x16::from_bitmask(simd, bits);
        let at = at.map(|part| f32x16::simd_from(simd, part));
        Found { is_hit: mask(is_hit), is_warp: mask(is_warp), at }
    }
}

/// Both directions in the frame of weft and warp, as seen from the side they are on.
struct Oriented<S: Simd> {
    /// Whether they are on one side, and finite.
    is_lit: mask32x16<S>,
    is_back: mask32x16<S>,
    wi: Vector<f32x16<S>>,
    wo: Vector<f32x16<S>>,
}

/// What shows at sixteen points.
struct Found<S: Simd> {
    is_hit: mask32x16<S>,
    is_warp: mask32x16<S>,
    at: [f32x16<S>; 3],
}

/// As many points as there are lanes.
pub(super) struct Block<'a> {
    points: &'a Batch<'a>,
    /// The first of them.
    from: usize,
    /// A bit for each that is wanted.
    is_wanted: u16,
}

impl<'a> Block<'a> {
    /// The block of `points` from `first` on; those that there are not are taken from `rest`.
    #[inline(always)]
    pub(super) fn new(points: &'a Batch<'a>, first: usize, rest: &'a Batch<'a>) -> Self {
        let count = LANES.min(points.len() - first);
        let is_wanted = match points.active {
            None => u16::MAX >> (LANES - count),
            Some(active) => (active[first..][..count].iter().rev())
                .fold(0, |bits, &is_active| bits << 1 | u16::from(is_active)),
        };
        let (points, from) = if count == LANES { (points, first) } else { (rest, 0) };
        Self { points, from, is_wanted }
    }
}

/// The last points of a batch, and zeros up to a block.
pub(super) struct Rest {
    uv: [[f64; LANES]; 2],
    wi: [[f32; LANES]; 3],
    wo: [[f32; LANES]; 3],
}

impl Rest {
    /// Those of `points` that fill no block.
    pub(super) fn new(points: &Batch<'_>) -> Self {
        let first = points.len() - points.len() % LANES;
        let mut rest = Self { uv: [[0.0; LANES]; 2], wi: [[0.0; LANES]; 3], wo: [[0.0; LANES]; 3] };
        for (to, from) in (first..points.len()).enumerate() {
            for (part, all) in rest.uv.iter_mut().zip(points.uv) {
                part[to] = all[from];
            }
            for (part, all) in rest.wi.iter_mut().zip(points.wi) {
                part[to] = all[from];
            }
            for (part, all) in rest.wo.iter_mut().zip(points.wo) {
                part[to] = all[from];
            }
        }
        rest
    }

    pub(super) fn batch(&self) -> Batch<'_> {
        Batch {
            uv: self.uv.each_ref().map(<[f64; LANES]>::as_slice),
            wi: self.wi.each_ref().map(<[f32; LANES]>::as_slice),
            wo: self.wo.each_ref().map(<[f32; LANES]>::as_slice),
            active: None,
        }
    }
}

/// Vectors of points from `first` on.
#[inline(always)]
fn vector<S: Simd>(simd: S, [x, y, z]: &[&[f32]; 3], first: usize) -> Vector<f32x16<S>> {
    let all = first..first + LANES;
    Vector::new(
        f32x16::from_slice(simd, &x[all.clone()]),
        f32x16::from_slice(simd, &y[all.clone()]),
        f32x16::from_slice(simd, &z[all]),
    )
}

/// [`Vector::turned_over`] where `is_back` holds.
#[inline(always)]
fn turned_over<S: Simd>(w: Vector<f32x16<S>>, is_back: mask32x16<S>) -> Vector<f32x16<S>> {
    let over = w.turned_over();
    Vector::new(is_back.select(over.x, w.x), w.y, is_back.select(over.z, w.z))
}

/// [`crate::frame::to_yarn`] side by side.
#[inline(always)]
fn to_yarn<S: Simd>(w: Vector<f32x16<S>>, is_warp: mask32x16<S>) -> Vector<f32x16<S>> {
    Vector::new(is_warp.select(w.x, -w.y), is_warp.select(w.y, w.x), w.z)
}
