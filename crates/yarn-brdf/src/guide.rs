//! What the diffuse lobe of a place is nearly, for all directions to the light at once.
//!
//! Whoever looks at many places in many lights may look at each place in one of the lights, and reckon with the guide to
//! what it would have been in the others: as a control variate, whose mean is subtracted again, it takes off noise and
//! changes no mean.

use glam::{DVec2, Vec3};

use crate::place::Place;
use crate::sampling::Seen;
use crate::shader::Shader;

/// A guide to the diffuse lobe: `color · max(facing · wi, 0)`, sr⁻¹.
///
/// It is the diffuse of yarn that is lit by its normal ([`Diffuse::YarnNormal`](crate::Diffuse::YarnNormal)), but for what
/// the highlight takes of light from `wi`: here, what it takes of light from everywhere. That of yarn that is flat faces
/// up, and is the diffuse times cos θi.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Guide {
    /// Linear RGB, in [0, 1].
    pub color: Vec3,
    /// Where the yarn faces, as long as what the view leaves of the lobe, sr⁻¹: in the shading frame.
    pub facing: Vec3,
}

impl Guide {
    /// What the diffuse lobe is nearly for the direction `wi` to the light, in front of the surface.
    #[must_use]
    pub fn diffuse(&self, wi: Vec3) -> Vec3 {
        self.color * self.facing.dot(wi).max(0.0)
    }
}

impl Shader {
    /// The guide to the diffuse lobe at `uv` (m) for the direction `wo` to the viewer; 0 in a gap.
    #[must_use]
    pub fn guide(&self, uv: DVec2, wo: Vec3) -> Guide {
        let guide = self.with_seen(uv, wo, |seen: &Seen<'_>| {
            let Place { piece, at, look, .. } = seen.place;
            let w = [seen.wo; 2];
            let (_, facing) = self.diffuse_and_facing(piece, *at, piece.inv_divisor(at[2]), w);
            Guide { color: look.matte().into(), facing: self.to_surface(seen, facing) }
        });
        guide.unwrap_or_default()
    }
}
