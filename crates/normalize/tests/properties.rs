//! What holds for every input of every public function.

use std::{cell::Cell, f64::consts::PI, num::NonZeroU32};

use proptest::{array::uniform4, prelude::*};
use selvedge_normalize::{
    Normalization, Search, albedo,
    albedo::{averaged, bihemispherical, directional},
    estimate::{Sampling, mean},
    glam::{DVec2, DVec3, Vec2, Vec3},
    halton::*,
    maximize,
    scale::{Mode, Options},
    table::{AlbedoTable, Resolution},
    warp::*,
};

fn base() -> impl Strategy<Value = Base> {
    (0usize..64).prop_map(|k| Base::ALL[k])
}

fn index() -> impl Strategy<Value = NonZeroU32> {
    (1..=u32::MAX).prop_map(|n| NonZeroU32::new(n).expect("from 1"))
}

fn scrambling() -> impl Strategy<Value = Scrambling> {
    prop_oneof![
        Just(Scrambling::None),
        any::<u64>().prop_map(Scrambling::Digits),
        any::<u64>().prop_map(Scrambling::Owen)
    ]
}

/// The closed unit square, its corners and edges more often than chance has them.
fn square() -> impl Strategy<Value = DVec2> {
    let coordinate = || prop_oneof![4 => 0.0..=1.0, 1 => Just(0.0), 1 => Just(1.0), 1 => Just(0.5)];
    (coordinate(), coordinate()).prop_map(|(x, y)| DVec2::new(x, y))
}

fn unit_vector() -> impl Strategy<Value = DVec3> {
    (-1.0..=1.0f64, 0.0..std::f64::consts::TAU)
        .prop_map(|(z, phi)| (DVec2::from_angle(phi) * (1.0 - z * z).sqrt()).extend(z))
}

/// Few points: what is tested here holds for any number of them.
fn sampling(seed: u64) -> Sampling {
    let count = |n| NonZeroU32::new(n).expect("not 0");
    Sampling { tolerance: 0.01, at_least: count(64), at_most: count(1024), seed }
}

fn search() -> Search {
    Search { explore: NonZeroU32::new(60).expect("not 0"), refine: 3, steps: 400 }
}

