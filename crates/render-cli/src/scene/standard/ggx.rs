//! Mirrors too small to see, with the slopes of Trowbridge & Reitz (GGX).

use std::f32::consts::{PI, TAU};

use glam::{Vec2, Vec3};

/// Facets of a surface whose mean normal is z. Their roughness along x and y is α: the ellipsoid
/// with the half axes 1/α, 1/α and 1 has as much area of each normal (Heitz 2014).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Ggx {
    alpha: Vec2,
}

/// Least α: the directions of f32 resolve a lobe of that width to a thousandth.
const LEAST_ALPHA: f32 = 1e-4;

impl Ggx {
    /// With α the square of `roughness` in [0, 1], stretched by `anisotropy` in [−1, 1]: rougher
    /// along x where positive, up to ten times (Burley 2012).
    pub(super) fn new(roughness: f32, anisotropy: f32) -> Self {
        let alpha = roughness * roughness;
        let aspect = (1.0 - 0.9 * anisotropy.abs()).sqrt();
        let (rougher, smoother) = (alpha / aspect, alpha * aspect);
        let alpha = if anisotropy >= 0.0 {
            Vec2::new(rougher, smoother)
        } else {
            Vec2::new(smoother, rougher)
        };
        Self { alpha: alpha.map(|alpha| alpha.clamp(LEAST_ALPHA, 1.0)) }
    }

    /// The lesser α.
    pub(super) fn least_alpha(self) -> f32 {
        self.alpha.min_element()
    }

    /// What facets without loss reflect, in sr⁻¹, by those with the normal `h`, the half vector.
    ///
    /// ```text
    /// D(h) G₂(wi, wo) / (4 cos θi cos θo) = D(h) / (2 (s(wi) cos θo + s(wo) cos θi))
    /// ```
    ///
    /// with G₂ = 1/(1 + Λ(wi) + Λ(wo)), which knows that high facets are seen and lit more (Heitz
    /// 2014), and Λ(w) = (s(w)/cos θ − 1)/2, s(w) = |(αx x, αy y, z)|.
    pub(super) fn reflection(self, h: Vec3, wi: Vec3, wo: Vec3) -> f32 {
        let shadowing = self.stretched(wi).length() * wo.z + self.stretched(wo).length() * wi.z;
        self.normals(h) / (2.0 * shadowing)
    }

    /// Density, sr⁻¹, of the mirror images of `wo` in the facets of [`Ggx::visible_normal`]:
    ///
    /// ```text
    /// G₁(wo) D(h) / (4 cos θo) = D(h) / (2 (cos θo + s(wo)))
    /// ```
    ///
    /// (Heitz 2018).
    pub(super) fn reflection_density(self, h: Vec3, wo: Vec3) -> f32 {
        self.normals(h) / (2.0 * (wo.z + self.stretched(wo).length()))
    }

    /// The normal of a facet that is seen from `wo`, each as likely as its part in the view (Heitz
    /// 2018), for `square` in [0, 1]².
    ///
    /// The facets stretched to a sphere mirror `wo` evenly into the cap of directions above −wo
    /// (Dupuy & Benyoub 2023); the half vector, stretched back, is the normal.
    pub(super) fn visible_normal(self, wo: Vec3, square: Vec2) -> Vec3 {
        let wo = self.stretched(wo).normalize();
        let z = 1.0 - square.y * (1.0 + wo.z);
        let across = Vec2::from_angle(TAU * square.x) * ((1.0 - z) * (1.0 + z)).max(0.0).sqrt();
        let half = across.extend(z) + wo;
        Vec3::new(self.alpha.x * half.x, self.alpha.y * half.y, half.z.max(0.0))
            .try_normalize()
            .unwrap_or(Vec3::Z)
    }

    /// D(h) = 1/(π αx αy (x²/αx² + y²/αy² + z²)²), sr⁻¹ (Heitz 2014).
    fn normals(self, h: Vec3) -> f32 {
        let slope = h.truncate() / self.alpha;
        let sum = slope.length_squared() + h.z * h.z;
        1.0 / (PI * self.alpha.element_product() * sum * sum)
    }

    fn stretched(self, w: Vec3) -> Vec3 {
        Vec3::new(self.alpha.x * w.x, self.alpha.y * w.y, w.z)
    }
}
