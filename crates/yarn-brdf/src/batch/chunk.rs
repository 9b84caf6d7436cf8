//! A chunk of points on its way through the kernel.

use fearless_simd::{Simd, f32x16, prelude::*, u32x16};

use super::Batch;
use crate::density::{Drawing, density};
use crate::draw::draw;
use crate::frame::Vector;
use crate::lanes::{LANES, put};
use crate::material::Piece;
use crate::phase::Parts;
use crate::real::Real;
use crate::shader::{Shader, White};

/// Points in a chunk: with what is kept of them, they fit in half of a first cache of 32 kB.
pub(super) const CHUNK: usize = 256;

/// What is kept of the points of a chunk.
pub(super) struct Chunk {
    /// x and y in [−1, 1], and w/l.
    pub(super) at: [[f32; CHUNK]; 3],
    /// Whether it is on a warp yarn, and seen from the back: a bit for each point of a block.
    pub(super) is_warp: [u16; CHUNK / LANES],
    pub(super) is_back: [u16; CHUNK / LANES],
    /// In the yarn frame; or the numbers that draw it.
    pub(super) wi: [[f32; CHUNK]; 3],
    pub(super) wo: [[f32; CHUNK]; 3],
    /// The key of the piece of yarn, or [`NOTHING`].
    pub(super) piece: [u32; CHUNK],
    /// The index of the type of yarn.
    pub(super) yarn: [u32; CHUNK],
    /// Points that are left to [`Shader::eval_lobes`].
    pub(super) is_apart: [bool; CHUNK],
    /// The factor of the highlight's grains; 1 where there are none.
    pub(super) intensity: [f32; CHUNK],
    /// f of the peak, of the uniform part and of the diffuse, if the yarn were white; or a direction
    /// drawn in the yarn frame.
    white: [[f32; CHUNK]; 3],
    /// The density; or how a direction was drawn: the share of the highlight and the ends of its span.
    density: [[f32; CHUNK]; 3],
    /// What is wanted.
    pub(super) specular: [[f32; CHUNK]; 3],
    pub(super) diffuse: [[f32; CHUNK]; 3],
    pub(super) pdf: [f32; CHUNK],
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
            at: [[0.0; CHUNK]; 3],
            is_warp: [0; CHUNK / LANES],
            is_back: [0; CHUNK / LANES],
            wi: [[0.0; CHUNK]; 3],
            wo: [[0.0; CHUNK]; 3],
            piece: [NOTHING; CHUNK],
            yarn: [0; CHUNK],
            is_apart: [false; CHUNK],
            intensity: [1.0; CHUNK],
            white: [[0.0; CHUNK]; 3],
            density: [[0.0; CHUNK]; 3],
            specular: [[0.0; CHUNK]; 3],
            diffuse: [[0.0; CHUNK]; 3],
            pdf: [0.0; CHUNK],
        }
    }
}

/// The points of a block that go through the kernel together.
#[derive(Clone, Copy)]
enum Lanes {
    /// Side by side from here on.
    From(usize),
    /// From anywhere in the chunk.
    Of([u8; LANES]),
}

impl Lanes {
    /// Their numbers in one part of a chunk.
    #[inline(always)]
    fn of<S: Simd>(&self, simd: S, part: &[f32; CHUNK]) -> f32x16<S> {
        match self {
            Self::From(first) => load(simd, part, *first),
            Self::Of(lanes) => f32x16::from_fn(simd, |i| part[usize::from(lanes[i]) % CHUNK]),
        }
    }

    #[inline(always)]
    fn vector<S: Simd>(&self, simd: S, [x, y, z]: &[[f32; CHUNK]; 3]) -> Vector<f32x16<S>> {
        Vector::new(self.of(simd, x), self.of(simd, y), self.of(simd, z))
    }

    /// Their types of yarn.
    #[inline(always)]
    fn yarns(&self, yarns: &[u32; CHUNK]) -> [u32; LANES] {
        match self {
            Self::From(first) => core::array::from_fn(|i| yarns[(first + i) % CHUNK]),
            Self::Of(lanes) => core::array::from_fn(|i| yarns[usize::from(lanes[i]) % CHUNK]),
        }
    }
}

/// The lanes of a block, `LANES` from `first` on.
#[inline(always)]
fn load<S: Simd>(simd: S, values: &[f32], first: usize) -> f32x16<S> {
    f32x16::from_slice(simd, &values[first..first + LANES])
}

