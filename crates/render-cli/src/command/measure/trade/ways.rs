//! The ways that are tried.

use selvedge_yarn_brdf::Instructions;

use crate::{
    args::MeasureOptions,
    measure::trade::{Way, normalization::Search},
    render::detail::{Level, Tier},
    report::Table,
};

/// Samples of a pixel in the longest run.
const MOST_SPP: u32 = 64;

/// Samples per pixel within the budget: a power of two, at least 4.
pub(super) fn spp(options: &MeasureOptions, most: u32) -> u32 {
    let most = f64::from(most) * options.budget.sqrt();
    (most as u32).clamp(4, 1 << 15).next_power_of_two()
}

/// All ways that are tried, the usual one first.
pub(super) fn all(options: &MeasureOptions) -> Vec<Way> {
    let most = spp(options, MOST_SPP);
    let some = most / 4;
    let mut ways = vec![Way::usual("usual", most)];
    for (name, level) in [("near", Level::Near), ("far", Level::Far)] {
        ways.push(Way { level, ..Way::usual(name, most) });
    }
    ways.push(Way { is_other_highlight: true, ..Way::usual("other highlight", most) });
    for noise in [0.4, 0.2, 0.1] {
        let mut way = Way::usual(&format!("noise {noise}"), 2 * most);
        way.limits.noise = Some(noise);
        ways.push(way);
    }
    for (directions, samples) in [(8, 16), (32, 128), (128, 1024)] {
        let search = Some(Search { directions, samples });
        let name = format!("{directions} x {samples} samples");
        ways.push(Way { search, ..Way::usual(&name, some) });
    }
    // What is far is not shaded by batches, so tiers are told apart near.
    let near = |name: &str, spp| Way { level: Level::Near, ..Way::usual(name, spp) };
    ways.push(Way { tier: Tier::Single, ..near("near, single points", some) });
    ways.push(Way { tier: Tier::Reference, ..near("near, single points, f64", some) });
    let available = Instructions::available();
    for &instructions in &available[..available.len().saturating_sub(1)] {
        let name = format!("near, batches, {instructions:?}").to_lowercase();
        ways.push(Way { instructions: Some(instructions), ..near(&name, some) });
    }
    ways
}

/// What is told of them.
pub(super) fn table(ways: &[Way]) -> Table {
    let mut table = Table::new("ways", ["way", "what differs from the usual one"]);
    for way in ways {
        let best = Instructions::available().last().map(|best| format!("{best:?}").to_lowercase());
        let what = match (way.search, way.limits.noise) {
            (Some(Search { directions, samples }), _) => format!(
                "the factor of the highlight is sought among {directions} directions with {samples} \
                 samples each, not by quadrature"
            ),
            (_, Some(noise)) => format!("adaptive: until the noise of each tile is {noise}"),
            _ if way.is_other_highlight => {
                "a window of δ = 0.3 where the cloth has rough fibres, and rough fibres of σ = 0.15 where \
                 it has a window: another look, whose error is no noise"
                    .to_owned()
            }
            _ if way.tier == Tier::Single => "as near, one place after the other".to_owned(),
            _ if way.tier == Tier::Reference => {
                "as near, one place after the other, in f64".to_owned()
            }
            _ if way.instructions.is_some() => "as near, with older instructions".to_owned(),
            _ if way.level == Level::Near => "each thread is shaded, however small".to_owned(),
            _ if way.level == Level::Far => {
                "all threads together are shaded, however large".to_owned()
            }
            _ => format!(
                "batches, {}, f32; threads as far as they can be seen; quadrature",
                best.unwrap_or_default()
            ),
        };
        table.row([way.name.as_str().into(), what.into()]);
    }
    table
}
