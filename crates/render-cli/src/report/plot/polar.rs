//! Plots of radii over angles, above a surface seen from its side.

use super::{Axis, Drawing, GRID, INK, Series, draw_series, words};

const WIDTH: u32 = 480;
const HEIGHT: u32 = 290;
/// The foot of the normal, and the greatest radius.
const FOOT: [f64; 2] = [240.0, 246.0];
const REACH: f64 = 214.0;

pub(super) fn draw(series: &[Series], radius: &str) -> Drawing {
    let radii = series.iter().flat_map(|s| s.points.iter().map(|point| point[1]));
    let scale = Axis::new(radius).scale(radii.chain([0.0]), 4);
    let at = |degrees: f64, share: f64| {
        let (sin, cos) = degrees.to_radians().sin_cos();
        [FOOT[0] + REACH * share * sin, FOOT[1] - REACH * share * cos]
    };
    let (mut grid, mut body) = (String::new(), String::new());
    for degrees in (-90..=90).step_by(30) {
        let [x, y] = at(f64::from(degrees), 1.0);
        grid.push_str(&format!("M{} {}L{x:.1} {y:.1}", FOOT[0], FOOT[1]));
        let [x, y] = at(f64::from(degrees), 1.07);
        body.push_str(&words([x as u32, y as u32 + 4], "middle", &format!("{degrees}°")));
    }
    for (value, text) in &scale.ticks {
        let Some(share) = scale.place(*value).filter(|share| (0.01..1.001).contains(share)) else {
            continue;
        };
        let ([left, y], [right, _], reach) = (at(-90.0, share), at(90.0, share), share * REACH);
        grid.push_str(&format!("M{left:.1} {y:.1}A{reach:.1} {reach:.1} 0 0 1 {right:.1} {y:.1}"));
        body.push_str(&words([right as u32, FOOT[1] as u32 + 18], "middle", text));
    }
    body.push_str(&format!("<path d=\"{grid}\" style=\"stroke:{GRID}\"/>\n"));
    let ([left, y], [right, _]) = (at(-90.0, 1.0), at(90.0, 1.0));
    body.push_str(&format!("<path d=\"M{left:.1} {y:.1}H{right:.1}\" style=\"stroke:{INK}\"/>\n"));
    body.push_str(&words([FOOT[0] as u32, HEIGHT - 8], "middle", radius));
    body.push_str(&draw_series(series, |[degrees, radius]| {
        degrees.is_finite().then_some(())?;
        Some(at(degrees, scale.place(radius)?.clamp(0.0, 1.0)))
    }));
    Drawing { width: WIDTH, height: HEIGHT, body }
}
