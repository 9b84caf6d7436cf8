//! Which thread a pixel shows, and which pixels show a thread.

use glam::{DVec2, Vec2};
use hyper::body::Bytes;
use image::{ExtendedColorType, ImageEncoder, codecs::png::PngEncoder};
use rayon::prelude::*;
use selvedge_yarn_brdf::{Side, Target};
use serde_json::{Value, json};

use super::{
    cloth::{srgb, values},
    reply::{Refusal, value_of},
    session::Shown,
};
use crate::{render::camera::Camera, scene::Material};

/// What a pixel shows of the cloth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Seen {
    /// The crossing, from 0 within the repeat.
    end: u32,
    pick: u32,
    /// Which thread is seen there, and its type; `None` in a gap.
    thread: Option<(bool, u32, u16)>,
}

/// Which pixels are asked for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Wanted {
    /// Those of this end, from 1.
    pub(super) end: Option<u32>,
    /// Those of this pick, from 1; of the crossing if both are given.
    pub(super) pick: Option<u32>,
    /// Those of this type of yarn, from 0.
    pub(super) yarn: Option<u16>,
}

impl Wanted {
    fn is(self, seen: &Seen) -> bool {
        match self {
            Self { yarn: Some(yarn), .. } => seen.thread.is_some_and(|(.., of)| of == yarn),
            Self { end: Some(end), pick: Some(pick), .. } => {
                seen.end + 1 == end && seen.pick + 1 == pick
            }
            Self { end: Some(end), .. } => {
                seen.thread.is_some_and(|(is_warp, thread, _)| is_warp && thread + 1 == end)
            }
            Self { pick: Some(pick), .. } => {
                seen.thread.is_some_and(|(is_warp, thread, _)| !is_warp && thread + 1 == pick)
            }
            _ => false,
        }
    }
}

impl Shown {
    /// The side and the place, m, of the cloth in the middle of what the camera sees at `place`,
    /// pixels; `None` where there is no cloth.
    fn cloth_at(&self, camera: &Camera, place: Vec2) -> Option<(Side, DVec2)> {
        let ray = camera.beam(place, place, Vec2::ZERO).ray;
        let hit = self.scene.geometry().intersect(&ray, 0.0, f32::INFINITY)?;
        let surface = self.scene.surface(&hit);
        if !matches!(surface.material, Material::Cloth { .. }) {
            return None;
        }
        let point = surface.mesh.surface(hit.triangle, hit.barycentrics);
        let is_face = point.geometric_normal.dot(ray.direction) < 0.0;
        Some((if is_face { Side::Face } else { Side::Back }, point.uv.as_dvec2()))
    }

    fn camera(&self) -> Camera {
        Camera::new(&self.scene.camera, self.document.view.size())
    }

    /// What is at `place`, pixels of the full size.
    pub(super) fn at(&self, place: Vec2) -> Value {
        let found = self.cloth_at(&self.camera(), place);
        let found = found.and_then(|(side, uv)| Some((side, uv, self.shader.crossing_at(uv)?)));
        let Some((side, uv, [end, pick])) = found else { return json!({ "cloth": false }) };
        let mut about = json!({
            "cloth": true,
            "revision": self.document.revision,
            "end": end + 1,
            "pick": pick + 1,
            "side": if side == Side::Face { "face" } else { "back" },
            "uv_mm": [uv.x * 1e3, uv.y * 1e3],
            "yarn": null,
        });
        let Some(seen) = self.shader.yarn_on(side, uv) else { return about };
        let cloth = &self.document.cloth;
        let yarn = &cloth.yarns[usize::from(seen.yarn)];
        let is_warp = seen.segment.is_warp;
        let pitch = cloth.pitch * 1e3 / cloth.scale;
        let (mut values, mut color) = (values(yarn), yarn.color);
        for textured in cloth.textures.iter().filter(|textured| textured.yarn == seen.yarn) {
            let found = textured.texture.value(uv, 0.0);
            match textured.target {
                Target::Parameter(name) => {
                    values.insert(name.to_owned(), found[0].into());
                }
                Target::Color => color = found,
                _ => {}
            }
        }
        let (along, across) = if is_warp { (pitch.y, pitch.x) } else { (pitch.x, pitch.y) };
        for (name, value) in [
            ("warp_on_top", json!(is_warp)),
            ("thread", json!(seen.segment.thread + 1)),
            ("yarn", json!(seen.yarn)),
            ("u", json!(seen.u)),
            ("v", json!(seen.v)),
            ("length_mm", json!(seen.segment.length * along)),
            ("width_mm", json!(seen.segment.width * across)),
            ("crossings", json!(seen.segment.crossings)),
            ("color", value_of(&color)),
            ("srgb", json!(srgb(color))),
            ("values", json!(values)),
        ] {
            about[name] = value;
        }
        about
    }

    /// What each pixel shows, row after row.
    fn seen(&self) -> &[Option<Seen>] {
        self.seen.get_or_init(|| {
            let (size, camera) = (self.document.view.size(), self.camera());
            let width = size.width() as usize;
            let mut seen = vec![None; width * size.height() as usize];
            seen.par_chunks_mut(width).enumerate().for_each(|(y, row)| {
                for (x, pixel) in row.iter_mut().enumerate() {
                    *pixel = self.seen_at(&camera, Vec2::new(x as f32 + 0.5, y as f32 + 0.5));
                }
            });
            seen
        })
    }

    fn seen_at(&self, camera: &Camera, place: Vec2) -> Option<Seen> {
        let (side, uv) = self.cloth_at(camera, place)?;
        let [end, pick] = self.shader.crossing_at(uv)?;
        let thread = self.shader.yarn_on(side, uv);
        let thread = thread.map(|at| (at.segment.is_warp, at.segment.thread, at.yarn));
        Some(Seen { end, pick, thread })
    }

    /// A PNG of the full size: white where what is `wanted` is seen, transparent elsewhere.
    pub(super) fn mask(&self, wanted: Wanted) -> Result<Bytes, Refusal> {
        let size = self.document.view.size();
        let alpha = |seen: &Option<Seen>| {
            let is_wanted = seen.as_ref().is_some_and(|seen| wanted.is(seen));
            [u8::MAX, if is_wanted { u8::MAX } else { 0 }]
        };
        let pixels: Vec<u8> = self.seen().iter().flat_map(alpha).collect();
        let mut bytes = Vec::new();
        PngEncoder::new(&mut bytes)
            .write_image(&pixels, size.width(), size.height(), ExtendedColorType::La8)
            .map_err(Refusal::conflict)?;
        Ok(bytes.into())
    }
}
