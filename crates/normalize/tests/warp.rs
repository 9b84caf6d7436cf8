//! Each map against its density: the density integrates to 1, mapped points follow it.

use std::f64::consts::{PI, TAU};

use selvedge_normalize::{
    glam::{DVec2, DVec3},
    warp::*,
};

/// Equally likely numbers in [0, 1) for statistics: hashes of a counter, not a low-discrepancy set,
/// whose χ² would be far too small to test anything.
fn uniform(counter: u64) -> f64 {
    let mut z = counter.wrapping_mul(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
}

fn squares() -> impl Iterator<Item = DVec2> {
    (1..=200_000).map(|i| DVec2::new(uniform(2 * i), uniform(2 * i + 1)))
}

/// χ² of the points against the expected shares of the boxes, and its 99.9 % quantile
/// (Wilson & Hilferty's approximation).
fn chi_squared(hits: &[f64], expected: &[f64]) -> (f64, f64) {
    let chi_sq = hits.iter().zip(expected).map(|(h, e)| (h - e).powi(2) / e).sum();
    let k = (hits.len() - 1) as f64;
    let quantile = k * (1.0 - 2.0 / (9.0 * k) + 3.0902 * (2.0 / (9.0 * k)).sqrt()).powi(3);
    (chi_sq, quantile)
}

const ROWS: usize = 12;
const COLUMNS: usize = 16;

/// Midpoint integrals of the density over boxes of equal z and φ; z runs from `lowest` to 1.
fn shares(density: fn(DVec3) -> f64, lowest: f64) -> Vec<f64> {
    let n = 40;
    let mut shares = vec![0.0; ROWS * COLUMNS];
    for (row, column) in (0..ROWS * n).flat_map(|r| (0..COLUMNS * n).map(move |c| (r, c))) {
        let z = lowest + (1.0 - lowest) * (row as f64 + 0.5) / (ROWS * n) as f64;
        let phi = TAU * (column as f64 + 0.5) / (COLUMNS * n) as f64;
        let w = (DVec2::from_angle(phi) * (1.0 - z * z).sqrt()).extend(z);
        let solid_angle = (1.0 - lowest) * TAU / (ROWS * n * COLUMNS * n) as f64;
        shares[row / n * COLUMNS + column / n] += density(w) * solid_angle;
    }
    shares
}

#[test]
fn directions_follow_their_densities() {
    type Row = (&'static str, fn(DVec2) -> DVec3, fn(DVec3) -> f64, f64);
    let maps: [Row; 3] = [
        ("cosine hemisphere", square_to_cosine_hemisphere, cosine_hemisphere_density, 0.0),
        ("uniform hemisphere", square_to_uniform_hemisphere, uniform_hemisphere_density, 0.0),
        ("uniform sphere", square_to_uniform_sphere, uniform_sphere_density, -1.0),
    ];
    for (name, map, density, lowest) in maps {
        let shares = shares(density, lowest);
        let total: f64 = shares.iter().sum();
        assert!((total - 1.0).abs() < 1e-9, "{name}: the density integrates to {total}");
        let mut hits = vec![0.0; ROWS * COLUMNS];
        let mut points = 0.0;
        for square in squares() {
            let w = map(square);
            assert!((w.length() - 1.0).abs() < 1e-14 && w.z >= lowest, "{name}: {square} to {w}");
            let row = ((w.z - lowest) / (1.0 - lowest) * ROWS as f64) as usize;
            let column = (w.truncate().to_angle().rem_euclid(TAU) / TAU * COLUMNS as f64) as usize;
            hits[row.min(ROWS - 1) * COLUMNS + column.min(COLUMNS - 1)] += 1.0;
            points += 1.0;
        }
        let expected: Vec<f64> = shares.iter().map(|share| share * points).collect();
        let (chi_sq, quantile) = chi_squared(&hits, &expected);
        assert!(chi_sq < quantile, "{name}: chi squared {chi_sq}, 99.9 % quantile {quantile}");
    }
}

#[test]
fn the_disk_is_filled_evenly() {
    let mut hits = vec![0.0; ROWS * COLUMNS];
    for square in squares() {
        let p = square_to_disk(square);
        assert!(p.length() <= 1.0 + 1e-15, "{square} to {p}");
        let row = (p.length_squared() * ROWS as f64) as usize;
        let column = (p.to_angle().rem_euclid(TAU) / TAU * COLUMNS as f64) as usize;
        hits[row.min(ROWS - 1) * COLUMNS + column.min(COLUMNS - 1)] += 1.0;
    }
    let points: f64 = hits.iter().sum();
    let (chi_sq, quantile) = chi_squared(&hits, &vec![points / hits.len() as f64; hits.len()]);
    assert!(chi_sq < quantile, "chi squared {chi_sq}, 99.9 % quantile {quantile}");
    // Over the square around the disk: the density is 1/π on an area of π.
    let n = 2000;
    let inside = (0..n * n).map(|i| {
        DVec2::new(f64::from(i % n) + 0.5, f64::from(i / n) + 0.5) * (2.0 / f64::from(n)) - 1.0
    });
    let total: f64 = inside.map(disk_density).sum::<f64>() * 4.0 / f64::from(n * n);
    assert!((total - 1.0).abs() < 1e-4, "the disk density integrates to {total}");
}

#[test]
fn landmarks_go_where_the_docs_say() {
    let (centre, corner, edge) = (DVec2::splat(0.5), DVec2::ONE, DVec2::new(1.0, 0.5));
    assert_eq!(square_to_disk(centre), DVec2::ZERO);
    assert_eq!(square_to_disk(edge), DVec2::X);
    assert!(square_to_disk(corner).distance(DVec2::splat(0.5f64.sqrt())) < 1e-15);
    for map in [square_to_cosine_hemisphere, square_to_uniform_hemisphere, square_to_uniform_sphere]
    {
        assert_eq!(map(centre), DVec3::Z);
    }
    assert_eq!(square_to_cosine_hemisphere(edge), DVec3::X);
    assert_eq!(square_to_uniform_hemisphere(edge), DVec3::X);
    assert_eq!(square_to_uniform_sphere(edge), DVec3::NEG_Z);
    assert!(
        square_to_uniform_sphere(uniform_sphere_to_square(DVec3::NEG_Z)).distance(DVec3::NEG_Z)
            < 1e-15
    );
    assert_eq!(disk_density(DVec2::new(0.8, 0.7)), 0.0);
    assert_eq!(
        [cosine_hemisphere_density(DVec3::NEG_Z), uniform_hemisphere_density(DVec3::NEG_Z)],
        [0.0; 2]
    );
    assert!((cosine_hemisphere_density(DVec3::Z) * PI - 1.0).abs() < 1e-15);
}

#[test]
fn the_inverse_of_the_sphere_is_accurate_near_both_poles() {
    for tilt in [1e-3, 1e-6, 1e-9] {
        for sign in [1.0, -1.0] {
            let w = DVec3::new(0.6 * tilt, -0.8 * tilt, sign * (1.0 - tilt * tilt).sqrt());
            let back = square_to_uniform_sphere(uniform_sphere_to_square(w));
            // At −z the square's border is one point, so a rounding of 2⁻⁵³ in the square is one of
            // about its root on the sphere.
            let tolerance = if sign > 0.0 { 1e-15 } else { 1e-16 / tilt + 4e-8 };
            assert!(w.distance(back) < tolerance, "{w} to {back}, tolerance {tolerance}");
        }
    }
}
