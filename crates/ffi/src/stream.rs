//! The caller's arrays of numbers and vectors: any layout that pointers and a stride can tell.

use std::mem::MaybeUninit;
use std::ops::Range;
use std::{ptr, slice};

use fearless_simd::{Level, dispatch};

use crate::batch::BLOCK;
use crate::status::Failure;

/// Pairs of numbers, each component with a pointer of its own, so that both arrays of structures
/// (`{p, p + 1}`, stride `2 * sizeof(double)`) and structures of arrays (`{u, v}`, stride
/// `sizeof(double)`) are told without a copy.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Positions {
    /// Of the first point.
    pub component: [*const f64; 2],
    /// Bytes from one point to the next, of any alignment; 0 gives all points the first.
    pub stride: isize,
}

/// Vectors, each component with a pointer of its own.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Vectors {
    /// Of the first point.
    pub component: [*const f32; 3],
    /// Bytes from one point to the next, of any alignment; 0 gives all points the first.
    pub stride: isize,
}

/// Numbers.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Numbers {
    /// That of the first point.
    pub values: *const f32,
    /// Bytes from one point to the next, of any alignment; 0 gives all points the first.
    pub stride: isize,
}

/// Flags.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Flags {
    /// That of the first point.
    pub values: *const u8,
    /// Bytes from one point to the next; 0 gives all points the first.
    pub stride: isize,
}

/// Where vectors go, each component with a pointer of its own.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct VectorsOut {
    /// Of the first point.
    pub component: [*mut f32; 3],
    /// Bytes from one point to the next, of any alignment.
    pub stride: isize,
}

/// Where numbers go.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct NumbersOut {
    /// Of the first point.
    pub values: *mut f32,
    /// Bytes from one point to the next, of any alignment.
    pub stride: isize,
}

impl Positions {
    pub(crate) fn check(&self, count: usize, name: &str) -> Result<(), Failure> {
        let is_null = self.component.iter().any(|component| component.is_null());
        check(count, self.stride, is_null, name)
    }

    /// Those of the points of `chosen`; 0 where they are not active.
    ///
    /// # Safety
    ///
    /// There are elements of all these points that are active.
    pub(crate) unsafe fn gather<'a>(
        &self,
        chosen: &Chosen<'_>,
        room: &'a mut Room<f64, 2>,
    ) -> [&'a mut [f64]; 2] {
        // SAFETY: the caller vouches for the elements.
        unsafe { gather(self.component, self.stride, chosen, room) }
    }
}

impl Vectors {
    pub(crate) fn check(&self, count: usize, name: &str) -> Result<(), Failure> {
        let is_null = self.component.iter().any(|component| component.is_null());
        check(count, self.stride, is_null, name)
    }

    /// Those of the points of `chosen`; 0 where they are not active.
    ///
    /// # Safety
    ///
    /// There are elements of all these points that are active.
    pub(crate) unsafe fn gather<'a>(
        &self,
        chosen: &Chosen<'_>,
        room: &'a mut Room<f32, 3>,
    ) -> [&'a mut [f32]; 3] {
        // SAFETY: the caller vouches for the elements.
        unsafe { gather(self.component, self.stride, chosen, room) }
    }
}

impl Positions {
    /// Whether they lie as in slices.
    pub(crate) fn are_slices(&self) -> bool {
        are_slices(self.component, self.stride)
    }

    /// The positions of `range` where they lie, if they lie as in slices.
    ///
    /// # Safety
    ///
    /// There are elements of all these points, which nothing changes during `'a`.
    pub(crate) unsafe fn direct<'a>(&self, range: &Range<usize>) -> Option<[&'a [f64]; 2]> {
        // SAFETY: the caller vouches for the elements.
        unsafe { direct(self.component, self.stride, range) }
    }

    /// What the components reach.
    pub(crate) fn reach(&self, count: usize) -> [Reach; 2] {
        self.component.map(|start| reach(start, self.stride, count))
    }
}

