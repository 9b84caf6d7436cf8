//! Whether the numbers of a scene mean something, and its names are those of something.

use glam::Vec3;
use selvedge_yarn_brdf::Color;

use super::{
    ColorSource, LightFile, MaterialFile, ObjectFile, RIG_LIGHTS, SceneFile, ShapeFile, groups,
};
use crate::{
    json,
    render::film::Size,
    scene::{
        MAX_DEPTH,
        drape::{MAX_SIDE, MIN_SIDE},
    },
};

/// Greatest coordinate, m.
const FARTHEST: f32 = 1e6;

impl SceneFile {
    /// Whether every number means something.
    ///
    /// # Errors
    ///
    /// A line `lights[2].quad.size: found [0, 1], expected lengths from 1e-6 to 1e6`.
    pub fn check(&self) -> Result<(), String> {
        let camera = &self.camera;
        point("camera.position", camera.position)?;
        point("camera.target", camera.target)?;
        direction("camera.up", camera.up)?;
        let view = camera.target - camera.position;
        if view.length() < 1e-9 {
            return Err(format!(
                "camera.target: found {}, expected another point than its position",
                camera.target
            ));
        }
        if view.normalize().cross(camera.up.normalize()).length() < 1e-4 {
            return Err(format!(
                "camera.up: found {}, expected a direction that is not along the view",
                camera.up
            ));
        }
        range("camera.fov_deg", camera.fov_deg, 1e-3, 170.0)?;
        range("camera.aperture", camera.aperture, 0.0, FARTHEST)?;
        if let Some(focus) = camera.focus {
            range("camera.focus", focus, 1e-6, FARTHEST)?;
        }
        self.check_film()?;
        if !(1..=MAX_DEPTH).contains(&self.depth) {
            return Err(format!("depth: found {}, expected 1 to {MAX_DEPTH}", self.depth));
        }
        for (name, material) in &self.materials {
            check_material(&format!("materials.{name}"), material)?;
        }
        for (name, objects) in &self.groups {
            self.check_objects(&format!("groups.{name}"), objects)?;
        }
        if self.objects.is_empty() {
            return Err("objects: found none, expected at least one".to_owned());
        }
        self.check_objects("objects", &self.objects)?;
        groups::check(&self.groups, &self.objects)?;
        if self.lights.is_empty() {
            return Err("lights: found none, expected at least one".to_owned());
        }
        for (index, light) in self.lights.iter().enumerate() {
            check_light(&format!("lights[{index}]"), light)?;
        }
        Ok(())
    }

    fn check_film(&self) -> Result<(), String> {
        let [width, height] = self.film.size;
        Size::new(width, height).map_err(|error| format!("film.size: {error}"))?;
        match self.film.crop {
            Some([left, top, right, bottom])
                if left >= right || top >= bottom || right > width || bottom > height =>
            {
                Err(format!(
                    "film.crop: found [{left}, {top}, {right}, {bottom}], expected left, upper, right and lower \
                     edge within {width}x{height}"
                ))
            }
            _ => Ok(()),
        }
    }

    fn check_objects(&self, list: &str, objects: &[ObjectFile]) -> Result<(), String> {
        for (index, object) in objects.iter().enumerate() {
            let at = format!("{list}[{index}]");
            let length =
                |name: &str, value| range(&format!("{at}.shape.{name}"), value, 1e-6, FARTHEST);
            match object.shape {
                ShapeFile::Plane { width, height } => {
                    length("plane.width", width)?;
                    length("plane.height", height)?;
                }
                ShapeFile::Sphere { radius } => length("sphere.radius", radius)?,
                ShapeFile::Cylinder { radius, height } => {
                    length("cylinder.radius", radius)?;
                    length("cylinder.height", height)?;
                }
                ShapeFile::Drape { side } => {
                    range(&format!("{at}.shape.drape.side"), side, MIN_SIDE, MAX_SIDE)?;
                }
                ShapeFile::Wrinkled { side } => length("wrinkled.side", side)?,
                ShapeFile::File { .. } | ShapeFile::Sheet {} | ShapeFile::Group { .. } => {}
            }
            match (&object.shape, &object.material) {
                (ShapeFile::Group { name }, None) if self.groups.contains_key(name) => {}
                (ShapeFile::Group { .. }, Some(name)) => {
                    return Err(format!(
                        "{at}.material: found {name:?}, expected none, as a group's objects have their own"
                    ));
                }
                (ShapeFile::Group { name }, None) => {
                    let known: Vec<_> = self.groups.keys().map(String::as_str).collect();
                    return Err(unknown(&format!("{at}.shape.group.name"), "group", name, &known));
                }
                (_, Some(name)) if self.materials.contains_key(name) => {}
                (_, Some(name)) => {
                    let known: Vec<_> = self.materials.keys().map(String::as_str).collect();
                    return Err(unknown(&format!("{at}.material"), "material", name, &known));
                }
                (_, None) => return Err(format!("{at}: found no \"material\", expected one")),
            }
            range(&format!("{at}.place.scale"), object.place.scale, 1e-6, 1e6)?;
            point(&format!("{at}.place.rotate_deg"), object.place.rotate_deg)?;
            point(&format!("{at}.place.translate"), object.place.translate)?;
            range(&format!("{at}.uv_scale"), object.uv_scale, 1e-6, 1e6)?;
        }
        Ok(())
    }
}

