//! A chunk of points on its way through the kernel.

use core::ops::Range;

use fearless_simd::{Level, Simd, f32x16, mask32x16, prelude::*, u32x16};

use super::Batch;
use super::places::{Block, Rest};
use crate::density::{Drawing, density};
use crate::draw::draw;
use crate::frame::Vector;
use crate::lanes::{LANES, put};
use crate::material::Piece;
use crate::pair::{Blocks, Pair, is_paired};
use crate::phase::Parts;
use crate::place::Look;
use crate::shader::{Shader, White};

/// Points in a chunk: with what is kept of those that are shaded, they fit in a first cache of 32 kB.
pub(super) const CHUNK: usize = 256;

/// What is kept of the points of a chunk.
///
/// Lanes lie within lines of the cache.
#[repr(align(64))]
pub(super) struct Chunk {
    pub(super) points: Points,
    /// Whether it is on a warp yarn, and seen from the back: a bit for each point of a block.
    pub(super) is_warp: [u16; CHUNK / LANES],
    pub(super) is_back: [u16; CHUNK / LANES],
    /// The key of the piece of yarn, or [`NOTHING`].
    pub(super) piece: [u32; CHUNK],
    /// Points that are left to [`Shader::eval_lobes`].
    pub(super) is_apart: [bool; CHUNK],
    /// The factor of the highlight's grains; 1 where there are none.
    pub(super) intensity: [f32; CHUNK],
    /// Points on one piece of yarn out of blocks that have others as well, side by side.
    alike: Points,
    /// What is wanted.
    pub(super) specular: [[f32; CHUNK]; 3],
    pub(super) diffuse: [[f32; CHUNK]; 3],
    pub(super) pdf: [f32; CHUNK],
}

/// What the kernel takes and returns of points.
#[repr(align(64))]
pub(super) struct Points {
    /// x and y in [−1, 1], and w/l.
    pub(super) at: [[f32; CHUNK]; 3],
    /// In the yarn frame; or the numbers that draw it.
    pub(super) wi: [[f32; CHUNK]; 3],
    pub(super) wo: [[f32; CHUNK]; 3],
    /// The index of the type of yarn.
    pub(super) yarn: [u32; CHUNK],
    /// The factor of the thread's colour; 1 where threads are alike.
    pub(super) lightness: [f32; CHUNK],
    /// f of the peak, of the uniform part and of the diffuse, if the yarn were white; or a direction
    /// drawn in the yarn frame.
    white: [[f32; CHUNK]; 3],
    /// The density; or how a direction was drawn: the share of the highlight and the ends of its span.
    density: [[f32; CHUNK]; 3],
}

/// What is wanted of points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Wanted {
    /// The sum of both lobes, in place of the highlight.
    Sum,
    Lobes,
    Density,
    Both,
    /// A direction, drawn by the numbers that stand in its place.
    Direction,
    /// Both, of a direction that was just drawn.
    Drawn,
}

impl Wanted {
    #[inline(always)]
    pub(super) fn has_lobes(self) -> bool {
        matches!(self, Self::Sum | Self::Lobes | Self::Both | Self::Drawn)
    }

    #[inline(always)]
    pub(super) fn has_density(self) -> bool {
        matches!(self, Self::Density | Self::Both | Self::Drawn)
    }
}

/// The key of points that reflect nothing.
pub(super) const NOTHING: u32 = u32::MAX;

/// Places, and the directions to the light and the viewer.
type Taken<R> = ([R; 3], Vector<R>, Vector<R>);

impl Chunk {
    pub(super) fn new() -> Self {
        Self {
            points: Points::new(),
            is_warp: [0; CHUNK / LANES],
            is_back: [0; CHUNK / LANES],
            piece: [NOTHING; CHUNK],
            is_apart: [false; CHUNK],
            intensity: [1.0; CHUNK],
            alike: Points::new(),
            specular: [[0.0; CHUNK]; 3],
            diffuse: [[0.0; CHUNK]; 3],
            pdf: [0.0; CHUNK],
        }
    }
}

impl Points {
    fn new() -> Self {
        let none = [[0.0; CHUNK]; 3];
        Self {
            at: none,
            wi: none,
            wo: none,
            yarn: [0; CHUNK],
            lightness: [1.0; CHUNK],
            white: none,
            density: none,
        }
    }

    /// Where the points of the blocks from `firsts` on are, and their directions.
    #[inline(always)]
    fn taken<S: Simd, B: Blocks<S>>(&self, simd: S, firsts: [usize; 2]) -> Taken<B> {
        let Vector { x, y, z } = vectors::<S, B>(simd, &self.at, firsts);
        let wi = vectors::<S, B>(simd, &self.wi, firsts);
        ([x, y, z], wi, vectors::<S, B>(simd, &self.wo, firsts))
    }