impl Vectors {
    /// Whether they lie as in slices.
    pub(crate) fn are_slices(&self) -> bool {
        are_slices(self.component, self.stride)
    }

    /// The vectors of `range` where they lie, if they lie as in slices.
    ///
    /// # Safety
    ///
    /// There are elements of all these points, which nothing changes during `'a`.
    pub(crate) unsafe fn direct<'a>(&self, range: &Range<usize>) -> Option<[&'a [f32]; 3]> {
        // SAFETY: the caller vouches for the elements.
        unsafe { direct(self.component, self.stride, range) }
    }

    /// What the components reach.
    pub(crate) fn reach(&self, count: usize) -> [Reach; 3] {
        self.component.map(|start| reach(start, self.stride, count))
    }
}

impl Numbers {
    pub(crate) fn check(&self, count: usize, name: &str) -> Result<(), Failure> {
        check(count, self.stride, self.values.is_null(), name)
    }

    /// Those of the points of `chosen`; 0 where they are not active.
    ///
    /// # Safety
    ///
    /// There are numbers of all these points that are active.
    pub(crate) unsafe fn gather<'a>(
        &self,
        chosen: &Chosen<'_>,
        room: &'a mut Room<f32, 1>,
    ) -> &'a mut [f32] {
        // SAFETY: the caller vouches for the numbers.
        let [numbers] = unsafe { gather([self.values], self.stride, chosen, room) };
        numbers
    }

    /// What they reach.
    pub(crate) fn reach(&self, count: usize) -> Reach {
        reach(self.values, self.stride, count)
    }
}

impl Flags {
    pub(crate) fn check(&self, count: usize, name: &str) -> Result<(), Failure> {
        check(count, self.stride, false, name)
    }

    /// Whether all points from `first` on are active; if not, `active` tells which.
    ///
    /// # Safety
    ///
    /// There are no flags, or those of all these points.
    pub(crate) unsafe fn gather(&self, first: usize, active: &mut [bool]) -> bool {
        if self.values.is_null() {
            return true;
        }
        for (i, active) in active.iter_mut().enumerate() {
            let at = offset(self.stride, first + i);
            // SAFETY: the caller vouches for the flag.
            *active = unsafe { *self.values.wrapping_byte_offset(at) } != 0;
        }
        active.iter().all(|&active| active)
    }
}

impl VectorsOut {
    pub(crate) fn check(&self, count: usize, name: &str) -> Result<(), Failure> {
        let is_null = self.component.iter().any(|component| component.is_null());
        check(count, self.stride, is_null, name)?;
        check_apart(count, self.stride, name)
    }

    /// # Safety
    ///
    /// There are places for all points of `chosen` that are active.
    pub(crate) unsafe fn scatter(&self, chosen: &Chosen<'_>, planes: [&[f32]; 3]) {
        // SAFETY: the caller vouches for the places.
        unsafe { scatter(self.component, self.stride, chosen, planes) };
    }
}

impl VectorsOut {
    /// What the components reach, if each is as a slice.
    pub(crate) fn slices(&self, count: usize) -> Option<[Reach; 3]> {
        let starts = self.component.map(<*mut f32>::cast_const);
        are_slices(starts, self.stride)
            .then(|| starts.map(|start| reach(start, self.stride, count)))
    }

    /// The places of `range`.
    ///
    /// # Safety
    ///
    /// [`VectorsOut::slices`] has told that they are slices; there are places of all these points, which
    /// nobody else uses during `'a`.
    pub(crate) unsafe fn direct<'a>(&self, range: &Range<usize>) -> [&'a mut [f32]; 3] {
        // SAFETY: the caller vouches for the places.
        self.component
            .map(|start| unsafe { slice::from_raw_parts_mut(start.add(range.start), range.len()) })
    }
}

impl NumbersOut {
    /// What it reaches, if it is as a slice.
    pub(crate) fn slice(&self, count: usize) -> Option<Reach> {
        let start = self.values.cast_const();
        are_slices([start], self.stride).then(|| reach(start, self.stride, count))
    }

