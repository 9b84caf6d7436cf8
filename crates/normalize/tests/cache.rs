//! Factors from a cache: the same bits from memory, from a file, in every frame and on every thread.

use std::{
    cell::Cell,
    fs,
    num::NonZeroU32,
    path::Path,
    sync::atomic::{AtomicU32, Ordering},
    thread,
};

use proptest::prelude::*;
use selvedge_normalize::{
    Normalization, Search,
    cache::{Cache, CacheError, Key},
    estimate::Sampling,
    glam::{DVec2, DVec3, Vec2, Vec3},
    scale::{Mode, Options, Place, ScaleError},
};

fn count(n: u32) -> NonZeroU32 {
    NonZeroU32::new(n).expect("not 0")
}

/// A lobe of the microfacet kind, brighter to the right, and a counter of its values.
fn glossy(x: Vec2, wi: Vec3, wo: Vec3) -> f32 {
    let half = (wi + wo).normalize_or_zero();
    (1.0 + x.x) * half.z.powi(12) / (0.2 + wi.z * wo.z)
}

fn quick() -> (Sampling, Options) {
    let sampling = Sampling { tolerance: 0.05, at_least: count(128), at_most: count(512), seed: 1 };
    let search = Search { explore: count(64), refine: 2, steps: 20 };
    (sampling, Options { search, ..Options::default() })
}

fn bits(n: &Normalization) -> Vec<u64> {
    let at = n.at.point.map(|p| p.to_array()).into_iter().flatten();
    let at = at.chain(n.at.direction.map(|w| w.to_array()).into_iter().flatten());
    let rest = [n.factor, n.max_albedo, n.lower_bound, n.upper_bound, n.evaluations.into()];
    at.chain(rest).map(f64::to_bits).collect()
}

#[test]
fn equal_settings_are_computed_once_and_different_ones_apart() {
    let (sampling, options) = quick();
    let (cache, key) = (Cache::new(), Key::new("glossy"));
    let calls = Cell::new(0);
    let counted = |x: Vec2, wi: Vec3, wo: Vec3| {
        calls.set(calls.get() + 1);
        glossy(x, wi, wo)
    };
    let computes = |key, mode, sampling: &Sampling, options: &Options| {
        calls.set(0);
        let n = cache.of(key, &counted, mode, sampling, options).expect("valid");
        assert_eq!(n, Normalization::of(&glossy, mode, sampling, options).expect("valid"));
        calls.get() > 0
    };
    assert!(computes(key, Mode::Pointwise, &sampling, &options));
    assert!(!computes(key, Mode::Pointwise, &sampling, &options));
    // Each field on its own makes another entry.
    assert!(computes(key.with_numbers(&[1.0]), Mode::Pointwise, &sampling, &options));
    assert!(computes(key, Mode::Segment, &sampling, &options));
    for other in [
        Sampling { tolerance: 0.06, ..sampling },
        Sampling { at_least: count(129), ..sampling },
        Sampling { at_most: count(513), ..sampling },
        Sampling { seed: 2, ..sampling },
    ] {
        assert!(computes(key, Mode::Pointwise, &other, &options), "{other:?}");
    }
    let search = options.search;
    for other in [
        Options { margin: 1.03, ..options },
        Options { albedo_error: 0.01, ..options },
        Options { bound: Some(0.0), ..options },
        Options { search: Search { explore: count(65), ..search }, ..options },
        Options { search: Search { refine: 3, ..search }, ..options },
        Options { search: Search { steps: 21, ..search }, ..options },
    ] {
        assert!(computes(key, Mode::Pointwise, &sampling, &other), "{other:?}");
    }
}

#[test]
fn an_error_is_not_kept() {
    let (sampling, options) = quick();
    let (cache, key) = (Cache::new(), Key::new("model"));
    let invalid = |_: Vec2, _: Vec3, _: Vec3| f32::NAN;
    let error = cache.of(key, &invalid, Mode::Pointwise, &sampling, &options);
    assert!(matches!(error, Err(ScaleError::Scattering(_))), "{error:?}");
    let found = cache.of(key, &glossy, Mode::Pointwise, &sampling, &options);
    assert!(found.expect("valid").factor > 0.0);
}

