//! Plots as static SVG, whose colours follow the page and stand for themselves elsewhere.

mod axis;
mod polar;
mod square;

use std::fmt::Write;

pub use axis::Axis;

use super::table::csv_field;

/// Points in a plane, in series that differ by colour and dashes.
#[derive(Clone, Debug, PartialEq)]
pub struct Plot {
    name: String,
    title: String,
    kind: Kind,
    series: Vec<Series>,
}

#[derive(Clone, Debug, PartialEq)]
enum Kind {
    Square {
        x: Axis,
        y: Axis,
    },
    /// The half above the surface; the words are what the radius is.
    Polar(String),
}

/// Points that belong together.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    name: String,
    points: Vec<[f64; 2]>,
    intervals: Vec<[f64; 2]>,
    labels: Vec<String>,
    has_line: bool,
    has_marks: bool,
}

impl Series {
    fn new(name: &str, points: Vec<[f64; 2]>, has_line: bool) -> Self {
        Self {
            name: name.to_owned(),
            points,
            intervals: Vec::new(),
            labels: Vec::new(),
            has_line,
            has_marks: !has_line,
        }
    }

    /// A line through points. Where one is not finite, or not above 0 on a logarithmic axis, it is broken.
    pub fn line(name: &str, points: Vec<[f64; 2]>) -> Self {
        Self::new(name, points, true)
    }

    /// Marks at points.
    pub fn marks(name: &str, points: Vec<[f64; 2]>) -> Self {
        Self::new(name, points, false)
    }

    /// A histogram of `heights` between `edges`, of which there is one more.
    pub fn steps(name: &str, edges: &[f64], heights: &[f64]) -> Self {
        let steps = edges.windows(2).zip(heights);
        let points = steps.flat_map(|(edge, &height)| [[edge[0], height], [edge[1], height]]);
        Self::line(name, points.collect())
    }

    /// The same with marks at its points.
    #[must_use]
    pub fn with_marks(self) -> Self {
        Self { has_marks: true, ..self }
    }

    /// The same with an interval of y, from low to high, about each point in turn.
    #[must_use]
    pub fn with_intervals(self, intervals: Vec<[f64; 2]>) -> Self {
        Self { intervals, ..self }
    }

    /// The same with words beside each point in turn.
    #[must_use]
    pub fn with_labels(self, labels: Vec<String>) -> Self {
        Self { labels, ..self }
    }
}

impl Plot {
    /// A plot without series, of y over x. The name is that of its files, without an extension.
    pub fn new(name: &str, title: &str, x: Axis, y: Axis) -> Self {
        Self::of_kind(name, title, Kind::Square { x, y })
    }

    /// A plot without series, of radii over angles from −90° to 90°; 0 is up, as a surface seen from its
    /// side, with its normal, would have it. `radius` says what the radii are.
    pub fn polar(name: &str, title: &str, radius: &str) -> Self {
        Self::of_kind(name, title, Kind::Polar(radius.to_owned()))
    }

    fn of_kind(name: &str, title: &str, kind: Kind) -> Self {
        Self { name: name.to_owned(), title: title.to_owned(), kind, series: Vec::new() }
    }

    /// The same with another series.
    #[must_use]
    pub fn with(mut self, series: Series) -> Self {
        self.series.push(series);
        self
    }

    /// The name of its files, without an extension.
    pub fn name(&self) -> &str {
        &self.name
    }

    pub(super) fn title(&self) -> &str {
        &self.title
    }

    /// Comma-separated values: a row for each point, with the name of its series and, where some have an
    /// interval, its ends.
    pub fn to_csv(&self) -> String {
        let [x, y] = match &self.kind {
            Kind::Square { x, y } => [x.label(), y.label()],
            Kind::Polar(radius) => ["angle, °", radius],
        };
        let has_intervals = self.series.iter().any(|series| !series.intervals.is_empty());
        let ends = if has_intervals { ",low,high" } else { "" };
        let mut text = format!("series,{},{}{ends}\n", csv_field(x), csv_field(y));
        for series in &self.series {
            for (index, [x, y]) in series.points.iter().enumerate() {
                let ends = match series.intervals.get(index) {
                    Some([low, high]) => format!(",{low:?},{high:?}"),
                    None if has_intervals => ",,".to_owned(),
                    None => String::new(),
                };
                text.push_str(&format!("{},{x:?},{y:?}{ends}\n", csv_field(&series.name)));
            }
        }
        text
    }

    /// The plot as a picture of its own.
    pub fn to_svg(&self) -> String {
        let drawing = match &self.kind {
            Kind::Square { x, y } => square::draw(&self.series, x, y),
            Kind::Polar(radius) => polar::draw(&self.series, radius),
        };
        let Drawing { width, height, body } = drawing;
        let legend = self.legend(width);
        // Sans-serif letters of this size are about so wide.
        let letters = self.series.iter().map(|series| series.name.chars().count()).max();
        let names = 48 + 7 * letters.unwrap_or(0) as u32;
        let full = if legend.is_empty() { width } else { width + names };
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {full} {height}\" \
             width=\"{full}\" height=\"{height}\" role=\"img\" font-family=\"sans-serif\" \
             font-size=\"12\" fill=\"none\" style=\"background:var(--paper,#fff)\">\n\
             <title>{}</title>\n{body}{legend}</svg>\n",
            escaped(&self.title)
        )
    }

    /// The names of the series, right of what is `width` wide, if there are several.
    fn legend(&self, width: u32) -> String {
        let mut text = String::new();
        if self.series.len() < 2 {
            return text;
        }
        for (index, series) in self.series.iter().enumerate() {
            let y = 24 + 20 * index;
            if series.has_line {
                let style = line_style(index);
                let (from, to) = (width + 4, width + 32);
                text.push_str(&format!("<path d=\"M{from} {y}H{to}\" {style}/>\n"));
            }
            if series.has_marks {
                text.push_str(&mark(index, [f64::from(width) + 18.0, y as f64]));
            }
            text.push_str(&words([width + 38, y as u32 + 4], "start", &series.name));
        }
        text
    }
}

