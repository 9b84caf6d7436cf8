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

/// [`Shader::sample`] for one viewer of all places `uv`, m, with the numbers `xi` in [0, 1), as a batch.
pub(super) fn samples(
    surface: &dyn Surface,
    uv: [&[f64]; 2],
    wo: Vec3,
    xi: [&[f32]; 3],
) -> Vec<Option<Sample>> {
    let count = uv[0].len();
    let viewer = wo.to_array().map(|part| vec![part; count]);
    let draws = Draws { uv, wo: viewer.each_ref().map(Vec::as_slice), xi, active: None };
    let black = || [(); 3].map(|()| vec![0.0; count]);
    let (mut wi, mut weight, mut pdf) = (black(), black(), vec![0.0; count]);
    let samples = Samples {
        wi: wi.each_mut().map(Vec::as_mut_slice),
        weight: weight.each_mut().map(Vec::as_mut_slice),
        pdf: &mut pdf,
    };
    surface.sample_batch(&draws, samples);
    let at = |of: &[Vec<f32>; 3], k: usize| Vec3::from_array(of.each_ref().map(|part| part[k]));
    let sample = |k: usize| Sample { wi: at(&wi, k), weight: at(&weight, k), pdf: pdf[k] };
    // A density of 0 says that there is none; one that is no number is for others to find out.
    (0..count).map(|k| (pdf[k] != 0.0).then(|| sample(k))).collect()
}

/// [`Shader::pdf`] for one viewer at all places `uv`, m, each with its own `wi`, as a batch.
pub(super) fn densities(surface: &dyn Surface, uv: [&[f64]; 2], wi: &[Vec3], wo: Vec3) -> Vec<f32> {
    let mut pdf = vec![0.0; wi.len()];
    with_batch(uv, wi, wo, |points| surface.pdf_batch(points, &mut pdf));
    pdf
}

/// Lets `work` have a batch of places `uv`, m, each with its own `wi`, for one viewer.
pub(super) fn with_batch(uv: [&[f64]; 2], wi: &[Vec3], wo: Vec3, work: impl FnOnce(&Batch<'_>)) {
    let light = [0, 1, 2].map(|axis| wi.iter().map(|w| w[axis]).collect::<Vec<_>>());
    let viewer = wo.to_array().map(|part| vec![part; wi.len()]);
    let wi = light.each_ref().map(Vec::as_slice);
    work(&Batch { uv, wi, wo: viewer.each_ref().map(Vec::as_slice), active: None });
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
