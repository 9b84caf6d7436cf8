//! Plots of y over x.

use super::{Axis, Drawing, GRID, INK, Series, draw_series, escaped, words};

const WIDTH: u32 = 560;
const HEIGHT: u32 = 340;
/// Edges of the area of the points: left, top, right, bottom.
const AREA: [f64; 4] = [70.0, 14.0, 544.0, 290.0];

pub(super) fn draw(series: &[Series], x: &Axis, y: &Axis) -> Drawing {
    let [left, top, right, bottom] = AREA;
    let xs = series.iter().flat_map(|s| s.points.iter().map(|point| point[0]));
    let ys = series.iter().flat_map(|s| s.points.iter().map(|point| point[1]));
    let ends = series.iter().flat_map(|s| s.intervals.iter().flatten().copied());
    let (across, up) = (x.scale(xs, 8), y.scale(ys.chain(ends), 6));

    let mut body = String::new();
    let mut grid = String::new();
    for (value, text) in &across.ticks {
        let Some(place) = across.place(*value) else { continue };
        let at = left + place * (right - left);
        grid.push_str(&format!("M{at:.1} {top}V{bottom}"));
        body.push_str(&words([at.round() as u32, bottom as u32 + 18], "middle", text));
    }
    for (value, text) in &up.ticks {
        let Some(place) = up.place(*value) else { continue };
        let at = bottom - place * (bottom - top);
        grid.push_str(&format!("M{left} {at:.1}H{right}"));
        body.push_str(&words([left as u32 - 6, at.round() as u32 + 4], "end", text));
    }
    body.push_str(&format!("<path d=\"{grid}\" style=\"stroke:{GRID}\"/>\n"));
    body.push_str(&format!(
        "<path d=\"M{left} {top}V{bottom}H{right}\" style=\"stroke:{INK}\"/>\n"
    ));
    let middle = [0.5 * (left + right), 0.5 * (top + bottom)];
    body.push_str(&words([middle[0] as u32, HEIGHT - 8], "middle", x.label()));
    body.push_str(&format!(
        "<text transform=\"translate(14 {}) rotate(-90)\" text-anchor=\"middle\" \
         style=\"fill:{INK}\">{}</text>\n",
        middle[1],
        escaped(y.label())
    ));
    // A picture within the picture cuts off what lies outside of it, and needs no name for that.
    let (width, height) = (right - left, bottom - top);
    body.push_str(&format!(
        "<svg x=\"{left}\" y=\"{top}\" width=\"{width}\" height=\"{height}\" \
         viewBox=\"{left} {top} {width} {height}\">\n"
    ));
    body.push_str(&draw_series(series, |[x, y]| {
        let (x, y) = (across.place(x)?, up.place(y)?);
        Some([left + x * width, bottom - y * height])
    }));
    body.push_str("</svg>\n");
    Drawing { width: WIDTH, height: HEIGHT, body }
}
