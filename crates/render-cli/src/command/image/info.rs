//! `selvedge image info`: what is in a picture, for people and for programs.

use serde::Serialize;
use serde_json::{Map, Value as Json, json};

use super::significant;
use crate::{
    args::PictureInfoOptions,
    image::{self, Picture, Samples, Value},
    input,
    output::Sink,
    terminal::printable,
};

/// Tells what is in `options.picture`: as text, or as the JSON of [`Info`].
///
/// # Errors
///
/// When the picture cannot be read, or standard output cannot be written.
pub fn run(options: &PictureInfoOptions) -> anyhow::Result<()> {
    let picture = image::read(&options.picture)?;
    let info = Info::new(input::name(&options.picture), &picture);
    let text = if options.json { serde_json::to_string_pretty(&info)? + "\n" } else { info.text() };
    Sink::Stdout.write(|out| out.write_all(text.as_bytes()))?;
    Ok(())
}

/// What is in a picture.
#[derive(Debug, Serialize)]
pub struct Info {
    file: String,
    width: u32,
    height: u32,
    layers: Vec<LayerInfo>,
    metadata: Map<String, Json>,
}

#[derive(Debug, Serialize)]
struct LayerInfo {
    name: String,
    channels: Vec<ChannelInfo>,
}

#[derive(Debug, Serialize)]
struct ChannelInfo {
    name: String,
    r#type: &'static str,
    /// Of the finite values, as the two below; `None` if there are none.
    min: Option<f64>,
    max: Option<f64>,
    mean: Option<f64>,
    non_finite: usize,
}

impl Info {
    fn new(file: String, picture: &Picture) -> Self {
        let layers = picture.layers().iter().map(|layer| {
            let channels = layer.channels.iter();
            LayerInfo {
                name: layer.title().to_owned(),
                channels: channels.map(|c| ChannelInfo::new(&c.name, &c.samples)).collect(),
            }
        });
        let metadata = picture.metadata.iter();
        Self {
            file,
            width: picture.size().width(),
            height: picture.size().height(),
            layers: layers.collect(),
            metadata: metadata.map(|(name, value)| (name.clone(), json(value))).collect(),
        }
    }

    fn text(&self) -> String {
        let mut rows = vec!["layer channel type min max mean non-finite".split(' ').collect()];
        let numbers: Vec<_> = self
            .layers
            .iter()
            .flat_map(|layer| layer.channels.iter().map(move |channel| (layer, channel)))
            .map(|(layer, channel)| {
                let range = [channel.min, channel.max, channel.mean];
                let [min, max, mean] = range.map(|x| x.map_or("-".to_owned(), significant));
                let names = [&layer.name, &channel.name].map(|name| printable(name));
                let non_finite = channel.non_finite.to_string();
                (names, channel.r#type, [min, max, mean, non_finite])
            })
            .collect();
        for ([layer, channel], kind, numbers) in &numbers {
            let mut row: Vec<&str> = vec![layer, channel, kind];
            row.extend(numbers.iter().map(String::as_str));
            rows.push(row);
        }
        let file = printable(&self.file);
        let mut text = format!("{file}: {}x{} pixels\n\n{}", self.width, self.height, table(&rows));
        if !self.metadata.is_empty() {
            text.push('\n');
        }
        for (name, value) in &self.metadata {
            let value = value.as_str().map_or_else(|| value.to_string(), str::to_owned);
            text += &format!("{}: {}\n", printable(name), printable(&value));
        }
        text
    }
}

impl ChannelInfo {
    fn new(name: &str, samples: &Samples) -> Self {
        let (r#type, range) = match samples {
            Samples::F32(samples) => ("f32", Range::of(samples.iter().map(|x| f64::from(*x)))),
            Samples::U32(samples) => ("u32", Range::of(samples.iter().map(|x| f64::from(*x)))),
        };
        let Range { min, max, sum, finite } = range;
        let given = |x: f64| (finite > 0).then_some(x);
        Self {
            name: name.to_owned(),
            r#type,
            min: given(min),
            max: given(max),
            mean: given(sum / finite as f64),
            non_finite: samples.len() - finite,
        }
    }
}

/// Of the finite ones among some numbers.
struct Range {
    min: f64,
    max: f64,
    sum: f64,
    finite: usize,
}

impl Range {
    fn of(numbers: impl Iterator<Item = f64>) -> Self {
        let none = Self { min: f64::INFINITY, max: f64::NEG_INFINITY, sum: 0.0, finite: 0 };
        numbers.filter(|x| x.is_finite()).fold(none, |range, x| Self {
            min: range.min.min(x),
            max: range.max.max(x),
            sum: range.sum + x,
            finite: range.finite + 1,
        })
    }
}

fn json(value: &Value) -> Json {
    match value {
        Value::Text(text) => json!(text),
        Value::Integer(number) => json!(number),
        Value::Real(number) => json!(number),
        Value::List(numbers) => json!(numbers),
    }
}

/// Rows of equal length as lines with columns.
fn table(rows: &[Vec<&str>]) -> String {
    let count = rows.first().map_or(0, Vec::len);
    let width = |k: usize| rows.iter().map(|row| row[k].chars().count()).max().unwrap_or(0);
    let widths: Vec<_> = (0..count).map(width).collect();
    let line = |row: &Vec<&str>| {
        let cells = row.iter().zip(&widths).map(|(cell, width)| format!("{cell:width$}"));
        cells.collect::<Vec<_>>().join("  ").trim_end().to_owned() + "\n"
    };
    rows.iter().map(line).collect()
}