    /// The places of `range`.
    ///
    /// # Safety
    ///
    /// As for [`VectorsOut::direct`].
    pub(crate) unsafe fn direct<'a>(&self, range: &Range<usize>) -> &'a mut [f32] {
        // SAFETY: the caller vouches for the places.
        unsafe { slice::from_raw_parts_mut(self.values.add(range.start), range.len()) }
    }

    pub(crate) fn check(&self, count: usize, name: &str) -> Result<(), Failure> {
        check(count, self.stride, self.values.is_null(), name)?;
        check_apart(count, self.stride, name)
    }

    /// # Safety
    ///
    /// There are places for all points of `chosen` that are active.
    pub(crate) unsafe fn scatter(&self, chosen: &Chosen<'_>, plane: &[f32]) {
        // SAFETY: the caller vouches for the places.
        unsafe { scatter([self.values], self.stride, chosen, [plane]) };
    }
}

/// The addresses of bytes that an array of points may reach, the last one left out.
pub(crate) type Reach = (usize, usize);

/// What is not there reaches nothing.
pub(crate) const NOWHERE: Reach = (0, 0);

/// Whether two arrays may share a byte.
pub(crate) fn overlap(a: Reach, b: Reach) -> bool {
    a.0 < b.1 && b.0 < a.1
}

/// What the elements of `count` points reach, which [`check`] has found to fit.
fn reach<T>(start: *const T, stride: isize, count: usize) -> Reach {
    let last = start.wrapping_byte_offset(offset(stride, count.saturating_sub(1)));
    let (low, high) = (start.addr().min(last.addr()), start.addr().max(last.addr()));
    (low, high.saturating_add(size_of::<T>()))
}

/// The elements of `range` where they lie, if one follows the other as in a slice.
///
/// # Safety
///
/// There are elements of all these points, which nothing changes during `'a`.
unsafe fn direct<'a, T, const N: usize>(
    starts: [*const T; N],
    stride: isize,
    range: &Range<usize>,
) -> Option<[&'a [T]; N]> {
    // SAFETY: aligned, and the caller vouches for the elements.
    let slice =
        |start: *const T| unsafe { slice::from_raw_parts(start.add(range.start), range.len()) };
    are_slices(starts, stride).then(|| starts.map(slice))
}

/// Whether one element follows the other as in a slice.
fn are_slices<T, const N: usize>(starts: [*const T; N], stride: isize) -> bool {
    stride == size_of::<T>() as isize && starts.iter().all(|start| start.is_aligned())
}

/// Whether there are arrays for `count` points, which fit into memory.
pub(crate) fn check(count: usize, stride: isize, is_null: bool, name: &str) -> Result<(), Failure> {
    if count == 0 {
        return Ok(());
    }
    if is_null {
        return Err(Failure::null(name));
    }
    let count_as_signed = isize::try_from(count).ok();
    if count_as_signed.and_then(|count| stride.checked_abs()?.checked_mul(count)).is_none() {
        let found = format!("{count} points {stride} bytes apart");
        return Err(Failure::argument(name, found, "no more than memory can hold"));
    }
    Ok(())
}

/// Whether the places of an output are not one and the same.
fn check_apart(count: usize, stride: isize, name: &str) -> Result<(), Failure> {
    if count > 1 && stride == 0 {
        return Err(Failure::argument(&format!("{name}.stride"), 0, "places of their own"));
    }
    Ok(())
}

/// Bytes from the first point to the one of this number, which [`check`] has found to fit.
fn offset(stride: isize, index: usize) -> isize {
    stride.wrapping_mul(index as isize)
}

/// Room for N components of a block of points, which nothing has been put into: that would cost as much as
/// filling it.
pub(crate) type Room<T, const N: usize> = [[MaybeUninit<T>; BLOCK]; N];

