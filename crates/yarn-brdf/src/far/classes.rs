//! Which pieces of yarn a side of the cloth shows, and how much of its area is each.

use std::collections::HashMap;

use crate::shader::Shader;
use crate::threads::Constant;
use crate::weave::{Position, Side};

/// Pieces of yarn that are alike.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Class {
    /// Index of the type of yarn.
    pub(super) yarn: u16,
    pub(super) is_warp: bool,
    pub(super) is_straight: bool,
    /// Width over length, 0 of a straight piece.
    pub(super) ratio: f64,
    /// Share of the area of the repeat.
    pub(super) share: f64,
}

/// The most crossings that are looked at: of more, so many, spread evenly.
const MOST: u64 = 1 << 20;

impl Shader {
    /// The pieces that `side` shows over one repeat, by their first crossing. Threads whose size
    /// changes have their mean size.
    ///
    /// A segment that is on top of n crossings counts at each of them with an nth of its area; of a slit
    /// between parallel threads the pair that it lies between counts.
    pub(super) fn classes(&self, side: Side) -> Vec<Class> {
        let threads = &self.threads;
        let types = self.materials.kinds.len();
        let sizes = threads.mean_sizes(types);
        let of_types = Constant { threads, sizes: &sizes };
        let (ends, picks) = (u64::from(self.weave.ends()), u64::from(self.weave.picks()));
        let count = (ends * picks).min(MOST);
        let mut known = HashMap::new();
        let mut classes = Vec::<Class>::new();
        let mut add = |class: Class| {
            let key = (class.yarn, class.is_warp, class.is_straight, class.ratio.to_bits());
            let index = *known.entry(key).or_insert(classes.len());
            match classes.get_mut(index) {
                Some(same) => same.share += class.share,
                None => classes.push(class),
            }
        };
        for k in 0..count {
            // All, or evenly spread ones.
            let index = (u128::from(k) * u128::from(ends * picks) / u128::from(count)) as u64;
            let (end, pick) = ((index % ends) as i64, (index / ends) as i64);
            let middle = Position { cell: [end, pick], fraction: [0.5; 2] };
            let Some(segment) = self.weave.segment_at(side, middle, &of_types) else { continue };
            let area = segment.width * segment.length / f64::from(segment.crossings);
            add(Class {
                yarn: threads.yarn(&segment),
                is_warp: segment.is_warp,
                is_straight: segment.is_straight(),
                ratio: self.shape(&segment),
                share: area / count as f64,
            });
            let next = if segment.is_warp { [end + 1, pick] } else { [end, pick + 1] };
            let is_parallel =
                self.weave.warp_on_top(next[0], next[1]) == self.weave.warp_on_top(end, pick);
            if !is_parallel || !threads.have_gaps() {
                continue;
            }
            let yarn_of = |is_warp: bool, [end, pick]: [i64; 2]| {
                let (thread, count) = if is_warp { (end, ends) } else { (pick, picks) };
                threads.yarn_of(is_warp, (thread as u64 % count) as u32)
            };
            let size_of = |yarn: u16| sizes[usize::from(yarn)];
            let slit = |cell| 0.5 * (1.0 - size_of(yarn_of(segment.is_warp, cell)));
            let below = yarn_of(!segment.is_warp, [end, pick]);
            let share = (slit([end, pick]) + slit(next)) * size_of(below) / count as f64;
            if share > 0.0 {
                let is_warp = !segment.is_warp;
                add(Class { yarn: below, is_warp, is_straight: true, ratio: 0.0, share });
            }
        }
        classes
    }
}
