//! Traversal by Embree 3 (Wald, Woop, Benthin, Johnson & Ernst 2014), in its robust mode.
//!
//! Of its ways, each is used where it was measured to take the least time: packets of sixteen rays where
//! the nearest hit is looked for, held together if they go similar ways as those of the camera, and a
//! stream where any hit will do.
//!
//! Robust means that no ray passes through an edge. Through a vertex, about one of a hundred rays that are
//! aimed at it exactly does. Of triangles that lie in one place, any may be the one that is hit.

use ::embree::sys::{RTCHit16, RTCRay, RTCRay16, RTCRayHit16};
use glam::Vec3;

use self::library::{Active, Found, Library, NONE, PACKET};
use super::{GeometryError, Hit, Ray};
use crate::scene::mesh::Mesh;

mod library;

/// Greatest difference in each component of directions that go similar ways: for those of a bounce,
/// packets that are held together take half as long again, for others less than half.
const SIMILAR: f32 = 0.5;

/// Where a packet may find another triangle than a ray by itself, as several are as near within rounding:
/// on a triangle that the ray only grazes, below the squared cosine, and near an edge, below the weight of
/// the corner that is opposite.
const GRAZING: f32 = 1e-3;
const EDGE: f32 = 1e-3;

/// All triangles of a scene in Embree's hierarchy.
pub(super) struct Embree {
    library: Library,
}

impl Found {
    fn hit(&self) -> Hit {
        let [v, w] = self.weights;
        // Rounding may put them a little outside.
        let weights = Vec3::new(1.0 - v - w, v, w).max(Vec3::ZERO);
        let barycentrics = weights / weights.element_sum();
        Hit { t: self.t, mesh: self.mesh, triangle: self.triangle, barycentrics }
    }
}

impl Embree {
    /// Of all triangles of `meshes`, built on one thread. How much larger than them the boxes are, Embree
    /// knows by itself.
    pub(super) fn new(meshes: &[&Mesh], _padding: f32) -> Result<Self, GeometryError> {
        match Library::new(meshes) {
            Ok(library) => Ok(Self { library }),
            Err(failure) => Err(GeometryError::Library(failure.to_string())),
        }
    }

    /// See [`super::Geometry::intersect_where`].
    pub(super) fn intersect_where(
        &self,
        ray: &Ray,
        limits: [f32; 2],
        mut accept: impl FnMut(&Hit) -> bool,
    ) -> Option<Hit> {
        let mut nearest: Option<Hit> = None;
        self.library.nearest(prepared(ray, limits, 0)?, &mut |found| {
            let hit = found.hit();
            let stands = accept(&hit);
            if stands && nearest.is_none_or(|nearest| hit.is_before(&nearest)) {
                nearest = Some(hit);
            }
            stands
        });
        nearest
    }

    /// See [`super::Geometry::occluded_where`].
    pub(super) fn occluded_where(
        &self,
        ray: &Ray,
        limits: [f32; 2],
        mut accept: impl FnMut(&Hit) -> bool,
    ) -> bool {
        let Some(mut ray) = prepared(ray, limits, 0) else { return false };
        self.library.any(&mut ray, &mut |found| accept(&found.hit()));
        is_occluded(ray.tfar)
    }

    /// See [`super::Geometry::intersect_all`].
    pub(super) fn intersect_all(&self, rays: &[Ray], t_min: f32) -> Vec<Option<Hit>> {
        let limits = [t_min, f32::INFINITY];
        let mut hits = Vec::with_capacity(rays.len());
        let mut packet = NOWHERE;
        for rays in rays.chunks(PACKET) {
            let mut active = Active([0; PACKET]);
            for (lane, ray) in rays.iter().enumerate() {
                if let Some(ray) = prepared(ray, limits, 0) {
                    active.0[lane] = -1;
                    put(&ray, &mut packet.ray, lane);
                }
            }
            // Where Embree takes packets apart, as it does with AVX2, it finds hits for lanes that are not active.
            packet.hit.geomID = [NONE; PACKET];
            self.library.nearest_of_packet(&active, &mut packet, are_similar(rays));
            let RTCRayHit16 { ray: ends, hit } = &packet;
            hits.extend(rays.iter().enumerate().map(|(lane, ray)| {
                let mesh = hit.geomID[lane];
                if mesh == NONE || active.0[lane] == 0 {
                    return None;
                }
                let normal = Vec3::new(hit.Ng_x[lane], hit.Ng_y[lane], hit.Ng_z[lane]);
                let weights = [hit.u[lane], hit.v[lane]];
                let triangle = hit.primID[lane];
                let found = Found { ray: 0, t: ends.tfar[lane], weights, mesh, triangle };
                let found = found.hit();
                let cosine = normal.dot(ray.direction);
                if found.barycentrics.min_element() < EDGE
                    || cosine * cosine < GRAZING * normal.length_squared()
                {
                    return self.intersect_where(ray, limits, |_| true);
                }
                Some(found)
            }));
        }
        hits
    }

