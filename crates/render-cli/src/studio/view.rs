//! How a cloth is shown: what `selvedge render` and `selvedge swatch` take on the command line.

use std::fmt::Write;

use glam::Vec2;
use serde::{Deserialize, Serialize};

use crate::{
    args::FARTHEST_MM,
    render::{
        detail::{Detail, Level},
        film::Size,
        progressive::Limits,
        sampler::MAX_SAMPLES,
    },
    scene::{
        stage::{Direction, Form, Orbit, Shot},
        swatch::{self, Swatch},
    },
};

/// How a cloth is shown.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, expecting = "an object, a view")]
pub struct View {
    /// As what.
    pub kind: Kind,
    /// Whether the back of a swatch is up.
    pub back: bool,
    /// Width of a swatch, mm, in [0.1, 1000].
    pub mm: f32,
    /// The place of the cloth in its corner, mm along weft and warp, each in [−2000, 2000].
    pub at: [f32; 2],
    /// Where the camera stands, but for a swatch; `None` for where it does if nothing is said.
    pub camera: Option<Orbit>,
    /// Where the light stands; `None` likewise.
    pub light: Option<Direction>,
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// Most samples per pixel.
    pub spp: u32,
    /// Noise at which a tile is done, in [0.0001, 1]; `None` for exactly `spp` samples.
    pub noise: Option<f32>,
    /// Chooses the noise.
    pub seed: u64,
    /// Stops by which the picture is brighter, in [−20, 20].
    pub exposure: f32,
    /// How much of cloth is looked at.
    pub lod: Level,
}

/// As what a cloth is shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// Draped over a low drum.
    #[default]
    Drape,
    /// On a ball.
    Sphere,
    /// A small piece, flat and from above.
    Swatch,
}

/// Pixels along a side, and in all: what is shown takes up to 250 bytes for each.
const SIDES: [u32; 2] = [16, 4096];
const MAX_PIXELS: u64 = 1 << 21;

impl Default for View {
    fn default() -> Self {
        Self {
            kind: Kind::default(),
            back: false,
            mm: 20.0,
            at: [0.0; 2],
            camera: None,
            light: None,
            size: [640, 480],
            spp: 64,
            noise: Some(0.05),
            seed: 0,
            exposure: 0.0,
            lod: Level::default(),
        }
    }
}

impl Kind {
    /// What a cloth lies on; `None` for a swatch.
    pub(super) fn form(self) -> Option<Form> {
        match self {
            Self::Drape => Some(Form::Drape),
            Self::Sphere => Some(Form::Sphere),
            Self::Swatch => None,
        }
    }
}

impl View {
    /// Checks the ranges.
    ///
    /// # Errors
    ///
    /// *where: what was found, expected what* of the first number out of range.
    pub(super) fn check(&self) -> Result<(), String> {
        fn range(name: &str, value: f64, low: f64, high: f64) -> Result<(), String> {
            let is_in = (low..=high).contains(&value);
            let wrong = || format!("view.{name}: found {value}, expected {low} to {high}");
            if is_in { Ok(()) } else { Err(wrong()) }
        }
        range("mm", self.mm.into(), 0.1, 1000.0)?;
        for place in self.at {
            range("at", place.into(), (-FARTHEST_MM).into(), FARTHEST_MM.into())?;
        }
        for side in self.size {
            range("size", side.into(), SIDES[0].into(), SIDES[1].into())?;
        }
        let pixels = u64::from(self.size[0]) * u64::from(self.size[1]);
        if pixels > MAX_PIXELS {
            return Err(format!("view.size: found {pixels} pixels, expected at most {MAX_PIXELS}"));
        }
        range("spp", self.spp.into(), 1.0, MAX_SAMPLES.into())?;
        if let Some(noise) = self.noise {
            range("noise", noise.into(), 1e-4, 1.0)?;
        }
        range("exposure", self.exposure.into(), -20.0, 20.0)?;
        if let Some(camera) = &self.camera {
            camera.check().map_err(|what| format!("view.camera.{what}"))?;
        }
        if let Some(light) = &self.light {
            light.check().map_err(|what| format!("view.light.{what}"))?;
        }
        Ok(())
    }

