//! Factors kept under the hash of what they depend on, in memory and (feature `json`) in a file.
//!
//! A [`Key`] is a hash of the model's parameters and of all settings. Equal keys have equal factors bit
//! for bit, so it does not matter who computed one, nor on which thread. The crate does not see inside
//! a scattering function: that the key holds every parameter is the caller's to ensure.

#[cfg(feature = "json")]
mod json;
mod key;

use std::{
    collections::BTreeMap,
    sync::{Mutex, MutexGuard, PoisonError},
};

#[cfg(feature = "json")]
pub use json::CacheError;
pub use key::Key;

use crate::{
    albedo::Scattering,
    estimate::Sampling,
    scale::{Mode, Normalization, Options, ScaleError},
};

/// Factors by the hash of what they depend on. Threads may share it; it only grows.
///
/// ```
/// use selvedge_normalize::{cache::{Cache, Key}, estimate::Sampling, scale::{Mode, Options}};
/// use selvedge_normalize::glam::{Vec2, Vec3};
/// let rho = 0.25f32;
/// let lambert = |_: Vec2, _: Vec3, _: Vec3| rho / std::f32::consts::PI;
/// let key = Key::new("lambert, 1").with_numbers(&[rho.into()]);
/// let cache = Cache::new();
/// let find = || cache.of(key, &lambert, Mode::Segment, &Sampling::default(), &Options::default());
/// assert_eq!(find()?, find()?); // The second is looked up.
/// # Ok::<(), selvedge_normalize::scale::ScaleError>(())
/// ```
#[derive(Debug, Default)]
pub struct Cache {
    entries: Mutex<BTreeMap<Key, Normalization>>,
}

impl Cache {
    /// A cache without entries.
    #[must_use]
    pub const fn new() -> Self {
        Self { entries: Mutex::new(BTreeMap::new()) }
    }

    /// [`Normalization::of`], or what it was before for equal `parameters`, mode, sampling and options.
    ///
    /// # Errors
    ///
    /// As [`Normalization::of`]; an error is not kept.
    pub fn of(
        &self,
        parameters: Key,
        brdf: &(impl Scattering + ?Sized),
        mode: Mode,
        sampling: &Sampling,
        options: &Options,
    ) -> Result<Normalization, ScaleError> {
        let key = parameters.with_mode(mode).with_sampling(sampling).with_options(options);
        self.get_or(key, || Normalization::of(brdf, mode, sampling, options))
    }

    /// The entry under `key`, which must hold everything that it depends on; `compute` makes it if there
    /// is none.
    ///
    /// No lock is held while it is computed. Threads that ask for the same key at the same time may
    /// each compute it, and the first to end is what all of them get.
    ///
    /// # Errors
    ///
    /// The error of `compute`; it is not kept.
    pub fn get_or<E>(
        &self,
        key: Key,
        compute: impl FnOnce() -> Result<Normalization, E>,
    ) -> Result<Normalization, E> {
        if let Some(found) = self.get(key) {
            return Ok(found);
        }
        let made = compute()?;
        Ok(*self.lock().entry(key).or_insert(made))
    }

    /// The entry under `key`.
    #[must_use]
    pub fn get(&self, key: Key) -> Option<Normalization> {
        self.lock().get(&key).copied()
    }

    /// The entries. No code of a caller runs while they are locked, so they are whole even if a thread
    /// that held the lock panicked.
    fn lock(&self) -> MutexGuard<'_, BTreeMap<Key, Normalization>> {
        self.entries.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