fn check_material(at: &str, material: &MaterialFile) -> Result<(), String> {
    match material {
        MaterialFile::Cloth { .. } => Ok(()),
        MaterialFile::Diffuse { reflectance } => {
            share(&format!("{at}.diffuse.reflectance"), reflectance.0.into())
        }
        MaterialFile::Standard(standard) => {
            for (name, source) in [
                ("base_color", &standard.base_color),
                ("roughness", &standard.roughness),
                ("specular", &standard.specular),
            ] {
                if let ColorSource::Constant(color) = source {
                    share(&format!("{at}.standard.{name}"), *color)?;
                }
            }
            range(&format!("{at}.standard.anisotropy"), standard.anisotropy, -1.0, 1.0)?;
            standard
                .size
                .iter()
                .try_for_each(|&side| range(&format!("{at}.standard.size"), side, 1e-6, FARTHEST))
        }
    }
}

fn check_light(at: &str, light: &LightFile) -> Result<(), String> {
    match *light {
        LightFile::Quad { centre, toward, size, radiance } => {
            let at = format!("{at}.quad");
            point(&format!("{at}.centre"), centre)?;
            point(&format!("{at}.toward"), toward)?;
            if centre.distance(toward) < 1e-9 {
                return Err(format!(
                    "{at}.toward: found {toward}, expected another point than its centre"
                ));
            }
            for side in size {
                range(&format!("{at}.size"), side, 1e-6, FARTHEST)?;
            }
            emission(&format!("{at}.radiance"), radiance)
        }
        LightFile::Sphere { centre, radius, radiance } => {
            let at = format!("{at}.sphere");
            point(&format!("{at}.centre"), centre)?;
            range(&format!("{at}.radius"), radius, 1e-6, FARTHEST)?;
            emission(&format!("{at}.radiance"), radiance)
        }
        LightFile::Distant { from, irradiance, angle_deg } => {
            let at = format!("{at}.distant");
            direction(&format!("{at}.from"), from)?;
            range(&format!("{at}.angle_deg"), angle_deg, 0.0, 180.0)?;
            emission(&format!("{at}.irradiance"), irradiance)
        }
        LightFile::Rig { irradiance, elevation_deg, angle_deg, only } => {
            let at = format!("{at}.rig");
            range(&format!("{at}.elevation_deg"), elevation_deg, -90.0, 90.0)?;
            range(&format!("{at}.angle_deg"), angle_deg, 0.0, 180.0)?;
            if let Some(only) = only.filter(|only| !(1..=RIG_LIGHTS).contains(only)) {
                return Err(format!("{at}.only: found {only}, expected 1 to {RIG_LIGHTS}"));
            }
            emission(&format!("{at}.irradiance"), irradiance)
        }
        LightFile::Constant { radiance } => emission(&format!("{at}.constant.radiance"), radiance),
        LightFile::Environment { rotation_deg, scale, .. } => {
            let at = format!("{at}.environment");
            range(&format!("{at}.rotation_deg"), rotation_deg, -1e6, 1e6)?;
            range(&format!("{at}.scale"), scale, 0.0, 1e6)
        }
    }
}

fn range(at: &str, found: f32, low: f32, high: f32) -> Result<(), String> {
    if (low..=high).contains(&found) {
        Ok(())
    } else {
        Err(format!("{at}: found {found}, expected {low} to {high}"))
    }
}

fn point(at: &str, found: Vec3) -> Result<(), String> {
    if found.abs().max_element() <= FARTHEST && found.is_finite() {
        Ok(())
    } else {
        Err(format!("{at}: found {found}, expected numbers from -{FARTHEST} to {FARTHEST}"))
    }
}

fn direction(at: &str, found: Vec3) -> Result<(), String> {
    point(at, found)?;
    match found.try_normalize() {
        Some(_) => Ok(()),
        None => Err(format!("{at}: found {found}, expected a direction other than 0")),
    }
}

/// A colour of which every part is a share of light.
fn share(at: &str, found: Vec3) -> Result<(), String> {
    found.to_array().into_iter().try_for_each(|part| range(at, part, 0.0, 1.0))
}

fn emission(at: &str, found: Color) -> Result<(), String> {
    found.0.into_iter().try_for_each(|part| range(at, part, 0.0, 1e9))
}

fn unknown(at: &str, kind: &str, found: &str, known: &[&str]) -> String {
    if known.is_empty() {
        return format!("{at}: found {found:?}, expected a {kind}, of which the scene has none");
    }
    format!("{at}: found {found:?}, expected {}", json::nearest(found, known))
}