impl Shader {
    /// Sets the places of `points`.
    #[inline(always)]
    pub(super) fn find_all<S: Simd>(&self, simd: S, points: &Batch<'_>, chunk: &mut Chunk) {
        for first in (0..points.len()).step_by(LANES) {
            self.find(simd, points, first, chunk);
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
        for (part, numbers) in chunk.wi.iter_mut().zip(points.wi) {
            part[..numbers.len()].copy_from_slice(numbers);
        }
        let blocks = points.len().div_ceil(LANES);
        self.shade_white(simd, blocks, Wanted::Direction, chunk);
        for first in (0..points.len()).step_by(LANES) {
            let direction = Lanes::From(first).vector(simd, &chunk.white);
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
        let mut order = [0_u8; CHUNK];
        let mut is_done = [0_u16; CHUNK];
        for start in 0..blocks {
            // The first point that is still to be shaded tells the next piece.
            loop {
                let pieces: u32x16<S> =
                    u32x16::from_slice(simd, &chunk.piece[LANES * start..][..LANES]);
                let open = !(pieces.simd_eq(NOTHING)).to_bitmask() as u16 & !is_done[start];
                if open == 0 {
                    break;
                }
                let key = chunk.piece[LANES * start + open.trailing_zeros() as usize];
                let piece = self.materials.piece_of(key);
                let mut count = 0;
                let open_blocks = is_done.iter_mut().enumerate().take(blocks).skip(start);
                for (block, is_done) in open_blocks {
                    let first = LANES * block;
                    let pieces = u32x16::from_slice(simd, &chunk.piece[first..first + LANES]);
                    let mut bits = pieces.simd_eq(key).to_bitmask() as u16;
                    *is_done |= bits;
                    if bits == u16::MAX {
                        let found = self.found_on(simd, piece, wanted, chunk, Lanes::From(first));
                        let (white, density) = found;
                        put(white, &mut chunk.white, first);
                        put(density, &mut chunk.density, first);
                        continue;
                    }
                    while bits != 0 {
                        order[count] = (first + bits.trailing_zeros() as usize) as u8;
                        count += 1;
                        bits &= bits - 1;
                    }
                }
                for some in order[..count].chunks(LANES) {
                    let mut lanes = [some[0]; LANES];
                    lanes[..some.len()].copy_from_slice(some);
                    let found = self.found_on(simd, piece, wanted, chunk, Lanes::Of(lanes));
                    let ([peak, uniform, diffuse], density) = found;
                    for (k, &lane) in some.iter().enumerate() {
                        let lane = usize::from(lane) % CHUNK;
                        chunk.white[0][lane] = peak[k];
                        chunk.white[1][lane] = uniform[k];
                        chunk.white[2][lane] = diffuse[k];
                        for (part, value) in chunk.density.iter_mut().zip(&density) {
                            part[lane] = value[k];
                        }
                    }
                }
            }
        }
    }

    /// What points on one `piece` reflect if they are white, and the density of their directions; or
    /// directions, and how they were drawn: as [`Chunk`] keeps them.
    ///
    /// Not inlined: it is most of the code of a batch, for each set of instructions.
    fn found_on<S: Simd>(
        &self,
        simd: S,
        piece: &Piece<f32>,
        wanted: Wanted,
        chunk: &Chunk,
        lanes: Lanes,
    ) -> ([f32x16<S>; 3], [f32x16<S>; 3]) {
        simd.vectorize(
            #[inline(always)]
            || {
                let (wi, wo) = (lanes.vector(simd, &chunk.wi), lanes.vector(simd, &chunk.wo));
                let Vector { x, y, z: ratio } = lanes.vector(simd, &chunk.at);
                let at = [x, y, ratio];
                let zero = x.zero();
                if wanted == Wanted::Direction {
                    let bright =
                        self.materials.side_by_side.look(simd, &lanes.yarns(&chunk.yarn)).bright();
                    let drawing = self.drawing(piece, at, wo, bright);
                    let Vector { x, y, z } = draw(piece, at, &drawing, wo, [wi.x, wi.y, wi.z]);
                    let [from, to] = drawing.span;
                    return ([x, y, z], [drawing.share, from, to]);
                }
                let (mut white, mut pdf) =
                    (White { highlight: Parts::none(x), diffuse: zero }, zero);
                if wanted != Wanted::Density {
                    white = self.white(piece, at, wi, wo);
                }
                if wanted != Wanted::Lobes {
                    let drawing = if wanted == Wanted::Drawn {
                        let Vector { x: share, y: from, z: to } =
                            lanes.vector(simd, &chunk.density);
                        Drawing { span: [from, to], share }
                    } else {
                        let looks = &self.materials.side_by_side;
                        let bright = looks.look(simd, &lanes.yarns(&chunk.yarn)).bright();
                        self.drawing(piece, at, wo, bright)
                    };
                    pdf = density(piece, at, &drawing, wi, wo);
                }
                let White { highlight: Parts { peak, uniform }, diffuse } = white;
                ([peak, uniform, diffuse], [pdf, zero, zero])
            },
        )
    }

    /// Sets the colours of the block of points from `first` on, and their densities.
    #[inline(always)]
    fn color<S: Simd>(&self, simd: S, first: usize, wanted: Wanted, chunk: &mut Chunk) {
        let lanes = first..first + LANES;
        let is_seen = !u32x16::from_slice(simd, &chunk.piece[lanes.clone()]).simd_eq(NOTHING);
        let zero = <f32x16<S> as SimdBase<S>>::splat(simd, 0.0);
        if wanted != Wanted::Lobes {
            let density = load(simd, &chunk.density[0], first);
            is_seen.select(density, zero).store_slice(&mut chunk.pdf[lanes.clone()]);
        }
        if wanted != Wanted::Density {
            let [peak, uniform, diffuse] = &chunk.white;
            let (peak, uniform) = (load(simd, peak, first), load(simd, uniform, first));
            let diffuse = load(simd, diffuse, first);
            let white = White { highlight: Parts { peak, uniform }, diffuse };
            let mut look = self.materials.side_by_side.look(simd, &chunk.yarn[lanes.clone()]);
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
