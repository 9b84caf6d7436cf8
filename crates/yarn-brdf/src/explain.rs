//! `Explanation`: every factor of the BRDF at one place, for people who want to know why it is so bright.

use core::f64::consts::FRAC_1_PI;

use glam::{DVec2, DVec3};

use crate::cloth::Combination;
use crate::frame::{Vector, to_yarn};
use crate::phase::Azimuth;
use crate::place::Place;
use crate::rough::longitudinal;
use crate::segment::{Root, Spread, in_window, normal};
use crate::shader::{Shader, YarnPoint, left};
use crate::weave::Side;
use crate::{filament, staple};

/// What [`Shader::eval_reference`] is made of at one place for two directions, in f64.
///
/// The lobes before colour are products:
///
/// ```text
/// f = opacity · (highlight · irregularity · (colour · peak + colour · uniform) + colour · diffuse)
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Explanation {
    /// Which side both directions are on.
    pub side: Side,
    /// The piece of yarn that this side shows, as [`Shader::yarn_at`] tells it of the face.
    pub point: YarnPoint,
    /// Width over length of the piece, in metres each: 1; 0 for a straight piece.
    pub ratio: f64,
    /// The directions in the frame of the yarn: x across, y along, z the normal of the cloth.
    pub wi_yarn: DVec3,
    /// The same of the direction to the viewer.
    pub wo_yarn: DVec3,
    /// Where on the yarn, and which kind of fibre, the highlight comes from; `None` if the yarn has none.
    pub fibre: Option<FibrePoint>,
    /// The factors of the highlight but for the phase function; empty if the yarn has none.
    pub highlight: Vec<Factor>,
    /// The part of the phase function that has a direction, and its uniform part, rad⁻¹.
    pub phase: [f64; 2],
    /// The factors of the diffuse lobe.
    pub diffuse: Vec<Factor>,
    /// Colours of the highlight's peak, of its uniform part, and of the diffuse, linear RGB.
    pub colors: [DVec3; 3],
    /// The irregularity of the highlight, 1.
    pub irregularity: f64,
    /// The opacity of the yarn, 1.
    pub opacity: f64,
    /// f of the highlight and of the diffuse, sr⁻¹, linear RGB.
    pub lobes: [DVec3; 2],
}

/// The fibre that reflects the one direction into the other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FibrePoint {
    /// `twisted`, `untwisted` or `rough`.
    pub kind: &'static str,
    /// Whether it exists, faces both directions, and its highlight is drawn at the place that is looked at.
    /// If not, the highlight is black, and the other numbers may mean nothing.
    pub is_lit: bool,
    /// Inclination along the arc, rad.
    pub u: f64,
    /// The angle around the section, rad.
    pub v: f64,
    /// n·wi and n·wo.
    pub cosines: [f64; 2],
    /// t·wi and t·wo, the fibre tangent.
    pub along: [f64; 2],
}

/// A number of which a value is the product.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Factor {
    /// Its name.
    pub name: &'static str,
    /// Its formula, with the symbols of the crate's page.
    pub formula: &'static str,
    /// What it is here.
    pub value: f64,
}

impl Shader {
    /// Every factor of [`Shader::eval_reference`] at `uv` (m); `None` where that is 0 because there is a
    /// gap, the directions are on two sides, or something is not finite.
    #[must_use]
    pub fn explain(&self, uv: DVec2, wi: DVec3, wo: DVec3) -> Option<Explanation> {
        let (side, wi, wo) = self.oriented(Vector::<f64>::of(wi), Vector::<f64>::of(wo))?;
        self.with_place(&self.materials.double, uv, side, |place| {
            let is_warp = place.segment.is_warp;
            self.explain_at(side, place, to_yarn(wi, is_warp), to_yarn(wo, is_warp))
        })
    }

    fn explain_at(
        &self,
        side: Side,
        place: &Place<'_, f64>,
        wi: Vector<f64>,
        wo: Vector<f64>,
    ) -> Explanation {
        let (look, piece) = (place.look, place.piece);
        let found = piece.has_highlight.then(|| self.explain_highlight(place, wi, wo));
        let (fibre, phase, highlight) =
            found.map_or((None, [0.0; 2], vec![]), |(f, p, h)| (Some(f), p, h));
        let lobes = self.lobes_at(place, wi, wo).map(DVec3::from_array);
        let vector = |w: Vector<f64>| DVec3::new(w.x, w.y, w.z);
        Explanation {
            side,
            point: self.yarn_point(side, place),
            ratio: place.at[2],
            wi_yarn: vector(wi),
            wo_yarn: vector(wo),
            fibre,
            highlight,
            phase,
            diffuse: self.explain_diffuse(place, wi, wo),
            colors: [look.specular[0], look.specular[1], look.color].map(DVec3::from_array),
            irregularity: look.intensity,
            opacity: look.opacity,
            lobes,
        }
    }

