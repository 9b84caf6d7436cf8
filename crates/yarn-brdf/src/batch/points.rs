//! What the kernel takes and returns of the points of a chunk, component by component.

use fearless_simd::{Level, Simd, f32x16, mask32x16, prelude::*, u32x16};

use super::chunk::Wanted;
use crate::frame::Vector;
use crate::lanes::LANES;
use crate::pair::Blocks;

/// Points in a chunk: with what is kept of those that are shaded, they fit in a first cache of 32 kB.
pub(super) const CHUNK: usize = 256;

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
    pub(super) white: [[f32; CHUNK]; 3],
    /// The density; or how a direction was drawn: the share of the highlight and the ends of its span.
    pub(super) density: [[f32; CHUNK]; 3],
    /// Where the diffuse faces, and how much: see [`Guide`](crate::Guide), in the yarn frame.
    pub(super) facing: [[f32; CHUNK]; 3],
}

/// Places, and the directions to the light and the viewer.
type Taken<R> = ([R; 3], Vector<R>, Vector<R>);

impl Points {
    pub(super) fn new() -> Self {
        let none = [[0.0; CHUNK]; 3];
        Self {
            at: none,
            wi: none,
            wo: none,
            yarn: [0; CHUNK],
            lightness: [1.0; CHUNK],
            white: none,
            density: none,
            facing: none,
        }
    }

    /// Where the points of the blocks from `firsts` on are, and their directions.
    #[inline(always)]
    pub(super) fn taken<S: Simd, B: Blocks<S>>(&self, simd: S, firsts: [usize; 2]) -> Taken<B> {
        let Vector { x, y, z } = vectors::<S, B>(simd, &self.at, firsts);
        let wi = vectors::<S, B>(simd, &self.wi, firsts);
        ([x, y, z], wi, vectors::<S, B>(simd, &self.wo, firsts))
    }

    /// Sets what the kernel takes, from the point `to` on, to that of those of another's block from
    /// `from` ≥ `to` on for which `mask` holds.
    #[inline(always)]
    pub(super) fn gather<S: Simd>(
        &mut self,
        to: usize,
        all: &Self,
        from: usize,
        mask: mask32x16<S>,
    ) {
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
    pub(super) fn scatter<S: Simd>(
        &mut self,
        to: usize,
        all: &Self,
        from: usize,
        mask: mask32x16<S>,
        wanted: Wanted,
    ) {
        if is_packed_fast(mask.token()) {
            for k in 0..3 {
                unpack(mask, &all.white[k], from, &mut self.white[k], to);
                unpack(mask, &all.density[k], from, &mut self.density[k], to);
                if wanted.has_guides() {
                    unpack(mask, &all.facing[k], from, &mut self.facing[k], to);
                }
            }
            return;
        }
        for (from, to) in (from..).zip(numbers(mask, to)) {
            for k in 0..3 {
                self.white[k][to] = all.white[k][from];
                self.density[k][to] = all.density[k][from];
                if wanted.has_guides() {
                    self.facing[k][to] = all.facing[k][from];
                }
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
pub(super) fn load<S: Simd>(simd: S, values: &[f32], first: usize) -> f32x16<S> {
    f32x16::from_slice(simd, &values[first..first + LANES])
}

/// Vectors of a block.
#[inline(always)]
pub(super) fn vector<S: Simd>(
    simd: S,
    parts: &[[f32; CHUNK]; 3],
    first: usize,
) -> Vector<f32x16<S>> {
    vectors::<S, f32x16<S>>(simd, parts, [first; 2])
}

/// Vectors of blocks.
#[inline(always)]
pub(super) fn vectors<S: Simd, B: Blocks<S>>(
    simd: S,
    [x, y, z]: &[[f32; CHUNK]; 3],
    firsts: [usize; 2],
) -> Vector<B> {
    Vector::new(B::load(simd, x, firsts), B::load(simd, y, firsts), B::load(simd, z, firsts))
}