proptest! {
    #[test]
    fn base_new_finds_exactly_the_bases(prime in 0u32..400) {
        let listed = Base::ALL.iter().copied().find(|b| b.get() == prime);
        prop_assert_eq!(Base::new(prime), listed);
    }

    #[test]
    fn fractions_are_the_mirrored_digits(base in base(), index in any::<u32>()) {
        let Fraction { mut numerator, denominator } = fraction(base, index);
        prop_assert!(numerator < denominator);
        let b = u64::from(base.get());
        let (mut back, mut power) = (0, denominator);
        while power > 1 {
            back = back * b + numerator % b;
            numerator /= b;
            power /= b;
        }
        // Mirroring twice with the same number of digits gives the index again.
        prop_assert_eq!(back, u64::from(index));
    }

    #[test]
    fn radical_inverses_are_below_one_and_correctly_rounded(base in base(), index in any::<u32>()) {
        let (x, y) = (radical_inverse(base, index), radical_inverse_f32(base, index));
        prop_assert!((0.0..1.0).contains(&x) && (0.0..1.0).contains(&y));
        prop_assert_eq!(fraction(base, index).value(), x);
        prop_assert!((f64::from(y) - x).abs() <= f64::from(f32::EPSILON) / 2.0);
        prop_assert!(below_one(x) == y);
    }

    #[test]
    fn below_one_is_below_one(x in 0.0..1.0f64) {
        prop_assert!(below_one(x) < 1.0 && (f64::from(below_one(x)) - x).abs() <= 2f64.powi(-24));
    }

    #[test]
    fn scrambling_keeps_different_indices_apart(
        base in base(), a in any::<u32>(), b in any::<u32>(), scrambling in scrambling()
    ) {
        let scrambled = |n| scrambled_fraction(base, n, scrambling);
        let (fa, fb) = (scrambled(a), scrambled(b));
        prop_assert!(fa.numerator < fa.denominator && fa.denominator <= 1 << 53);
        prop_assert_eq!(a == b, fa == fb);
    }

    #[test]
    fn points_agree_however_they_are_reached(
        start in index(), leap in 1u32..1000, k in 0usize..50, scrambling in scrambling()
    ) {
        let sequence = Halton::<16>::scrambled(scrambling);
        let leap = NonZeroU32::new(leap).expect("from 1");
        let ahead = u32::try_from(k).ok().and_then(|k| k.checked_mul(leap.get()));
        let direct = ahead.and_then(|a| start.checked_add(a)).map(|n| sequence.point(n));
        prop_assert_eq!(sequence.leaped(start, leap).nth(k), direct);
        prop_assert_eq!(sequence.points_from(start).step_by(leap.get() as usize).nth(k), direct);
        let mut walked = sequence.leaped(start, leap);
        (0..k).for_each(|_| { walked.next(); });
        prop_assert_eq!(walked.next(), direct);
        for (x, y) in sequence.point(start).into_iter().zip(sequence.point_f32(start)) {
            prop_assert!((0.0..1.0).contains(&x) && y < 1.0 && y == below_one(x));
        }
        let exact = sequence.fractions(start).map(Fraction::value);
        prop_assert_eq!(exact, sequence.point(start));
    }

    #[test]
    fn hammersley_fills_every_interval_of_its_first_coordinate(n in 1u32..500) {
        let n = NonZeroU32::new(n).expect("from 1");
        let points: Vec<[f64; 3]> = hammersley(n).collect();
        prop_assert_eq!(points.len(), n.get() as usize);
        for (k, [x, y, z]) in points.into_iter().enumerate() {
            prop_assert_eq!((x * f64::from(n.get())) as usize, k);
            prop_assert!((0.0..1.0).contains(&y) && (0.0..1.0).contains(&z));
        }
    }

    #[test]
    fn maps_of_the_square_invert(s in square()) {
        let disk = square_to_disk(s);
        prop_assert!(disk.length() <= 1.0 + 1e-15);
        prop_assert!(disk_to_square(disk).distance(s) < 1e-15, "{} by {}", s, disk);
        // Near the rim the maps to directions are steep, so compare the directions, not the squares.
        let cosine = square_to_cosine_hemisphere(s);
        let again = square_to_cosine_hemisphere(cosine_hemisphere_to_square(cosine));
        prop_assert!(cosine.is_normalized() && cosine.z >= 0.0 && cosine.distance(again) < 5e-8);
        let uniform = square_to_uniform_hemisphere(s);
        let again = square_to_uniform_hemisphere(uniform_hemisphere_to_square(uniform));
        prop_assert!(uniform.is_normalized() && uniform.z >= 0.0 && uniform.distance(again) < 2e-15);
        let sphere = square_to_uniform_sphere(s);
        let again = square_to_uniform_sphere(uniform_sphere_to_square(sphere));
        prop_assert!(sphere.is_normalized() && sphere.distance(again) < 5e-8);
    }

    #[test]
    fn inverses_of_the_maps_invert(w in unit_vector()) {
        let up = w.with_z(w.z.abs());
        for (inverse, map, w, tolerance) in [
            (cosine_hemisphere_to_square as fn(DVec3) -> DVec2, square_to_cosine_hemisphere as fn(DVec2) -> DVec3, up, 5e-8),
            (uniform_hemisphere_to_square, square_to_uniform_hemisphere, up, 2e-15),
            (uniform_sphere_to_square, square_to_uniform_sphere, w, 5e-8),
        ] {
            let square = inverse(w);
            prop_assert!(square.min_element() >= 0.0 && square.max_element() <= 1.0, "{} to {}", w, square);
            prop_assert!(map(square).distance(w) < tolerance, "{} to {}", w, map(square));
        }
    }

    #[test]
    fn densities_are_those_of_their_domains(w in unit_vector(), p in square()) {
        prop_assert_eq!(cosine_hemisphere_density(w), w.z.max(0.0) * std::f64::consts::FRAC_1_PI);
        prop_assert_eq!(uniform_hemisphere_density(w) > 0.0, w.z >= 0.0);
        prop_assert!((uniform_sphere_density(w) * 4.0 * PI - 1.0).abs() < 1e-15);
        prop_assert_eq!(disk_density(p) > 0.0, p.length_squared() <= 1.0);
    }

    #[test]
    fn the_mean_is_linear_and_exact_for_constants(c in -1e6..1e6f64, seed in any::<u64>()) {
        let constant = mean(|_: [f64; 3]| c, &sampling(seed)).expect("finite");
        prop_assert!((constant.value - c).abs() <= 1e-12 * c.abs(), "{:?}", constant);
        let spent = Sampling { tolerance: 0.0, ..sampling(seed) };
        let once = mean(|[x, y]: [f64; 2]| x * y, &spent).expect("finite");
        let scaled = mean(|[x, y]: [f64; 2]| c * x * y, &spent).expect("finite");
        prop_assert!((scaled.value - c * once.value).abs() <= 1e-12 * c.abs());
        prop_assert!((scaled.error - c.abs() * once.error).abs() <= 1e-9 * c.abs());
        prop_assert_eq!(once.points, 1024);
    }

    #[test]
    fn the_maximum_is_a_value_and_no_explored_point_is_higher(centre in uniform4(-0.5..1.5f64), steep in 0.1..100.0f64) {
        let f = |p: [f64; 4]| -steep * p.iter().zip(centre).map(|(a, b)| (a - b).abs()).sum::<f64>();
        let calls = Cell::new(0);
        let counted = |p| {
            calls.set(calls.get() + 1);
            f(p)
        };
        let top = maximize(counted, &search()).expect("finite");
        prop_assert_eq!(top.evaluations, calls.get());
        prop_assert_eq!(f(top.at), top.value);
        prop_assert!(top.at.iter().all(|x| (0.0..=1.0).contains(x)));
        prop_assert!(top.evaluations >= 60 && top.evaluations <= 60 + 3 * 400);
        for p in Halton::new().points_from(NonZeroU32::MIN).take(60) {
            prop_assert!(f(p) <= top.value);
        }
    }

    #[test]
    fn albedos_of_lambert_are_its_reflectance(rho in 0.0..2.0f32, w in unit_vector(), x in square(), seed in any::<u64>()) {
        let f = move |_: Vec2, _: Vec3, _: Vec3| rho / std::f32::consts::PI;
        let wi = w.with_z(w.z.abs());
        let s = sampling(seed);
        for estimate in [directional(&f, x, wi, &s), averaged(&f, wi, &s), bihemispherical(&f, x, &s)] {
            let e = estimate.expect("valid");
            prop_assert!((e.value - f64::from(rho)).abs() <= 2e-7 * f64::from(rho), "{:?}", e);
        }
        let quick = albedo(|_, _| rho / std::f32::consts::PI, NonZeroU32::new(9).expect("not 0"));
        prop_assert!((quick - rho).abs() <= 5e-7 * rho, "{}", quick);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    #[test]
    fn scaling_the_function_scales_the_factor_inversely(scale in 1e-3..1e3f64, tilt in 0.0..1.0f64) {
        let options = Options { search: search(), ..Options::default() };
        let albedo = move |x: DVec2, w: DVec3| (1.0 + x.x * tilt) * (0.2 + tilt * w.z);
        let calls = Cell::new(0);
        let counted = |x, w| {
            calls.set(calls.get() + 1);
            albedo(x, w)
        };
        let n = Normalization::pointwise(counted, &options).expect("valid");
        prop_assert_eq!(n.evaluations, calls.get());
        let m = Normalization::pointwise(|x, w| scale * albedo(x, w), &options).expect("valid");
        prop_assert!((n.factor - scale * m.factor).abs() <= 1e-9 * n.factor);
        prop_assert!(n.lower_bound <= n.max_albedo && n.max_albedo <= n.upper_bound);
        let segment = Normalization::segment(|w| 0.5 * (albedo(DVec2::ZERO, w) + albedo(DVec2::X, w)), &options);
        prop_assert!(segment.expect("valid").factor >= 0.99 * n.factor);
    }

    #[test]
    fn a_table_is_within_its_error_and_below_its_maximum(
        [a, b, c, d] in uniform4(0.0..0.5f64), rows in 8u32..32, w in unit_vector(), x in square()
    ) {
        // Never negative, with a bend at z = d and no symmetry.
        let albedo = |w: DVec3| 0.5 + 0.5 * a * w.x - 0.4 * b * w.y + c * (w.z - d).abs();
        let f = move |_: Vec2, wi: Vec3, _: Vec3| (albedo(wi.as_dvec3()) / PI) as f32;
        let at_most = NonZeroU32::new(rows).expect("from 8");
        let resolution = Resolution { tolerance: 0.0, at_most };
        for x in [Some(x), None] {
            let table = AlbedoTable::of(&f, x, &sampling(0), &resolution).expect("valid");
            let up = w.with_z(w.z.abs());
            prop_assert!((table.at(up) - albedo(up)).abs() <= table.error(), "{}", up);
            prop_assert!(table.at(up) <= table.max() * (1.0 + 1e-12));
            let mean = table.mean();
            // (1/π) ∫ |cos θ − d| cos θ dw = 2/3 − d + 2d³/3.
            let exact = 0.5 + c * (2.0 / 3.0 - d + 2.0 * d.powi(3) / 3.0);
            prop_assert!((mean.value - exact).abs() <= mean.error, "{:?}, exact {}", mean, exact);
        }
    }

    #[test]
    fn no_mode_fails_on_a_valid_function(rho in 0.0..3.0f32, seed in any::<u64>(), cos_power in 0i32..4) {
        let f = move |_: Vec2, wi: Vec3, wo: Vec3| rho * (wi.z * wo.z).powi(cos_power);
        let options = Options { search: search(), ..Options::default() };
        for mode in [Mode::Pointwise, Mode::Segment, Mode::None] {
            let n = Normalization::of(&f, mode, &sampling(seed), &options).expect("valid");
            prop_assert!(n.factor.is_finite() && n.factor > 0.0);
            prop_assert!(n.lower_bound <= n.upper_bound);
        }
    }
}
