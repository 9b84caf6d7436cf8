//! A hash of parameters that is the same on every platform and in every run.

use core::fmt;

use crate::{
    estimate::Sampling,
    scale::{Mode, Options},
    search::Search,
};

/// Where FNV starts and what it multiplies by, for 128 bits (Fowler et al. 2026).
const OFFSET_BASIS: u128 = 0x6c62_272e_07bb_0142_62b8_2175_6295_c58d;
const PRIME: u128 = (1 << 88) + 0x13b;

/// The name of a result: a hash of all that it depends on.
///
/// 128 bits of FNV-1a (Fowler et al. 2026) over the parts in their order, each with its length in front.
/// Two different lists of parameters do not meet by chance; nothing protects from one who makes them.
///
/// ```
/// use selvedge_normalize::cache::Key;
/// let phong = |exponent| Key::new("phong, 1").with_numbers(&[exponent]);
/// assert_eq!(phong(20.0), phong(20.0));
/// assert_ne!(phong(20.0), phong(20.5));
/// ```
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Key(u128);

impl Key {
    /// The key of a model without parameters. The name should change whenever the model does.
    #[must_use]
    pub fn new(model: &str) -> Self {
        Self(OFFSET_BASIS).with_bytes(model.as_bytes())
    }

    /// The key with `bytes` as one more parameter.
    #[must_use]
    pub fn with_bytes(self, bytes: &[u8]) -> Self {
        self.with_length(bytes.len()).hashed(bytes)
    }

    /// The key with a list of numbers as one more parameter. Numbers with different bits differ, also
    /// 0 and −0.
    #[must_use]
    pub fn with_numbers(self, numbers: &[f64]) -> Self {
        let hashed = |key: Self, number: &f64| key.hashed(&number.to_bits().to_le_bytes());
        numbers.iter().fold(self.with_length(numbers.len()), hashed)
    }

    /// The key with what the maximum is over as one more parameter.
    #[must_use]
    pub fn with_mode(self, mode: Mode) -> Self {
        self.with_bytes(match mode {
            Mode::Pointwise => b"pointwise",
            Mode::Segment => b"segment",
            Mode::None => b"none",
        })
    }

    /// The key with the way in which albedos are estimated as one more parameter.
    #[must_use]
    pub fn with_sampling(self, sampling: &Sampling) -> Self {
        let Sampling { tolerance, at_least, at_most, seed } = *sampling;
        self.with_numbers(&[tolerance, at_least.get().into(), at_most.get().into()])
            .with_bytes(&seed.to_le_bytes())
    }

    /// The key with the way in which the maximum is sought and bounded as one more parameter.
    #[must_use]
    pub fn with_options(self, options: &Options) -> Self {
        let Options { search, margin, albedo_error, bound } = *options;
        let Search { explore, refine, steps } = search;
        self.with_numbers(&[
            explore.get().into(),
            refine.into(),
            steps.into(),
            margin,
            albedo_error,
        ])
        .with_numbers(bound.as_slice())
    }

    fn with_length(self, length: usize) -> Self {
        self.hashed(&(length as u64).to_le_bytes())
    }

    fn hashed(self, bytes: &[u8]) -> Self {
        Self(bytes.iter().fold(self.0, |hash, byte| (hash ^ u128::from(*byte)).wrapping_mul(PRIME)))
    }
}

impl fmt::Display for Key {
    /// 32 hexadecimal digits.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:032x}", self.0)
    }
}

impl fmt::Debug for Key {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Key({self})")
    }
}

#[cfg(feature = "json")]
impl serde::Serialize for Key {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

#[cfg(feature = "json")]
impl<'de> serde::Deserialize<'de> for Key {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = <std::borrow::Cow<'de, str>>::deserialize(deserializer)?;
        u128::from_str_radix(&text, 16).map(Self).map_err(serde::de::Error::custom)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hash_is_that_of_the_published_test_vectors() {
        for (text, expected) in [
            ("", 0x6c62_272e_07bb_0142_62b8_2175_6295_c58d),
            ("a", 0xd228_cb69_6f1a_8caf_7891_2b70_4e4a_8964),
            ("foobar", 0x343e_1662_793c_64bf_6f0d_3597_ba44_6f18),
        ] {
            assert_eq!(Key(OFFSET_BASIS).hashed(text.as_bytes()), Key(expected), "{text:?}");
        }
    }

    #[test]
    fn parts_do_not_run_into_each_other() {
        let key = Key::new("model");
        assert_ne!(key.with_bytes(b"ab").with_bytes(b"c"), key.with_bytes(b"a").with_bytes(b"bc"));
        assert_ne!(key.with_bytes(b""), key);
        assert_ne!(key.with_numbers(&[1.0, 2.0]), key.with_numbers(&[1.0]).with_numbers(&[2.0]));
        assert_ne!(key.with_numbers(&[0.0]), key.with_numbers(&[-0.0]));
    }
}
