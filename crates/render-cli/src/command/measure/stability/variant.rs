//! Cloths at a limit.

use glam::DVec2;
use selvedge_yarn_brdf::{Cloth, Yarn};

/// A cloth at a limit.
#[derive(Clone, Debug)]
pub(super) struct Variant {
    pub(super) group: Group,
    /// What is at its limit.
    pub(super) name: String,
    /// What `selvedge eval --set` makes it of the cloth that it comes from.
    pub(super) setting: Option<String>,
    pub(super) cloth: Cloth,
    /// From where on it is looked at, m.
    pub(super) origin: DVec2,
}

/// What kind of limit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Group {
    /// The cloth as it is.
    Own,
    /// A parameter of its yarns.
    Parameters,
    /// Its scale.
    Scales,
    /// Far from the origin.
    Places,
}

impl Group {
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Own => "as it is",
            Self::Parameters => "parameters at their limits",
            Self::Scales => "other scales",
            Self::Places => "far from the origin",
        }
    }
}

/// All that are looked at of `cloth`.
pub(super) fn variants(cloth: &Cloth) -> Vec<Variant> {
    let variant = |group, name: String, setting| Variant {
        group,
        name,
        setting,
        cloth: cloth.clone(),
        origin: DVec2::ZERO,
    };
    let mut all = vec![variant(Group::Own, "as it is".to_owned(), None)];
    for parameter in Yarn::parameters() {
        // That of noise changes little, and nothing where there is none.
        if parameter.name.starts_with("noise.") && parameter.low > 0.0 {
            continue;
        }
        for value in [parameter.low, parameter.high] {
            let setting = format!("{}={value:?}", parameter.name);
            let mut variant = variant(Group::Parameters, setting.clone(), Some(setting));
            for yarn in &mut variant.cloth.yarns {
                parameter.set(yarn, value);
            }
            if variant.cloth.yarns != cloth.yarns {
                all.push(variant);
            }
        }
    }
    for scale in [1e-6, 1e-3, 1e3, 1e6] {
        let setting = format!("scale={scale:?}");
        let mut variant = variant(Group::Scales, setting.clone(), Some(setting));
        variant.cloth.scale = scale;
        all.push(variant);
    }
    for distance in [1e3, -1e6, 1e9] {
        let variant = variant(Group::Places, format!("{distance:?} m away"), None);
        all.push(Variant { origin: DVec2::new(distance, -0.7 * distance), ..variant });
    }
    all
}