    /// See [`super::Geometry::occluded_all_where`].
    pub(super) fn occluded_all_where(
        &self,
        rays: &[(Ray, f32)],
        t_min: f32,
        mut accept: impl FnMut(usize, &Hit) -> bool,
    ) -> Vec<bool> {
        let mut stream: Vec<_> = rays
            .iter()
            .zip(0..)
            .filter_map(|((ray, t_max), id)| prepared(ray, [t_min, *t_max], id))
            .collect();
        let mut accept = |found: &Found| accept(found.ray as usize, &found.hit());
        self.library.any_of_stream(&mut stream, &mut accept);
        let mut occluded = vec![false; rays.len()];
        for ray in stream {
            occluded[ray.id as usize] = is_occluded(ray.tfar);
        }
        occluded
    }
}

/// What Embree makes of `tfar` of a ray that is occluded.
fn is_occluded(tfar: f32) -> bool {
    tfar == f32::NEG_INFINITY
}

/// Whether all rays go similar ways.
fn are_similar(rays: &[Ray]) -> bool {
    let (mut least, mut greatest) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    for ray in rays {
        least = least.min(ray.direction);
        greatest = greatest.max(ray.direction);
    }
    (greatest - least).max_element() < SIMILAR
}

/// `ray` for Embree, which looks for hits beyond `t_min` and up to `tfar`; `None` where nothing may be
/// hit.
fn prepared(ray: &Ray, [t_min, t_max]: [f32; 2], id: u32) -> Option<RTCRay> {
    let Ray { origin, direction } = ray;
    let longest = direction.abs().max_element();
    let is_sound = origin.is_finite() && direction.is_finite() && longest >= f32::MIN_POSITIVE;
    (is_sound && t_min < t_max).then(|| RTCRay {
        org_x: origin.x,
        org_y: origin.y,
        org_z: origin.z,
        tnear: t_min.max(0.0),
        dir_x: direction.x,
        dir_y: direction.y,
        dir_z: direction.z,
        time: 0.0,
        tfar: t_max.next_down(),
        mask: u32::MAX,
        id,
        flags: 0,
    })
}

/// Puts a ray into a packet.
fn put(ray: &RTCRay, packet: &mut RTCRay16, lane: usize) {
    packet.org_x[lane] = ray.org_x;
    packet.org_y[lane] = ray.org_y;
    packet.org_z[lane] = ray.org_z;
    packet.tnear[lane] = ray.tnear;
    packet.dir_x[lane] = ray.dir_x;
    packet.dir_y[lane] = ray.dir_y;
    packet.dir_z[lane] = ray.dir_z;
    packet.time[lane] = ray.time;
    packet.tfar[lane] = ray.tfar;
    packet.mask[lane] = ray.mask;
    packet.id[lane] = ray.id;
    packet.flags[lane] = ray.flags;
}

/// A packet without rays and hits.
const NOWHERE: RTCRayHit16 = RTCRayHit16 {
    ray: RTCRay16 {
        org_x: [0.0; PACKET],
        org_y: [0.0; PACKET],
        org_z: [0.0; PACKET],
        tnear: [0.0; PACKET],
        dir_x: [0.0; PACKET],
        dir_y: [0.0; PACKET],
        dir_z: [0.0; PACKET],
        time: [0.0; PACKET],
        tfar: [0.0; PACKET],
        mask: [0; PACKET],
        id: [0; PACKET],
        flags: [0; PACKET],
    },
    hit: RTCHit16 {
        Ng_x: [0.0; PACKET],
        Ng_y: [0.0; PACKET],
        Ng_z: [0.0; PACKET],
        u: [0.0; PACKET],
        v: [0.0; PACKET],
        primID: [NONE; PACKET],
        geomID: [NONE; PACKET],
        instID: [[NONE; PACKET]],
    },
};

#[cfg(test)]
mod tests;