    /// Sets what the kernel takes, from the point `to` on, to that of those of another's block from
    /// `from` ≥ `to` on for which `mask` holds.
    #[inline(always)]
    fn gather<S: Simd>(&mut self, to: usize, all: &Self, from: usize, mask: mask32x16<S>) {
        if is_packed_fast(mask.token()) {
            for k in 0..3 {
                pack(mask, &all.at[k], from, &mut self.at[k], to);
                pack(mask, &all.wi[k], from, &mut self.wi[k], to);
                pack(mask, &all.wo[k], from, &mut self.wo[k], to);
                pack(mask, &all.density[k], from, &mut self.density[k], to);
            }
            let yarns = u32x16::from_slice(mask.token(), &all.yarn[from..from + LANES]);
            yarns.compress(mask).store_slice(&mut self.yarn[to..to + LANES]);
            pack(mask, &all.lightness, from, &mut self.lightness, to);
            return;
        }
        for (to, from) in (to..).zip(numbers(mask, from)) {
            for k in 0..3 {
                self.at[k][to] = all.at[k][from];
                self.wi[k][to] = all.wi[k][from];
                self.wo[k][to] = all.wo[k][from];
                self.density[k][to] = all.density[k][from];
            }
            self.yarn[to] = all.yarn[from];
            self.lightness[to] = all.lightness[from];
        }
    }

    /// Sets what the kernel returns, at those points of the block from `to` on for which `mask` holds,
    /// to that of another's points from `from` ≤ `to` on.
    #[inline(always)]
    fn scatter<S: Simd>(&mut self, to: usize, all: &Self, from: usize, mask: mask32x16<S>) {
        if is_packed_fast(mask.token()) {
            for k in 0..3 {
                unpack(mask, &all.white[k], from, &mut self.white[k], to);
                unpack(mask, &all.density[k], from, &mut self.density[k], to);
            }
            return;
        }
        for (from, to) in (from..).zip(numbers(mask, to)) {
            for k in 0..3 {
                self.white[k][to] = all.white[k][from];
                self.density[k][to] = all.density[k][from];
            }
        }
    }
}

/// Whether there are instructions that move the lanes of a mask next to each other.
#[inline(always)]
fn is_packed_fast<S: Simd>(simd: S) -> bool {
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    if let Level::Avx512(_) = simd.level() {
        return true;
    }
    let _ = simd;
    false
}

/// Sets the numbers of `own` from `to` on to those of the block of `all` from `from` on for which `mask`
/// holds, and changes others of that block.
#[inline(always)]
fn pack<S: Simd>(
    mask: mask32x16<S>,
    all: &[f32; CHUNK],
    from: usize,
    own: &mut [f32; CHUNK],
    to: usize,
) {
    load(mask.token(), all, from).compress(mask).store_slice(&mut own[to..to + LANES]);
}

/// The inverse of [`pack`], which leaves the others as they are.
#[inline(always)]
fn unpack<S: Simd>(
    mask: mask32x16<S>,
    all: &[f32; CHUNK],
    from: usize,
    own: &mut [f32; CHUNK],
    to: usize,
) {
    let simd = mask.token();
    let others = load(simd, own, to);
    load(simd, all, from).expand_merge(mask, others).store_slice(&mut own[to..to + LANES]);
}

/// Which points of a block are on the piece with this `key`.
#[inline(always)]
fn on<S: Simd>(simd: S, pieces: &[u32; CHUNK], key: u32, block: usize) -> mask32x16<S> {
    u32x16::from_slice(simd, &pieces[LANES * block..][..LANES]).simd_eq(key)
}

/// The numbers of the points of the block from `first` on for which `mask` holds.
#[inline(always)]
fn numbers<S: Simd>(mask: mask32x16<S>, first: usize) -> impl Iterator<Item = usize> {
    let mut bits = mask.to_bitmask();
    core::iter::from_fn(move || {
        let lane = bits.trailing_zeros() as usize;
        (bits != 0).then(|| {
            bits &= bits - 1;
            (first + lane) % CHUNK
        })
    })
}

/// The lanes of a block, `LANES` from `first` on.
#[inline(always)]
fn load<S: Simd>(simd: S, values: &[f32], first: usize) -> f32x16<S> {
    f32x16::from_slice(simd, &values[first..first + LANES])
}

/// Vectors of a block.
#[inline(always)]
fn vector<S: Simd>(simd: S, parts: &[[f32; CHUNK]; 3], first: usize) -> Vector<f32x16<S>> {
    vectors::<S, f32x16<S>>(simd, parts, [first; 2])
}

