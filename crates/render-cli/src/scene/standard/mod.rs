//! The material that pictures are painted for: a coloured ground under a glossy coat.
//!
//! What cloth is compared with: every parameter may be a picture.

mod ggx;

use std::{f32::consts::FRAC_1_PI, sync::Arc};

use glam::{Mat3, Vec2, Vec3};
use selvedge_normalize::warp::square_to_cosine_hemisphere;
use selvedge_yarn_brdf::Sample;

use self::ggx::Ggx;
use super::texture::MipTexture;

/// A Lambertian ground under facets of Trowbridge & Reitz (GGX), alike on both sides.
///
/// ```text
/// f = F(wi · h) D(h) G₂(wi, wo) / (4 cos θi cos θo)
///   + ρ/π (1 − E(wi)) (1 − E(wo)) / (1 − Ē)
/// ```
///
/// F is the reflectance of Schlick (1994). E bounds the directional albedo of the facets from above
/// and Ē its mean over directions from below, so the ground gets what the coat leaves and no more
/// (Kelemen & Szirmay-Kalos 2001): the whole never reflects more than it receives. Light
/// that the facets reflect to and fro is lost: with α = 1, 0.7 of what a perfect mirror would reflect
/// upright. A white ground under a coat of 0.04 loses 0.6 % (smooth) to 4.7 % (α = 1) of diffuse
/// light, and 18 % at most, at grazing angles.
#[derive(Clone, Debug, PartialEq)]
pub struct Standard {
    /// Reflectance ρ of the ground, linear, in [0, 1].
    pub base_color: Input,
    /// The normal in the shading frame, halved and shifted by 0.5 in each component: x along u, y
    /// along v (which points up in the picture), z out of the surface.
    pub normal: Input,
    /// Square root of α, in [0, 1].
    pub roughness: Input,
    /// Reflectance F₀ of the facets upright, linear, in [0, 1]; 0.04 for plastics and varnish.
    pub specular: Input,
    /// How much rougher along u than along v, in [−1, 1]; in a picture halved and shifted by 0.5.
    pub anisotropy: Input,
}

/// A parameter, the same everywhere or a picture. Numbers are its first component.
#[derive(Clone, Debug, PartialEq)]
pub enum Input {
    /// The same everywhere.
    Constant(Vec3),
    /// Looked up.
    Texture(Arc<MipTexture>),
}

impl Default for Standard {
    /// Grey plastic, flat, moderately rough.
    fn default() -> Self {
        Self {
            base_color: Input::Constant(Vec3::splat(0.5)),
            normal: Input::Constant(Vec3::new(0.5, 0.5, 1.0)),
            roughness: Input::Constant(Vec3::splat(0.5)),
            specular: Input::Constant(Vec3::splat(0.04)),
            anisotropy: Input::Constant(Vec3::ZERO),
        }
    }
}

impl Input {
    fn value(&self, uv: Vec2, footprint: [Vec2; 2]) -> Vec3 {
        match self {
            Self::Constant(value) => *value,
            Self::Texture(texture) => texture.value(uv, footprint),
        }
    }
}

impl Standard {
    /// Bytes of memory that its pictures take.
    pub fn bytes(&self) -> usize {
        let Self { base_color, normal, roughness, specular, anisotropy } = self;
        let inputs = [base_color, normal, roughness, specular, anisotropy].into_iter();
        inputs
            .map(|input| if let Input::Texture(texture) = input { texture.bytes() } else { 0 })
            .sum()
    }

    /// The material at `uv`, its parameters averaged over `footprint` as by [`MipTexture::value`].
    /// What is out of range is moved to its limit; what is not a number counts as 0.
    pub fn at(&self, uv: Vec2, footprint: [Vec2; 2]) -> StandardPoint {
        let value = |input: &Input| {
            let value = input.value(uv, footprint);
            value.map(|number| if number.is_nan() { 0.0 } else { number })
        };
        let unit = |input: &Input| value(input).clamp(Vec3::ZERO, Vec3::ONE);
        let specular = unit(&self.specular);
        // Not even glass reflects less than 0.02 upright: a coat that does is fading away.
        let grazing = (50.0 * specular.max_element()).min(1.0);
        let roughness = unit(&self.roughness).x;
        let anisotropy = value(&self.anisotropy).x;
        let anisotropy = match &self.anisotropy {
            Input::Constant(_) => anisotropy.clamp(-1.0, 1.0),
            Input::Texture(_) => (2.0 * anisotropy - 1.0).clamp(-1.0, 1.0),
        };
        StandardPoint {
            ground: unit(&self.base_color),
            specular,
            grazing: Vec3::splat(grazing) - specular,
            facets: Ggx::new(roughness, anisotropy),
            normal: upward(2.0 * value(&self.normal) - 1.0),
        }
    }
}

