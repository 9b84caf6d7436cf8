//! `selvedge eval`: what a cloth reflects at one place, and every factor of it.

use std::fmt::Write as _;

use anyhow::Context;
use glam::{DVec2, DVec3, Vec3};
use selvedge_yarn_brdf::{Batch, Cloth, Explanation, Factor, Footprint, Shader, Side};
use serde_json::{Value, json};

use crate::{
    args::{EvalOptions, ParameterSetting, Place},
    fabric,
    output::Sink,
    report::significant,
};

/// Significant digits that people are shown.
const DIGITS: usize = 9;

/// Writes the value that `options` name, and its factors, to standard output.
///
/// # Errors
///
/// As for the cloth of [`render`](super::render::run), when a setting does not fit it, and when standard
/// output cannot be written.
pub fn run(options: &EvalOptions) -> anyhow::Result<()> {
    let source = fabric::read(&options.input)?;
    let drawdown = source.draft().drawdown()?;
    let mut cloth = source.cloth(&drawdown)?;
    for setting in &options.settings {
        set(&mut cloth, *setting).with_context(|| source.name().to_owned())?;
    }
    let shader = source.shader(&cloth)?;
    let Place(uv) = options.at;
    let values = Values::new(&cloth, &shader, uv, options.wi.single(), options.wo.single());
    let text = if options.json {
        format!("{:#}\n", values.to_json(uv))
    } else {
        values.to_text(uv, &cloth).context("a string takes all")?
    };
    Sink::Stdout.write(|out| out.write_all(text.as_bytes()))?;
    Ok(())
}

fn set(cloth: &mut Cloth, setting: ParameterSetting) -> anyhow::Result<()> {
    match setting {
        ParameterSetting::Scale(scale) => cloth.scale = scale,
        ParameterSetting::Yarns(parameter, value) => {
            let set = cloth.yarns.iter_mut().map(|yarn| parameter.set(yarn, value));
            let count = set.filter(|has| *has).count();
            anyhow::ensure!(count > 0, "--set {}: found no yarn that has one", parameter.name);
        }
    }
    Ok(())
}