/// The factors of both modes in each of 24 frames, on `threads` threads that share a cache. In each
/// frame a camera moves on and looks at the surface, as a renderer would.
fn animated(cache: &Cache, threads: usize) -> Vec<Vec<u64>> {
    let (sampling, options) = quick();
    let looked_at = AtomicU32::new(0);
    let frame = |k: usize| {
        let wo = Vec3::new(0.1 * k as f32 - 1.2, 0.3, 1.0).normalize();
        if glossy(Vec2::splat(0.5), Vec3::Z, wo) > 0.0 {
            looked_at.fetch_add(1, Ordering::Relaxed);
        }
        [Mode::Pointwise, Mode::Segment].map(|mode| {
            let n = cache.of(Key::new("glossy"), &glossy, mode, &sampling, &options);
            bits(&n.expect("valid"))
        })
    };
    let frame = &frame;
    let mut frames = vec![Vec::new(); 24];
    thread::scope(|scope| {
        let workers: Vec<_> = (0..threads)
            .map(|t| scope.spawn(move || (t..24).step_by(threads).map(|k| (k, frame(k))).collect()))
            .collect();
        for worker in workers {
            let done: Vec<(usize, [Vec<u64>; 2])> = worker.join().expect("no panic");
            for (k, factors) in done {
                frames[k] = factors.concat();
            }
        }
    });
    assert_eq!(looked_at.into_inner(), 24);
    frames
}

#[test]
fn neither_frame_nor_thread_nor_cache_changes_a_bit() {
    let first = &animated(&Cache::new(), 1)[0];
    assert!(first.len() >= 16);
    for threads in [1, 2, 8] {
        let shared = Cache::new();
        for _ in 0..2 {
            let frames = animated(&shared, threads);
            assert!(frames.iter().all(|frame| frame == first), "{threads} threads: {frames:?}");
        }
    }
    // Without a cache every frame computes the factor anew.
    let (sampling, options) = quick();
    for _ in 0..24 {
        let n = [Mode::Pointwise, Mode::Segment]
            .map(|mode| Normalization::of(&glossy, mode, &sampling, &options).expect("valid"));
        assert_eq!(&n.iter().flat_map(bits).collect::<Vec<_>>(), first);
    }
}

fn filled() -> (Cache, Vec<Key>) {
    let cache = Cache::new();
    let keys = (0..6).map(|k| Key::new("model").with_numbers(&[f64::from(k)])).collect::<Vec<_>>();
    for (k, key) in (1u32..).zip(&keys) {
        let third = f64::from(k) / 3.0;
        let options = Options { bound: Some(third), ..quick().1 };
        let found = match k {
            1 => Ok(Normalization::none()),
            2 | 3 => Normalization::segment(|w| third * w.z.sqrt(), &options),
            _ => Normalization::pointwise(|x, w| third * x.x * w.y.abs().sqrt(), &options),
        };
        cache.get_or(*key, || found).expect("valid");
    }
    (cache, keys)
}

#[test]
fn a_file_is_read_back_to_the_bit() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("factors.json");
    assert!(Cache::load(&path).expect("no file is an empty cache").get(Key::new("x")).is_none());
    let (cache, keys) = filled();
    cache.save(&path).expect("saved");
    let again = Cache::load(&path).expect("what was saved");
    for key in &keys {
        let (saved, found) = (cache.get(*key).expect("kept"), again.get(*key).expect("saved"));
        assert_eq!(bits(&saved), bits(&found), "{key:?}: {saved:?}, {found:?}");
        again.get_or::<()>(*key, || panic!("{key:?} is there")).expect("there");
    }
    // Equal entries make equal files, and saving leaves nothing else behind.
    let text = fs::read(&path).expect("readable");
    again.save(&path).expect("saved");
    assert_eq!(fs::read(&path).expect("readable"), text);
    assert_eq!(fs::read_dir(folder.path()).expect("readable").count(), 1);
}

#[test]
fn saving_keeps_what_others_have_saved() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("factors.json");
    let key = |k: u32| Key::new("model").with_numbers(&[k.into()]);
    thread::scope(|scope| {
        for k in 0..8 {
            let (path, key) = (&path, key(k));
            scope.spawn(move || {
                let cache = Cache::new();
                cache.get_or::<()>(key, || Ok(Normalization::none())).expect("valid");
                for _ in 0..20 {
                    cache.save(path).expect("saved");
                    // Whoever wrote it, the file is whole.
                    Cache::load(path).expect("never half a file");
                }
            });
        }
    });
    for k in 0..8 {
        let cache = Cache::new();
        cache.get_or::<()>(key(k), || Ok(Normalization::none())).expect("valid");
        cache.save(&path).expect("saved");
    }
    let all = Cache::load(&path).expect("what was saved");
    assert!((0..8).all(|k| all.get(key(k)).is_some()), "{all:?}");
}