/// Least cosine of a normal from a picture to the shading normal, and of the direction it is seen
/// from to the normal.
const LEAST_COSINE: f32 = 0.01;

/// Of unit length and not below the surface.
fn upward(normal: Vec3) -> Vec3 {
    let normal = normal.normalize_or(Vec3::Z);
    normal.with_z(normal.z.max(LEAST_COSINE)).normalize()
}

/// A [`Standard`] material at one place.
///
/// All directions are unit vectors in the shading frame, away from the surface: `wi` to the light,
/// `wo` to the viewer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StandardPoint {
    ground: Vec3,
    /// F₀, and how much more the facets reflect at grazing angles.
    specular: Vec3,
    grazing: Vec3,
    facets: Ggx,
    /// Unit length, in the shading frame.
    normal: Vec3,
}

/// Cosine below which a direction is along the surface: f32 does not tell its sign.
const EDGE_ON: f32 = 1e-6;

/// Least share of samples for a lobe that reflects anything.
const LEAST_SHARE: f32 = 0.1;

/// Factors of the bound on the albedo: as large as they can be.
const BOUND_COSINE: f32 = 0.94;
const BOUND_ALPHA: f32 = 7.0;

impl StandardPoint {
    /// f in sr⁻¹, without the cosine: finite, at least 0, and 0 where the directions are on different
    /// sides of the surface or `wi` is behind the normal of the picture.
    ///
    /// f is that of a surface with the normal n of the picture times wi · n over cos θi, so that the
    /// cosine of the shading frame gives what such a surface reflects. That is not reciprocal, like
    /// all that bends normals (Veach 1997, section 5.3); where n is the shading normal it is.
    pub fn eval(&self, wi: Vec3, wo: Vec3) -> Vec3 {
        let [ground, facets] = self.eval_lobes(wi, wo);
        ground + facets
    }

    /// What the ground and the facets have in [`StandardPoint::eval`].
    pub fn eval_lobes(&self, wi: Vec3, wo: Vec3) -> [Vec3; 2] {
        let both = Frame::new(self.normal, wo).and_then(|frame| Some((frame.lit(wi)?, frame)));
        both.map_or([Vec3::ZERO; 2], |(lit, frame)| {
            let lobes = [self.scattered(lit.z, frame.wo.z), self.mirrored(lit, frame.wo)];
            lobes.map(|lobe| lobe * (lit.z / wi.z.abs()))
        })
    }

    /// About the share of white light from all around that is reflected to `wo`.
    pub fn albedo(&self, wo: Vec3) -> Vec3 {
        let left = self.left(self.bound(wo.z.abs()));
        self.ground * left + (Vec3::ONE - left)
    }

    /// The density with which [`StandardPoint::sample`] draws `wi`, sr⁻¹.
    pub fn pdf(&self, wi: Vec3, wo: Vec3) -> f32 {
        let both = Frame::new(self.normal, wo).and_then(|frame| Some((frame.lit(wi)?, frame.wo)));
        both.map_or(0.0, |(wi, wo)| self.density(wi, wo))
    }

    /// A direction for light to `wo`, by the three numbers `xi` in [0, 1). `None` for one that gets
    /// below the surface.
    ///
    /// Facets by what is seen of them, the ground by the cosine, each as often as it reflects.
    pub fn sample(&self, wo: Vec3, xi: [f32; 3]) -> Option<Sample> {
        let frame = Frame::new(self.normal, wo)?;
        let square = Vec2::new(xi[1], xi[2]);
        let wi = if xi[0] < self.specular_share(frame.wo) {
            let h = self.facets.visible_normal(frame.wo, square);
            2.0 * frame.wo.dot(h) * h - frame.wo
        } else {
            square_to_cosine_hemisphere(square.as_dvec2()).as_vec3()
        };
        let wi = frame.to_shading(wi);
        let lit = frame.lit(wi)?;
        let pdf = self.density(lit, frame.wo);
        let weight = self.reflectance(lit, frame.wo) * (lit.z / pdf);
        (pdf > 0.0 && weight.is_finite()).then_some(Sample { wi, weight, pdf })
    }

    /// f for directions in the frame of the facets.
    fn reflectance(&self, wi: Vec3, wo: Vec3) -> Vec3 {
        self.mirrored(wi, wo) + self.scattered(wi.z, wo.z)
    }

    /// By the facets.
    fn mirrored(&self, wi: Vec3, wo: Vec3) -> Vec3 {
        let h = (wi + wo).normalize_or(Vec3::Z);
        let fresnel = self.specular + self.grazing * (1.0 - wi.dot(h).clamp(0.0, 1.0)).powi(5);
        fresnel * self.facets.reflection(h, wi, wo)
    }