    fn explain_highlight(
        &self,
        place: &Place<'_, f64>,
        wi: Vector<f64>,
        wo: Vector<f64>,
    ) -> (FibrePoint, [f64; 2], Vec<Factor>) {
        let optics = &place.piece.optics;
        let [x, y, ratio] = place.at;
        let ((sin_u, cos_u, du_dy), (sin_v, cos_v, dv_dx)) = (optics.along(y), optics.across(x));
        let factor = |name, formula, value| Factor { name, formula, value };
        let window = |is_drawn: bool| factor("window", "χ", f64::from(u8::from(is_drawn)));
        let (kind, root, azimuth, own) = match optics.spread {
            Spread::Staple { delta, .. } => {
                let root = staple::root(optics, sin_u, cos_u, wi, wo);
                let is_drawn = in_window(x, optics.x_of_v(root.sin_v), delta);
                let t = root.tangent(optics);
                let sum = (root.p + root.q).max(1e-30);
                let own = vec![
                    window(is_drawn),
                    factor("height of the window", "1/2δ", 0.5 / delta),
                    factor("mapping", "(du/dy)/sin u_max", du_dy),
                    factor("geometry G", "1/((p+q) |sin ψ|)", 1.0 / (sum * optics.sin_psi.abs())),
                ];
                let root = Root { is_lit: root.is_lit && is_drawn, ..root };
                ("twisted", root, Azimuth::on_cone(t, wi, wo), own)
            }
            Spread::Filament { delta, strength, .. } => {
                let (root, m) = filament::root(optics, sin_v, cos_v, wi, wo);
                let is_drawn = in_window(y, optics.y_of_u(root.sin_u), delta);
                let t = root.tangent(optics);
                let own = vec![
                    window(is_drawn),
                    factor("height of the window", "1/(2δ sin u_e)", strength),
                    factor("mapping", "dv/dx", dv_dx),
                    factor("geometry G", "1/√(H_y² + H_z²)", 1.0 / m),
                    factor(
                        "fading at the ends",
                        "smooth step of u_max − |u|",
                        optics.fade(root.sin_u),
                    ),
                ];
                let root = Root { is_lit: root.is_lit && is_drawn, ..root };
                ("untwisted", root, Azimuth::on_cone(t, wi, wo), own)
            }
            Spread::Rough { inv_variance, scale } => {
                let n = normal(sin_u, cos_u, sin_v, cos_v);
                let (p, q) = (n.dot(wi), n.dot(wo));
                let t = optics.tangent(sin_u, cos_u, sin_v, cos_v);
                let own = vec![
                    factor("mapping", "(du/dy)(dv/dx)/sin u_max", du_dy * dv_dx),
                    factor(
                        "spread along the fibre M",
                        "exp(−s_i s_o/σ²) I₀(c_i c_o/σ²)/(2σ² sinh σ⁻²)",
                        longitudinal([inv_variance, scale], t, wi, wo),
                    ),
                ];
                let is_lit = p > 0.0 && q > 0.0;
                let root = Root { sin_u, cos_u, sin_v, cos_v, p, q, is_lit };
                ("rough", root, Azimuth::about(t, wi, wo), own)
            }
        };
        let Root { sin_u, cos_u, sin_v, cos_v, p, q, is_lit } = root;
        let t = root.tangent(optics);
        let phase = optics.phase.eval(&azimuth);
        let area = optics.area(ratio, optics.bend(sin_u), cos_v);
        let mut factors = own;
        factors.extend([
            factor("area of the yarn", "S − (w/l) sin u_max (S − cos v)", area),
            factor("attenuation A", "pq/(p+q)", p * (q / (p + q).max(1e-30))),
            factor("normalisation a", "1/divisor", 1.0 / place.piece.reflectance.divisor(ratio)),
        ]);
        let fibre = FibrePoint {
            kind,
            is_lit,
            u: sin_u.atan2(cos_u),
            v: sin_v.atan2(cos_v),
            cosines: [p, q],
            along: [t.dot(wi), t.dot(wo)],
        };
        (fibre, [phase.peak, phase.uniform], factors)
    }

    fn explain_diffuse(
        &self,
        place: &Place<'_, f64>,
        wi: Vector<f64>,
        wo: Vector<f64>,
    ) -> Vec<Factor> {
        let Place { piece, at: [x, y, ratio], .. } = *place;
        let factor = |name, formula, value| Factor { name, formula, value };
        let mut factors = Vec::new();
        if piece.has_highlight && self.combination == Combination::Lerp {
            factors.push(factor("share of the diffuse", "1 − k", 1.0 - piece.amount));
        } else if piece.has_highlight {
            let scale = piece.amount / piece.reflectance.divisor(ratio);
            let [of_wi, of_wo] = piece.reflectance.of_both([wi, wo]).map(|of| of.at(ratio));
            factors.push(factor("left by the highlight of wi", "1 − E(wi)", left(scale * of_wi)));
            factors.push(factor("left by the highlight of wo", "1 − E(wo)", left(scale * of_wo)));
            if piece.diffuse_scale.is_none() {
                let of_all = left(scale * piece.mean.at(ratio)).max(1e-3);
                factors.push(factor("over what is left of all", "1/(1 − Ē)", 1.0 / of_all));
            }
        }
        if let Some(scale) = piece.diffuse_scale {
            let ((sin_u, cos_u, _), (sin_v, cos_v, _)) =
                (piece.optics.along(y), piece.optics.across(x));
            let n = normal(sin_u, cos_u, sin_v, cos_v);
            let cosines = n.dot(wi).max(0.0) * n.dot(wo).max(0.0);
            factors.push(factor("cosines of the yarn's normal", "(n·wi)(n·wo)", cosines));
            factors.push(factor("scale of these", "1 over their greatest albedo", scale));
        }
        factors.push(factor("Lambert", "1/π", FRAC_1_PI));
        factors
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Cloth, Diffuse, Highlight, Phase, Thread, Weave, Yarn};

