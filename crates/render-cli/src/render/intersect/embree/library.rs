//! Embree, behind functions that are safe to call.
//!
//! The crate `embree` has safe functions of its own, but none for the flags of a scene, packets of
//! sixteen rays or filters: these call its bindings.
//!
//! Nothing here changes how the processor rounds. Embree would be a little faster if numbers near 0 were
//! flushed to 0, but so would those of all else that the thread computes.

#![allow(unsafe_code, reason = "Embree is a library in C++")]

use std::{
    ffi::{CStr, c_int},
    fmt,
    mem::size_of,
    ptr,
};

use ::embree::sys::{
    RTCBufferType, RTCDevice, RTCDeviceProperty, RTCError, RTCFilterFunctionNArguments, RTCFormat,
    RTCGeometry, RTCGeometryType, RTCHit, RTCIntersectContext, RTCIntersectContextFlags, RTCRay,
    RTCRayHit, RTCRayHit16, RTCScene, RTCSceneFlags, rtcAttachGeometryByID, rtcCommitGeometry,
    rtcCommitScene, rtcGetDeviceError, rtcGetDeviceProperty, rtcIntersect1, rtcIntersect16,
    rtcNewDevice, rtcNewGeometry, rtcNewScene, rtcOccluded1, rtcOccluded1M, rtcReleaseDevice,
    rtcReleaseGeometry, rtcReleaseScene, rtcSetNewGeometryBuffer, rtcSetSceneFlags,
};

use crate::scene::mesh::Mesh;

/// Marks what is not there, as `RTC_INVALID_GEOMETRY_ID`.
pub(super) const NONE: u32 = u32::MAX;

/// Rays of a packet.
pub(super) const PACKET: usize = 16;

/// On one thread: equal meshes give equal trees.
const CONFIG: &CStr = c"threads=1";

/// What we use of Embree that it can be built without.
const NEEDED: [RTCDeviceProperty; 3] = [
    RTCDeviceProperty::TRIANGLE_GEOMETRY_SUPPORTED,
    RTCDeviceProperty::RAY_STREAM_SUPPORTED,
    RTCDeviceProperty::FILTER_FUNCTION_SUPPORTED,
];

/// The triangles of some meshes, in a robust scene of Embree.
pub(super) struct Library {
    device: RTCDevice,
    scene: RTCScene,
}

// SAFETY: a committed scene may be asked by many threads at once, and it and its device may be let go by
// any (Embree API, "Threading").
unsafe impl Send for Library {}
// SAFETY: as above.
unsafe impl Sync for Library {}

/// No hit.
const NOTHING: RTCHit = RTCHit {
    Ng_x: 0.0,
    Ng_y: 0.0,
    Ng_z: 0.0,
    u: 0.0,
    v: 0.0,
    primID: NONE,
    geomID: NONE,
    instID: [NONE],
};

/// Which rays of a packet are looked at: −1 for those that are, else 0.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(super) struct Active(pub(super) [c_int; PACKET]);

/// A hit that Embree found.
#[derive(Clone, Copy, Debug)]
pub(super) struct Found {
    /// The `id` of the ray.
    pub(super) ray: u32,
    /// Distance in lengths of the ray's direction.
    pub(super) t: f32,
    /// Weights of the second and third corner.
    pub(super) weights: [f32; 2],
    pub(super) mesh: u32,
    pub(super) triangle: u32,
}

/// Whether a hit stands. It must not panic, as there is no way back through Embree.
pub(super) type Accept<'a> = &'a mut dyn FnMut(&Found) -> bool;

/// What Embree hands through to [`filter`].
#[repr(C)]
struct Context<'a> {
    /// The part that Embree knows of.
    common: RTCIntersectContext,
    accept: Option<Accept<'a>>,
}