    /// By the ground, for these cosines.
    fn scattered(&self, cos_i: f32, cos_o: f32) -> Vec3 {
        let left = self.left(self.bound(cos_i)) * self.left(self.bound(cos_o));
        // Of a mirror nothing is left, neither here nor there.
        let mean = self.left(self.mean_bound()).max(Vec3::splat(f32::MIN_POSITIVE));
        self.ground * FRAC_1_PI * left / mean
    }

    /// Of a direction in the frame of the facets, sr⁻¹.
    fn density(&self, wi: Vec3, wo: Vec3) -> f32 {
        let h = (wi + wo).normalize_or(Vec3::Z);
        let share = self.specular_share(wo);
        let mirrored = share * self.facets.reflection_density(h, wo);
        mirrored + (1.0 - share) * wi.z * FRAC_1_PI
    }

    /// The part of samples that is mirrored.
    fn specular_share(&self, wo: Vec3) -> f32 {
        let left = self.left(self.bound(wo.z));
        let mirrored = (Vec3::ONE - left).element_sum();
        let ground = (self.ground * left).element_sum();
        let share = mirrored / (mirrored + ground);
        if ground <= 0.0 {
            1.0
        } else if mirrored <= 0.0 {
            0.0
        } else {
            share.clamp(LEAST_SHARE, 1.0 - LEAST_SHARE)
        }
    }

    /// 1 − E where the facets reflect `bound` of what Schlick's factor adds at grazing angles.
    fn left(&self, bound: f32) -> Vec3 {
        Vec3::ONE - self.specular - self.grazing * bound
    }

    /// A bound on the mean of Schlick's (1 − wi · h)⁵ over the facets seen at the cosine `cos`.
    ///
    /// ```text
    /// B = s/(1 + 7 α s),  s = (1 − 0.94 cos θ)⁵
    /// ```
    ///
    /// Smooth facets have (1 − cos θ)⁵, rough ones turn towards the viewer and have less. Fitted to
    /// quadratures over α, anisotropy and angle: together with what facets reflect to and fro E is
    /// never below the albedo.
    fn bound(&self, cos: f32) -> f32 {
        let s = (1.0 - BOUND_COSINE * cos).max(0.0).powi(5);
        s / (1.0 + BOUND_ALPHA * self.facets.least_alpha() * s)
    }

    /// At most the mean 2 ∫ B(μ) μ dμ of the bound over diffuse light.
    ///
    /// 1/(1 + a s) is convex in s, so its mean weighted by s μ is at least its value at the mean 7/22
    /// of s (Jensen's inequality): with c = 0.94 and a = 7 α
    ///
    /// ```text
    /// 2 ∫ s μ dμ = 1/(21 c²),  2 ∫ s² μ dμ = 1/(66 c²),  B̄ = 1/(21 c² (1 + 7/22 a))
    /// ```
    fn mean_bound(&self) -> f32 {
        let smooth = 1.0 / (21.0 * BOUND_COSINE * BOUND_COSINE);
        smooth / (1.0 + 7.0 / 22.0 * BOUND_ALPHA * self.facets.least_alpha())
    }
}

/// The frame of the facets on the side that is seen.
struct Frame {
    /// To the shading frame, with z towards the viewer.
    axes: Mat3,
    /// 1 or −1: the side of the surface.
    side: f32,
    /// In the frame.
    wo: Vec3,
}

impl Frame {
    /// `None` where the surface is seen edge on.
    fn new(normal: Vec3, wo: Vec3) -> Option<Self> {
        let side = wo.z.signum();
        let wo = wo.with_z(wo.z.abs());
        if wo.z.is_nan() || wo.z < EDGE_ON {
            return None;
        }
        let axes = if normal == Vec3::Z { Mat3::IDENTITY } else { axes(leaning(normal, wo)) };
        let wo = axes.transpose() * wo;
        (wo.z >= EDGE_ON).then_some(Self { axes, side, wo })
    }

    /// A direction in the frame, if light from it arrives on the side of the viewer at surface and
    /// facets.
    fn lit(&self, wi: Vec3) -> Option<Vec3> {
        let wi = wi.with_z(wi.z * self.side);
        let in_frame = self.axes.transpose() * wi;
        (wi.z >= EDGE_ON && in_frame.z >= EDGE_ON).then_some(in_frame)
    }

    fn to_shading(&self, w: Vec3) -> Vec3 {
        let w = (self.axes * w).normalize();
        w.with_z(w.z * self.side)
    }
}

/// `normal`, turned towards `wo` until it can be seen.
fn leaning(normal: Vec3, wo: Vec3) -> Vec3 {
    let missing = (LEAST_COSINE - normal.dot(wo)).max(0.0);
    (normal + missing * wo).normalize()
}

/// Axes around a normal above the surface, x in the plane of the shading frame's x.
fn axes(normal: Vec3) -> Mat3 {
    let x = (Vec3::X - normal * normal.x).normalize_or(Vec3::NEG_Z);
    Mat3::from_cols(x, normal.cross(x), normal)
}

#[cfg(test)]
mod tests;
