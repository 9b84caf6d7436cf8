//! Points of a call and places for what is found, after a look at whether they are there.

use std::ops::Range;

use crate::batch::{BLOCK, Inputs, Outputs};
use crate::memory;
use crate::non_null;
use crate::points::{Lobes, Points, Sides};
use crate::status::Failure;
use crate::stream::{Chosen, NOWHERE, NumbersOut, Reach, VectorsOut, room};

/// What a function looks at besides the positions.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Input {
    Footprint,
    Wi,
    Wo,
    Xi,
}

/// Points whose arrays are there, as far as they are needed.
pub(crate) struct Checked {
    pub(crate) points: Points,
    /// Whether directions to the light, to the viewer and random numbers are looked at.
    uses: [bool; 3],
    has_footprint: bool,
    pub(crate) lobes: Lobes,
    is_face_alone: bool,
}

impl Checked {
    /// # Safety
    ///
    /// `points` is NULL or points to a struct that is as large as it says.
    pub(crate) unsafe fn new(points: *const Points, uses: &[Input]) -> Result<Self, Failure> {
        // SAFETY: the caller vouches for the struct.
        let points = unsafe { memory::read(points)? };
        let lobes = match points.lobes {
            0 => Lobes::Both,
            1 => Lobes::Specular,
            2 => Lobes::Diffuse,
            lobes => return Err(Failure::argument("points.lobes", lobes, "0 to 2")),
        };
        if points.sides > 1 {
            return Err(Failure::argument("points.sides", points.sides, "0 or 1"));
        }
        let has_footprint = uses.contains(&Input::Footprint) && !points.footprint.values.is_null();
        let uses = [Input::Wi, Input::Wo, Input::Xi].map(|input| uses.contains(&input));
        let count = points.count;
        points.uv.check(count, "points.uv")?;
        let names = ["points.wi", "points.wo", "points.xi"];
        for ((used, vectors), name) in uses.iter().zip([points.wi, points.wo, points.xi]).zip(names)
        {
            if *used {
                vectors.check(count, name)?;
            }
        }
        if has_footprint {
            points.footprint.check(count, "points.footprint")?;
        }
        points.active.check(count, "points.active")?;
        let is_face_alone = points.sides == Sides::Face as u32;
        Ok(Self { points, uses, has_footprint, lobes, is_face_alone })
    }

    /// Whether each point counts, on both sides.
    pub(crate) fn is_whole(&self) -> bool {
        self.points.active.values.is_null() && !self.is_face_alone
    }

    /// What the arrays that are looked at reach.
    pub(crate) fn reaches(&self) -> [Reach; 12] {
        let Points { count, uv, wi, wo, xi, footprint, .. } = self.points;
        let mut reaches = [NOWHERE; 12];
        let (of_uv, rest) = reaches.split_at_mut(2);
        of_uv.copy_from_slice(&uv.reach(count));
        let (of_vectors, of_widths) = rest.as_chunks_mut();
        for ((to, vectors), used) in of_vectors.iter_mut().zip([wi, wo, xi]).zip(self.uses) {
            if used {
                *to = vectors.reach(count);
            }
        }
        if self.has_footprint {
            of_widths[0] = footprint.reach(count);
        }
        reaches
    }

    /// Whether all that is looked at lies as in slices, without footprints, and each point counts.
    pub(crate) fn are_slices(&self) -> bool {
        let Points { uv, wi, wo, xi, .. } = &self.points;
        let mut used = self.uses.into_iter().zip([wi, wo, xi]).filter(|(used, _)| *used);
        self.is_whole()
            && !self.has_footprint
            && uv.are_slices()
            && used.all(|(_, vectors)| vectors.are_slices())
    }

