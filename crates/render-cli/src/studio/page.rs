//! The page: files that are compiled in.

use hyper::body::Bytes;

/// What stands for the address of everything else in the page, in its element `base`.
const BASE: &str = "{{base}}";

const INDEX: &str = include_str!("page/index.html");

macro_rules! files {
    ($kind:literal: $($name:literal)*) => {
        [$(($name, $kind, include_str!(concat!("page/", $name)))),*]
    };
}

const SCRIPTS: [(&str, &str, &str); 18] = files!("text/javascript; charset=utf-8":
    "api.js" "compare.js" "crossing.js" "dial.js" "dom.js" "fabric.js" "files.js" "images.js" "loom.js" "main.js"
    "parameters.js" "picture.js" "presets.js" "report.js" "scale.js" "session.js" "view.js" "yarns.js");

const STYLES: [(&str, &str, &str); 4] = files!("text/css; charset=utf-8":
    "controls.css" "panel.css" "picture.css" "studio.css");

/// The page itself, whose relative addresses start with the `token`.
pub(super) fn index(token: &str) -> Bytes {
    INDEX.replacen(BASE, &format!("/{token}/"), 1).into()
}

/// Media type and text of the file `name` of the page.
pub(super) fn file(name: &str) -> Option<(&'static str, &'static str)> {
    let mut files = SCRIPTS.into_iter().chain(STYLES);
    files.find(|(known, ..)| *known == name).map(|(_, kind, text)| (kind, text))
}