    /// Width and height.
    ///
    /// # Panics
    ///
    /// If they have not been checked.
    pub(super) fn size(&self) -> Size {
        Size::new(self.size[0], self.size[1]).expect("the size has been checked")
    }

    /// When a picture is done.
    pub(super) fn limits(&self) -> Limits {
        Limits { spp: self.spp, time: None, noise: self.noise }
    }

    /// The level of detail.
    pub(super) fn detail(&self) -> Detail {
        Detail { level: self.lod, bias: 0.0 }
    }

    /// Where camera and light stand, but for a swatch.
    pub(super) fn shot(&self) -> Shot {
        Shot { camera: self.camera, light: self.light }
    }

    /// The swatch.
    pub(super) fn swatch(&self) -> Swatch {
        let light = self.light.map_or(swatch::Light::Raking, swatch::Light::From);
        let at = Vec2::from(self.at) * 1e-3;
        Swatch { width: self.mm * 1e-3, at, light, is_back: self.back }
    }

    /// The command line that draws the same into `output` from the fabric at `input`.
    pub(super) fn command(&self, input: &str, output: &str) -> String {
        let mut line = "selvedge ".to_owned();
        let mut add = |part: std::fmt::Arguments<'_>| {
            line.write_fmt(part).expect("a string takes all");
        };
        let what = if self.kind == Kind::Swatch { "swatch" } else { "render" };
        let [width, height] = self.size;
        add(format_args!("{what} {input} -o {output} --size {width}x{height} --spp {}", self.spp));
        if let Some(noise) = self.noise {
            add(format_args!(" --noise {noise}"));
        }
        add(format_args!(" --seed {}", self.seed));
        match self.kind {
            Kind::Swatch => {
                add(format_args!(" --mm {}", self.mm));
                if self.at != [0.0; 2] {
                    let [u, v] = self.at;
                    add(format_args!(" --at {u},{v}"));
                }
                if self.back {
                    add(format_args!(" --back"));
                }
            }
            Kind::Drape => {}
            Kind::Sphere => add(format_args!(" --form sphere")),
        }
        if let Some(camera) = self.camera.filter(|_| self.kind != Kind::Swatch) {
            let Orbit { azimuth, elevation, distance } = camera;
            add(format_args!(" --camera {azimuth},{elevation},{distance}"));
        }
        if let Some(Direction { azimuth, elevation }) = self.light {
            add(format_args!(" --light {azimuth},{elevation}"));
        }
        if self.exposure != 0.0 {
            add(format_args!(" --exposure {}", self.exposure));
        }
        match self.lod {
            Level::Auto => {}
            Level::Near => add(format_args!(" --lod near")),
            Level::Far => add(format_args!(" --lod far")),
        }
        line
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_out_of_range_is_named() {
        let check = |text: &str| serde_json::from_str::<View>(text).unwrap().check();
        assert_eq!(check("{}"), Ok(()));
        for (text, expected) in [
            (r#"{"mm": 0}"#, "view.mm: found 0, expected 0.1 to 1000"),
            (r#"{"at": [0, 3000]}"#, "view.at: found 3000, expected -2000 to 2000"),
            (r#"{"size": [8, 640]}"#, "view.size: found 8, expected 16 to 4096"),
            (
                r#"{"size": [4096, 4096]}"#,
                "view.size: found 16777216 pixels, expected at most 2097152",
            ),
            (r#"{"spp": 0}"#, "view.spp: found 0, expected 1 to 65536"),
            (
                r#"{"light": {"azimuth": 0, "elevation": 90}}"#,
                "view.light.elevation: found 90, expected 1 to 89",
            ),
        ] {
            assert_eq!(check(text).unwrap_err(), expected, "{text}");
        }
        assert_eq!(serde_json::from_str::<View>(r#"{"noise": null}"#).unwrap().noise, None);
    }
}