/// Room with nothing in it.
pub(crate) const fn room<T: Copy, const N: usize>() -> Room<T, N> {
    [[MaybeUninit::uninit(); BLOCK]; N]
}

/// Zeros in the first places of each component, as many as its length tells.
pub(crate) fn zeros<const N: usize>(
    room: &mut Room<f32, N>,
    lengths: [usize; N],
) -> [&mut [f32]; N] {
    let mut lengths = lengths.into_iter();
    room.each_mut().map(|plane| {
        let plane = &mut plane[..lengths.next().unwrap_or(0)];
        plane.fill(MaybeUninit::new(0.0));
        // SAFETY: filled just now.
        unsafe { plane.assume_init_mut() }
    })
}

/// Points of a call: `count` from `first` on, of which those count that are `active`, or all.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Chosen<'a> {
    pub(crate) first: usize,
    /// At most [`BLOCK`].
    pub(crate) count: usize,
    pub(crate) active: Option<&'a [bool]>,
}

/// The components of the points of `chosen`.
///
/// # Safety
///
/// There are elements of all these points that are active.
unsafe fn gather<'a, T: Copy + Default, const N: usize>(
    starts: [*const T; N],
    stride: isize,
    chosen: &Chosen<'_>,
    room: &'a mut Room<T, N>,
) -> [&'a mut [T]; N] {
    let starts = starts.map(|start| start.wrapping_byte_offset(offset(stride, chosen.first)));
    let (count, level) = (chosen.count, Level::new());
    // SAFETY: the caller vouches for the elements that are read.
    unsafe {
        match (chosen.active, packed(starts, stride)) {
            (None, 2) => {
                dispatch!(level, _ => gather_packed::<T, N, 2>(starts[0], count, room));
            }
            (None, 3) => {
                dispatch!(level, _ => gather_packed::<T, N, 3>(starts[0], count, room));
            }
            (None, 4) => {
                dispatch!(level, _ => gather_packed::<T, N, 4>(starts[0], count, room));
            }
            (None, _) if stride == size_of::<T>() as isize => {
                for (plane, start) in room.iter_mut().zip(starts) {
                    let to = plane[..count].as_mut_ptr().cast();
                    ptr::copy_nonoverlapping(start.cast::<u8>(), to, count * size_of::<T>());
                }
            }
            (None, _) if stride == 0 && count > 0 => {
                for (plane, start) in room.iter_mut().zip(starts) {
                    plane[..count].fill(MaybeUninit::new(start.read_unaligned()));
                }
            }
            (None, _) => gather_spaced(starts, stride, count, room),
            (Some(active), _) => {
                for (plane, start) in room.iter_mut().zip(starts) {
                    gather_some(start, stride, active, &mut plane[..count]);
                }
            }
        }
    }
    // SAFETY: whatever the layout, each of the first `count` has been written.
    room.each_mut().map(|plane| unsafe { plane[..count].assume_init_mut() })
}

/// # Safety
///
/// There are places for all points of `chosen` that are active.
unsafe fn scatter<const N: usize>(
    starts: [*mut f32; N],
    stride: isize,
    chosen: &Chosen<'_>,
    planes: [&[f32]; N],
) {
    let starts = starts.map(|start| start.wrapping_byte_offset(offset(stride, chosen.first)));
    let (count, level) = (chosen.count, Level::new());
    let planes = planes.map(|plane| &plane[..count]);
    // SAFETY: the caller vouches for the places that are written.
    unsafe {
        match (chosen.active, packed(starts.map(<*mut f32>::cast_const), stride)) {
            (None, 3) => {
                dispatch!(level, _ => scatter_packed::<N, 3>(starts[0], count, planes));
            }
            (None, 4) => {
                dispatch!(level, _ => scatter_packed::<N, 4>(starts[0], count, planes));
            }
            (None, _) if stride == size_of::<f32>() as isize => {
                for (plane, start) in planes.iter().zip(starts) {
                    let bytes = plane.as_ptr().cast::<u8>();
                    ptr::copy_nonoverlapping(bytes, start.cast(), size_of_val(*plane));
                }
            }
            (None, _) => scatter_spaced(starts, stride, count, planes),
            (Some(active), _) => {
                for i in (0..count).filter(|&i| active[i]) {
                    for (plane, start) in planes.iter().zip(starts) {
                        start.wrapping_byte_offset(offset(stride, i)).write_unaligned(plane[i]);
                    }
                }
            }
        }
    }
}

