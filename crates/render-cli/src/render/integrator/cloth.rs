//! Many places of cloth at once.

use std::ptr;

use glam::{DVec2, Vec3};
use selvedge_yarn_brdf::{Lobes, Sample, Shader};

/// Places of cloth, each with two directions or with numbers that choose one, and with the index of
/// whom they are of.
#[derive(Default)]
pub(super) struct ClothPoints<'a> {
    cloths: Vec<(&'a Shader, Points)>,
}

/// Places of one cloth.
#[derive(Default)]
struct Points {
    of: Vec<usize>,
    uv: Vec<DVec2>,
    wi: Vec<Vec3>,
    wo: Vec<Vec3>,
}

impl<'a> ClothPoints<'a> {
    /// A place of `shader`'s cloth, uv in metres. `wi` is a direction of the shading frame, or three
    /// numbers in [0, 1).
    pub(super) fn push(&mut self, of: usize, shader: &'a Shader, uv: DVec2, wi: Vec3, wo: Vec3) {
        let known = self.cloths.iter().position(|(cloth, _)| ptr::eq(*cloth, shader));
        let cloth = known.unwrap_or(self.cloths.len());
        if known.is_none() {
            self.cloths.push((shader, Points::default()));
        }
        let points = &mut self.cloths[cloth].1;
        points.of.push(of);
        points.uv.push(uv);
        points.wi.push(wi);
        points.wo.push(wo);
    }

    /// Calls `each` with f at each place and the density with which [`ClothPoints::samples`] draws it.
    pub(super) fn scattering(&self, mut each: impl FnMut(usize, Lobes, f32)) {
        for (shader, points) in &self.cloths {
            for (k, &of) in points.of.iter().enumerate() {
                let (uv, wi, wo) = (points.uv[k], points.wi[k], points.wo[k]);
                each(of, shader.eval_lobes(uv, wi, wo), shader.pdf(uv, wi, wo));
            }
        }
    }

    /// Calls `each` with a direction drawn at each place, where there is one.
    pub(super) fn samples(&self, mut each: impl FnMut(usize, &Shader, DVec2, Sample)) {
        for (shader, points) in &self.cloths {
            for (k, &of) in points.of.iter().enumerate() {
                let (uv, numbers, wo) = (points.uv[k], points.wi[k], points.wo[k]);
                if let Some(sample) = shader.sample(uv, wo, numbers.to_array()) {
                    each(of, shader, uv, sample);
                }
            }
        }
    }
}
