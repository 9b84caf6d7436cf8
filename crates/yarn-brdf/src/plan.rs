//! `Plan`: what the shader of a cloth works out at each point, and what it leaves out.

use crate::cloth::Combination;
use crate::segment::Spread;
use crate::shader::Shader;
use crate::threads::Fill;
use crate::yarn::Diffuse;

/// What [`Shader::eval`] works out at each point. What a cloth does not have is left out when it is
/// prepared and costs nothing afterwards.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// What may be worked out, for the cloth and then for each type of yarn.
    pub steps: Vec<Step>,
    /// The memory of the cloth, in bytes: of it, `bytes_of_weave` are for its crossings and threads, the
    /// rest for its types of yarn.
    pub bytes: usize,
    /// Of the weave and the threads.
    pub bytes_of_weave: usize,
}

/// Something that may be worked out at each point.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Step {
    /// The type of yarn that it is for; `None` if it is for the whole cloth.
    pub yarn: Option<u16>,
    /// What it is.
    pub what: &'static str,
    /// Whether it is worked out.
    pub is_done: bool,
    /// Because of what.
    pub why: &'static str,
}

impl Shader {
    /// What this shader works out at each point, and why.
    pub fn plan(&self) -> Plan {
        let bytes_of_weave = self.weave.bytes() + self.threads.bytes();
        let of_yarns = (0..self.materials.kinds.len()).flat_map(|yarn| self.steps_of(yarn));
        let steps = self.steps().into_iter().chain(of_yarns).collect();
        Plan { steps, bytes: self.bytes(), bytes_of_weave }
    }

    fn steps(&self) -> Vec<Step> {
        let step = |what, is_done, [yes, no]: [&'static str; 2]| Step {
            yarn: None,
            what,
            is_done,
            why: if is_done { yes } else { no },
        };
        let moves = matches!(self.threads.fill, Fill::Varying { .. });
        let is_layered = self.combination == Combination::Layered;
        vec![
            step(
                "gaps",
                self.threads.have_gaps(),
                ["a yarn fills less than its pitch, or moves", "every yarn fills its pitch"],
            ),
            step(
                "threads that move",
                moves,
                [
                    "noise.width, noise.offset or slubs are above 0",
                    "no thread changes its size or place",
                ],
            ),
            step("rotation", self.frame.turn.is_some(), ["rotation is not 0", "rotation is 0"]),
            step(
                "albedo of both directions",
                is_layered,
                ["combination is layered", "combination is lerp"],
            ),
        ]
    }

    fn steps_of(&self, index: usize) -> Vec<Step> {
        let step = |what, is_done, [yes, no]: [&'static str; 2]| Step {
            yarn: Some(index as u16),
            what,
            is_done,
            why: if is_done { yes } else { no },
        };
        let (kind, material) = (&self.materials.kinds[index], &self.materials.double[index]);
        let noise = &kind.yarn.noise;
        let piece = material.piece(false, 0.0);
        let (highlight, because) = match piece.optics.spread {
            Spread::Staple { .. } => ("highlight of twisted fibres", "psi is not 0"),
            Spread::Filament { .. } => ("highlight of filaments", "psi is 0"),
            Spread::Rough { .. } => ("highlight of rough fibres", "highlight is rough"),
        };
        vec![
            step(highlight, piece.has_highlight, [because, "specular is black"]),
            step(
                "diffuse by the yarn's normal",
                kind.yarn.diffuse == Diffuse::YarnNormal,
                ["diffuse is yarn_normal", "diffuse is flat"],
            ),
            step(
                "grains of the highlight",
                noise.intensity > 0.0,
                ["noise.intensity is above 0", "noise.intensity is 0"],
            ),
            step(
                "lightness of threads",
                noise.color > 0.0,
                ["noise.color is above 0", "noise.color is 0"],
            ),
            step(
                "a shape of each segment",
                kind.is_reshaped,
                ["noise or a texture changes it", "neither noise nor textures change it"],
            ),
            step("textures", !kind.textures.is_empty(), ["it has some", "it has none"]),
            step(
                "partial opacity",
                kind.yarn.opacity < 1.0,
                ["opacity is below 1", "opacity is 1"],
            ),
        ]
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec2;

    use crate::{Cloth, Combination, Highlight, Thread, Weave, Yarn};

    fn done(yarn: &Yarn, combination: Combination) -> Vec<&'static str> {
        let weave = Weave::new(2, 2, |end, pick| end == pick).unwrap();
        let thread = Thread { color: [0.5; 3], ..Thread::default() };
        let mut cloth = Cloth::from_threads(weave, &[thread; 2], &[thread; 2], yarn).unwrap();
        cloth.pitch = DVec2::splat(1e-3);
        cloth.combination = combination;
        // Which threads tell by their diameter.
        cloth.yarns.iter_mut().for_each(|own| own.size = yarn.size);
        let plan = cloth.prepare().unwrap().plan();
        assert!(plan.bytes > plan.bytes_of_weave && plan.bytes_of_weave > 0, "{plan:?}");
        plan.steps.iter().filter(|step| step.is_done).map(|step| step.what).collect()
    }

    #[test]
    fn only_what_a_cloth_has_is_worked_out() {
        let plain = Yarn { specular: [0.0; 3], ..Yarn::default() };
        assert_eq!(done(&plain, Combination::Lerp), [""; 0]);
        let staple = Yarn { psi: 0.5, specular: [0.1; 3], ..Yarn::default() };
        let expected = ["albedo of both directions", "highlight of twisted fibres"];
        assert_eq!(done(&staple, Combination::Layered), expected);
        let mut rough = Yarn { highlight: Highlight::Rough { sigma: 0.2 }, size: 0.8, ..staple };
        rough.noise.intensity = 0.5;
        rough.opacity = 0.5;
        let expected =
            ["gaps", "highlight of rough fibres", "grains of the highlight", "partial opacity"];
        assert_eq!(done(&rough, Combination::Lerp), expected);
    }
}