/// All that is told of a place and two directions.
struct Values {
    explanation: Option<Explanation>,
    /// f of the reference, of a single point, of a batch and from afar, sr⁻¹.
    f: [(&'static str, DVec3); 4],
    pdf: f32,
    far_pdf: f32,
    albedo: Vec3,
    opacity: f32,
}

impl Values {
    fn new(cloth: &Cloth, shader: &Shader, uv: DVec2, wi: Vec3, wo: Vec3) -> Self {
        // What f32 cannot hold of a direction is no error of the value.
        let (wi_double, wo_double) = (wi.as_dvec3(), wo.as_dvec3());
        let far = Footprint { uv, deviation: 100.0 * cloth.size() };
        Self {
            explanation: shader.explain(uv, wi_double, wo_double),
            f: [
                ("f64", shader.eval_reference(uv, wi_double, wo_double)),
                ("f32", shader.eval(uv, wi, wo).as_dvec3()),
                ("batch", in_batch(shader, uv, wi, wo).as_dvec3()),
                ("far", shader.far_eval(&far, wi, wo).as_dvec3()),
            ],
            pdf: shader.pdf(uv, wi, wo),
            far_pdf: shader.far_pdf(&far, wi, wo),
            albedo: shader.albedo(uv, wo),
            opacity: shader.opacity(uv),
        }
    }

    fn to_text(&self, uv: DVec2, cloth: &Cloth) -> Result<String, std::fmt::Error> {
        let mut text = String::new();
        match &self.explanation {
            None => writeln!(
                text,
                "nothing      a gap, or directions that are not on one side of the cloth"
            )?,
            Some(explanation) => explain(&mut text, explanation, cloth)?,
        }
        writeln!(text, "f, sr⁻¹")?;
        let reference = self.f[0].1;
        for (name, f) in self.f {
            let error = (f - reference).abs().max_element() / reference.max_element();
            let is_compared = matches!(name, "f32" | "batch") && reference.max_element() > 0.0;
            let off = if is_compared {
                format!("  off by {}", significant(error, 3))
            } else {
                String::new()
            };
            writeln!(text, "  {name:<34}{}{off}", rgb(f))?;
        }
        let number = |x: f32| significant(x.into(), DIGITS);
        writeln!(
            text,
            "pdf          {} sr⁻¹, from afar {}",
            number(self.pdf),
            number(self.far_pdf)
        )?;
        writeln!(text, "albedo       {}", rgb(self.albedo.as_dvec3()))?;
        writeln!(text, "opacity      {} at {:?}, {:?} m", number(self.opacity), uv.x, uv.y)?;
        Ok(text)
    }

    fn to_json(&self, uv: DVec2) -> Value {
        let factors = |of: &[Factor]| {
            let each = of
                .iter()
                .map(|f| json!({ "name": f.name, "formula": f.formula, "value": f.value }));
            Value::Array(each.collect())
        };
        let f = self.f.map(|(name, f)| (name.to_owned(), json!(f.to_array())));
        let mut all = json!({
            "place": uv.to_array(),
            "side": Value::Null,
            "f": Value::Object(f.into_iter().collect()),
            "pdf": self.pdf,
            "far_pdf": self.far_pdf,
            "albedo": self.albedo.to_array(),
            "opacity": self.opacity,
        });
        if let Some(own) = &self.explanation {
            let point = &own.point;
            let segment = &point.segment;
            let fibre = own.fibre.map(|fibre| {
                json!({
                    "kind": fibre.kind, "lit": fibre.is_lit, "u": fibre.u, "v": fibre.v,
                    "cosines": fibre.cosines, "along": fibre.along,
                })
            });
            let details = json!({
                "side": if own.side == Side::Face { "face" } else { "back" },
                "yarn": point.yarn,
                "segment": {
                    "warp": segment.is_warp, "thread": segment.thread, "crossings": segment.crossings,
                    "kind": format!("{:?}", segment.kind).to_lowercase(),
                    "x": segment.x, "y": segment.y, "ratio": own.ratio, "u": point.u, "v": point.v,
                    "normal": point.normal.to_array(), "tangent": point.tangent.to_array(),
                },
                "wi_yarn": own.wi_yarn.to_array(),
                "wo_yarn": own.wo_yarn.to_array(),
                "fibre": fibre,
                "highlight": factors(&own.highlight),
                "phase": { "peak": own.phase[0], "uniform": own.phase[1] },
                "diffuse": factors(&own.diffuse),
                "colors": {
                    "peak": own.colors[0].to_array(), "uniform": own.colors[1].to_array(),
                    "diffuse": own.colors[2].to_array(),
                },
                "irregularity": own.irregularity,
                "lobes": { "highlight": own.lobes[0].to_array(), "diffuse": own.lobes[1].to_array() },
            });
            if let (Value::Object(all), Value::Object(details)) = (&mut all, details) {
                all.extend(details);
            }
        }
        all
    }
}

/// f of a batch of many such points.
fn in_batch(shader: &Shader, uv: DVec2, wi: Vec3, wo: Vec3) -> Vec3 {
    const COUNT: usize = 16;
    let place = uv.to_array().map(|part| [part; COUNT]);
    let [wi, wo] = [wi, wo].map(|w| w.to_array().map(|part| [part; COUNT]));
    let points = Batch {
        uv: place.each_ref().map(<[f64; COUNT]>::as_slice),
        wi: wi.each_ref().map(<[f32; COUNT]>::as_slice),
        wo: wo.each_ref().map(<[f32; COUNT]>::as_slice),
        active: None,
    };
    let mut f = [[0.0; COUNT]; 3];
    shader
        .eval_batch(&points, f.each_mut().map(<[f32; COUNT]>::as_mut_slice))
        .expect("all slices have as many points");
    Vec3::from_array(f.map(|part| part[0]))
}

fn explain(text: &mut String, own: &Explanation, cloth: &Cloth) -> std::fmt::Result {
    let number = |x: f64| significant(x, DIGITS);
    let degrees = |x: f64| format!("{}°", significant(x.to_degrees(), DIGITS));
    let vector = |w: DVec3| format!("{}, {}, {}", number(w.x), number(w.y), number(w.z));
    let point = &own.point;
    let segment = &point.segment;
    let side = if own.side == Side::Face { "face" } else { "back" };
    let (thread, count) = match segment.is_warp {
        true => ("end", cloth.weave.ends()),
        false => ("pick", cloth.weave.picks()),
    };
    let of = segment.thread + 1;
    writeln!(
        text,
        "yarn         type {}, {thread} {of} of {count}, seen from the {side}",
        point.yarn
    )?;
    let kind = format!("{:?}", segment.kind).to_lowercase();
    writeln!(
        text,
        "segment      {kind}, over {} crossings, x {}, y {}, w/l {}",
        segment.crossings,
        number(segment.x),
        number(segment.y),
        number(own.ratio)
    )?;
    writeln!(text, "angles       u {}, v {}", degrees(point.u), degrees(point.v))?;
    writeln!(text, "normal       {}", vector(point.normal))?;
    writeln!(text, "tangent      {}", vector(point.tangent))?;
    writeln!(text, "wi           {} in the frame of the yarn", vector(own.wi_yarn))?;
    writeln!(text, "wo           {}", vector(own.wo_yarn))?;
    let line = |text: &mut String, name: &str, value: f64, formula: &str| {
        let line = format!("  {name:<34}{:<18}{formula}", number(value));
        writeln!(text, "{}", line.trim_end())
    };
    match &own.fibre {
        None => writeln!(text, "highlight    none: the yarn has no specular colour")?,
        Some(fibre) => {
            let lit = if fibre.is_lit { "lit" } else { "not lit" };
            let (u, v) = (degrees(fibre.u), degrees(fibre.v));
            writeln!(text, "highlight    {} fibres, {lit}, from u {u}, v {v}", fibre.kind)?;
            let [p, q] = fibre.cosines.map(number);
            let [si, so] = fibre.along.map(number);
            writeln!(text, "  p = n·wi {p}, q = n·wo {q}, t·wi {si}, t·wo {so}")?;
            for Factor { name, formula, value } in &own.highlight {
                line(text, name, *value, formula)?;
            }
            line(text, "phase, peak", own.phase[0], "f_c, rad⁻¹")?;
            line(text, "phase, uniform part", own.phase[1], "rad⁻¹")?;
            line(text, "irregularity", own.irregularity, "")?;
            writeln!(text, "  {:<34}{}", "colour of the peak", rgb(own.colors[0]))?;
            writeln!(text, "  {:<34}{}", "colour of the uniform part", rgb(own.colors[1]))?;
        }
    }
    writeln!(text, "diffuse")?;
    for Factor { name, formula, value } in &own.diffuse {
        line(text, name, *value, formula)?;
    }
    writeln!(text, "  {:<34}{}", "colour", rgb(own.colors[2]))?;
    line(text, "opacity of both", own.opacity, "")?;
    writeln!(text, "lobes, sr⁻¹")?;
    writeln!(text, "  {:<34}{}", "highlight", rgb(own.lobes[0]))?;
    writeln!(text, "  {:<34}{}", "diffuse", rgb(own.lobes[1]))
}

fn rgb(color: DVec3) -> String {
    let [r, g, b] = color.to_array().map(|x| significant(x, DIGITS));
    format!("{r}, {g}, {b}")
}
