//! How much a scattering function reflects at worst, and by what it must be scaled to conserve energy.
//!
//! A measured, fitted or invented scattering function f (a BRDF, in sr⁻¹) need not conserve energy.
//! The fraction of the light from a direction wi that it reflects is its directional albedo,
//!
//! ```text
//! ρ(x, wi) = ∫ f(x, wi, wo) cos θo dwo ,
//! ```
//!
//! and f is scaled by the reciprocal of the greatest ρ over all points x and directions wi (Nelson,
//! McEvoy & Fratarcangeli 2016, equation 2). This crate finds that number for any function: no
//! random generator, no hidden state, one thread, so equal input gives equal bits.
//!
//! From the parts to the whole:
//! - [`halton`]: evenly spread points, exact in integer digits, optionally scrambled;
//! - [`warp`]: maps of the square to the disk, the hemisphere and the sphere, with densities;
//! - [`estimate`]: the mean of a function over the unit cube, with its error;
//! - [`mod@albedo`]: directional, averaged and bihemispherical albedo;
//! - [`search`]: the maximum of a function over the unit cube;
//! - [`scale`]: the factor and the bounds it rests on;
//! - [`table`]: the albedo as a table over direction, with its error;
//! - [`cache`]: factors kept under the hash of what they depend on.
//!
//! Directions are unit vectors in the shading frame: z is the normal, and both directions point
//! away from the surface. Sums are in f64. Sampling can miss a lobe narrower than the spacing of the
//! points, so a model with such lobes should bring its own quadrature ([`Scattering::albedo_exact`]).
//!
//! # References
//!
//! - Cranley & Patterson 1976, *Randomization of number theoretic methods for multiple integration*,
//!   [doi:10.1137/0713071](https://doi.org/10.1137/0713071)
//! - Fowler, Noll, Vo, Eastlake & Hansen 2026, *The FNV non-cryptographic hash algorithm*,
//!   [doi:10.17487/RFC9923](https://doi.org/10.17487/RFC9923)
//! - Halton 1960, *On the efficiency of certain quasi-random sequences of points in evaluating
//!   multi-dimensional integrals*, [doi:10.1007/BF01386213](https://doi.org/10.1007/BF01386213)
//! - Hammersley 1960, *Monte Carlo methods for solving multivariable problems*,
//!   [doi:10.1111/j.1749-6632.1960.tb42846.x](https://doi.org/10.1111/j.1749-6632.1960.tb42846.x)
//! - Hooke & Jeeves 1961, *"Direct search" solution of numerical and statistical problems*,
//!   [doi:10.1145/321062.321069](https://doi.org/10.1145/321062.321069)
//! - Kelemen & Szirmay-Kalos 2001, *A microfacet based coupled specular-matte BRDF model with
//!   importance sampling*, Eurographics short presentations
//! - Kocis & Whiten 1997, *Computational investigations of low-discrepancy sequences*,
//!   [doi:10.1145/264029.264064](https://doi.org/10.1145/264029.264064)
//! - Kolda, Lewis & Torczon 2003, *Optimization by direct search*,
//!   [doi:10.1137/S003614450242889](https://doi.org/10.1137/S003614450242889)
//! - Matoušek 1998, *On the L2-discrepancy for anchored boxes*,
//!   [doi:10.1006/jcom.1998.0489](https://doi.org/10.1006/jcom.1998.0489)
//! - Nelson, McEvoy & Fratarcangeli 2016, *Practical offline rendering of woven cloth*
//! - Nicodemus et al. 1977, *Geometrical considerations and nomenclature for reflectance*,
//!   [doi:10.6028/NBS.MONO.160](https://doi.org/10.6028/NBS.MONO.160)
//! - Owen 1995, *Randomly permuted (t,m,s)-nets and (t,s)-sequences*,
//!   [doi:10.1007/978-1-4612-2552-2_19](https://doi.org/10.1007/978-1-4612-2552-2_19)
//! - Owen 2013, *Monte Carlo theory, methods and examples*,
//!   [artowen.su.domains/mc](https://artowen.su.domains/mc/)
//! - Pharr, Jakob & Humphreys 2023, *Physically based rendering*, 4th edition
//! - Shirley & Chiu 1997, *A low distortion map between disk and square*,
//!   [doi:10.1080/10867651.1997.10487479](https://doi.org/10.1080/10867651.1997.10487479)
//! - Steele, Lea & Flood 2014, *Fast splittable pseudorandom number generators*,
//!   [doi:10.1145/2660193.2660195](https://doi.org/10.1145/2660193.2660195)

pub mod albedo;
pub mod cache;
pub mod estimate;
pub mod halton;
pub mod scale;
pub mod search;
pub mod table;
pub mod warp;

pub use albedo::{Scattering, albedo};
pub use glam;
pub use scale::Normalization;
pub use search::{Maximum, Search, maximize};

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
