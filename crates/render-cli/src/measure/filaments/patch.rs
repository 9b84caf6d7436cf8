//! A piece of yarn as seen from above, and what can be told of its streak.

use rayon::prelude::*;

/// Brightness over a rectangle about the middle of a piece of yarn. Lengths are in half its width.
#[derive(Clone, Debug, PartialEq)]
pub struct Patch {
    /// Pixels across and along.
    pub size: [usize; 2],
    /// Half the extent along; across it is 1.
    pub half_length: f64,
    /// Rows from the near end, y = −`half_length`.
    pub pixels: Vec<f64>,
}

/// Where a streak lies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Streak {
    /// Its middle.
    pub center: [f64; 2],
    /// Angle from the direction of the yarn towards +x of the line along which it extends most, rad,
    /// in (−π/2, π/2].
    pub angle: f64,
}

impl Patch {
    /// The means of `brightness` over pixels `across` in number, as wide as long: each of `side`² points.
    ///
    /// `brightness` is given the point (x, y) and an index that is unique to it.
    pub fn new(
        across: usize,
        half_length: f64,
        side: usize,
        brightness: impl Fn([f64; 2], u64) -> f64 + Sync,
    ) -> Self {
        let along = (across as f64 * half_length).round().max(1.0) as usize;
        let pixels = (0..across * along).into_par_iter().map(|index| {
            let (column, row) = (index % across, index / across);
            let sum: f64 = (0..side * side)
                .map(|k| {
                    let place = |pixel: usize, part: usize, count: usize| {
                        let part = (part as f64 + 0.5) / side as f64;
                        2.0 * (pixel as f64 + part) / count as f64 - 1.0
                    };
                    let x = place(column, k % side, across);
                    let y = half_length * place(row, k / side, along);
                    brightness([x, y], (index * side * side + k) as u64)
                })
                .sum();
            sum / (side * side) as f64
        });
        Self { size: [across, along], half_length, pixels: pixels.collect() }
    }

    /// The greatest brightness.
    pub fn peak(&self) -> f64 {
        self.pixels.iter().copied().fold(0.0, f64::max)
    }

    /// The mean brightness.
    pub fn mean(&self) -> f64 {
        self.pixels.iter().sum::<f64>() / self.pixels.len() as f64
    }

    /// The middle of a pixel.
    fn place(&self, index: usize) -> [f64; 2] {
        let [across, along] = self.size;
        let middle = |k: usize, count: usize| (2.0 * k as f64 + 1.0) / count as f64 - 1.0;
        [middle(index % across, across), self.half_length * middle(index / across, along)]
    }

    /// The streak: the middle of all light and the axis about which it has least inertia; `None` in
    /// the dark.
    pub fn streak(&self) -> Option<Streak> {
        let total: f64 = self.pixels.iter().sum();
        let mean = |f: &dyn Fn([f64; 2]) -> f64| {
            let light = self.pixels.iter().enumerate();
            light.map(|(k, light)| light * f(self.place(k))).sum::<f64>() / total
        };
        let center = [mean(&|p| p[0]), mean(&|p| p[1])];
        let moment = |a: usize, b: usize| mean(&|p| (p[a] - center[a]) * (p[b] - center[b]));
        let angle = 0.5 * (2.0 * moment(0, 1)).atan2(moment(1, 1) - moment(0, 0));
        (total > 0.0).then_some(Streak { center, angle })
    }

    /// The mean brightness over lines along `streak`, by their distance from it: of `bins` from −`reach`
    /// to `reach`, those that meet the patch, each with the distance of its middle, positive on the side
    /// of +x.
    pub fn profile(&self, streak: &Streak, reach: f64, bins: usize) -> Vec<(f64, f64)> {
        let (sin, cos) = streak.angle.sin_cos();
        let mut sums = vec![(0.0, 0u32); bins];
        for (index, light) in self.pixels.iter().enumerate() {
            let [x, y] = self.place(index);
            let off = (x - streak.center[0]) * cos - (y - streak.center[1]) * sin;
            let bin = ((off / reach + 1.0) * 0.5 * bins as f64).floor();
            if (0.0..bins as f64).contains(&bin) {
                let (sum, count) = &mut sums[bin as usize];
                *sum += light;
                *count += 1;
            }
        }
        let middle = |bin: usize| reach * ((2.0 * bin as f64 + 1.0) / bins as f64 - 1.0);
        let bins = sums.into_iter().enumerate().filter(|(_, (_, count))| *count > 0);
        bins.map(|(bin, (sum, count))| (middle(bin), sum / f64::from(count))).collect()
    }

    /// The mean brightness of each row, with its y.
    pub fn rows(&self) -> Vec<(f64, f64)> {
        let across = self.size[0];
        let rows = self.pixels.chunks(across).enumerate();
        rows.map(|(row, light)| {
            (self.place(row * across)[1], light.iter().sum::<f64>() / across as f64)
        })
        .collect()
    }
}

/// The root mean square difference of two profiles over the places where either is above a twentieth
/// of the greatest value of the second, over that value: 1, ≥ 0.
///
/// # Panics
///
/// If they are not of the same places.
pub fn profile_error(found: &[(f64, f64)], expected: &[(f64, f64)]) -> f64 {
    assert_eq!(found.len(), expected.len(), "profiles are of the same places");
    let peak = expected.iter().map(|(_, value)| *value).fold(0.0, f64::max);
    let (mut sum, mut count) = (0.0, 0u32);
    for ((_, found), (_, expected)) in found.iter().zip(expected) {
        if found.max(*expected) > 0.05 * peak {
            sum += (found - expected).powi(2);
            count += 1;
        }
    }
    if count == 0 { 0.0 } else { (sum / f64::from(count)).sqrt() / peak }
}

/// The angle between two lines, rad, in [0, π/2].
pub fn angle_between(a: f64, b: f64) -> f64 {
    let turned = (a - b).rem_euclid(core::f64::consts::PI);
    turned.min(core::f64::consts::PI - turned)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ridge(angle: f64) -> Patch {
        Patch::new(40, 3.0, 3, |[x, y], _| {
            let off = (x - 0.1) * angle.cos() - (y + 0.2) * angle.sin();
            let along = (x - 0.1) * angle.sin() + (y + 0.2) * angle.cos();
            (-off * off / 0.005 - along * along / 0.1).exp()
        })
    }

    #[test]
    fn streak_lies_where_it_was_drawn() {
        for degrees in [-60.0f64, -20.0, 0.0, 35.0, 80.0] {
            let streak = ridge(degrees.to_radians()).streak().unwrap();
            assert!(
                angle_between(streak.angle, degrees.to_radians()) < 2e-3,
                "{degrees}: {streak:?}"
            );
            let [x, y] = streak.center;
            assert!((x - 0.1).hypot(y + 0.2) < 5e-3, "{degrees}: {streak:?}");
        }
        assert_eq!(Patch::new(4, 2.0, 1, |_, _| 0.0).streak(), None);
    }

    #[test]
    fn profiles_differ_by_what_is_added() {
        let (a, b) = (ridge(0.5), ridge(0.5));
        let streak = a.streak().unwrap();
        let (a, mut b) = (a.profile(&streak, 1.0, 32), b.profile(&streak, 1.0, 32));
        assert_eq!(profile_error(&a, &b), 0.0);
        let peak = a.iter().map(|(_, value)| *value).fold(0.0, f64::max);
        b.iter_mut().for_each(|(_, value)| *value += 0.1 * peak);
        let error = profile_error(&b, &a);
        assert!((error - 0.1).abs() < 1e-12, "{error}");
    }
}
