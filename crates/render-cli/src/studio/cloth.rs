//! What a cloth is made of, for the panel.

use std::{collections::BTreeMap, num::NonZeroU32};

use glam::{DVec2, Vec2, Vec3};
use selvedge_normalize::{halton::Halton, scale::Normalization, warp::square_to_cosine_hemisphere};
use selvedge_yarn_brdf::{Cloth, Shader, Yarn};
use serde_json::{Map, Value, json};

use super::{document::Document, parameters::name_of, reply::value_of};
use crate::{
    fabric,
    image::{View, luminance},
};

/// `#rrggbb` of linear light.
pub(super) fn srgb(color: [f32; 3]) -> String {
    let [r, g, b] = View::Srgb.bytes(Vec3::from(color));
    format!("#{r:02x}{g:02x}{b:02x}")
}

/// The numbers of a yarn, by name: those that it has.
pub(super) fn values(yarn: &Yarn) -> Map<String, Value> {
    let parameters = Yarn::parameters().iter();
    let values = parameters.filter_map(|p| Some((p.name.to_owned(), p.of(yarn)?.into())));
    values.collect()
}

/// The types of yarn with all their parameters, and the colours of the draft.
pub(super) fn describe(document: &Document) -> Value {
    let Document { cloth, source, drawdown, .. } = document;
    let [ends, picks] = fabric::threads(drawdown);
    let overrides = &source.fabric().overrides;
    let mut palette = BTreeMap::<u32, ([f32; 3], [usize; 2])>::new();
    let mut types = vec![([0, 0], None::<Vec<usize>>, Vec::<u32>::new()); cloth.yarns.len()];
    for (side, threads, yarns) in [(0, &ends, &cloth.end_yarns), (1, &picks, &cloth.pick_yarns)] {
        for ((thread, &yarn), number) in threads.iter().zip(yarns).zip(1..) {
            let (counts, rules, colors) = &mut types[usize::from(yarn)];
            counts[side] += 1;
            // They are the same for all threads of a type.
            rules.get_or_insert_with(|| {
                let applies = |&index: &usize| overrides[index].matches(side == 0, number, thread);
                (0..overrides.len()).filter(applies).map(|index| index + 1).collect()
            });
            if let Some(color) = thread.color_number {
                if !colors.contains(&color) {
                    colors.push(color);
                }
                palette.entry(color).or_insert((thread.color, [0, 0])).1[side] += 1;
            }
        }
    }
    let yarns = cloth.yarns.iter().zip(types).enumerate();
    let yarns = yarns.map(|(index, (yarn, ([ends, picks], rules, colors)))| {
        json!({
            "index": index,
            "color": value_of(&yarn.color),
            "srgb": srgb(yarn.color),
            "specular": value_of(&yarn.specular),
            "specular_srgb": srgb(yarn.specular),
            "specular_uniform": value_of(&yarn.specular_uniform),
            "ends": ends,
            "picks": picks,
            "color_numbers": colors,
            "overrides": rules.unwrap_or_default(),
            "kind": {
                "highlight": name_of(&json!(yarn.highlight)),
                "phase": name_of(&json!(yarn.phase)),
                "diffuse": name_of(&json!(yarn.diffuse)),
            },
            "values": values(yarn),
        })
    });
    let palette = palette.into_iter().map(|(number, (color, [ends, picks]))| {
        json!({ "number": number, "srgb": srgb(color), "ends": ends, "picks": picks })
    });
    json!({
        "revision": document.revision,
        "yarns": yarns.collect::<Vec<_>>(),
        "palette": palette.collect::<Vec<_>>(),
    })
}

/// By how much the highlights are scaled so that they reflect no more than they receive.
pub(super) fn energy(cloth: &Cloth, shader: &Shader) -> Value {
    let yarns = (0..cloth.yarns.len()).filter_map(|index| {
        let both = shader.normalization(u16::try_from(index).ok()?)?;
        let factors = both.map(|of: Normalization| of.factor);
        let albedos = both.map(|of| of.upper_bound);
        let least = factors[0].min(factors[1]);
        // It is white here; what is left of it after its colour may be within bounds as it is.
        let amount = cloth.yarns[index].specular.into_iter().fold(0.0, f32::max);
        let is_clamped = least < 1.0 && amount > 0.0;
        let warning = is_clamped.then(|| {
            format!(
                "yarn {index}: its highlight would reflect up to {:.2} of the light, lowered to {least:.2} of it",
                albedos[0].max(albedos[1])
            )
        });
        Some(json!({
            "yarn": index,
            "factors": factors,
            "albedo": albedos,
            "is_clamped": is_clamped,
            "warning": warning,
        }))
    });
    json!({
        "lowered": shader.lowered().iter().map(ToString::to_string).collect::<Vec<_>>(),
        "yarns": yarns.collect::<Vec<_>>(),
    })
}

/// Step between directions, degrees, and their number.
const STEP: u32 = 5;
const STEPS: u32 = 18;

/// Places of the cloth that are tried, those of the type that are taken, and directions at each.
const TRIES: usize = 20_000;
const PLACES: usize = 96;
const DIRECTIONS: usize = 24;

/// Share of the light that the type of yarn `index` reflects, by how far it comes from the normal, in
/// the plane along the yarn: luminance of its highlight and of all. `None` if it is nowhere seen.
pub(super) fn albedo(cloth: &Cloth, shader: &Shader, index: u16) -> Option<Value> {
    let size = cloth.size() / cloth.scale;
    let points = Halton::<2>::new().points_from(NonZeroU32::MIN).take(TRIES);
    let places = points.filter_map(|[x, y]| {
        let uv = size * DVec2::new(x, y);
        let seen = shader.yarn_at(uv).filter(|seen| seen.yarn == index)?;
        Some((uv, seen.segment.is_warp))
    });
    let places: Vec<_> = places.take(PLACES).collect();
    if places.is_empty() {
        return None;
    }
    // Weft and warp lie turned against u and v.
    let along = |is_warp: bool| {
        let weft = Vec2::from_angle(-cloth.rotation as f32);
        if is_warp { weft.perp() } else { weft }
    };
    let mut highlight = Vec::new();
    let mut total = Vec::new();
    for step in 0..STEPS {
        let (sin, cos) = ((step * STEP) as f32).to_radians().sin_cos();
        let mut sums = [0.0; 2];
        // Another part of the sequence at each place, drawn by the cosine.
        let mut directions = Halton::<2>::new().points_from(NonZeroU32::MIN);
        for &(uv, is_warp) in &places {
            let wi = (along(is_warp) * sin).extend(cos);
            for [a, b] in directions.by_ref().take(DIRECTIONS) {
                let wo = square_to_cosine_hemisphere(DVec2::new(a, b)).as_vec3();
                let lobes = shader.eval_lobes(uv, wi, wo);
                sums[0] += f64::from(luminance(lobes.specular));
                sums[1] += f64::from(luminance(lobes.specular + lobes.diffuse));
            }
        }
        let mean = |sum: f64| std::f64::consts::PI * sum / (places.len() * DIRECTIONS) as f64;
        highlight.push(mean(sums[0]));
        total.push(mean(sums[1]));
    }
    let theta: Vec<_> = (0..STEPS).map(|step| step * STEP).collect();
    Some(json!({ "yarn": index, "theta": theta, "highlight": highlight, "total": total }))
}
