//! Colours in files: linear numbers, or sRGB as hexadecimal digits.

use core::fmt;

use serde::de::{Deserialize, Deserializer, Error, SeqAccess, Visitor};

/// Reads linear RGB from three numbers, from one for a grey, or from `"#rrggbb"` in sRGB.
pub(crate) fn required<'de, D: Deserializer<'de>>(from: D) -> Result<[f32; 3], D::Error> {
    from.deserialize_any(ColorVisitor)
}

/// As [`required`], or nothing from a null.
pub(crate) fn optional<'de, D: Deserializer<'de>>(from: D) -> Result<Option<[f32; 3]>, D::Error> {
    Ok(Option::<Color>::deserialize(from)?.map(|Color(color)| color))
}

/// A colour as files write it: `[red, green, blue]`, linear, one number for a grey, or `"#rrggbb"`
/// in sRGB.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Color(
    /// Linear RGB, any numbers.
    pub [f32; 3],
);

impl<'de> Deserialize<'de> for Color {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        required(from).map(Self)
    }
}

#[cfg(feature = "schema")]
impl Color {
    /// The JSON Schema of colours of which each number is from `low` to `high`.
    pub fn schema_within(low: f64, high: f64) -> schemars::Schema {
        schemars::json_schema!({
            "description": "Linear [red, green, blue], one number for a grey, or \"#rrggbb\" in sRGB",
            "anyOf": [
                {
                    "type": "array",
                    "items": { "type": "number", "minimum": low, "maximum": high },
                    "minItems": 3,
                    "maxItems": 3
                },
                { "type": "number", "minimum": low, "maximum": high },
                { "type": "string", "pattern": "^#[0-9A-Fa-f]{6}$" }
            ]
        })
    }
}

/// Each number of a colour from 0 to 1.
#[cfg(feature = "schema")]
impl schemars::JsonSchema for Color {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Color".into()
    }

    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        Self::schema_within(0.0, 1.0)
    }
}

struct ColorVisitor;

impl<'de> Visitor<'de> for ColorVisitor {
    type Value = [f32; 3];

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a color: [red, green, blue], a number or \"#rrggbb\"")
    }

    fn visit_f64<E: Error>(self, grey: f64) -> Result<[f32; 3], E> {
        Ok([grey as f32; 3])
    }

    fn visit_i64<E: Error>(self, grey: i64) -> Result<[f32; 3], E> {
        self.visit_f64(grey as f64)
    }

    fn visit_u64<E: Error>(self, grey: u64) -> Result<[f32; 3], E> {
        self.visit_f64(grey as f64)
    }

    fn visit_str<E: Error>(self, text: &str) -> Result<[f32; 3], E> {
        srgb(text).ok_or_else(|| E::custom(format_args!("color {text:?}, expected \"#rrggbb\"")))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut numbers: A) -> Result<[f32; 3], A::Error> {
        let mut color = [0.0; 3];
        for (index, place) in color.iter_mut().enumerate() {
            *place =
                numbers.next_element()?.ok_or_else(|| A::Error::invalid_length(index, &self))?;
        }
        match numbers.next_element::<f32>()? {
            None => Ok(color),
            Some(_) => Err(A::Error::invalid_length(4, &self)),
        }
    }
}

/// The linear colour of `#rrggbb` (IEC 61966-2-1).
fn srgb(text: &str) -> Option<[f32; 3]> {
    let digits = text.strip_prefix('#').filter(|digits| digits.len() == 6)?;
    if !digits.bytes().all(|digit| digit.is_ascii_hexdigit()) {
        return None;
    }
    let number = u32::from_str_radix(digits, 16).ok()?;
    Some([16, 8, 0].map(|shift| {
        let c = f64::from(number >> shift & 0xff) / 255.0;
        let linear = if c <= 0.040_45 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) };
        linear as f32
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hexadecimal_digits_are_srgb() {
        assert_eq!(srgb("#000000"), Some([0.0; 3]));
        assert_eq!(srgb("#FFffff"), Some([1.0; 3]));
        let [red, green, blue] = srgb("#804020").unwrap();
        // (128 / 255 + 0.055) / 1.055 to the power of 2.4, and so on.
        for (found, expected) in [(red, 0.215_860_5), (green, 0.051_269_46), (blue, 0.014_443_84)] {
            assert!((found - expected).abs() < 1e-7, "{found}, expected {expected}");
        }
        for text in ["", "#", "804020", "#80402", "#8040200", "#80402g", "#+80402", "#äää"] {
            assert_eq!(srgb(text), None, "{text}");
        }
    }
}
