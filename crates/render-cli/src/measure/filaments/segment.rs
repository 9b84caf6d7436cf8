//! The same piece of yarn as the shader shows it.

use anyhow::Context;
use glam::{DVec2, DVec3};
use selvedge_yarn_brdf::{
    Fabric, Highlight, Mapping, Mode, PartialYarn, Phase, Shader, Thread, Weave, Yarn,
};

use super::{fibre::Fibre, strand::Shape};

/// A float of an end over one broad pick, of white fibres, with nothing but its highlight.
#[derive(Debug)]
pub struct Segment {
    shader: Shader,
    /// Its middle and half its extent, m.
    middle: DVec2,
    half: DVec2,
}

/// Width of the float, m.
const WIDTH: f64 = 1e-3;

impl Segment {
    /// The float of the yarn `shape`, with fibres like `fibre` and this highlight, seen orthographically
    /// and scaled by nothing.
    ///
    /// # Errors
    ///
    /// When a parameter is out of its range.
    pub fn new(shape: &Shape, fibre: &Fibre, highlight: Highlight) -> anyhow::Result<Self> {
        let weave = Weave::new(1, 2, |_, pick| pick == 1)?;
        let yarn = Yarn {
            color: [0.0; 3],
            specular: [1.0; 3],
            u_max: shape.u_max,
            psi: shape.psi,
            highlight,
            phase: Phase::VonMises { alpha: fibre.alpha, beta: fibre.beta },
            ..Yarn::default()
        };
        let fabric = Fabric {
            yarn: PartialYarn { size: None, ..PartialYarn::from(&yarn) },
            mapping: Mapping::Arcsine,
            normalization: Mode::None,
            ..Fabric::default()
        };
        let [end, pick] = [WIDTH, WIDTH * shape.aspect].map(|pitch| Thread {
            pitch: Some(pitch),
            diameter: Some(pitch),
            ..Thread::default()
        });
        let cloth = fabric.cloth(weave, &[end], &[pick; 2])?;
        Ok(Self {
            shader: cloth.prepare().context("the piece of yarn")?,
            middle: DVec2::new(0.5, 1.5) * cloth.pitch,
            half: 0.5 * cloth.pitch,
        })
    }

    /// f at (x, y) in [−1, 1]² of the piece, sr⁻¹, from the light at `wi` to a viewer far above.
    pub fn brightness(&self, [x, y]: [f64; 2], wi: DVec3) -> f64 {
        let uv = self.middle + self.half * DVec2::new(x, y);
        self.shader.eval_reference(uv, wi, DVec3::Z).x
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn piece_is_one_float_with_its_ends_at_its_edges() {
        let shape = Shape { u_max: 0.5, psi: 0.4, aspect: 2.5 };
        let fibre = Fibre { sigma: 0.1, alpha: 0.05, beta: 4.0 };
        let highlight = Highlight::Rough { sigma: 0.1 };
        let segment = Segment::new(&shape, &fibre, highlight).unwrap();
        for [x, y] in [[0.0, 0.0], [-0.9, 0.99], [0.7, -0.99]] {
            let uv = segment.middle + segment.half * DVec2::new(x, y);
            let found = segment.shader.yarn_at(uv).unwrap().segment;
            assert!(found.is_warp && found.crossings == 1, "{found:?}");
            assert!((found.x - x).hypot(found.y - y) < 1e-9, "{found:?}, expected {x}, {y}");
        }
    }
}
