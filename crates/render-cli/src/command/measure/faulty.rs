//! A shader that is broken on purpose, to show that what is measured finds it out.

use glam::{DVec2, DVec3, Vec3};
use selvedge_yarn_brdf::{Batch, Draws, Footprint, Instructions, Lobes, Sample, Samples, Shader};

use super::surface::Surface;
use crate::args::Fault;

/// A shader, and what is wrong with it.
pub(super) struct Faulty {
    pub(super) shader: Shader,
    pub(super) fault: Fault,
}

/// Cosine below which a direction is grazing.
const GRAZING: f32 = 0.01;

impl Faulty {
    /// f of `lobes`, of which the integral over the phase function is twice what the factor of the highlight
    /// takes it for, or which is no number at grazing directions.
    fn f(&self, Lobes { specular, diffuse }: Lobes, wi: Vec3, wo: Vec3) -> Vec3 {
        match self.fault {
            Fault::Phase => 2.0 * specular + diffuse,
            Fault::Grazing if wi.z.abs().min(wo.z.abs()) < GRAZING => Vec3::NAN,
            Fault::Pdf | Fault::Grazing => specular + diffuse,
        }
    }

    /// What is told for the density `pdf`.
    fn density(&self, pdf: f32) -> f32 {
        if self.fault == Fault::Pdf { 2.0 * pdf } else { pdf }
    }

    fn resampled(&self, sample: Option<Sample>, f: impl Fn(Vec3) -> Vec3) -> Option<Sample> {
        let Sample { wi, pdf, .. } = sample?;
        let pdf = self.density(pdf);
        Some(Sample { wi, weight: f(wi) * wi.z.abs() / pdf, pdf })
    }
}

impl Surface for Faulty {
    fn shader(&self) -> &Shader {
        &self.shader
    }

    fn eval(&self, uv: DVec2, wi: Vec3, wo: Vec3) -> Vec3 {
        self.f(self.shader.eval_lobes(uv, wi, wo), wi, wo)
    }

    fn reference(&self, uv: DVec2, wi: DVec3, wo: DVec3) -> DVec3 {
        self.shader.eval_reference(uv, wi, wo)
    }

    fn sample(&self, uv: DVec2, wo: Vec3, xi: [f32; 3]) -> Option<Sample> {
        self.resampled(self.shader.sample(uv, wo, xi), |wi| self.eval(uv, wi, wo))
    }

    fn pdf(&self, uv: DVec2, wi: Vec3, wo: Vec3) -> f32 {
        self.density(self.shader.pdf(uv, wi, wo))
    }

    fn eval_batch(&self, points: &Batch<'_>, mut f: [&mut [f32]; 3]) {
        for k in 0..points.uv[0].len() {
            let [wi, wo] = [points.wi, points.wo].map(|w| Vec3::from_array(w.map(|part| part[k])));
            let value = self.eval(DVec2::new(points.uv[0][k], points.uv[1][k]), wi, wo);
            for (c, f) in f.iter_mut().enumerate() {
                f[k] = value[c];
            }
        }
    }

    fn pdf_batch(&self, points: &Batch<'_>, pdf: &mut [f32]) {
        Surface::pdf_batch(&self.shader, points, pdf);
        pdf.iter_mut().for_each(|pdf| *pdf = self.density(*pdf));
    }

    fn sample_batch(&self, draws: &Draws<'_>, samples: Samples<'_>) {
        let Samples { wi, weight, pdf } = samples;
        for k in 0..pdf.len() {
            let at = |parts: [&[f32]; 3]| parts.map(|part| part[k]);
            let uv = DVec2::new(draws.uv[0][k], draws.uv[1][k]);
            let sample = self.sample(uv, Vec3::from_array(at(draws.wo)), at(draws.xi));
            let nothing = Sample { wi: Vec3::ZERO, weight: Vec3::ZERO, pdf: 0.0 };
            let sample = sample.unwrap_or(nothing);
            for c in 0..3 {
                wi[c][k] = sample.wi[c];
                weight[c][k] = sample.weight[c];
            }
            pdf[k] = sample.pdf;
        }
    }

    fn far_eval(&self, footprint: &Footprint, wi: Vec3, wo: Vec3) -> Vec3 {
        self.f(self.shader.far_eval_lobes(footprint, wi, wo), wi, wo)
    }

    fn far_sample(&self, footprint: &Footprint, wo: Vec3, xi: [f32; 3]) -> Option<Sample> {
        let sample = self.shader.far_sample(footprint, wo, xi);
        self.resampled(sample, |wi| self.far_eval(footprint, wi, wo))
    }

    fn far_pdf(&self, footprint: &Footprint, wi: Vec3, wo: Vec3) -> f32 {
        self.density(self.shader.far_pdf(footprint, wi, wo))
    }

    fn use_instructions(&mut self, instructions: Instructions) -> bool {
        self.shader.use_instructions(instructions)
    }
}

#[cfg(test)]
mod tests {
    use std::{fs, path::PathBuf};

    use super::*;
    use crate::{
        Outcome,
        args::{MeasureCommand, MeasureOptions},
        command::measure::run,
    };

    /// A plain weave of twisted yarn with a drawn highlight.
    const FABRIC: &str = r#"{
        "version": 1,
        "draft": { "wif": "[WIF]\nVersion=1.1\n[CONTENTS]\nWeaving=1\nWarp=1\nWeft=1\nThreading=1\nLiftplan=1\n[WEAVING]\nShafts=2\nTreadles=0\nRising Shed=1\n[WARP]\nThreads=2\n[WEFT]\nThreads=2\n[THREADING]\n1=1\n2=2\n[LIFTPLAN]\n1=1\n2=2\n" },
        "yarn": { "psi": 0.5, "specular": 0.4, "color": 0.5 }
    }"#;

    /// How `measure` ends for a sound shader, and for one with `fault`.
    fn outcomes(measure: fn(MeasureOptions) -> MeasureCommand, fault: Fault) -> [Outcome; 2] {
        let place = tempfile::tempdir().unwrap();
        let fabric = place.path().join("plain.json");
        fs::write(&fabric, FABRIC).unwrap();
        [(None, "sound"), (Some(fault), "broken")].map(|(fault, name)| {
            let output: PathBuf = place.path().join(name);
            let options = MeasureOptions {
                inputs: vec![fabric.clone()],
                output: output.clone(),
                budget: 0.05,
                seed: 0,
                threads: None,
                quiet: true,
                fault,
            };
            let outcome = run(&measure(options)).unwrap();
            assert!(output.join("report.html").is_file(), "{name}");
            outcome
        })
    }

    const CAUGHT: [Outcome; 2] = [Outcome::Done, Outcome::BelowThreshold];

    #[test]
    fn furnace_catches_a_phase_function_that_is_not_normalised() {
        assert_eq!(outcomes(MeasureCommand::Furnace, Fault::Phase), CAUGHT);
    }

    #[test]
    fn chi2_catches_a_density_that_is_twice_too_high() {
        assert_eq!(outcomes(MeasureCommand::Chi2, Fault::Pdf), CAUGHT);
    }

    #[test]
    fn stability_catches_what_is_no_number_at_grazing_directions() {
        assert_eq!(outcomes(MeasureCommand::Stability, Fault::Grazing), CAUGHT);
    }
}
