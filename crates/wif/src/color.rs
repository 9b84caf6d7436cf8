//! Colours of threads: the table of the file, and 8-bit sRGB.

use crate::draft::Side;
use crate::sparse::Sparse;

/// A colour in 8-bit sRGB: red, green, blue.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Rgb8(pub [u8; 3]);

/// Colour of an end whose file gives none.
///
/// Dark warp on light weft, as in a drawdown on paper, but off the ends of the range, so that
/// a renderer gets reflectances strictly between 0 and 1.
pub const DEFAULT_WARP_COLOR: Rgb8 = Rgb8([64, 64, 64]);

/// Colour of a pick whose file gives none; see [`DEFAULT_WARP_COLOR`].
pub const DEFAULT_WEFT_COLOR: Rgb8 = Rgb8([224, 224, 224]);

impl Rgb8 {
    /// The colour decoded to linear light, each component in [0, 1].
    ///
    /// ```text
    /// c ≤ 0.04045:  c / 12.92
    /// else:         ((c + 0.055) / 1.055)^2.4        with c = component / 255
    /// ```
    ///
    /// (IEC 61966-2-1, the sRGB transfer function.)
    pub fn linear(self) -> [f32; 3] {
        self.0.map(|component| {
            let c = f64::from(component) / 255.0;
            let linear = if c <= 0.040_45 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) };
            linear as f32
        })
    }
}

/// The colour table of a draft, with the range its components are written in.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Palette {
    /// Smallest and largest value of a component; the second is the greater.
    pub range: (u32, u32),
    /// Red, green and blue by colour number, within `range`. The numbers are names, as written
    /// in the file (usually from 1, possibly with gaps), not positions.
    pub colors: Sparse<[u32; 3]>,
}

impl Default for Palette {
    /// No colours, components from 0 to 255.
    fn default() -> Self {
        Self { range: (0, 255), colors: Sparse::default() }
    }
}

impl Palette {
    /// The colour with this number, or `None` where the table has none.
    pub fn color(&self, number: u32) -> Option<Rgb8> {
        self.colors.get(number).map(|&color| self.scale(color))
    }

    /// A colour in the range of the palette, as 8-bit sRGB, rounded to nearest.
    ///
    /// ```text
    /// 255 · (v − min) / (max − min), with v first clamped to [min, max]
    /// ```
    pub fn scale(&self, color: [u32; 3]) -> Rgb8 {
        let (low, high) = self.range;
        let extent = u64::from(high.saturating_sub(low)).max(1);
        Rgb8(color.map(|v| {
            let above = u64::from(v.clamp(low, high.max(low)) - low);
            // At most (255 · extent + extent / 2) / extent = 255.
            ((above * 255 + extent / 2) / extent) as u8
        }))
    }
}

/// The colour of a thread for which the file gives no usable one.
pub(crate) fn default_color(side: Side) -> Rgb8 {
    match side {
        Side::Warp => DEFAULT_WARP_COLOR,
        Side::Weft => DEFAULT_WEFT_COLOR,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn linear_light_matches_the_standard() {
        assert_eq!(Rgb8([0, 255, 0]).linear(), [0.0, 1.0, 0.0]);
        let [dark, middle, _] = Rgb8([10, 188, 0]).linear();
        // 10 / 255 / 12.92 and the mid grey of sRGB, to the rounding of f32.
        assert!((dark - 0.003_035_27).abs() < 1e-8, "{dark}");
        assert!((middle - 0.502_886_5).abs() < 1e-6, "{middle}");
    }

    #[test]
    fn components_scale_from_any_range() {
        let scale = |range, v| {
            let palette = Palette { range, ..Palette::default() };
            palette.scale([v; 3]).0[0]
        };
        assert_eq!(scale((0, 255), 37), 37);
        assert_eq!(scale((0, 999), 999), 255);
        assert_eq!(scale((0, 999), 500), 128);
        assert_eq!(scale((20, 1200), 20), 0);
        assert_eq!(scale((20, 1200), 610), 128);
        assert_eq!(scale((20, 1200), 3), 0);
        assert_eq!(scale((0, u32::MAX), u32::MAX), 255);
        assert_eq!(scale((9, 9), 9), 0);
    }
}
