//! The caller's arrays of numbers and vectors: any layout that pointers and a stride can tell.

use std::ops::Range;
use std::{array, ptr, slice};

use crate::batch::{BLOCK, Plane};
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

    /// # Safety
    ///
    /// There are elements of all points from `first` on that are active.
    pub(crate) unsafe fn gather(
        &self,
        first: usize,
        active: &[bool],
        planes: &mut [[f64; BLOCK]; 2],
    ) {
        // SAFETY: the caller vouches for the elements.
        unsafe { gather(self.component, self.stride, first, active, planes) };
    }
}

impl Vectors {
    pub(crate) fn check(&self, count: usize, name: &str) -> Result<(), Failure> {
        let is_null = self.component.iter().any(|component| component.is_null());
        check(count, self.stride, is_null, name)
    }

    /// # Safety
    ///
    /// There are elements of all points from `first` on that are active.
    pub(crate) unsafe fn gather(&self, first: usize, active: &[bool], planes: &mut [Plane; 3]) {
        // SAFETY: the caller vouches for the elements.
        unsafe { gather(self.component, self.stride, first, active, planes) };
    }
}

impl Positions {
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

    /// # Safety
    ///
    /// There are numbers of all points from `first` on that are active.
    pub(crate) unsafe fn gather(&self, first: usize, active: &[bool], plane: &mut Plane) {
        // SAFETY: the caller vouches for the numbers.
        unsafe { gather([self.values], self.stride, first, active, array::from_mut(plane)) };
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

    /// # Safety
    ///
    /// There are no flags, or those of all points from `first` on.
    pub(crate) unsafe fn gather(&self, first: usize, active: &mut [bool]) {
        if self.values.is_null() {
            active.fill(true);
            return;
        }
        for (i, active) in active.iter_mut().enumerate() {
            let at = offset(self.stride, first + i);
            // SAFETY: the caller vouches for the flag.
            *active =
                self.values.is_null() || unsafe { *self.values.wrapping_byte_offset(at) } != 0;
        }
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
    /// There are places for all points from `first` on that are active.
    pub(crate) unsafe fn scatter(&self, first: usize, active: &[bool], planes: &[Plane; 3]) {
        // SAFETY: the caller vouches for the places.
        unsafe { scatter(self.component, self.stride, first, active, planes) };
    }
}

impl VectorsOut {
    /// What the components reach, if each is as a slice.
    pub(crate) fn slices(&self, count: usize) -> Option<[Reach; 3]> {
        let is_slice = self.stride == size_of::<f32>() as isize
            && self.component.iter().all(|start| start.is_aligned());
        is_slice.then(|| self.component.map(|start| reach(start, self.stride, count)))
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
    pub(crate) fn slices(&self, count: usize) -> Option<[Reach; 1]> {
        let is_slice = self.stride == size_of::<f32>() as isize && self.values.is_aligned();
        is_slice.then(|| [reach(self.values, self.stride, count)])
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
    /// There are places for all points from `first` on that are active.
    pub(crate) unsafe fn scatter(&self, first: usize, active: &[bool], plane: &Plane) {
        // SAFETY: the caller vouches for the places.
        unsafe { scatter([self.values], self.stride, first, active, array::from_ref(plane)) };
    }
}

/// The addresses of bytes that an array of points may reach, the last one left out.
pub(crate) type Reach = (usize, usize);

/// Whether two arrays may share a byte.
pub(crate) fn overlap(a: Reach, b: Reach) -> bool {
    a.0 < b.1 && b.0 < a.1
}

/// What the elements of `count` points reach, which [`check`] has found to fit.
fn reach<T>(start: *const T, stride: isize, count: usize) -> Reach {
    let last = start.wrapping_byte_offset(offset(stride, count.saturating_sub(1)));
    let (low, high) = (start.addr().min(last.addr()), start.addr().max(last.addr()));
    (low, high + size_of::<T>())
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
    let is_slice = |start: &*const T| start.is_aligned() && stride == size_of::<T>() as isize;
    // SAFETY: aligned, and the caller vouches for the elements.
    let slice =
        |start: *const T| unsafe { slice::from_raw_parts(start.add(range.start), range.len()) };
    starts.iter().all(is_slice).then(|| starts.map(slice))
}

/// Whether there are arrays for `count` points, which fit into memory.
fn check(count: usize, stride: isize, is_null: bool, name: &str) -> Result<(), Failure> {
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

/// # Safety
///
/// There are elements of all points from `first` on that are active.
unsafe fn gather<T: Copy, const N: usize>(
    starts: [*const T; N],
    stride: isize,
    first: usize,
    active: &[bool],
    planes: &mut [[T; BLOCK]; N],
) {
    let starts = starts.map(|start| start.wrapping_byte_offset(offset(stride, first)));
    let is_full = is_full(active);
    // SAFETY: the caller vouches for the elements that are read.
    unsafe {
        if is_full && stride == size_of::<T>() as isize {
            let bytes = active.len() * size_of::<T>();
            for (plane, start) in planes.iter_mut().zip(starts) {
                ptr::copy_nonoverlapping(start.cast::<u8>(), plane.as_mut_ptr().cast(), bytes);
            }
            return;
        }
        for i in (0..active.len().min(BLOCK)).filter(|&i| is_full || active[i]) {
            for (plane, start) in planes.iter_mut().zip(starts) {
                plane[i] = start.wrapping_byte_offset(offset(stride, i)).read_unaligned();
            }
        }
    }
}

/// # Safety
///
/// There are places for all points from `first` on that are active.
unsafe fn scatter<const N: usize>(
    starts: [*mut f32; N],
    stride: isize,
    first: usize,
    active: &[bool],
    planes: &[Plane; N],
) {
    let starts = starts.map(|start| start.wrapping_byte_offset(offset(stride, first)));
    let is_full = is_full(active);
    // SAFETY: the caller vouches for the places that are written.
    unsafe {
        if is_full && stride == size_of::<f32>() as isize {
            let bytes = active.len() * size_of::<f32>();
            for (plane, start) in planes.iter().zip(starts) {
                ptr::copy_nonoverlapping(plane.as_ptr().cast::<u8>(), start.cast(), bytes);
            }
            return;
        }
        for i in (0..active.len().min(BLOCK)).filter(|&i| is_full || active[i]) {
            for (plane, start) in planes.iter().zip(starts) {
                start.wrapping_byte_offset(offset(stride, i)).write_unaligned(plane[i]);
            }
        }
    }
}

/// Whether no point is left out, which saves looking at each.
fn is_full(active: &[bool]) -> bool {
    active.iter().all(|&active| active)
}
