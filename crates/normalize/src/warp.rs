//! Maps from the unit square to the disk, the hemisphere and the sphere, each beside its density
//! and its inverse.
//!
//! Every map takes evenly spread points to points spread with its density: an integral is the mean
//! of `f / density` over the mapped points. All are built on the concentric disk, which keeps
//! neighbours together and has no seam. Directions are unit vectors in the shading frame, z the
//! normal; the hemisphere is z ≥ 0.

use core::f64::consts::{FRAC_1_PI, FRAC_PI_2, FRAC_PI_4};

use glam::{DVec2, DVec3};

/// Point of the unit disk for `square` in [0, 1]²; areas keep their ratio.
///
/// Concentric squares become concentric circles (Shirley & Chiu 1997). The centre goes to the
/// centre, the border to the border.
#[must_use]
pub fn square_to_disk(square: DVec2) -> DVec2 {
    let p = 2.0 * square - DVec2::ONE;
    let (radius, angle) = if p == DVec2::ZERO {
        return DVec2::ZERO;
    } else if p.x.abs() > p.y.abs() {
        (p.x, FRAC_PI_4 * (p.y / p.x))
    } else {
        (p.y, FRAC_PI_2 - FRAC_PI_4 * (p.x / p.y))
    };
    radius * DVec2::from_angle(angle)
}

/// Inverse of [`square_to_disk`]; a point outside the disk goes to the border of the square.
#[must_use]
pub fn disk_to_square(disk: DVec2) -> DVec2 {
    let radius = disk.length();
    // The angle from the nearest half axis, in units of an eighth of the circle, is the other coordinate.
    let eighth = |along: f64, across: f64| radius * (across.abs().atan2(along.abs()) / FRAC_PI_4);
    let p = if disk.x.abs() > disk.y.abs() {
        DVec2::new(radius.copysign(disk.x), eighth(disk.x, disk.y).copysign(disk.y))
    } else {
        DVec2::new(eighth(disk.y, disk.x).copysign(disk.x), radius.copysign(disk.y))
    };
    (0.5 * (p + DVec2::ONE)).clamp(DVec2::ZERO, DVec2::ONE)
}

/// Density of [`square_to_disk`] with respect to area: 1/π inside the unit disk, 0 outside.
#[must_use]
pub fn disk_density(disk: DVec2) -> f64 {
    if disk.length_squared() <= 1.0 { FRAC_1_PI } else { 0.0 }
}

/// Direction with a density proportional to its cosine: the disk lifted onto the hemisphere.
///
/// (Malley's method; Pharr, Jakob & Humphreys 2023, section A.5.3.)
#[must_use]
pub fn square_to_cosine_hemisphere(square: DVec2) -> DVec3 {
    let p = square_to_disk(square);
    p.extend((1.0 - p.length_squared()).max(0.0).sqrt())
}

/// Inverse of [`square_to_cosine_hemisphere`], for a unit vector with z ≥ 0.
#[must_use]
pub fn cosine_hemisphere_to_square(w: DVec3) -> DVec2 {
    disk_to_square(w.truncate())
}

/// Density of [`square_to_cosine_hemisphere`] in sr⁻¹: `max(cos θ, 0)/π`.
#[must_use]
pub fn cosine_hemisphere_density(w: DVec3) -> f64 {
    w.z.max(0.0) * FRAC_1_PI
}

/// Direction of the hemisphere, all equally likely: `z = 1 − r²` for the disk's radius r.
#[must_use]
pub fn square_to_uniform_hemisphere(square: DVec2) -> DVec3 {
    let p = square_to_disk(square);
    let r_sq = p.length_squared().min(1.0);
    (p * (2.0 - r_sq).sqrt()).extend(1.0 - r_sq)
}

/// Inverse of [`square_to_uniform_hemisphere`], for a unit vector with z ≥ 0.
#[must_use]
pub fn uniform_hemisphere_to_square(w: DVec3) -> DVec2 {
    disk_to_square(w.truncate() / (1.0 + w.z.max(0.0)).sqrt())
}

/// Density of [`square_to_uniform_hemisphere`] in sr⁻¹: 1/2π for z ≥ 0, else 0.
#[must_use]
pub fn uniform_hemisphere_density(w: DVec3) -> f64 {
    if w.z >= 0.0 { 0.5 * FRAC_1_PI } else { 0.0 }
}

/// Direction of the sphere, all equally likely: `z = 1 − 2r²` for the disk's radius r.
///
/// The centre of the square goes to +z and its whole border to −z.
#[must_use]
pub fn square_to_uniform_sphere(square: DVec2) -> DVec3 {
    let p = square_to_disk(square);
    let r_sq = p.length_squared().min(1.0);
    (p * (2.0 * (1.0 - r_sq).sqrt())).extend(1.0 - 2.0 * r_sq)
}

/// Inverse of [`square_to_uniform_sphere`], for a unit vector; −z goes to one point of the border.
#[must_use]
pub fn uniform_sphere_to_square(w: DVec3) -> DVec2 {
    let across = w.truncate();
    // Above the equator 1 − z cancels, below it 1 + z does: take each from the other side.
    let radius_per_length = if w.z >= 0.0 {
        (2.0 * (1.0 + w.z)).sqrt().recip()
    } else {
        (0.5 * (1.0 - w.z)).sqrt() / across.length()
    };
    let disk = across * radius_per_length;
    disk_to_square(if disk.is_finite() { disk } else { DVec2::X })
}

/// Density of [`square_to_uniform_sphere`] in sr⁻¹: 1/4π.
#[must_use]
pub fn uniform_sphere_density(_w: DVec3) -> f64 {
    0.25 * FRAC_1_PI
}