impl<'a> Context<'a> {
    fn new(is_coherent: bool, accept: Option<Accept<'a>>) -> Self {
        let flags = if is_coherent {
            RTCIntersectContextFlags::COHERENT
        } else {
            RTCIntersectContextFlags::INCOHERENT
        };
        let filter = accept.is_some().then_some(filter as _);
        Self { common: RTCIntersectContext { flags, filter, instID: [NONE] }, accept }
    }

    /// A pointer to all of it, for Embree.
    fn as_common(&mut self) -> *mut RTCIntersectContext {
        ptr::from_mut(self).cast()
    }
}

impl Library {
    /// The scene of all triangles of `meshes`, numbered as they are there.
    pub(super) fn new(meshes: &[&Mesh]) -> Result<Self, Failure> {
        // SAFETY: the configuration ends in a zero byte, and the device is there if it is not null.
        let library = unsafe {
            let device = rtcNewDevice(CONFIG.as_ptr());
            let scene = if device.is_null() { ptr::null_mut() } else { rtcNewScene(device) };
            Self { device, scene }
        };
        library.check()?;
        if library.scene.is_null() {
            return Err(Failure(RTCError::UNKNOWN));
        }
        for property in NEEDED {
            // SAFETY: the device is there.
            if unsafe { rtcGetDeviceProperty(library.device, property) } == 0 {
                return Err(Failure(RTCError::INVALID_OPERATION));
            }
        }
        // SAFETY: the scene is there, and has not been committed.
        unsafe {
            let filters = RTCSceneFlags::CONTEXT_FILTER_FUNCTION;
            rtcSetSceneFlags(library.scene, RTCSceneFlags::ROBUST | filters);
        }
        for (index, mesh) in meshes.iter().enumerate() {
            if !mesh.triangles().is_empty() {
                library.attach(mesh, index as u32)?;
            }
        }
        // SAFETY: the scene is there, and all its geometries have been committed.
        unsafe { rtcCommitScene(library.scene) };
        library.check()?;
        Ok(library)
    }

    /// Adds a mesh of at least one triangle.
    fn attach(&self, mesh: &Mesh, index: u32) -> Result<(), Failure> {
        // SAFETY: the device and the scene are there. Buffers that Embree could not allocate are null
        // and not written to; others have room for as many items as are asked for, of three numbers of
        // 32 bits each, as the lists of the mesh have. Its triangles name vertices that are there. The
        // scene keeps the geometry after it is released.
        unsafe {
            let geometry = rtcNewGeometry(self.device, RTCGeometryType::TRIANGLE);
            if !geometry.is_null() {
                fill(geometry, RTCBufferType::VERTEX, RTCFormat::FLOAT3, mesh.positions());
                fill(geometry, RTCBufferType::INDEX, RTCFormat::UINT3, mesh.triangles());
                rtcCommitGeometry(geometry);
                rtcAttachGeometryByID(self.scene, geometry, index);
                rtcReleaseGeometry(geometry);
            }
        }
        self.check()
    }

    /// The first error of this thread since it was last asked.
    fn check(&self) -> Result<(), Failure> {
        // SAFETY: without a device, what is told is why there is none.
        match unsafe { rtcGetDeviceError(self.device) } {
            RTCError::NONE => Ok(()),
            error => Err(Failure(error)),
        }
    }

    /// Asks `accept` about hits of `ray`, until it has found nothing nearer than one that stands.
    pub(super) fn nearest(&self, ray: RTCRay, accept: Accept<'_>) {
        let mut context = Context::new(false, Some(accept));
        let mut found = RTCRayHit { ray, hit: NOTHING };
        // SAFETY: the scene is committed; the ray is aligned as its type is.
        unsafe { rtcIntersect1(self.scene, context.as_common(), &mut found) };
    }

    /// Puts the nearest hits of the active rays into `rays`, in less time for those that go similar ways
    /// if `are_coherent`.
    pub(super) fn nearest_of_packet(
        &self,
        active: &Active,
        rays: &mut RTCRayHit16,
        are_coherent: bool,
    ) {
        let mut context = Context::new(are_coherent, None);
        // SAFETY: the scene is committed; the arguments are aligned as their types are.
        unsafe { rtcIntersect16(active.0.as_ptr(), self.scene, context.as_common(), rays) };
    }

