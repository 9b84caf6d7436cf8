//! From a scene to a picture.

pub mod camera;
pub mod film;
pub mod footprint;
pub mod integrator;
pub mod intersect;
pub mod sampler;

use glam::{DVec3, Vec2};
use rayon::prelude::*;

use self::{
    film::{Film, Size},
    sampler::PixelSampler,
};
use crate::{render::camera::Camera, scene::Scene};

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

/// The picture of `scene`, rendered on the threads of the current rayon pool.
///
/// `row_done` is called after each row of pixels, from any thread. A pixel depends on the scene,
/// the settings and its own place alone, and its samples are summed in their order, so the result
/// has the same bits for any number of threads.
pub fn render(scene: &Scene, settings: &Settings, row_done: impl Fn() + Sync) -> Film {
    let Settings { size, spp, seed } = *settings;
    let camera = Camera::new(&scene.camera, size);
    let spp = spp.clamp(1, sampler::MAX_SAMPLES);
    let mut film = Film::black(size);
    film.par_rows_mut().enumerate().for_each(|(y, row)| {
        for (x, pixel) in row.iter_mut().enumerate() {
            let sampler = PixelSampler::new([x as u32, y as u32], seed);
            let corner = Vec2::new(x as f32, y as f32);
            let sum: DVec3 = (0..spp)
                .map(|index| {
                    let mut sample = sampler.sample(index);
                    let beam = camera.beam(corner + film::filter_offset(sample.next_2d()));
                    integrator::radiance(scene, beam, &mut sample).as_dvec3()
                })
                .sum();
            *pixel = (sum / f64::from(spp)).as_vec3();
        }
        row_done();
    });
    film
}