/// What is drawn of a plot, without its legend.
struct Drawing {
    width: u32,
    height: u32,
    body: String,
}

/// The colour of the lines and words of a plot.
const INK: &str = "var(--ink,#222)";
/// The colour of its grid.
const GRID: &str = "var(--grid,#ddd)";

/// Colours that most people who do not see all of them can tell apart (Okabe & Ito 2008), and dashes.
const COLORS: [&str; 7] =
    ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#b58900", "#7f7f7f"];
const DASHES: [&str; 4] = ["", "7 3", "2 2", "9 3 2 3"];

fn color(index: usize) -> &'static str {
    COLORS[index % COLORS.len()]
}

fn line_style(index: usize) -> String {
    let dash = DASHES[index % DASHES.len()];
    let dash =
        if dash.is_empty() { String::new() } else { format!(" stroke-dasharray=\"{dash}\"") };
    format!("stroke=\"{}\" stroke-width=\"1.8\"{dash}", color(index))
}

fn mark(index: usize, [x, y]: [f64; 2]) -> String {
    format!("<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"3.5\" fill=\"{}\"/>\n", color(index))
}

fn words([x, y]: [u32; 2], anchor: &str, text: &str) -> String {
    format!(
        "<text x=\"{x}\" y=\"{y}\" text-anchor=\"{anchor}\" style=\"fill:{INK}\">{}</text>\n",
        escaped(text)
    )
}

/// Lines, marks and intervals of all series; `place` tells where a point is, if it can be shown.
fn draw_series(series: &[Series], place: impl Fn([f64; 2]) -> Option<[f64; 2]>) -> String {
    let mut text = String::new();
    for (index, series) in series.iter().enumerate() {
        let places: Vec<_> = series.points.iter().map(|&point| place(point)).collect();
        if series.has_line {
            let mut path = String::new();
            let mut pen = 'M';
            for at in &places {
                match at {
                    Some([x, y]) => {
                        write!(path, "{pen}{x:.1} {y:.1}").expect("a string takes all");
                        pen = 'L';
                    }
                    None => pen = 'M',
                }
            }
            let style = line_style(index);
            text.push_str(&format!("<path d=\"{path}\" {style} stroke-linejoin=\"round\"/>\n"));
        }
        for (point, [low, high]) in series.points.iter().zip(&series.intervals) {
            if let (Some([x, y]), Some([_, to])) =
                (place([point[0], *low]), place([point[0], *high]))
            {
                let color = color(index);
                text.push_str(&format!(
                    "<path d=\"M{x:.1} {y:.1}V{to:.1}\" stroke=\"{color}\" stroke-width=\"1\"/>\n"
                ));
            }
        }
        for (k, at) in places.iter().enumerate() {
            let Some([x, y]) = *at else { continue };
            if series.has_marks {
                text.push_str(&mark(index, [x, y]));
            }
            if let Some(label) = series.labels.get(k) {
                text.push_str(&words([x as u32 + 6, (y - 5.0).max(0.0) as u32], "start", label));
            }
        }
    }
    text
}

/// `text` as it stands in HTML and SVG.
pub(super) fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_broken_where_a_point_cannot_be_shown() {
        let points =
            vec![[1.0, 1.0], [2.0, 10.0], [3.0, f64::NAN], [4.0, 0.0], [5.0, 1.0], [6.0, 2.0]];
        let plot =
            |y| Plot::new("p", "t", Axis::new("x"), y).with(Series::line("s", points.clone()));
        let path = |svg: String| {
            let start = svg.rfind("<path d=\"").unwrap() + 9;
            svg[start..].split('"').next().unwrap().to_owned()
        };
        let linear = path(plot(Axis::new("y")).to_svg());
        assert_eq!(linear.matches('M').count(), 2, "{linear}");
        assert_eq!(linear.matches('L').count(), 3, "{linear}");
        let log = path(plot(Axis::new("y").log()).to_svg());
        assert_eq!((log.matches('M').count(), log.matches('L').count()), (2, 2), "{log}");
        assert!(!plot(Axis::new("y")).to_svg().contains("NaN"));
    }

    #[test]
    fn words_are_no_markup() {
        let plot = Plot::new("p", "a<b & \"c\"", Axis::new("x"), Axis::new("<script>"));
        let svg = plot.to_svg();
        assert!(svg.contains("a&lt;b &amp; &quot;c&quot;") && !svg.contains("<script>"), "{svg}");
    }

    #[test]
    fn rows_of_points_have_their_series() {
        let plot = Plot::new("p", "t", Axis::new("θ, °"), Axis::new("f"))
            .with(Series::line("a", vec![[0.0, 0.1 + 0.2]]))
            .with(Series::marks("b,c", vec![[1.0, 2.0]]).with_intervals(vec![[1.5, 2.5]]));
        let expected =
            "series,\"θ, °\",f,low,high\na,0.0,0.30000000000000004,,\n\"b,c\",1.0,2.0,1.5,2.5\n";
        assert_eq!(plot.to_csv(), expected);
    }
}