    /// Takes `tfar` of the ray to −∞ if anything that stands is before it.
    pub(super) fn any(&self, ray: &mut RTCRay, accept: Accept<'_>) {
        let mut context = Context::new(false, Some(accept));
        // SAFETY: the scene is committed; the ray is aligned as its type is.
        unsafe { rtcOccluded1(self.scene, context.as_common(), ray) };
    }

    /// As [`Library::any`] for many rays.
    pub(super) fn any_of_stream(&self, rays: &mut [RTCRay], accept: Accept<'_>) {
        let mut context = Context::new(false, Some(accept));
        let (count, stride) = (rays.len() as u32, size_of::<RTCRay>());
        // SAFETY: the scene is committed; the rays are as many, as far apart and as aligned as told.
        unsafe {
            rtcOccluded1M(self.scene, context.as_common(), rays.as_mut_ptr(), count, stride);
        }
    }
}

impl Drop for Library {
    fn drop(&mut self) {
        // SAFETY: nobody has these but the library, and what is null is not there.
        unsafe {
            if !self.scene.is_null() {
                rtcReleaseScene(self.scene);
            }
            if !self.device.is_null() {
                rtcReleaseDevice(self.device);
            }
        }
    }
}

/// Copies `items` into a new buffer of the geometry, unless Embree has no room for it.
///
/// # Safety
///
/// The geometry must be there, and items be as large as the format tells.
unsafe fn fill<T: Copy>(
    geometry: RTCGeometry,
    buffer: RTCBufferType,
    format: RTCFormat,
    items: &[T],
) {
    // SAFETY: the buffer has room for the items, unless it is null.
    unsafe {
        let to = rtcSetNewGeometryBuffer(geometry, buffer, 0, format, size_of::<T>(), items.len());
        if !to.is_null() {
            ptr::copy_nonoverlapping(items.as_ptr(), to.cast(), items.len());
        }
    }
}

/// Asks `accept` of the context about hits of one or many rays.
///
/// # Safety
///
/// It must be called by Embree, with a context of the type [`Context`].
unsafe extern "C" fn filter(arguments: *const RTCFilterFunctionNArguments) {
    // SAFETY: Embree hands through the context that it was given, whose borrow of `accept` lasts as long
    // as the call that asks for hits, on the one thread of that call.
    let (arguments, context) = unsafe {
        let arguments = &*arguments;
        (arguments, &mut *arguments.context.cast::<Context<'_>>())
    };
    let Some(accept) = &mut context.accept else { return };
    let count = arguments.N as usize;
    let (rays, hits) = (arguments.ray.cast::<f32>(), arguments.hit.cast::<f32>());
    for lane in 0..count {
        // SAFETY: the rays and hits are lists of all their numbers in the order of `RTCRay` and `RTCHit`,
        // `count` of each and all of 32 bits.
        let (found, is_active) = unsafe {
            let ray = |field: usize| rays.add(field * count + lane);
            let hit = |field: usize| hits.add(field * count + lane);
            let found = Found {
                ray: ray(10).cast::<u32>().read(),
                t: ray(8).read(),
                weights: [hit(3).read(), hit(4).read()],
                triangle: hit(5).cast::<u32>().read(),
                mesh: hit(6).cast::<u32>().read(),
            };
            (found, arguments.valid.add(lane).read() != 0)
        };
        if is_active && !accept(&found) {
            // SAFETY: there is one for each ray.
            unsafe { arguments.valid.add(lane).write(0) };
        }
    }
}

/// Why Embree does not work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Failure(RTCError);

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self.0 {
            RTCError::OUT_OF_MEMORY => "too little memory",
            RTCError::UNSUPPORTED_CPU => "a processor that it does not know",
            RTCError::INVALID_OPERATION => "a library built without triangles, streams or filters",
            _ => "an error without a name",
        })
    }
}