    /// Hands on all points, `step` by `step`, each time with the index of the first: where they lie, if they
    /// lie as in slices and all count, else gathered.
    ///
    /// # Safety
    ///
    /// The arrays have as many elements as there are points, and lie as in slices if `step` is more than
    /// [`BLOCK`].
    pub(crate) unsafe fn each_block(&self, step: usize, mut shade: impl FnMut(usize, &Inputs<'_>)) {
        let Points { count, uv, wi, wo, xi, footprint, active, .. } = &self.points;
        let mut flags = [true; BLOCK];
        let mut widths = room();
        let mut places = room();
        let mut planes = [room(), room(), room()];
        let none: [&[f32]; 3] = [&[]; 3];
        for first in (0..*count).step_by(step) {
            let range = first..(*count).min(first + step);
            let flags = &mut flags[..range.len().min(BLOCK)];
            // SAFETY: the caller vouches for elements up to the number of points.
            unsafe {
                let is_full = active.gather(first, flags);
                let active = (!is_full).then_some(&*flags);
                let chosen = Chosen { first, count: range.len(), active };
                let uv_slices = self.is_whole().then(|| uv.direct(&range)).flatten();
                let uv = uv_slices
                    .unwrap_or_else(|| uv.gather(&chosen, &mut places).map(|plane| &*plane));
                let mut vectors = [none; 3];
                let streams = [wi, wo, xi].into_iter().zip(&mut planes).zip(self.uses);
                for (to, ((stream, planes), used)) in vectors.iter_mut().zip(streams) {
                    if !used {
                        continue;
                    }
                    let slices = self.is_whole().then(|| stream.direct(&range)).flatten();
                    *to = slices.unwrap_or_else(|| {
                        let [x, y, z] = stream.gather(&chosen, planes);
                        if self.is_face_alone {
                            // In the plane of the cloth nothing is seen.
                            z.iter_mut().for_each(|z| *z = z.max(0.0));
                        }
                        [x, y, z].map(|plane| &*plane)
                    });
                }
                let [wi, wo, xi] = vectors;
                let footprint =
                    self.has_footprint.then(|| &*footprint.gather(&chosen, &mut widths));
                let (lobes, wide) = (self.lobes, &[][..]);
                shade(first, &Inputs { uv, wi, wo, xi, footprint, active, wide, lobes });
            }
        }
    }
}

/// The planes of what can be found at once: two vectors, and numbers.
pub(crate) const FIRST: Range<usize> = 0..3;
pub(crate) const SECOND: Range<usize> = 3..6;
pub(crate) const NUMBERS: Range<usize> = 6..7;

/// Where something found goes.
pub(crate) enum Output {
    /// The vector of this number.
    Vectors(VectorsOut, &'static str, usize),
    Numbers(NumbersOut, &'static str),
}

impl Output {
    /// # Safety
    ///
    /// `output` is NULL or points to a struct.
    pub(crate) unsafe fn vectors(
        output: *const VectorsOut,
        name: &'static str,
        number: usize,
    ) -> Result<Self, Failure> {
        // SAFETY: not NULL, so the caller vouches for a struct.
        let output = unsafe { non_null(output, name)?.read_unaligned() };
        Ok(Self::Vectors(output, name, number))
    }

    /// # Safety
    ///
    /// `output` is NULL or points to a struct.
    pub(crate) unsafe fn numbers(
        output: *const NumbersOut,
        name: &'static str,
    ) -> Result<Self, Failure> {
        // SAFETY: not NULL, so the caller vouches for a struct.
        let output = unsafe { non_null(output, name)?.read_unaligned() };
        Ok(Self::Numbers(output, name))
    }

    pub(crate) fn check(&self, count: usize) -> Result<(), Failure> {
        match self {
            Self::Vectors(output, name, _) => output.check(count, name),
            Self::Numbers(output, name) => output.check(count, name),
        }
    }

    /// Its planes among all that can be found.
    pub(crate) fn planes(&self) -> Range<usize> {
        match self {
            Self::Vectors(_, _, 0) => FIRST,
            Self::Vectors(..) => SECOND,
            Self::Numbers(..) => NUMBERS,
        }
    }

    /// Sets what its planes reach, if they are as slices.
    pub(crate) fn set_reaches(&self, count: usize, reaches: &mut [Reach]) {
        match self {
            Self::Vectors(output, ..) => {
                if let Some(slices) = output.slices(count) {
                    reaches.copy_from_slice(&slices);
                }
            }
            Self::Numbers(output, _) => {
                if let Some(slice) = output.slice(count) {
                    reaches[0] = slice;
                }
            }
        }
    }

    /// Has what is found in `range` written where it goes.
    ///
    /// # Safety
    ///
    /// It is as slices, there are as many places as points, and nobody else uses them meanwhile.
    pub(crate) unsafe fn give(&self, range: &Range<usize>, to: &mut Outputs<'_>) {
        // SAFETY: the caller vouches for the places.
        unsafe {
            match self {
                Self::Vectors(output, _, number) => to.vectors[*number] = output.direct(range),
                Self::Numbers(output, _) => to.numbers = output.direct(range),
            }
        }
    }

    /// # Safety
    ///
    /// There are as many places as points, of which `inputs` has those from `first` on, with what has been
    /// `found` there.
    pub(crate) unsafe fn scatter(&self, first: usize, inputs: &Inputs<'_>, found: &[&mut [f32]]) {
        let chosen = Chosen { first, count: inputs.uv[0].len(), active: inputs.active };
        // SAFETY: the caller vouches for the places.
        unsafe {
            match self {
                Self::Vectors(output, ..) => {
                    output.scatter(&chosen, [&*found[0], &*found[1], &*found[2]]);
                }
                Self::Numbers(output, _) => output.scatter(&chosen, &*found[0]),
            }
        }
    }
}