/// Vectors of blocks.
#[inline(always)]
fn vectors<S: Simd, B: Blocks<S>>(
    simd: S,
    [x, y, z]: &[[f32; CHUNK]; 3],
    firsts: [usize; 2],
) -> Vector<B> {
    Vector::new(B::load(simd, x, firsts), B::load(simd, y, firsts), B::load(simd, z, firsts))
}

/// The first points of as many of `blocks` as `B` has, again and again; the last one twice where they
/// do not come out even.
#[inline(always)]
fn together<S: Simd, B: Blocks<S>>(blocks: Range<usize>) -> impl Iterator<Item = [usize; 2]> {
    let last = blocks.end - 1;
    blocks.step_by(B::COUNT).map(move |block| [LANES * block, LANES * last.min(block + 1)])
}

/// [`Shader::highlight_of_piece`].
#[inline(always)]
fn highlights<S: Simd, B: Blocks<S>>(
    simd: S,
    piece: &Piece<f32>,
    points: &mut Points,
    blocks: Range<usize>,
) {
    for firsts in together::<S, B>(blocks) {
        let (at, wi, wo) = points.taken::<S, B>(simd, firsts);
        let inv_divisor = B::load(simd, &points.white[0], firsts);
        let Parts { peak, uniform } = piece.highlight(at, inv_divisor, wi, wo);
        peak.put(&mut points.white[0], firsts);
        uniform.put(&mut points.white[1], firsts);
    }
}

impl Shader {
    /// Sets the places of `points`.
    #[inline(always)]
    pub(super) fn find_all<S: Simd>(&self, simd: S, points: &Batch<'_>, chunk: &mut Chunk) {
        let rest = Rest::new(points);
        let rest = rest.batch();
        for first in (0..points.len()).step_by(LANES) {
            let block = Block::new(points, first, &rest);
            self.find(simd, &block, first, chunk);
        }
    }

    /// Sets what is `wanted` of `points`, but of those that are apart.
    #[inline(always)]
    pub(super) fn shade_lanes<S: Simd>(
        &self,
        simd: S,
        points: &Batch<'_>,
        wanted: Wanted,
        chunk: &mut Chunk,
    ) {
        self.find_all(simd, points, chunk);
        self.shade_white(simd, points.len().div_ceil(LANES), wanted, chunk);
        for first in (0..points.len()).step_by(LANES) {
            self.color(simd, first, wanted, chunk);
        }
    }

    /// Draws a direction at each of `points` by the numbers that stand in its place, in the shading
    /// frame, and sets lobes and density there; nothing but a density of 0 where there is none. Of
    /// those that are apart, nothing is set.
    #[inline(always)]
    pub(super) fn draw_lanes<S: Simd>(
        &self,
        simd: S,
        points: &Batch<'_>,
        drawn: &mut [[f32; CHUNK]; 3],
        chunk: &mut Chunk,
    ) {
        // What is seen does not depend on where light comes from, as long as that is in front.
        self.find_all(simd, &Batch { wi: points.wo, ..*points }, chunk);
        for (part, numbers) in chunk.points.wi.iter_mut().zip(points.wi) {
            part[..numbers.len()].copy_from_slice(numbers);
        }
        let blocks = points.len().div_ceil(LANES);
        self.shade_white(simd, blocks, Wanted::Direction, chunk);
        for first in (0..points.len()).step_by(LANES) {
            let direction = vector(simd, &chunk.points.white, first);
            let direction = self.settle(direction, first, chunk);
            put([direction.x, direction.y, direction.z], drawn, first);
        }
        self.shade_white(simd, blocks, Wanted::Drawn, chunk);
        for first in (0..points.len()).step_by(LANES) {
            self.color(simd, first, Wanted::Drawn, chunk);
        }
    }

