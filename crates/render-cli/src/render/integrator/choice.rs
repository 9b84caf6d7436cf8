//! Which one of several things stands for all of them.

use glam::Vec3;

use super::vertex::{Lit, Lobes};

/// The share of the choice among several lights that is even, whatever they bring: where the one that brings most
/// is in the shadow, another one has to be looked at. Of six equal lights in sight, a tenth of it would take
/// 6 % off the noise.
const EVEN: f32 = 0.25;

/// What weighs more is as good as this: the sum of a few is a number.
const HUGE: f32 = 1e37;

/// One of the lights `lit` of a vertex, chosen by `xi` in [0, 1) mostly in proportion to what it brings if
/// nothing is in its way, be it less than nothing, and what stands for all of them if so, given f of each. `None` if none brings
/// anything.
///
/// The choice is what a sum of all lights costs that looks for one of them alone (Talbot, Cline & Egbert
/// 2005).
pub(super) fn choose<'a>(lit: &'a [Lit], f: &[Lobes], xi: f32) -> Option<(&'a Lit, Lobes)> {
    let brought = |(lit, lobes): (&Lit, &Lobes)| lobes.scaled(lit.weight);
    let weights =
        lit.iter().zip(f).map(brought).map(|lobes| weight((lobes.diffuse + lobes.other).abs()));
    // What is in the way of one light is mostly in the way of all directions to it.
    let is_one = lit.iter().all(|other| other.light == lit[0].light);
    let even = if is_one { 0.0 } else { EVEN };
    let (k, probability) = pick(weights, even, xi)?;
    Some((&lit[k], brought((&lit[k], &f[k])).scaled(Vec3::splat(1.0 / probability))))
}

/// By which colours are chosen.
pub(super) fn weight(color: Vec3) -> f32 {
    color.element_sum().min(HUGE)
}

/// The number of one of the `weights`, chosen by `xi` in [0, 1), and its probability: in proportion to it but for
/// a share `even`, which those above 0 have in common. `None` if there are none.
pub(super) fn pick(
    weights: impl Iterator<Item = f32> + Clone,
    even: f32,
    xi: f32,
) -> Option<(usize, f32)> {
    let weights = weights.enumerate().filter(|&(_, weight)| weight > 0.0);
    let (sum, count) =
        weights.clone().fold((0.0, 0), |(sum, count), (_, weight)| (sum + weight, count + 1));
    let mut rest = xi;
    let mut picked = None;
    for (k, weight) in weights {
        let probability = (1.0 - even) * (weight / sum) + even / count as f32;
        picked = Some((k, probability));
        rest -= probability;
        if rest < 0.0 {
            break;
        }
    }
    picked
}
