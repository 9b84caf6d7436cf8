//! A report as one page that needs no other file and no script.

use std::fmt::Write;

use super::{Block, Check, Figure, Report, Table, plot::escaped};
use crate::data_uri;

/// The page.
pub(super) fn page(report: &Report) -> String {
    let title = escaped(&report.title);
    let mut body = format!(
        "<h1>{title}</h1>\n<p>{}</p>\n<pre>{}</pre>\n",
        prose(&report.lead),
        escaped(&report.command)
    );
    if !report.checks.is_empty() {
        let missed = report.checks.iter().filter(|check| !check.is_kept()).count();
        let of = report.checks.len();
        let verdict = match missed {
            0 => "<p class=\"kept\">All checks are kept.</p>\n".to_owned(),
            _ => format!("<p class=\"missed\">Missed: {missed} of {of} checks.</p>\n"),
        };
        body.push_str(&verdict);
        body.push_str(&table(&Check::table(&report.checks)));
    }
    for block in &report.blocks {
        match block {
            Block::Heading(text) => body.push_str(&format!("<h2>{}</h2>\n", escaped(text))),
            Block::Paragraph(text) => body.push_str(&format!("<p>{}</p>\n", prose(text))),
            Block::Table(own) => {
                body.push_str(&table(own));
                body.push_str(&format!(
                    "<p><small>The same with all digits: <code>{}.csv</code></small></p>\n",
                    escaped(own.name())
                ));
            }
            Block::Data(what, own) => body.push_str(&format!(
                "<p>{}: <code>{}.csv</code></p>\n",
                prose(what),
                escaped(own.name())
            )),
            Block::Plots(plots) => {
                let figures = plots.iter().map(|plot| {
                    let title = escaped(plot.title());
                    let caption = format!("<figcaption>{title}</figcaption>");
                    format!("<figure>\n{}{caption}</figure>\n", plot.to_svg())
                });
                row(&mut body, figures);
            }
            Block::Pictures(figures) => row(&mut body, figures.iter().map(picture)),
        }
    }
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width\">\n<title>{title}</title>\n\
         <link rel=\"icon\" href=\"data:,\">\n<style>\n{}</style>\n</head>\n<body>\n{body}\
         <footer>selvedge {}. The numbers are in <code>{}</code> and in the CSV files beside \
         this page.</footer>\n</body>\n</html>\n",
        include_str!("style.css"),
        env!("CARGO_PKG_VERSION"),
        super::INDEX
    )
}

fn row(body: &mut String, figures: impl Iterator<Item = String>) {
    body.push_str("<div class=\"row\">\n");
    body.extend(figures);
    body.push_str("</div>\n");
}

/// Pixels across which a picture is shown at least, as far as whole pixels allow.
const SMALL: u32 = 200;

fn picture(figure: &Figure) -> String {
    let Figure { caption, size, png, .. } = figure;
    let caption = escaped(caption);
    // Small ones are shown larger, each pixel as a square.
    let scale = (SMALL / size[0].max(1)).max(1);
    let [width, height] = size.map(|side| scale * side);
    format!(
        "<figure><img width=\"{width}\" height=\"{height}\" alt=\"{caption}\" \
         src=\"{}\">\n<figcaption>{caption}</figcaption></figure>\n",
        data_uri::encode("image/png", png)
    )
}

fn table(table: &Table) -> String {
    let mut text = "<div class=\"table\"><table>\n<tr>".to_owned();
    let is_number = |column: usize| table.rows().iter().any(|row| row[column].is_number());
    let class = |column: usize| if is_number(column) { " class=\"number\"" } else { "" };
    for (column, name) in table.columns().iter().enumerate() {
        write!(text, "<th{}>{}</th>", class(column), escaped(name)).expect("a string takes all");
    }
    text.push_str("</tr>\n");
    for row in table.rows() {
        text.push_str("<tr>");
        for (column, cell) in row.iter().enumerate() {
            let cell = cell.to_text();
            let class = match &*cell {
                "kept" | "missed" => format!(" class=\"{cell}\""),
                _ => class(column).to_owned(),
            };
            write!(text, "<td{class}>{}</td>", escaped(&cell)).expect("a string takes all");
        }
        text.push_str("</tr>\n");
    }
    text.push_str("</table></div>\n");
    text
}

/// Plain text, with what stands between backticks as code.
fn prose(text: &str) -> String {
    let parts = escaped(text);
    let parts = parts.split('`').enumerate();
    parts
        .map(|(index, part)| match index % 2 {
            1 => format!("<code>{part}</code>"),
            _ => part.to_owned(),
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        image::{Layer, Picture},
        render::film::Size,
        report::{Axis, Limit, Plot, Series},
    };

    #[test]
    fn page_needs_nothing_else() {
        let mut report = Report::new("a < b", "`x` & y");
        let size = Size::new(2, 1).unwrap();
        let mut picture = Picture::new(size);
        picture.push(Layer::colors("", &[glam::Vec3::ONE, glam::Vec3::ZERO]));
        report.heading("pictures");
        report.pictures(vec![Figure::new("white", "white, black", &picture).unwrap()]);
        report.plot(
            Plot::polar("lobes", "lobes", "f, sr⁻¹").with(Series::line("s", vec![[0.0, 1.0]])),
        );
        report.plot(Plot::new("flat", "flat", Axis::new("x"), Axis::new("y")));
        report.check(Check::new("share", 0.5, Limit::AtMost(0.1)));
        let page = page(&report);
        for part in
            ["a &lt; b", "<code>x</code> &amp; y", "Missed: 1 of 1 checks", "<svg", "image/png"]
        {
            assert!(page.contains(part), "found no {part}: {page}");
        }
        let outside = page.replace("http://www.w3.org/2000/svg", "");
        for part in ["http", "<script", "url("] {
            assert!(!outside.contains(part), "found {part}: {page}");
        }
        for tag in ["svg", "figure>", "table>", "div", "pre>"] {
            let [opened, closed] =
                ["<", "</"].map(|start| page.matches(&format!("{start}{tag}")).count());
            assert_eq!(opened, closed, "{tag}: {page}");
        }
    }
}
