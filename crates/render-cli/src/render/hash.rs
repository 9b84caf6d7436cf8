//! A hash that is the same on every platform and in every run.

use std::{
    fmt,
    io::{self, Read, Write},
};

/// FNV-1a of what is written to it, 64 bits (Fowler et al. 2026).
///
/// Whatever one changes in one byte, the hash is another one, as each step is a bijection; other
/// changes keep it with a chance of 2⁻⁶⁴. Nothing protects from one who means harm.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fnv(u64);

impl Default for Fnv {
    /// Of nothing.
    fn default() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }
}

impl Fnv {
    /// The hash of all that was written so far.
    pub fn finish(self) -> u64 {
        self.0
    }

    /// Adds bytes.
    pub fn add(&mut self, bytes: &[u8]) {
        self.0 = bytes.iter().fold(self.0, |hash, byte| {
            (hash ^ u64::from(*byte)).wrapping_mul(0x0000_0100_0000_01b3)
        });
    }
}

impl fmt::Write for Fnv {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        self.add(text.as_bytes());
        Ok(())
    }
}

/// Hashes what passes through.
#[derive(Debug)]
pub(super) struct Hashed<T> {
    pub(super) inner: T,
    pub(super) hash: Fnv,
}

impl<T> Hashed<T> {
    pub(super) fn new(inner: T) -> Self {
        Self { inner, hash: Fnv::default() }
    }
}

impl<T: Write> Write for Hashed<T> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.inner.write(bytes)?;
        self.hash.add(&bytes[..written]);
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.inner.flush()
    }
}

impl<T: Read> Read for Hashed<T> {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        let read = self.inner.read(bytes)?;
        self.hash.add(&bytes[..read]);
        Ok(read)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hash_is_that_of_the_published_test_vectors() {
        for (text, expected) in [
            ("", 0xcbf2_9ce4_8422_2325),
            ("a", 0xaf63_dc4c_8601_ec8c),
            ("foobar", 0x8594_4171_f739_67e8),
        ] {
            let mut hash = Fnv::default();
            hash.add(text.as_bytes());
            assert_eq!(hash.finish(), expected, "{text:?}");
        }
    }

    #[test]
    fn what_is_hashed_passes_through() {
        let mut writer = Hashed::new(Vec::new());
        writer.write_all(b"foo").unwrap();
        writer.write_all(b"bar").unwrap();
        assert_eq!(writer.inner, b"foobar");
        assert_eq!(writer.hash.finish(), 0x8594_4171_f739_67e8);
    }
}
