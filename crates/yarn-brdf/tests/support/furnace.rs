//! The white furnace: how much cloths of random yarns reflect.

#![allow(dead_code, reason = "not every user needs all of it")]

use selvedge_normalize::halton::Halton;
use selvedge_yarn_brdf::glam::DVec2;
use selvedge_yarn_brdf::{Combination, Diffuse, Mapping, Mode, Yarn};

use super::yarns::{USUAL, WIDEST, cloth, direction, on_end, yarn};

/// What the quadrature of the check itself may be off by.
pub(crate) const CHECK: f64 = 1e-3;

/// The `i`-th yarn with what matters to the energy of a cloth beside the shape of the highlight.
pub(crate) fn furnished(i: u32) -> Yarn {
    let shape = yarn(i, &WIDEST);
    Yarn {
        specular_uniform: (i % 7 == 2).then_some([0.3, 1.0, 0.6]),
        diffuse: if i % 5 == 3 { Diffuse::YarnNormal } else { Diffuse::Flat },
        opacity: if i % 3 == 1 { 0.7 } else { 1.0 },
        size: if i % 4 == 2 { 0.6 } else { 1.0 },
        ..shape
    }
}

/// The greatest share of light that the `i`-th cloth reflects or lets through.
pub(crate) fn greatest(i: u32, mode: Mode, combination: Combination) -> (f64, String) {
    let float = [2, 3, 6][i as usize % 3];
    let mut cloth = cloth(&vec![furnished(i); float]);
    cloth.mapping = if i.is_multiple_of(2) { Mapping::Arcsine } else { Mapping::Linear };
    // Ends of segments a third as long as wide among them, which cannot bend far.
    cloth.pitch.y *= if i % 9 == 4 { 0.34 } else { 1.0 };
    (cloth.normalization, cloth.combination) = (mode, combination);
    let shader = cloth.prepare().expect("every parameter is in range");
    let points = Halton::<2>::new();
    let shares = (0..8).filter_map(|j| {
        let [x, y] = points.point((9 * i + j + 1).try_into().expect("not 0"));
        let uv = cloth.size() * DVec2::new(x, y);
        let wo = direction(9 * i + j);
        let albedo = match mode {
            Mode::Pointwise => shader.albedo_at(uv, wo),
            Mode::Segment | Mode::None => shader.albedo_of_segment(uv, wo),
        };
        let covered = f64::from(shader.opacity(uv));
        // What falls into a gap goes through.
        (covered > 0.0).then(|| (albedo.max_element() + 1.0 - covered, uv, wo))
    });
    let nothing = (0.0, DVec2::ZERO, direction(0));
    let (share, uv, wo) = shares.max_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or(nothing);
    let kind = &cloth.yarns[0];
    let what = format!("{mode:?} {combination:?} {i}: {share} at {uv} for {wo}, {kind:?}");
    (share, what)
}

/// The least and the greatest share that the white cloth of the `i`-th yarn reflects, at `k` from 0 to 1.
pub(crate) fn reflected_by_white(i: u32, directions: u32) -> [(f64, String); 2] {
    let shares = [0.0, 0.2, 0.5, 0.8, 1.0];
    let full = yarn(i, &USUAL);
    let of = |k: f32| Yarn { specular: [k; 3], ..full.clone() };
    let shader = cloth(&shares.map(of)).prepare().expect("every parameter is in range");
    let found = (0..directions).flat_map(|j| {
        let wo = direction(directions * i + j);
        let shader = &shader;
        let full = &full;
        (0..shares.len()).map(move |end| {
            let k = shares[end];
            let albedo = shader.albedo_of_segment(on_end(end, shares.len(), 0.5, 0.5), wo).x;
            (albedo, format!("{i}: {albedo} at k = {k} for {wo}, {full:?}"))
        })
    });
    let found: Vec<(f64, String)> = found.collect();
    let least = found.iter().min_by(|a, b| a.0.total_cmp(&b.0));
    let greatest = found.iter().max_by(|a, b| a.0.total_cmp(&b.0));
    [least, greatest].map(|extreme| extreme.expect("there are some").clone())
}