    /// Finds what is `wanted` of points whose places are known, as if they were white.
    #[inline(always)]
    fn shade_white<S: Simd>(&self, simd: S, blocks: usize, wanted: Wanted, chunk: &mut Chunk) {
        let Chunk { points, alike, piece: pieces, .. } = chunk;
        let mut is_done = [0_u16; CHUNK / LANES];
        for start in 0..blocks {
            // The first point that is still to be shaded tells the next piece.
            loop {
                let open = !(on(simd, pieces, NOTHING, start).to_bitmask() as u16 | is_done[start]);
                if open == 0 {
                    break;
                }
                let key = pieces[LANES * start + open.trailing_zeros() as usize];
                let piece = self.materials.piece_of(key);
                // How many are packed, and the blocks that are whole up to the last one.
                let (mut count, mut whole) = (0, start..start);
                for (block, is_done) in is_done.iter_mut().enumerate().take(blocks).skip(start) {
                    let mask = on(simd, pieces, key, block);
                    let bits = mask.to_bitmask() as u16;
                    *is_done |= bits;
                    if bits == u16::MAX {
                        if whole.end != block {
                            self.shade_piece(simd, piece, wanted, points, whole);
                            whole = block..block;
                        }
                        whole.end = block + 1;
                    } else if bits != 0 {
                        alike.gather(count, points, LANES * block, mask);
                        count += bits.count_ones() as usize;
                    }
                }
                self.shade_piece(simd, piece, wanted, points, whole);
                self.shade_piece(simd, piece, wanted, alike, 0..count.div_ceil(LANES));
                let mut from = 0;
                for block in start..blocks {
                    if from == count {
                        break;
                    }
                    let mask = on(simd, pieces, key, block);
                    let bits = mask.to_bitmask() as u16;
                    if bits != u16::MAX && bits != 0 {
                        points.scatter(LANES * block, alike, from, mask);
                        from += bits.count_ones() as usize;
                    }
                }
            }
        }
    }

    /// Sets what the points of `blocks` on one `piece` reflect if they are white, and the density of their
    /// directions; or directions, and how they were drawn: as [`Points`] keeps them.
    ///
    /// One after the other for all blocks: each of them alone is short enough for a processor to have
    /// the next block under way before one is done, and none waits for its long chains.
    #[inline(always)]
    fn shade_piece<S: Simd>(
        &self,
        simd: S,
        piece: &Piece<f32>,
        wanted: Wanted,
        points: &mut Points,
        blocks: Range<usize>,
    ) {
        if blocks.is_empty() {
            return;
        }
        if wanted == Wanted::Direction {
            self.draw_piece(simd, piece, points, blocks);
            return;
        }
        if wanted.has_density() {
            self.density_of_piece(simd, piece, wanted, points, blocks.clone());
        }
        if wanted.has_lobes() {
            self.diffuse_of_piece(simd, piece, points, blocks.clone());
            self.highlight_of_piece(simd, piece, points, blocks);
        }
    }

    /// Draws directions.
    ///
    /// Not inlined, as those that follow: they are most of the code of a batch, for each set of
    /// instructions.
    #[inline(never)]
    fn draw_piece<S: Simd>(
        &self,
        simd: S,
        piece: &Piece<f32>,
        points: &mut Points,
        blocks: Range<usize>,
    ) {
        simd.vectorize(
            #[inline(always)]
            || {
                for first in blocks.map(|block| LANES * block) {
                    let firsts = [first; 2];
                    let (at, xi, wo) = points.taken::<S, f32x16<S>>(simd, firsts);
                    let drawing = self.drawing(piece, at, wo, self.bright(simd, points, firsts));
                    let Vector { x, y, z } = draw(piece, at, &drawing, wo, [xi.x, xi.y, xi.z]);
                    let [from, to] = drawing.span;
                    put([x, y, z], &mut points.white, first);
                    put([drawing.share, from, to], &mut points.density, first);
                }
            },
        );
    }

    /// Sets densities.
    #[inline(never)]
    fn density_of_piece<S: Simd>(
        &self,
        simd: S,
        piece: &Piece<f32>,
        wanted: Wanted,
        points: &mut Points,
        blocks: Range<usize>,
    ) {
        simd.vectorize(
            #[inline(always)]
            || {
                if is_paired(simd) {
                    self.densities::<S, Pair<S>>(simd, piece, wanted, points, blocks);
                } else {
                    self.densities::<S, f32x16<S>>(simd, piece, wanted, points, blocks);
                }
            },
        );
    }

    #[inline(always)]
    fn densities<S: Simd, B: Blocks<S>>(
        &self,
        simd: S,
        piece: &Piece<f32>,
        wanted: Wanted,
        points: &mut Points,
        blocks: Range<usize>,
    ) {
        for firsts in together::<S, B>(blocks) {
            let (at, wi, wo) = points.taken::<S, B>(simd, firsts);
            let drawing = if wanted == Wanted::Drawn {
                let [share, from, to] = &points.density;
                let [from, to] = [B::load(simd, from, firsts), B::load(simd, to, firsts)];
                Drawing { span: [from, to], share: B::load(simd, share, firsts) }
            } else {
                self.drawing(piece, at, wo, self.bright(simd, points, firsts))
            };
            density(piece, at, &drawing, wi, wo).put(&mut points.density[0], firsts);
        }
    }

