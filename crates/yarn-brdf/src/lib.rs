//! Reflection from woven cloth: a weave and its yarns to a BRDF.
//!
//! The model is that of Nelson, McEvoy & Fratarcangeli 2016, built on Irawan & Marschner 2012. Every
//! crossing shows one of two yarns. Each visible piece of yarn, a [`Segment`], is a bent cylinder of
//! parallel fibres, twisted by ψ about the yarn; a fibre mirrors light into a cone, so at each point
//! of a segment the highlight is where the fibre tangent t satisfies `t·(wi + wo) = 0`:
//!
//! ```text
//! f = k a T + diffuse      T = f_c(phase) · A(attenuation) · G(geometry) · χ(window) / (δ w l)
//! ```
//!
//! That line is spread over the segment by a window χ or, with [`Highlight::Rough`], by fibres that
//! blur it themselves: then G χ / δ is a density M(t·wi, t·wo) at the point itself, whose mean over
//! the segment tends to the same as the blur goes to 0. The factor a makes the highlight reflect at most what it receives (equation 2), for every segment
//! or at every point.
//!
//! ```text
//!        y (along v, the warp)          yarn frame:  x across, y along, z = n
//!        ▲                              warp: as the shading frame
//!   pick 1 ──┼──┼──                     weft: (x, y, z) → (−y, x, z)
//!   pick 0 ──┼──┼──▶ x (along u, the weft)
//!        end 0  end 1
//! ```
//!
//! Data goes one way: a grid of crossings becomes a [`Weave`], with yarns a [`Cloth`], and
//! [`Cloth::prepare`] a [`Shader`].
//!
//! # Examples
//!
//! ```
//! use selvedge_yarn_brdf::{Cloth, Thread, Weave, Yarn, glam::{DVec2, Vec3}};
//!
//! let plain = Weave::new(2, 2, |end, pick| end == pick)?;
//! let warp = Thread { color: [0.5, 0.1, 0.1], pitch: Some(5e-4), ..Thread::default() };
//! let weft = Thread { color: [0.1, 0.1, 0.5], ..warp };
//! let shader = Cloth::from_threads(plain, &[warp; 2], &[weft; 2], &Yarn::default())?.prepare()?;
//!
//! let light = Vec3::new(0.6, 0.0, 0.8);
//! let f = shader.eval(DVec2::new(0.25e-3, 0.25e-3), light, Vec3::Z);
//! assert!(f.x > f.z); // a crossing with the warp on top
//! # Ok::<(), selvedge_yarn_brdf::ClothError>(())
//! ```
//!
//! # Departures from the paper
//!
//! - The argument of the phase function is the azimuth about the fibre ([`Phase`]), so that it is
//!   normalised on every cone, and the scattering is forward.
//! - The highlight is divided by the area of its segment: long floats are not brighter than short
//!   ones. The area is in metres, so that cells need not be square.
//! - Fibres may be rough ([`Highlight::Rough`]). The window draws a patch with hard edges and 1/δ of
//!   the segment's light; rough fibres shade the yarn smoothly, need no case for untwisted yarn, and
//!   are sampled with less noise. They are what [`Fabric`] assumes where nothing is said.
//! - The diffuse gets what the highlight leaves ([`Combination::Layered`]); the paper's mix can be
//!   selected.
//! - Equation 2 is maximised over the albedo of a segment by default ([`Mode::Segment`]).
//!   [`Mode::Pointwise`] is the paper's, which is dark: the drawn highlight gathers the light of a
//!   segment by 1/δ.
//!
//! # References
//!
//! - Abramowitz & Stegun 1964, *Handbook of mathematical functions*
//! - Best & Fisher 1979, *Efficient simulation of the von Mises distribution*
//! - d'Eon, Francois, Hill, Letteri & Aubry 2011, *An energy-conserving hair reflectance model*
//! - d'Eon, Marschner & Hanika 2013, *Importance sampling for physically-based hair fiber models*
//! - Irawan 2008, *Appearance of woven cloth*
//! - Irawan & Marschner 2012, *Specular reflection from woven cloth*,
//!   [doi:10.1145/2077341.2077352](https://doi.org/10.1145/2077341.2077352)
//! - Kelemen & Szirmay-Kalos 2001, *A microfacet based coupled specular-matte BRDF model with
//!   importance sampling*
//! - Nelson, McEvoy & Fratarcangeli 2016, *Practical offline rendering of woven cloth*
//! - Perlin 2002, *Improving noise*
//! - Steele, Lea & Flood 2014, *Fast splittable pseudorandom number generators*
//! - Veach 1997, *Robust Monte Carlo methods for light transport simulation*

mod albedo;
mod azimuth;
mod batch;
mod cloth;
#[cfg(feature = "serde")]
mod color;
mod density;
mod draw;
mod explain;
mod fabric;
mod far;
mod filament;
mod frame;
mod guide;
mod lanes;
mod material;
mod math;
mod moving;
mod noise;
mod pair;
mod parameter;
mod partial;
mod phase;
mod place;
mod plan;
mod points;
mod prepare;
mod quadrature;
mod real;
mod reflectance;
mod ring;
mod rough;
mod rules;
mod sampling;
#[cfg(feature = "schema")]
mod schema;
mod segment;
mod shader;
mod staple;
mod table;
#[cfg(test)]
mod tests;
mod texture;
mod threads;
mod variants;
mod weave;
mod yarn;

pub use batch::{Batch, BatchError, Colors, Draws, Guides, Instructions, Samples, YarnPoints};
pub use cloth::{
    Cloth, ClothError, Combination, DEFAULT_PITCH, MIN_SIZE, PLAUSIBLE_PITCH, Steep, Thread,
};
#[cfg(feature = "serde")]
pub use color::Color;
pub use explain::{Explanation, Factor, FibrePoint};
pub use fabric::{Fabric, Override};
pub use far::Footprint;
pub use glam;
pub use guide::Guide;
pub use material::Lowered;
pub use parameter::{ParamError, Parameter};
pub use partial::{PartialError, PartialNoise, PartialYarn};
pub use phase::{Phase, PhaseTable};
pub use plan::{Plan, Step};
pub use prepare::Preparer;
pub use sampling::Sample;
pub use segment::Mapping;
pub use selvedge_normalize::scale::{Mode, Normalization};
pub use shader::{Lobes, Shader, YarnColors, YarnPoint};
pub use texture::{Target, Texture, Textured, Textures};
pub use weave::{
    Local, MAX_CROSSINGS, Position, Segment, SegmentKind, Side, Sizes, ThreadPoint, ThreadSizes,
    Touching, Weave, WeaveError,
};
pub use yarn::{Diffuse, FILAMENT_PSI, FILAMENT_U_MAX, Highlight, Noise, Yarn};

/// The README, whose example is a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