    fn shader(yarn: &Yarn, combination: Combination) -> Shader {
        let weave = Weave::new(5, 5, |end, pick| (2 * pick + end) % 5 != 0).unwrap();
        let thread = Thread { color: [0.5, 0.3, 0.2], pitch: Some(1e-3), ..Thread::default() };
        let mut cloth = Cloth::from_threads(weave, &[thread; 5], &[thread; 5], yarn).unwrap();
        (cloth.combination, cloth.rotation) = (combination, 0.3);
        cloth.yarns.iter_mut().for_each(|own| own.size = yarn.size);
        cloth.prepare().unwrap()
    }

    #[test]
    fn the_product_of_the_factors_is_the_value() {
        let d = Yarn { specular: [0.6, 0.3, 0.1], size: 0.9, opacity: 0.8, ..Yarn::default() };
        let rough = Highlight::Rough { sigma: 0.2 };
        let mut noisy = Yarn { specular_uniform: Some([0.1, 0.4, 0.2]), ..d.clone() };
        noisy.noise.intensity = 0.7;
        noisy.noise.u_max = 0.1;
        let cases = [
            d.clone(),
            Yarn { psi: 0.0, smoothing: 0.4, kappa: 0.5, ..d.clone() },
            Yarn { highlight: rough, diffuse: Diffuse::YarnNormal, ..d.clone() },
            Yarn { phase: Phase::WrappedCauchy { rho: 0.6, is_backward: true }, ..noisy },
            Yarn { specular: [0.0; 3], ..d },
        ];
        for (index, yarn) in cases.iter().enumerate() {
            let combination = [Combination::Layered, Combination::Lerp][index % 2];
            let shader = shader(yarn, combination);
            let (mut lit, mut gaps) = (0, 0);
            for k in 0..4000 {
                let at = |step: f64| (f64::from(k) * step).fract();
                let uv = 5e-3 * DVec2::new(at(0.754_877_666), at(0.569_840_291));
                let direction = |a: f64, b: f64| {
                    let up = if k % 5 == 0 { -1.0 } else { 1.0 };
                    DVec3::new(1.8 * at(a) - 0.9, 1.8 * at(b) - 0.9, 0.8 * up).normalize()
                };
                let (wi, wo) = (
                    direction(0.819_172_513, 0.671_043_607),
                    direction(0.856_674_884, 0.733_891_856),
                );
                let expected = shader.eval_reference(uv, wi, wo);
                let Some(found) = shader.explain(uv, wi, wo) else {
                    assert_eq!(expected, DVec3::ZERO);
                    gaps += 1;
                    continue;
                };
                assert!((found.lobes[0] + found.lobes[1] - expected).abs().max_element() < 1e-12);
                let product = |of: &[Factor]| of.iter().map(|f| f.value).product::<f64>();
                let gain = found.opacity * found.irregularity * product(&found.highlight);
                let fibre = found.fibre.filter(|fibre| fibre.is_lit);
                let specular = fibre.map_or(DVec3::ZERO, |_| {
                    let [peak, uniform] = found.phase;
                    gain * (found.colors[0] * peak + found.colors[1] * uniform)
                });
                let diffuse = found.opacity * product(&found.diffuse) * found.colors[2];
                for (lobe, expected) in [specular, diffuse].into_iter().zip(found.lobes) {
                    let error = (lobe - expected).abs().max_element();
                    let most = 1e-11 * expected.max_element();
                    assert!(error <= most, "{lobe}, expected {expected}: {found:?}");
                }
                lit += u32::from(specular != DVec3::ZERO);
            }
            let has_highlight = yarn.specular != [0.0; 3];
            assert_eq!(lit > 50, has_highlight, "{lit}: {yarn:?}");
            assert!(gaps > 5, "{gaps}: {yarn:?}");
        }
    }

    #[test]
    fn nothing_is_explained_where_nothing_is() {
        let shader = shader(&Yarn { size: 0.5, ..Yarn::default() }, Combination::Layered);
        let (up, down) = (DVec3::Z, -DVec3::Z);
        let (gap, yarn) = (DVec2::splat(1e-9), DVec2::splat(0.5e-3));
        assert_eq!(shader.explain(gap, up, up), None);
        assert_eq!(shader.explain(yarn, up, down), None);
        assert_eq!(shader.explain(DVec2::NAN, up, up), None);
        assert_eq!(shader.explain(yarn, DVec3::NAN, up), None);
    }
}
