//! From a scene to a picture.

pub mod accumulate;
pub mod camera;
pub mod checkpoint;
pub mod exposure;
pub mod film;
pub mod footprint;
pub mod hash;
pub mod integrator;
pub mod intersect;
pub mod progressive;
pub mod sampler;

use glam::{DVec3, Vec2};
use rayon::prelude::*;

use self::{
    camera::Camera,
    exposure::{Expose, Exposure},
    film::{Film, Size},
    sampler::PixelSampler,
};
use crate::scene::Scene;

/// How to render.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Settings {
    /// Width and height of the picture.
    pub size: Size,
    /// Samples per pixel, 1 to [`sampler::MAX_SAMPLES`]; taken into this range.
    pub spp: u32,
    /// Chooses the noise.
    pub seed: u64,
}

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
        let mut sample = PixelSampler::new(pixel, self.seed).sample(index);
        let corner = Vec2::new(pixel[0] as f32, pixel[1] as f32);
        let place = corner + self.scene.filter.offset(sample.next_2d());
        // Two numbers that a pinhole leaves for what comes next.
        let lens = self.scene.lens.map_or(Vec2::ZERO, |_| sample.next_2d());
        let beam = self.camera.beam(place, lens);
        integrator::expose(self.scene, beam, &mut sample, self.has_layers)
    }
}

/// The picture of `scene`, rendered on the threads of the current rayon pool.
///
/// `row_done` is called after each row of pixels, from any thread. A pixel depends on the scene,
/// the settings and its own place alone, and its samples are summed in their order, so the result
/// has the same bits for any number of threads.
pub fn render(scene: &Scene, settings: &Settings, row_done: impl Fn() + Sync) -> Film {
    let Settings { size, spp, seed } = *settings;
    let view = View::new(scene, size, seed, false);
    let spp = spp.clamp(1, sampler::MAX_SAMPLES);
    let mut film = Film::black(size);
    film.par_rows_mut().enumerate().for_each(|(y, row)| {
        for (x, pixel) in row.iter_mut().enumerate() {
            let radiance = |index| view.expose([x as u32, y as u32], index).radiance.as_dvec3();
            let sum: DVec3 = (0..spp).map(radiance).sum();
            *pixel = (sum / f64::from(spp)).as_vec3();
        }
        row_done();
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
            let plain = render(&scene, &Settings { size, spp, seed: 3 }, || {});
            let limits = Limits { spp, time: None, noise: None };
            let plan = Plan { frame: Frame::whole(size), layers: Layers::None, limits, key: 0 };
            let interrupt = AtomicBool::new(false);
            let control = Control { interrupt: &interrupt, watch: &|_| {}, save: None };
            let outcome = expose(&View::new(&scene, size, 3, false), &plan, &control);
            assert!(outcome.exposed().beauty == plain, "{spp} spp");
        }
    }
}
