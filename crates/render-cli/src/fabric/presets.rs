//! The fabrics that are compiled in: those of `fixtures/fabrics`.

/// A fabric that is compiled in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Preset {
    /// Its name, as in `preset:NAME`.
    pub name: &'static str,
    /// The fabric, JSON.
    pub(super) fabric: &'static str,
    /// Its draft, WIF, if that is not in the fabric.
    pub(super) draft: Option<&'static str>,
}

macro_rules! draft {
    ($file:literal) => {
        include_str!(concat!("../../../../fixtures/drafts/", $file))
    };
}

macro_rules! preset {
    ($name:literal, $draft:expr) => {
        Preset {
            name: $name,
            fabric: include_str!(concat!("../../../../fixtures/fabrics/", $name, ".json")),
            draft: $draft,
        }
    };
}

/// All of them, by name.
pub const PRESETS: [Preset; 13] = [
    preset!("cotton-gauze", Some(draft!("gauze.wif"))),
    preset!("cotton-twill", Some(draft!("cotton-twill.wif"))),
    preset!("denim", Some(draft!("denim.wif"))),
    preset!("duchesse-satin", Some(draft!("satin-8.wif"))),
    preset!("fabric-a", Some(draft!("upholstery.wif"))),
    preset!("fabric-b", Some(draft!("homespun.wif"))),
    preset!("herringbone-tweed", Some(draft!("herringbone.wif"))),
    preset!("jacquard-damask", Some(draft!("damask.wif"))),
    preset!("polyester-lining", None),
    preset!("silk-charmeuse", Some(draft!("charmeuse.wif"))),
    preset!("silk-shantung", Some(draft!("shantung.wif"))),
    preset!("tartan-wool", Some(draft!("tartan.wif"))),
    preset!("wool-gabardine", Some(draft!("gabardine.wif"))),
];

/// The preset that is called `name`.
pub(super) fn find(name: &str) -> Option<Preset> {
    PRESETS.into_iter().find(|preset| preset.name == name)
}
