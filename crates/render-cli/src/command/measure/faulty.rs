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
const GRAZING: f32 = 0.03;

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
        for (k, pdf) in pdf.iter_mut().enumerate() {
            let at = |parts: [&[f32]; 3]| parts.map(|part| part[k]);
            let uv = DVec2::new(draws.uv[0][k], draws.uv[1][k]);
            let sample = self.sample(uv, Vec3::from_array(at(draws.wo)), at(draws.xi));
            let nothing = Sample { wi: Vec3::ZERO, weight: Vec3::ZERO, pdf: 0.0 };
            let sample = sample.unwrap_or(nothing);
            for c in 0..3 {
                wi[c][k] = sample.wi[c];
                weight[c][k] = sample.weight[c];
            }
            *pdf = sample.pdf;
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

    use serde_json::Value;

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

    /// Whether `measure` finds nothing wrong with a sound shader, and misses all checks of this kind with one
    /// that has the `fault`.
    fn is_caught(
        measure: fn(MeasureOptions) -> MeasureCommand,
        budget: f64,
        fault: Fault,
        checks: &str,
    ) -> bool {
        let place = tempfile::tempdir().unwrap();
        let fabric = place.path().join("plain.json");
        fs::write(&fabric, FABRIC).unwrap();
        let [sound, broken] = [(None, "sound"), (Some(fault), "broken")].map(|(fault, name)| {
            let output: PathBuf = place.path().join(name);
            let options = MeasureOptions {
                inputs: vec![fabric.clone()],
                output: output.clone(),
                budget,
                seed: 0,
                threads: None,
                quiet: true,
                fault,
            };
            let outcome = run(&measure(options)).unwrap();
            let report = fs::read(output.join("report.json")).unwrap();
            let report: Value = serde_json::from_slice(&report).unwrap();
            let is_such = |check: &&Value| check["what"].as_str().unwrap().contains(checks);
            let such = report["checks"].as_array().unwrap().iter().filter(is_such);
            (outcome, such.map(|check| check["kept"].as_bool().unwrap()).collect::<Vec<_>>())
        });
        let is_sound = sound.0 == Outcome::Done && !sound.1.is_empty();
        is_sound && broken.0 == Outcome::BelowThreshold && !broken.1.contains(&true)
    }

    #[test]
    fn furnace_catches_a_phase_function_that_is_not_normalised() {
        let checks = "white yarns";
        assert!(is_caught(MeasureCommand::Furnace, 0.05, Fault::Phase, checks));
    }

    #[test]
    fn chi2_catches_a_density_that_is_twice_too_high() {
        let checks = "least chance";
        assert!(is_caught(MeasureCommand::Chi2, 0.02, Fault::Pdf, checks));
    }

    #[test]
    fn stability_catches_what_is_no_number_at_grazing_directions() {
        let checks = "not finite";
        assert!(is_caught(MeasureCommand::Stability, 0.005, Fault::Grazing, checks));
    }
}
