//! What is measured of a cloth: a trait, so that what is broken on purpose can be measured as well.

use glam::{DVec2, DVec3, Vec3};
use selvedge_yarn_brdf::{Batch, Draws, Footprint, Instructions, Sample, Samples, Shader};

use crate::args::MeasureOptions;

/// A surface that reflects, in three precisions: [`Shader`].
///
/// All functions are those of the shader. The slices of a batch are equally long.
pub(super) trait Surface: Send + Sync {
    /// The shader that this is, or is made of.
    fn shader(&self) -> &Shader;

    /// [`Shader::eval`].
    fn eval(&self, uv: DVec2, wi: Vec3, wo: Vec3) -> Vec3;

    /// [`Shader::eval_reference`].
    fn reference(&self, uv: DVec2, wi: DVec3, wo: DVec3) -> DVec3;

    /// [`Shader::sample`].
    fn sample(&self, uv: DVec2, wo: Vec3, xi: [f32; 3]) -> Option<Sample>;

    /// [`Shader::pdf`].
    fn pdf(&self, uv: DVec2, wi: Vec3, wo: Vec3) -> f32;

    /// [`Shader::eval_batch`].
    fn eval_batch(&self, points: &Batch<'_>, f: [&mut [f32]; 3]);

    /// [`Shader::pdf_batch`].
    fn pdf_batch(&self, points: &Batch<'_>, pdf: &mut [f32]);

    /// [`Shader::sample_batch`].
    fn sample_batch(&self, draws: &Draws<'_>, samples: Samples<'_>);

    /// [`Shader::far_eval`].
    fn far_eval(&self, footprint: &Footprint, wi: Vec3, wo: Vec3) -> Vec3;

    /// [`Shader::far_sample`].
    fn far_sample(&self, footprint: &Footprint, wo: Vec3, xi: [f32; 3]) -> Option<Sample>;

    /// [`Shader::far_pdf`].
    fn far_pdf(&self, footprint: &Footprint, wi: Vec3, wo: Vec3) -> f32;

    /// [`Shader::use_instructions`].
    fn use_instructions(&mut self, instructions: Instructions) -> bool;
}

/// What is measured of `shader`: the shader itself, or what the options' fault makes of it.
#[cfg_attr(
    not(any(test, feature = "faults")),
    expect(unused_variables, reason = "only where there are faults there is a choice")
)]
pub(super) fn surface(options: &MeasureOptions, shader: Shader) -> Box<dyn Surface> {
    #[cfg(any(test, feature = "faults"))]
    if let Some(fault) = options.fault {
        return Box::new(super::faulty::Faulty { shader, fault });
    }
    Box::new(shader)
}

const EQUAL: &str = "the slices of a batch are equally long";

impl Surface for Shader {
    fn shader(&self) -> &Shader {
        self
    }

    fn eval(&self, uv: DVec2, wi: Vec3, wo: Vec3) -> Vec3 {
        self.eval(uv, wi, wo)
    }

    fn reference(&self, uv: DVec2, wi: DVec3, wo: DVec3) -> DVec3 {
        self.eval_reference(uv, wi, wo)
    }

    fn sample(&self, uv: DVec2, wo: Vec3, xi: [f32; 3]) -> Option<Sample> {
        self.sample(uv, wo, xi)
    }

    fn pdf(&self, uv: DVec2, wi: Vec3, wo: Vec3) -> f32 {
        self.pdf(uv, wi, wo)
    }

    fn eval_batch(&self, points: &Batch<'_>, f: [&mut [f32]; 3]) {
        self.eval_batch(points, f).expect(EQUAL);
    }

    fn pdf_batch(&self, points: &Batch<'_>, pdf: &mut [f32]) {
        self.pdf_batch(points, pdf).expect(EQUAL);
    }

    fn sample_batch(&self, draws: &Draws<'_>, samples: Samples<'_>) {
        self.sample_batch(draws, samples).expect(EQUAL);
    }

    fn far_eval(&self, footprint: &Footprint, wi: Vec3, wo: Vec3) -> Vec3 {
        self.far_eval(footprint, wi, wo)
    }

    fn far_sample(&self, footprint: &Footprint, wo: Vec3, xi: [f32; 3]) -> Option<Sample> {
        self.far_sample(footprint, wo, xi)
    }

    fn far_pdf(&self, footprint: &Footprint, wi: Vec3, wo: Vec3) -> f32 {
        self.far_pdf(footprint, wi, wo)
    }

    fn use_instructions(&mut self, instructions: Instructions) -> bool {
        self.use_instructions(instructions)
    }
}
