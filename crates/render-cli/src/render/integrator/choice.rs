//! Which of the lights of a vertex is looked for.

use glam::Vec3;

use super::vertex::{Lit, Lobes};

/// The share of the choice among lights that is even, whatever they bring: where the one that brings most
/// is in the shadow, another one has to be looked at. Of six equal lights in sight, a tenth of it would take
/// 6 % off the noise.
const EVEN: f32 = 0.25;

/// What weighs more is as good as this: the sum of a few is a number.
const HUGE: f32 = 1e37;

/// One of the lights `lit` of a vertex, chosen by `xi` in [0, 1) mostly in proportion to what it brings if
/// nothing is in its way, and what stands for all of them if so, given f of each. `None` if none brings
/// anything.
///
/// The choice is what a sum of all lights costs that looks for one of them alone (Talbot, Cline & Egbert
/// 2005).
pub(super) fn choose<'a>(lit: &'a [Lit], f: &[Lobes], xi: f32) -> Option<(&'a Lit, Lobes)> {
    let brought = || lit.iter().zip(f).map(|(lit, lobes)| lobes.scaled(lit.weight));
    let weight = |lobes: Lobes| (lobes.diffuse + lobes.other).element_sum().min(HUGE);
    let (sum, count) = brought()
        .map(weight)
        .filter(|&weight| weight > 0.0)
        .fold((0.0, 0), |(sum, count), weight| (sum + weight, count + 1));
    let mut rest = xi;
    let mut chosen = None;
    for (lit, lobes) in lit.iter().zip(brought()) {
        let weight = weight(lobes);
        if weight > 0.0 {
            let probability = (1.0 - EVEN) * (weight / sum) + EVEN / count as f32;
            chosen = Some((lit, lobes.scaled(Vec3::splat(1.0 / probability))));
            rest -= probability;
            if rest < 0.0 {
                break;
            }
        }
    }
    chosen
}
