//! A chunk of points on its way through the kernel.

use core::cell::Cell;
use core::ops::Range;

use fearless_simd::{Simd, f32x16, mask32x16, prelude::*, u32x16};

use super::Batch;
use super::places::{Block, Rest};
use super::points::{CHUNK, Points, load, vector};
use crate::density::{Drawing, density};
use crate::draw::draw;
use crate::frame::Vector;
use crate::lanes::{LANES, put};
use crate::material::Piece;
use crate::pair::{Blocks, Pair, is_paired};
use crate::phase::Parts;
use crate::place::Look;
use crate::real::Real;
use crate::shader::{Shader, White};

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
    /// The colours of guides, and where they face, in the shading frame.
    pub(super) color: [[f32; CHUNK]; 3],
    pub(super) facing: [[f32; CHUNK]; 3],
}

/// What is wanted of points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Wanted {
    /// The sum of both lobes, in place of the highlight.
    Sum,
    Lobes,
    Density,
    Both,
    /// Both, and guides to the diffuse.
    Guided,
    /// Lobes and guides, and 1 in place of the density.
    Lit,
    /// A direction, drawn by the numbers that stand in its place.
    Direction,
    /// Both, of a direction that was just drawn.
    Drawn,
}

impl Wanted {
    #[inline(always)]
    pub(super) fn has_lobes(self) -> bool {
        matches!(
            self,
            Self::Sum | Self::Lobes | Self::Both | Self::Guided | Self::Lit | Self::Drawn
        )
    }

    #[inline(always)]
    pub(super) fn has_density(self) -> bool {
        matches!(self, Self::Density | Self::Both | Self::Guided | Self::Drawn)
    }

    #[inline(always)]
    pub(super) fn has_guides(self) -> bool {
        matches!(self, Self::Guided | Self::Lit)
    }
}

/// The key of points that reflect nothing.
pub(super) const NOTHING: u32 = u32::MAX;

thread_local! {
    /// The chunk that this thread used last: to fill a new one with zeros takes as long as to shade a hundred points.
    static LAST: Cell<Option<Box<Chunk>>> = const { Cell::new(None) };
}

impl Chunk {
    /// What `use_it` makes of a chunk in which no point is set.
    pub(super) fn with<T>(use_it: impl FnOnce(&mut Self) -> T) -> T {
        // None where another chunk is in use further up, or the thread is about to end.
        let last = LAST.try_with(Cell::take).ok().flatten();
        let mut chunk = last.map_or_else(|| Box::new(Self::new()), Self::cleared);
        let made = use_it(&mut chunk);
        _ = LAST.try_with(|last| last.set(Some(chunk)));
        made
    }

    /// Without what not every cloth sets of each point.
    fn cleared(mut self: Box<Self>) -> Box<Self> {
        for points in [&mut self.points, &mut self.alike] {
            points.yarn.fill(0);
            points.lightness.fill(1.0);
        }
        self.intensity.fill(1.0);
        self.is_apart.fill(false);
        self
    }

    fn new() -> Self {
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
            color: [[0.0; CHUNK]; 3],
            facing: [[0.0; CHUNK]; 3],
        }
    }
}

/// Which points of a block are on the piece with this `key`.
#[inline(always)]
fn on<S: Simd>(simd: S, pieces: &[u32; CHUNK], key: u32, block: usize) -> mask32x16<S> {
    u32x16::from_slice(simd, &pieces[LANES * block..][..LANES]).simd_eq(key)
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
    ///
    /// Not inlined: it is most of the code of a batch, for each set of instructions.
    #[inline(never)]
    pub(super) fn find_all<S: Simd>(&self, simd: S, points: &Batch<'_>, chunk: &mut Chunk) {
        simd.vectorize(
            #[inline(always)]
            || {
                let rest = Rest::new(points);
                let rest = rest.batch();
                for first in (0..points.len()).step_by(LANES) {
                    let block = Block::new(points, first, &rest);
                    self.find(simd, &block, first, chunk);
                }
            },
        );
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
                        points.scatter(LANES * block, alike, from, mask, wanted);
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
            self.diffuse_of_piece(simd, piece, wanted, points, blocks.clone());
            self.highlight_of_piece(simd, piece, points, blocks);
        }
    }

    /// Draws directions.
    ///
    /// Not inlined, as those that follow: they are most of the rest.
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

    /// Sets the diffuse, where it faces if that is wanted, and the peak of the highlight to what scales it.
    #[inline(never)]
    fn diffuse_of_piece<S: Simd>(
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
                    self.diffuses::<S, Pair<S>>(simd, piece, wanted, points, blocks);
                } else {
                    self.diffuses::<S, f32x16<S>>(simd, piece, wanted, points, blocks);
                }
            },
        );
    }

    #[inline(always)]
    fn diffuses<S: Simd, B: Blocks<S>>(
        &self,
        simd: S,
        piece: &Piece<f32>,
        wanted: Wanted,
        points: &mut Points,
        blocks: Range<usize>,
    ) {
        for firsts in together::<S, B>(blocks) {
            let (at, wi, wo) = points.taken::<S, B>(simd, firsts);
            let inv_divisor = piece.inv_divisor(at[2]);
            inv_divisor.put(&mut points.white[0], firsts);
            let (diffuse, facing) = self.diffuse_and_facing(piece, at, inv_divisor, [wi, wo]);
            diffuse.put(&mut points.white[2], firsts);
            if wanted.has_guides() {
                facing.x.put(&mut points.facing[0], firsts);
                facing.y.put(&mut points.facing[1], firsts);
                facing.z.put(&mut points.facing[2], firsts);
            }
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
        if !common.lightness.is_empty() {
            look.lighten(load(simd, &points.lightness, first));
        }
        look
    }

    /// Sets the colours of the block of points from `first` on, and their densities.
    #[inline(always)]
    fn color<S: Simd>(&self, simd: S, first: usize, wanted: Wanted, chunk: &mut Chunk) {
        let lanes = first..first + LANES;
        let mut is_seen = !u32x16::from_slice(simd, &chunk.piece[lanes.clone()]).simd_eq(NOTHING);
        if self.materials.side_by_side.is_hidden {
            is_seen &= self.look(simd, &chunk.points, first).opacity.is_positive();
        }
        if wanted.has_density() {
            let density = load(simd, &chunk.points.density[0], first);
            let zero = <f32x16<S> as SimdBase<S>>::splat(simd, 0.0);
            is_seen.select(density, zero).store_slice(&mut chunk.pdf[lanes.clone()]);
        } else if wanted == Wanted::Lit {
            let [one, zero] = [1.0, 0.0].map(|x| <f32x16<S> as SimdBase<S>>::splat(simd, x));
            is_seen.select(one, zero).store_slice(&mut chunk.pdf[lanes.clone()]);
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
            if wanted.has_guides() {
                put(seen(is_seen, look.matte()), &mut chunk.color, first);
                let facing = vector(simd, &chunk.points.facing, first);
                let facing = self.shown(facing, first, chunk);
                put(seen(is_seen, [facing.x, facing.y, facing.z]), &mut chunk.facing, first);
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