/// How many elements lie from one point to the next, if the components of each lie one after the other; else 0.
fn packed<T, const N: usize>(starts: [*const T; N], stride: isize) -> isize {
    let size = size_of::<T>() as isize;
    let is_in_order = (0..N).all(|k| starts[k] == starts[0].wrapping_add(k));
    let is_whole = N > 1 && stride >= N as isize * size && stride % size == 0;
    if is_in_order && is_whole { stride / size } else { 0 }
}

/// Points that lie `STEP` elements apart, which the compiler takes many at a time because it knows that: with
/// AVX-512 it shuffles 16 vectors in six instructions, and so it is made for each set of instructions.
///
/// # Safety
///
/// There are `count` points, of whose `STEP` elements at least the first N are there.
#[inline(always)]
unsafe fn gather_packed<T: Copy, const N: usize, const STEP: usize>(
    start: *const T,
    count: usize,
    room: &mut Room<T, N>,
) {
    for i in 0..count.min(BLOCK) {
        for (k, plane) in room.iter_mut().enumerate() {
            // SAFETY: the caller vouches for the element.
            plane[i].write(unsafe { start.add(STEP * i + k).read_unaligned() });
        }
    }
}

/// # Safety
///
/// As for [`gather_packed`], of places.
#[inline(always)]
unsafe fn scatter_packed<const N: usize, const STEP: usize>(
    start: *mut f32,
    count: usize,
    planes: [&[f32]; N],
) {
    let planes = planes.map(|plane| &plane[..count]);
    for i in 0..count {
        for (k, plane) in planes.iter().enumerate() {
            // SAFETY: the caller vouches for the place.
            unsafe { start.add(STEP * i + k).write_unaligned(plane[i]) };
        }
    }
}

/// Points any distance apart, each read as a whole, since its components often share a line of a cache.
///
/// # Safety
///
/// There are `count` points.
unsafe fn gather_spaced<T: Copy, const N: usize>(
    starts: [*const T; N],
    stride: isize,
    count: usize,
    room: &mut Room<T, N>,
) {
    for i in 0..count.min(BLOCK) {
        for (plane, start) in room.iter_mut().zip(starts) {
            let from = start.wrapping_byte_offset(offset(stride, i));
            // SAFETY: the caller vouches for the element.
            plane[i].write(unsafe { from.read_unaligned() });
        }
    }
}

/// # Safety
///
/// As for [`gather_spaced`], of places.
unsafe fn scatter_spaced<const N: usize>(
    starts: [*mut f32; N],
    stride: isize,
    count: usize,
    planes: [&[f32]; N],
) {
    let planes = planes.map(|plane| &plane[..count]);
    for i in 0..count {
        for (plane, start) in planes.iter().zip(starts) {
            let to = start.wrapping_byte_offset(offset(stride, i));
            // SAFETY: the caller vouches for the place.
            unsafe { to.write_unaligned(plane[i]) };
        }
    }
}

/// # Safety
///
/// There are elements where a point is active.
unsafe fn gather_some<T: Copy + Default>(
    start: *const T,
    stride: isize,
    active: &[bool],
    plane: &mut [MaybeUninit<T>],
) {
    for (i, (value, &is_active)) in plane.iter_mut().zip(active).enumerate() {
        let from = start.wrapping_byte_offset(offset(stride, i));
        // SAFETY: the caller vouches for the element.
        value.write(if is_active { unsafe { from.read_unaligned() } } else { T::default() });
    }
}

#[cfg(test)]
mod tests;
