//! Axes: what they are of, how far they reach, and where their ticks are.

use crate::report::number::significant;

/// An axis of a plot.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    label: String,
    range: Option<[f64; 2]>,
    is_log: bool,
}

/// How far an axis reaches, and where its ticks are.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Scale {
    /// Both ends, as the logarithms to base 10 where `is_log`.
    ends: [f64; 2],
    is_log: bool,
    /// Values, and how they are written.
    pub(super) ticks: Vec<(f64, String)>,
}

impl Axis {
    /// A linear axis that reaches as far as its points. The label has the unit: `θ, °`.
    pub fn new(label: &str) -> Self {
        Self { label: label.to_owned(), range: None, is_log: false }
    }

    /// The same, from `low` to `high`.
    #[must_use]
    pub fn from_to(self, low: f64, high: f64) -> Self {
        Self { range: Some([low, high]), ..self }
    }

    /// The same with a logarithmic scale, which shows numbers above 0.
    #[must_use]
    pub fn log(self) -> Self {
        Self { is_log: true, ..self }
    }

    pub(super) fn label(&self) -> &str {
        &self.label
    }

    /// The scale for `values`, with about `count` ticks.
    pub(super) fn scale(&self, values: impl Iterator<Item = f64>, count: usize) -> Scale {
        let shown = values.filter(|x| x.is_finite() && (!self.is_log || *x > 0.0));
        let inside = |[low, high]: [f64; 2], x: f64| [low.min(x), high.max(x)];
        let reach = shown.fold([f64::INFINITY, f64::NEG_INFINITY], inside);
        let nothing = if self.is_log { [1.0, 10.0] } else { [0.0, 1.0] };
        let reach = self.range.unwrap_or(if reach[0] <= reach[1] { reach } else { nothing });
        if self.is_log {
            logarithmic(reach, self.range.is_some())
        } else {
            self.linear(reach, count)
        }
    }

    fn linear(&self, [mut low, mut high]: [f64; 2], count: usize) -> Scale {
        if low == high {
            let room = if low == 0.0 { 1.0 } else { 0.1 * low.abs() };
            (low, high) = (low - room, high + room);
        }
        let step = step((high - low) / count as f64);
        if self.range.is_none() {
            (low, high) = (step * (low / step).floor(), step * (high / step).ceil());
        }
        let first = (low / step - 1e-9).ceil() as i64;
        let last = (high / step + 1e-9).floor() as i64;
        let decimals = (-step.log10().floor()).max(0.0) as usize;
        let greatest = low.abs().max(high.abs());
        let ticks = (first..=last).map(|k| {
            let value = k as f64 * step;
            let text = if (1e-4..1e7).contains(&greatest) {
                format!("{value:.decimals$}")
            } else {
                significant(value, 3)
            };
            (value, text)
        });
        Scale { ends: [low, high], is_log: false, ticks: ticks.collect() }
    }
}

/// 1, 2 or 5 times a power of ten, at least `width`.
fn step(width: f64) -> f64 {
    let power = 10f64.powf(width.log10().floor());
    [1.0, 2.0, 5.0, 10.0]
        .map(|factor| factor * power)
        .into_iter()
        .find(|step| *step >= width * 0.999)
        .unwrap_or(width)
}

fn logarithmic(reach: [f64; 2], is_fixed: bool) -> Scale {
    let [mut low, mut high] = reach.map(|x| x.max(1e-300).log10());
    // Less than a third of a decade would show no tick.
    if !is_fixed {
        (low, high) = ((3.0 * low).floor() / 3.0, (3.0 * high).ceil() / 3.0);
    }
    if high - low < 0.5 {
        (low, high) = (low - 0.25, high + 0.25);
    }
    let decades = high - low;
    let every = (decades / 8.0).ceil().max(1.0) as i64;
    let factors: &[f64] = if decades < 2.5 { &[1.0, 2.0, 5.0] } else { &[1.0] };
    let powers = (low.floor() as i64..=high.ceil() as i64).filter(|power| power % every == 0);
    let values = powers.flat_map(|power| factors.iter().map(move |f| f * 10f64.powi(power as i32)));
    let shown = values.filter(|value| {
        let at = value.log10();
        (low - 1e-9..=high + 1e-9).contains(&at)
    });
    let ticks = shown.map(|value| (value, significant(value, 3))).collect();
    Scale { ends: [low, high], is_log: true, ticks }
}

impl Scale {
    /// Where `value` is: 0 at the beginning, 1 at the end; `None` where it cannot be shown.
    pub(super) fn place(&self, value: f64) -> Option<f64> {
        let value = if self.is_log { value.log10() } else { value };
        let [low, high] = self.ends;
        let place = (value - low) / (high - low);
        // Far outside, other programs' numbers would overflow; what lies there is cut off anyway.
        place.is_finite().then(|| place.clamp(-10.0, 10.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ticks(axis: &Axis, values: &[f64]) -> Vec<String> {
        let scale = axis.scale(values.iter().copied(), 6);
        scale.ticks.into_iter().map(|(_, text)| text).collect()
    }

    #[test]
    fn ticks_are_round_numbers() {
        let linear = Axis::new("x");
        assert_eq!(ticks(&linear, &[0.0, 1.0]), ["0.0", "0.2", "0.4", "0.6", "0.8", "1.0"]);
        assert_eq!(ticks(&linear, &[-3.0, 88.0]), ["-20", "0", "20", "40", "60", "80", "100"]);
        assert_eq!(ticks(&linear.clone().from_to(0.0, 90.0), &[]), ["0", "20", "40", "60", "80"]);
        assert_eq!(ticks(&linear, &[f64::NAN, 1.0, 1.0]).len(), 5);
        let log = Axis::new("x").log();
        assert_eq!(ticks(&log, &[0.0, 1e-3, 1.0]), ["0.001", "0.01", "0.1", "1"]);
        assert_eq!(ticks(&log, &[1.0, 20.0]), ["1", "2", "5", "10", "20"]);
        assert_eq!(ticks(&log, &[1e-16, 1.0]).len(), 9);
    }

    #[test]
    fn places_go_from_0_to_1() {
        let scale = Axis::new("x").log().from_to(1e-2, 1e2).scale(std::iter::empty(), 6);
        assert_eq!([1e-2, 1.0, 1e2].map(|x| scale.place(x)), [Some(0.0), Some(0.5), Some(1.0)]);
        assert_eq!([0.0, -1.0, f64::NAN, f64::INFINITY].map(|x| scale.place(x)), [None; 4]);
    }
}
