//! A chunk of points on its way through the kernel.

use fearless_simd::{Level, Simd, f32x16, mask32x16, prelude::*, u32x16};

use super::Batch;
use super::places::{Block, Rest};
use crate::density::{Drawing, density};
use crate::draw::draw;
use crate::frame::Vector;
use crate::lanes::{LANES, put};
use crate::material::Piece;
use crate::phase::Parts;
use crate::shader::{Shader, White};

/// Points in a chunk: with what is kept of them, they fit in half of a first cache of 32 kB.
pub(super) const CHUNK: usize = 256;

/// What is kept of the points of a chunk.
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
pub(super) struct Points {
    /// x and y in [−1, 1], and w/l.
    pub(super) at: [[f32; CHUNK]; 3],
    /// In the yarn frame; or the numbers that draw it.
    pub(super) wi: [[f32; CHUNK]; 3],
    pub(super) wo: [[f32; CHUNK]; 3],
    /// The index of the type of yarn.
    pub(super) yarn: [u32; CHUNK],
    /// f of the peak, of the uniform part and of the diffuse, if the yarn were white; or a direction
    /// drawn in the yarn frame.
    white: [[f32; CHUNK]; 3],
    /// The density; or how a direction was drawn: the share of the highlight and the ends of its span.
    density: [[f32; CHUNK]; 3],
}

/// What is wanted of points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Wanted {
    Lobes,
    Density,
    Both,
    /// A direction, drawn by the numbers that stand in its place.
    Direction,
    /// Both, of a direction that was just drawn.
    Drawn,
}

/// The key of points that reflect nothing.
pub(super) const NOTHING: u32 = u32::MAX;

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
        Self { at: none, wi: none, wo: none, yarn: [0; CHUNK], white: none, density: none }
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
fn vector<S: Simd>(simd: S, [x, y, z]: &[[f32; CHUNK]; 3], first: usize) -> Vector<f32x16<S>> {
    Vector::new(load(simd, x, first), load(simd, y, first), load(simd, z, first))
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
                let mut count = 0;
                for (block, is_done) in is_done.iter_mut().enumerate().take(blocks).skip(start) {
                    let mask = on(simd, pieces, key, block);
                    let bits = mask.to_bitmask() as u16;
                    *is_done |= bits;
                    if bits == u16::MAX {
                        self.shade_piece(simd, piece, wanted, points, LANES * block);
                    } else if bits != 0 {
                        alike.gather(count, points, LANES * block, mask);
                        count += bits.count_ones() as usize;
                    }
                }
                for first in (0..count).step_by(LANES) {
                    self.shade_piece(simd, piece, wanted, alike, first);
                }
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

    /// Sets what the points of a block on one `piece` reflect if they are white, and the density of their
    /// directions; or directions, and how they were drawn: as [`Points`] keeps them.
    ///
    /// Not inlined: it is most of the code of a batch, for each set of instructions.
    #[inline(never)]
    fn shade_piece<S: Simd>(
        &self,
        simd: S,
        piece: &Piece<f32>,
        wanted: Wanted,
        points: &mut Points,
        first: usize,
    ) {
        simd.vectorize(
            #[inline(always)]
            || {
                let (wi, wo) = (vector(simd, &points.wi, first), vector(simd, &points.wo, first));
                let Vector { x, y, z: ratio } = vector(simd, &points.at, first);
                let at = [x, y, ratio];
                if wanted == Wanted::Direction {
                    let bright = self.bright(simd, points, first);
                    let drawing = self.drawing(piece, at, wo, bright);
                    let Vector { x, y, z } = draw(piece, at, &drawing, wo, [wi.x, wi.y, wi.z]);
                    let [from, to] = drawing.span;
                    put([x, y, z], &mut points.white, first);
                    put([drawing.share, from, to], &mut points.density, first);
                    return;
                }
                if wanted != Wanted::Lobes {
                    let drawing = if wanted == Wanted::Drawn {
                        let Vector { x: share, y: from, z: to } =
                            vector(simd, &points.density, first);
                        Drawing { span: [from, to], share }
                    } else {
                        self.drawing(piece, at, wo, self.bright(simd, points, first))
                    };
                    let density = density(piece, at, &drawing, wi, wo);
                    density.store_slice(&mut points.density[0][first..first + LANES]);
                }
                if wanted != Wanted::Density {
                    let White { highlight: Parts { peak, uniform }, diffuse } =
                        self.white(piece, at, wi, wo);
                    put([peak, uniform, diffuse], &mut points.white, first);
                }
            },
        );
    }

    /// [`Look::bright`](crate::place::Look::bright) of a block of points.
    #[inline(always)]
    fn bright<S: Simd>(&self, simd: S, points: &Points, first: usize) -> [f32x16<S>; 2] {
        let yarns = &points.yarn[first..first + LANES];
        self.materials.side_by_side.look(simd, yarns).bright()
    }

    /// Sets the colours of the block of points from `first` on, and their densities.
    #[inline(always)]
    fn color<S: Simd>(&self, simd: S, first: usize, wanted: Wanted, chunk: &mut Chunk) {
        let lanes = first..first + LANES;
        let is_seen = !u32x16::from_slice(simd, &chunk.piece[lanes.clone()]).simd_eq(NOTHING);
        let zero = <f32x16<S> as SimdBase<S>>::splat(simd, 0.0);
        if wanted != Wanted::Lobes {
            let density = load(simd, &chunk.points.density[0], first);
            is_seen.select(density, zero).store_slice(&mut chunk.pdf[lanes.clone()]);
        }
        if wanted != Wanted::Density {
            let Vector { x: peak, y: uniform, z: diffuse } =
                vector(simd, &chunk.points.white, first);
            let white = White { highlight: Parts { peak, uniform }, diffuse };
            let mut look =
                self.materials.side_by_side.look(simd, &chunk.points.yarn[lanes.clone()]);
            look.intensity = load(simd, &chunk.intensity, first);
            let [specular, diffuse] = look.lobes(&white);
            let [r, g, b] = specular;
            let specular =
                [is_seen.select(r, zero), is_seen.select(g, zero), is_seen.select(b, zero)];
            put(specular, &mut chunk.specular, first);
            let [r, g, b] = diffuse;
            let diffuse =
                [is_seen.select(r, zero), is_seen.select(g, zero), is_seen.select(b, zero)];
            put(diffuse, &mut chunk.diffuse, first);
        }
    }
}