    /// Sets the diffuse, and the peak of the highlight to what scales it.
    #[inline(never)]
    fn diffuse_of_piece<S: Simd>(
        &self,
        simd: S,
        piece: &Piece<f32>,
        points: &mut Points,
        blocks: Range<usize>,
    ) {
        simd.vectorize(
            #[inline(always)]
            || {
                if is_paired(simd) {
                    self.diffuses::<S, Pair<S>>(simd, piece, points, blocks);
                } else {
                    self.diffuses::<S, f32x16<S>>(simd, piece, points, blocks);
                }
            },
        );
    }

    #[inline(always)]
    fn diffuses<S: Simd, B: Blocks<S>>(
        &self,
        simd: S,
        piece: &Piece<f32>,
        points: &mut Points,
        blocks: Range<usize>,
    ) {
        for firsts in together::<S, B>(blocks) {
            let (at, wi, wo) = points.taken::<S, B>(simd, firsts);
            let inv_divisor = piece.inv_divisor(at[2]);
            inv_divisor.put(&mut points.white[0], firsts);
            self.diffuse(piece, at, inv_divisor, wi, wo).put(&mut points.white[2], firsts);
        }
    }

    /// Sets both parts of the highlight, by what scales it in place of its peak.
    #[inline(never)]
    fn highlight_of_piece<S: Simd>(
        &self,
        simd: S,
        piece: &Piece<f32>,
        points: &mut Points,
        blocks: Range<usize>,
    ) {
        simd.vectorize(
            #[inline(always)]
            || {
                if is_paired(simd) {
                    highlights::<S, Pair<S>>(simd, piece, points, blocks);
                } else {
                    highlights::<S, f32x16<S>>(simd, piece, points, blocks);
                }
            },
        );
    }

    /// [`Look::bright`](crate::place::Look::bright) of blocks of points.
    #[inline(always)]
    fn bright<S: Simd, B: Blocks<S>>(
        &self,
        simd: S,
        points: &Points,
        firsts: [usize; 2],
    ) -> [B; 2] {
        // A closure that is compiled on its own knows none of the instructions.
        let highlight = B::of_blocks(
            firsts,
            #[inline(always)]
            |first| self.look(simd, points, first).bright()[0],
        );
        let diffuse = B::of_blocks(
            firsts,
            #[inline(always)]
            |first| self.look(simd, points, first).bright()[1],
        );
        [highlight, diffuse]
    }

    /// The looks of the block of points from `first` on, without the grains of the highlight.
    #[inline(always)]
    fn look<S: Simd>(&self, simd: S, points: &Points, first: usize) -> Look<f32x16<S>> {
        let common = &self.materials.side_by_side;
        let mut look = common.look(simd, &points.yarn[first..first + LANES]);
        if common.is_lightened {
            look.lighten(load(simd, &points.lightness, first));
        }
        look
    }

    /// Sets the colours of the block of points from `first` on, and their densities.
    #[inline(always)]
    fn color<S: Simd>(&self, simd: S, first: usize, wanted: Wanted, chunk: &mut Chunk) {
        let lanes = first..first + LANES;
        let is_seen = !u32x16::from_slice(simd, &chunk.piece[lanes.clone()]).simd_eq(NOTHING);
        if wanted.has_density() {
            let density = load(simd, &chunk.points.density[0], first);
            let zero = <f32x16<S> as SimdBase<S>>::splat(simd, 0.0);
            is_seen.select(density, zero).store_slice(&mut chunk.pdf[lanes.clone()]);
        }
        if wanted.has_lobes() {
            let Vector { x: peak, y: uniform, z: diffuse } =
                vector(simd, &chunk.points.white, first);
            let white = White { highlight: Parts { peak, uniform }, diffuse };
            let mut look = self.look(simd, &chunk.points, first);
            look.intensity = load(simd, &chunk.intensity, first);
            let [[r, g, b], [s, t, u]] = look.lobes(&white);
            if wanted == Wanted::Sum {
                put(seen(is_seen, [r + s, g + t, b + u]), &mut chunk.specular, first);
            } else {
                put(seen(is_seen, [r, g, b]), &mut chunk.specular, first);
                put(seen(is_seen, [s, t, u]), &mut chunk.diffuse, first);
            }
        }
    }
}

/// `color` where `mask` holds, else black.
#[inline(always)]
fn seen<S: Simd>(mask: mask32x16<S>, [r, g, b]: [f32x16<S>; 3]) -> [f32x16<S>; 3] {
    let zero = <f32x16<S> as SimdBase<S>>::splat(mask.token(), 0.0);
    [mask.select(r, zero), mask.select(g, zero), mask.select(b, zero)]
}
