//! How linear light is shown: the view, and the transfer function of sRGB, here and nowhere else.

use clap::ValueEnum;
use glam::Vec3;

/// What is done to linear values on their way to a screen.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum View {
    /// Bright light fades to white, as a photograph shows it: for radiance.
    Srgb,
    /// Values as they are, cut off below 0 and above 1: a PNG of them reads back as these values.
    /// For what has been a PNG before, and for values that are not light.
    Raw,
}

/// Radiance above which [`View::Srgb`] begins to compress.
const SHOULDER: f32 = 0.6;

impl View {
    /// The sRGB component, 0 to 1, with which a screen shows the linear value `x`; 0 for NaN.
    ///
    /// What [`View::Srgb`] finds below the shoulder s = 0.6 is shown as it is; above, the curve
    /// bends smoothly towards white, so that highlights keep their shape and fade to white instead
    /// of ending in a flat patch:
    ///
    /// ```text
    /// x ≤ s:  x
    /// else:   1 − (1 − s) exp(−(x − s)/(1 − s))
    /// ```
    ///
    /// Then follows, in either view, the transfer function of sRGB (IEC 61966-2-1).
    pub fn component(self, x: f32) -> f32 {
        let shown = match self {
            Self::Srgb if x > SHOULDER => {
                1.0 - (1.0 - SHOULDER) * (-(x - SHOULDER) / (1.0 - SHOULDER)).exp()
            }
            _ if x > 0.0 => x.min(1.0),
            _ => 0.0,
        };
        srgb_from_linear(shown)
    }

    /// The components of `color`, rounded to 8 bits.
    pub fn bytes(self, color: Vec3) -> [u8; 3] {
        color.to_array().map(|x| (255.0 * self.component(x)).round() as u8)
    }
}

/// Luminance of linear RGB with the primaries of sRGB (Rec. ITU-R BT.709-6, item 3.2).
pub fn luminance(rgb: Vec3) -> f32 {
    rgb.dot(Vec3::new(0.2126, 0.7152, 0.0722))
}

/// The sRGB component of a linear value, both 0 to 1 (IEC 61966-2-1).
pub fn srgb_from_linear(x: f32) -> f32 {
    if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 }
}

/// The linear value of an sRGB component, both 0 to 1 (IEC 61966-2-1).
pub fn linear_from_srgb(c: f32) -> f32 {
    if c <= 0.040_45 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn view_leaves_mid_tones_alone() {
        // 0.2140 is the linear value of sRGB 127.5.
        for (linear, expected) in [(0.0, 0), (0.001, 3), (0.2122, 127), (0.5, 188)] {
            assert_eq!(View::Srgb.bytes(Vec3::splat(linear)), [expected; 3], "{linear}");
        }
        assert_eq!(View::Srgb.bytes(Vec3::new(0.0, 0.5, 1e9)), [0, 188, 255]);
    }

    #[test]
    fn view_rises_smoothly_to_white() {
        let shown = |x: f32| View::Srgb.bytes(Vec3::splat(x))[0];
        let steps: Vec<_> = (0..400).map(|i| shown(i as f32 / 100.0)).collect();
        assert!(steps.is_sorted());
        assert!(steps.windows(2).skip(10).all(|pair| pair[1] - pair[0] <= 8), "{steps:?}");
        assert!(shown(1.0) < 240 && shown(4.0) == 255, "{} {}", shown(1.0), shown(4.0));
    }

    #[test]
    fn raw_view_undoes_the_reading_of_8_and_16_bits() {
        for byte in 0..=u8::MAX {
            let linear = linear_from_srgb(f32::from(byte) / 255.0);
            assert_eq!(View::Raw.bytes(Vec3::splat(linear)), [byte; 3]);
        }
        for word in 0..=u16::MAX {
            let c = f32::from(word) / 65535.0;
            let found = View::Raw.component(linear_from_srgb(c));
            assert!((found - c).abs() < 0.1 / 65535.0, "{c}: {found}");
        }
    }

    #[test]
    fn what_is_no_light_is_shown_all_the_same() {
        for view in [View::Srgb, View::Raw] {
            let odd = [f32::NAN, f32::NEG_INFINITY, -1.0, f32::INFINITY];
            let shown = odd.map(|x| view.bytes(Vec3::splat(x))[0]);
            assert_eq!(shown, [0, 0, 0, 255], "{view:?}");
        }
    }
}
