//! The section names of the format, and how names are compared.

use super::line::trim;

macro_rules! names {
    ($($name:ident = $text:literal,)+) => {
        /// A section of the format, in the order in which it describes them.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub(crate) enum Name { $($name,)+ }

        impl Name {
            pub(crate) const ALL: &'static [Self] = &[$(Self::$name),+];

            pub(crate) const fn as_str(self) -> &'static str {
                match self { $(Self::$name => $text),+ }
            }
        }
    };
}

names! {
    Wif = "WIF",
    Contents = "CONTENTS",
    Text = "TEXT",
    Notes = "NOTES",
    Weaving = "WEAVING",
    Warp = "WARP",
    Weft = "WEFT",
    ColorPalette = "COLOR PALETTE",
    WarpSymbolPalette = "WARP SYMBOL PALETTE",
    WeftSymbolPalette = "WEFT SYMBOL PALETTE",
    ColorTable = "COLOR TABLE",
    WarpSymbolTable = "WARP SYMBOL TABLE",
    WeftSymbolTable = "WEFT SYMBOL TABLE",
    Threading = "THREADING",
    Tieup = "TIEUP",
    Treadling = "TREADLING",
    Liftplan = "LIFTPLAN",
    WarpColors = "WARP COLORS",
    WeftColors = "WEFT COLORS",
    WarpSymbols = "WARP SYMBOLS",
    WeftSymbols = "WEFT SYMBOLS",
    WarpSpacing = "WARP SPACING",
    WeftSpacing = "WEFT SPACING",
    WarpThickness = "WARP THICKNESS",
    WeftThickness = "WEFT THICKNESS",
    WarpSpacingZoom = "WARP SPACING ZOOM",
    WeftSpacingZoom = "WEFT SPACING ZOOM",
    WarpThicknessZoom = "WARP THICKNESS ZOOM",
    WeftThicknessZoom = "WEFT THICKNESS ZOOM",
}

/// Names that the format reserves or has dropped: their sections pass without a word.
const RESERVED: [&str; 5] =
    ["TRANSLATIONS", "BITMAP FILE", "BITMAP IMAGE", "BITMAP IMAGE DATA", "DESIGN"];

impl Name {
    /// The section of the format with this name, if there is one.
    pub(crate) fn of(name: &[u8]) -> Option<Self> {
        Self::ALL.iter().copied().find(|known| same_name(name, known.as_str().as_bytes()))
    }

    /// Whether values are text, in which `;` is a character like any other.
    pub(crate) fn has_text(self) -> bool {
        matches!(self, Self::Wif | Self::Text | Self::Notes)
    }
}

/// Whether the format knows a section of this name without defining its content.
pub(crate) fn is_reserved(name: &[u8]) -> bool {
    RESERVED.iter().any(|reserved| same_name(name, reserved.as_bytes())) || is_private(name)
}

fn is_private(name: &[u8]) -> bool {
    words(name).next().is_some_and(|first| first.eq_ignore_ascii_case(b"PRIVATE"))
}

/// Whether two names are the same but for case and the amount of white space.
pub(crate) fn same_name(a: &[u8], b: &[u8]) -> bool {
    let first = |name: &[u8]| name.first().map(u8::to_ascii_lowercase);
    first(trim(a)) == first(trim(b))
        && words(a).map(<[u8]>::to_ascii_lowercase).eq(words(b).map(<[u8]>::to_ascii_lowercase))
}

/// The name in lower case with white space folded: equal for names that are the same.
pub(crate) fn folded(name: &[u8]) -> Vec<u8> {
    words(name).collect::<Vec<_>>().join(&b' ').to_ascii_lowercase()
}

/// The parts of a name between white space.
pub(crate) fn words(name: &[u8]) -> impl Iterator<Item = &[u8]> {
    name.split(|&byte| super::line::is_space(byte)).filter(|word| !word.is_empty())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_differ_by_letters_only() {
        assert_eq!(Name::of(b"  warp\t Colors "), Some(Name::WarpColors));
        assert_eq!(Name::of(b"WARPCOLORS"), None);
        assert_eq!(Name::of(b""), None);
        assert!(is_reserved(b"private x y") && is_reserved(b"Bitmap  File"));
        assert!(!is_reserved(b"PRIVATEER") && !is_reserved(b"TW STUFF"));
    }
}
