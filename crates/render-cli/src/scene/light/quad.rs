//! A rectangle drawn by solid angle.

use std::f32::consts::PI;

use glam::{DVec2, DVec3, Vec2, Vec3};

use super::{LightAhead, LightSample};
use crate::scene::drape::RectangleLight;

/// A rectangle that shines evenly from one side, drawn evenly by solid angle where it is near:
/// samples drawn evenly by area are of very different weight from there. It casts no shadow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quad {
    radiance: Vec3,
    centre: DVec3,
    /// Unit vectors along both edges and to the side that shines.
    axes: [DVec3; 3],
    /// Half of both sides, metres.
    half: DVec2,
}

/// A rectangle as it looks from a point before its plane: x and y run along its edges from the
/// foot of the point in the plane.
struct View {
    low: DVec2,
    high: DVec2,
    /// Of the point above the plane, metres.
    height: f64,
}

/// The directions to a rectangle, in slices across x.
#[derive(Clone, Copy)]
struct Solid {
    /// ψ at the first slice, rad.
    start: f64,
    /// Of all slices, sr.
    angle: f64,
}

/// Ratio of the squares of the greatest and the least distance up to which a rectangle is drawn by
/// area: the density, d³ over height and area, changes by no more than a factor of 2, and the
/// weights of samples have a relative variance below 0.04. That is cheaper, and exact however small
/// the solid angle.
const FAR_RATIO: f64 = 1.6;

/// Solid angle, sr, of slivers that are drawn by area too, since the sums have lost half their
/// digits.
const SLIVER: f64 = 1e-8;

impl Quad {
    /// The light of `shape`, which `radiance`, linear RGB, leaves.
    pub fn new(shape: RectangleLight, radiance: Vec3) -> Self {
        let [u, v] = [shape.half_u, shape.half_v].map(Vec3::as_dvec3);
        let axes = [u, v, u.cross(v)].map(DVec3::normalize_or_zero);
        let half = DVec2::new(u.length(), v.length());
        Self { radiance, centre: shape.centre.as_dvec3(), axes, half }
    }

    /// See [`Light::sample`](super::Light::sample).
    pub(super) fn sample(&self, position: Vec3, square: Vec2) -> Option<LightSample> {
        let view = self.view(position)?;
        let solid = view.solid();
        let place = match solid {
            Some(solid) => view.place(square.as_dvec2(), solid),
            None => view.low + square.as_dvec2() * (view.high - view.low),
        };
        let [x, y, z] = self.axes;
        let offset = x * place.x + y * place.y - z * view.height;
        let (direction, distance) = offset.normalize_and_length();
        let density = self.density(&view, solid, distance);
        Some(LightSample {
            direction: direction.as_vec3(),
            distance: distance as f32,
            irradiance: self.radiance * density.recip() as f32,
            density: density as f32,
        })
    }

    /// See [`Light::ahead`](super::Light::ahead).
    pub(super) fn ahead(&self, origin: Vec3, direction: Vec3) -> Option<LightAhead> {
        let view = self.view(origin)?;
        let [x, y, z] = self.axes.map(|axis| axis.dot(direction.as_dvec3()));
        let distance = view.height / -z;
        let place = DVec2::new(x, y) * distance;
        let is_within = place.cmpge(view.low).all() && place.cmple(view.high).all();
        (z < 0.0 && is_within).then(|| LightAhead {
            distance: distance as f32,
            density: self.density(&view, view.solid(), distance) as f32,
            radiance: self.radiance,
        })
    }

    /// π A L.
    pub(super) fn power(&self) -> Vec3 {
        self.radiance * (PI * self.area() as f32)
    }

    fn area(&self) -> f64 {
        4.0 * self.half.x * self.half.y
    }

    /// By solid angle 1/Ω, or by area d²/(A cos θ) with cos θ = height/d (Pharr, Jakob & Humphreys
    /// 2023, section 4.2.3).
    fn density(&self, view: &View, solid: Option<Solid>, distance: f64) -> f64 {
        match solid {
            Some(solid) => solid.angle.recip(),
            None => distance.powi(3) / (self.area() * view.height),
        }
    }

    /// `None` from behind and for a rectangle without area.
    fn view(&self, position: Vec3) -> Option<View> {
        let offset = self.centre - position.as_dvec3();
        let [x, y, z] = self.axes.map(|axis| axis.dot(offset));
        let centre = DVec2::new(x, y);
        let (low, high) = (centre - self.half, centre + self.half);
        (z < 0.0 && self.area() > 0.0).then_some(View { low, high, height: -z })
    }
}

impl View {
    /// How the rectangle divides the directions, where it is drawn by them.
    ///
    /// ```text
    /// Ω = ψ(x₁) − ψ(x₀),  ψ(x) = A(x, y₁) − A(x, y₀),  A(x, y) = atan(x y / (h √(x² + y² + h²)))
    /// ```
    ///
    /// The mixed derivative of A is h/(x² + y² + h²)^(3/2), the solid angle of a unit of area.
    fn solid(&self) -> Option<Solid> {
        let Self { low, high, height } = *self;
        let nearest = DVec2::ZERO.clamp(low, high).length_squared() + height * height;
        let furthest = low.abs().max(high.abs()).length_squared() + height * height;
        if furthest <= FAR_RATIO * nearest {
            return None;
        }
        // atan(a/b) − atan(c/d) = atan2(ad − bc, bd + ac) for positive b and d.
        let strip = |x: f64| {
            let [b, d] = [high.y, low.y].map(|y| height * (x * x + y * y + height * height).sqrt());
            let [a, c] = [x * high.y, x * low.y];
            (a * d - b * c).atan2(b * d + a * c)
        };
        let start = strip(low.x);
        let angle = strip(high.x) - start;
        (angle > SLIVER).then_some(Solid { start, angle })
    }

    /// The place in the plane for `square` in [0, 1]²: all parts of the solid angle are equally
    /// likely (Ureña, Fajardo & King 2013).
    ///
    /// With the sines σ = x/√(x² + h²) and e = y/√(y² + h²), A is asin(σ e). So ψ is inverted by the
    /// addition theorem, sin(asin(σ e₀) + ψ) = σ e₁:
    ///
    /// ```text
    /// σ = sin ψ / √(e₀² + e₁² − 2 e₀ e₁ cos ψ)
    /// ```
    ///
    /// Across, in a strip at distance d = √(x² + h²) from the point, the solid angle is even in
    /// y/√(y² + d²).
    fn place(&self, square: DVec2, solid: Solid) -> DVec2 {
        let Self { low, high, height } = *self;
        let sine =
            |length: f64, distance: f64| length / (length * length + distance * distance).sqrt();
        let tangent = |sine: f64| sine / ((1.0 - sine) * (1.0 + sine)).max(0.0).sqrt();

        let (e_low, e_high) = (sine(low.y, height), sine(high.y, height));
        let (sin, cos) = (0.5 * (solid.start + square.x * solid.angle)).sin_cos();
        let chord_squared = (e_high - e_low).powi(2) + 4.0 * e_low * e_high * sin * sin;
        let sigma = 2.0 * sin * cos / chord_squared.sqrt();
        // What rounds to beyond a border, even to infinity, belongs on it.
        let x = (height * tangent(sigma)).max(low.x).min(high.x);

        let distance = (x * x + height * height).sqrt();
        let (tau_low, tau_high) = (sine(low.y, distance), sine(high.y, distance));
        let tau = tau_low + square.y * (tau_high - tau_low);
        let y = (distance * tangent(tau)).max(low.y).min(high.y);
        DVec2::new(x, y)
    }
}