#[test]
fn numbers_of_no_albedo_are_left_out_of_the_file() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("factors.json");
    let base = Normalization { upper_bound: 1.0, ..Normalization::none() };
    let at = |x: f64| Place { point: Some(DVec2::new(0.5, x)), direction: Some(DVec3::Z) };
    let odd = [
        Normalization { factor: f64::NAN, ..base },
        Normalization { lower_bound: f64::NEG_INFINITY, ..base },
        Normalization { upper_bound: f64::NAN, ..base },
        Normalization { at: at(f64::INFINITY), ..base },
        Normalization { at: at(0.5), ..base },
    ];
    let cache = Cache::new();
    let key = |k: usize| Key::new("odd").with_bytes(&[u8::try_from(k).expect("few")]);
    for (k, n) in odd.iter().enumerate() {
        cache.get_or::<()>(key(k), || Ok(*n)).expect("valid");
    }
    cache.save(&path).expect("saved");
    let again = Cache::load(&path).expect("what was saved");
    let kept = (0..odd.len()).map(|k| again.get(key(k)).is_some());
    assert_eq!(kept.collect::<Vec<_>>(), [false, false, false, false, true]);
}

/// What loading `text` fails with.
fn error_of(path: &Path, text: &[u8]) -> CacheError {
    fs::write(path, text).expect("writable");
    Cache::load(path).expect_err("not as it was saved")
}

#[test]
fn a_damaged_or_other_file_is_an_error_and_saving_replaces_it() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("factors.json");
    let (cache, keys) = filled();
    cache.save(&path).expect("saved");
    let text = fs::read_to_string(&path).expect("readable");

    for cut in (0..text.len() - 1).step_by(23) {
        let error = error_of(&path, &text.as_bytes()[..cut]);
        assert!(matches!(error, CacheError::Damaged { .. }), "cut at {cut}: {error:?}");
    }
    assert!(matches!(error_of(&path, b"\xff\xfe"), CacheError::Damaged { .. }));
    let digit = text.replacen("\"factor\": 1.", "\"factor\": 2.", 1);
    assert_ne!(digit, text);
    let error = error_of(&path, digit.as_bytes());
    assert!(matches!(error, CacheError::Checksum { .. }), "{error:?}");
    let version = env!("CARGO_PKG_VERSION");
    let other = text.replace(&format!("\"version\": \"{version}\""), "\"version\": \"0.0.1\"");
    let error = error_of(&path, other.as_bytes());
    let expected = format!("cache {}: version \"0.0.1\", expected \"{version}\"", path.display());
    assert_eq!(error.to_string(), expected);
    // Another version may have any other form.
    let error = error_of(&path, br#"{"version": "9.9.9", "factors": []}"#);
    assert!(matches!(error, CacheError::Version { .. }), "{error:?}");

    cache.save(&path).expect("replaces the file");
    let again = Cache::load(&path).expect("what was saved");
    assert!(keys.iter().all(|key| again.get(*key).is_some()));

    let error = Cache::load(folder.path()).expect_err("a folder");
    assert!(matches!(error, CacheError::Io { .. }), "{error:?}");
    assert!(std::error::Error::source(&error).is_some());
    let error = cache.save(&folder.path().join("none/factors.json")).expect_err("no folder");
    assert!(error.to_string().ends_with("cannot be read or written"), "{error}");
}

proptest! {
    #[test]
    fn keys_are_equal_only_if_all_parts_are(
        a in prop::collection::vec(prop::collection::vec(any::<u8>(), 0..4), 0..4),
        b in prop::collection::vec(prop::collection::vec(any::<u8>(), 0..4), 0..4),
    ) {
        let key = |parts: &[Vec<u8>]| {
            parts.iter().fold(Key::new("model"), |key, part| key.with_bytes(part))
        };
        prop_assert_eq!(key(&a) == key(&b), a == b);
        let numbers = |parts: &[Vec<u8>]| {
            parts.iter().fold(Key::new("model"), |key, part| {
                key.with_numbers(&part.iter().map(|byte| f64::from(*byte)).collect::<Vec<_>>())
            })
        };
        prop_assert_eq!(numbers(&a) == numbers(&b), a == b);
        prop_assert_eq!(key(&a).to_string().len(), 32);
    }

    #[test]
    fn any_bytes_are_a_cache_or_an_error(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("factors.json");
        fs::write(&path, &bytes).expect("writable");
        prop_assert!(Cache::load(&path).is_err());
    }

    #[test]
    fn every_number_survives_the_file(numbers in prop::array::uniform6(any::<f64>()), evaluations in any::<u32>()) {
        prop_assume!(numbers.iter().all(|x| x.is_finite()));
        let [factor, max_albedo, lower_bound, upper_bound, x, y] = numbers;
        let at = Place { point: Some(DVec2::new(x, y)), direction: None };
        let n = Normalization { factor, max_albedo, at, lower_bound, upper_bound, evaluations };
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("factors.json");
        let cache = Cache::new();
        cache.get_or::<()>(Key::new("any"), || Ok(n)).expect("valid");
        cache.save(&path).expect("saved");
        let again = Cache::load(&path).expect("what was saved").get(Key::new("any"));
        prop_assert_eq!(bits(&again.expect("saved")), bits(&n));
    }
}
