//! From a scene to a picture.

pub mod accumulate;
pub mod camera;
pub mod checkpoint;
pub mod detail;
pub mod exposure;
pub mod film;
pub mod footprint;
pub mod hash;
pub mod integrator;
pub mod intersect;
pub mod progressive;
pub mod sampler;
pub mod stages;

use glam::Vec2;
#[cfg(test)]
use rayon::prelude::*;

use self::{
    camera::Camera,
    exposure::{Expose, Exposure},
    film::Size,
    sampler::PixelSampler,
};
use crate::scene::Scene;

/// A scene as its camera sees it.
#[derive(Clone, Copy, Debug)]
pub struct View<'a> {
    scene: &'a Scene,
    camera: Camera,
    seed: u64,
    has_layers: bool,
}

impl<'a> View<'a> {
    /// The view of `scene` in a picture of `size`; `seed` chooses the noise. `has_layers` if more is
    /// asked for than radiance.
    pub fn new(scene: &'a Scene, size: Size, seed: u64, has_layers: bool) -> Self {
        let camera = Camera::new(&scene.camera, size).with_lens(scene.lens);
        Self { scene, camera, seed, has_layers }
    }
}

impl Expose for View<'_> {
    fn expose(&self, pixel: [u32; 2], index: u32) -> Exposure {
        self.expose_all(&[pixel], index)[0]
    }

    fn expose_all(&self, pixels: &[[u32; 2]], index: u32) -> Vec<Exposure> {
        let sample = |&pixel: &[u32; 2]| PixelSampler::new(pixel, self.seed).sample(index);
        let mut samples: Vec<_> = pixels.iter().map(sample).collect();
        sampler::prepare(samples.iter_mut(), integrator::CAMERA_AND_VERTEX);
        let beams = pixels.iter().zip(samples).map(|(pixel, mut sample)| {
            let corner = Vec2::new(pixel[0] as f32, pixel[1] as f32);
            let place = corner + self.scene.filter.offset(sample.next_2d());
            // Two numbers that a pinhole leaves for what comes next.
            let lens = self.scene.lens.map_or(Vec2::ZERO, |_| sample.next_2d());
            (self.camera.beam(place, corner + 0.5, lens), sample)
        });
        integrator::expose(self.scene, beams, self.has_layers)
    }
}

/// The picture that `view` exposes with `spp` samples per pixel, which are summed in their order.
#[cfg(test)]
fn plain(view: &View<'_>, size: Size, spp: u32) -> film::Film {
    let mut film = film::Film::black(size);
    film.pixels_mut().par_iter_mut().enumerate().for_each(|(index, pixel)| {
        let place = [index as u32 % size.width(), index as u32 / size.width()];
        let radiance = |index| view.expose(place, index).radiance.as_dvec3();
        let sum: glam::DVec3 = (0..spp).map(radiance).sum();
        *pixel = (sum / f64::from(spp)).as_vec3();
    });
    film
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::AtomicBool;

    use glam::Vec3;

    use super::{
        accumulate::Layers,
        film::Frame,
        progressive::{Control, Limits, Plan, expose},
        *,
    };
    use crate::scene::{Material, drape::DEFAULT_SIDE};

    #[test]
    fn passes_add_up_to_the_plain_loop() {
        let scene = Scene::built_in(Material::Matte(Vec3::splat(0.5)), DEFAULT_SIDE).unwrap();
        let size = Size::new(37, 21).unwrap();
        for spp in [1, 16, 21] {
            let view = View::new(&scene, size, 3, false);
            let plain = plain(&view, size, spp);
            let limits = Limits { spp, time: None, noise: None };
            let plan = Plan { frame: Frame::whole(size), layers: Layers::None, limits, key: 0 };
            let interrupt = AtomicBool::new(false);
            let control = Control::until(&interrupt);
            let outcome = expose(&view, &plan, &control);
            assert!(outcome.exposed().beauty == plain, "{spp} spp");
        }
    }
}
