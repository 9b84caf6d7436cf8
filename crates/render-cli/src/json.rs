//! What JSON holds, or where what is wrong with it.

use schemars::{JsonSchema, Schema, generate::SchemaSettings, transform::RecursiveTransform};
use serde::de::DeserializeOwned;

/// The value in `text`, or where what is wrong with it, and what would not be:
/// `line 3, column 7: unknown key "sigm", expected "sigma"`.
///
/// `more` tells, for the keys that would have been known where one is not, those that are known
/// there besides.
pub(crate) fn parse<T: DeserializeOwned>(
    text: &[u8],
    more: &dyn Fn(&[&str]) -> &'static [&'static str],
) -> Result<T, String> {
    serde_json::from_slice(text).map_err(|error| describe(text, &error, more))
}

/// What an error says without its line and column, which are those of a text that nobody has seen.
pub(crate) fn without_line(what: &str) -> &str {
    match what.split_once(": ") {
        Some((_, rest)) if what.starts_with("line ") => rest,
        _ => what,
    }
}

/// The JSON Schema (draft 2020-12) of what is read as a `T`.
pub(crate) fn schema<T: JsonSchema>() -> Schema {
    let describe = RecursiveTransform(|schema: &mut Schema| {
        if let Some(text) = schema.get("description").and_then(|text| text.as_str()) {
            let text = without_markup(text);
            schema.insert("description".to_owned(), text.into());
        }
    });
    let settings = SchemaSettings::draft2020_12().with_transform(describe);
    settings.into_generator().into_root_schema_for::<T>()
}

/// A docstring without links, each paragraph that is no formula on one line.
fn without_markup(doc: &str) -> String {
    let mut text = doc.replace("[`", "`");
    while let Some((before, after)) = text.split_once("`](") {
        let after = after.split_once(')').map_or("", |(_, after)| after);
        text = format!("{before}`{after}");
    }
    let text = text.replace("`]", "`");
    let paragraphs = text.split("\n\n").map(|paragraph| {
        let is_formula = paragraph.starts_with("```");
        if is_formula { paragraph.to_owned() } else { paragraph.replace('\n', " ") }
    });
    paragraphs.collect::<Vec<_>>().join("\n\n")
}

/// The error in `json` as `line 3, column 7: found, expected`.
fn describe(
    json: &[u8],
    error: &serde_json::Error,
    more: &dyn Fn(&[&str]) -> &'static [&'static str],
) -> String {
    let (line, column) = (error.line(), error.column());
    let text = error.to_string();
    let text = text.strip_suffix(&format!(" at line {line} column {column}")).unwrap_or(&text);
    // What serde quotes: the name that is wrong first, then those that are not.
    let mut names = text.split('`').skip(1).step_by(2);
    let found = names.next().unwrap_or_default();
    let what = if text.starts_with("unknown ") {
        let mut known: Vec<_> = names.collect();
        known.extend(more(&known));
        let kind = if text.starts_with("unknown field") { "key" } else { "name" };
        format!("unknown {kind} {found:?}, expected {}", nearest(found, &known))
    } else if text.starts_with("missing field") {
        format!("found no {found:?}, expected one")
    } else if text.starts_with("duplicate field") {
        format!("found {found:?} a second time, expected it once")
    } else if error.is_eof() {
        "found the end of the file, expected more".to_owned()
    } else if error.is_syntax() {
        syntax(json, (line, column), text)
    } else {
        in_plain_words(text)
    };
    format!("line {line}, column {}: {what}", column.max(1))
}

/// What is no JSON at a line and a column, both from 1, of which the parser says `text`.
fn syntax(json: &[u8], (line, column): (usize, usize), text: &str) -> String {
    let start = json.split_inclusive(|&byte| byte == b'\n').take(line.saturating_sub(1));
    let place = start.map(<[u8]>::len).sum::<usize>() + column.saturating_sub(1);
    let (before, after) = json.split_at(place.min(json.len()));
    let after = String::from_utf8_lossy(&after[..after.len().min(8)]);
    let found = after.chars().next().map_or_else(String::new, |c| format!("{:?}", c.to_string()));
    match text {
        // As serde names what it takes: by a key alone, where the parser stops before the comma.
        "expected value"
            if after.chars().skip(1).find(|c| !c.is_whitespace()) == Some(',')
                && !before.trim_ascii_end().ends_with(b":") =>
        {
            "found a second key, expected one alone".to_owned()
        }
        "expected value" => format!("found {found}, expected a value"),
        "trailing characters" => format!("found {found}, expected the end of the list or the file"),
        "trailing comma" => "found a comma at the end, expected none".to_owned(),
        "number out of range" => "found a number out of range, expected a smaller one".to_owned(),
        _ => match text.strip_prefix("expected ") {
            Some(expected) => format!("found {found}, expected {}", expected.replace('`', "\"")),
            None => format!("found {found} ({text}), expected JSON"),
        },
    }
}

/// What serde says of a value, without the names that Rust has for it.
fn in_plain_words(text: &str) -> String {
    if text.starts_with("invalid type: unit variant") {
        return "found a name alone, expected it as a key, with an object of what belongs to it"
            .to_owned();
    }
    let text = text.strip_prefix("invalid type: ").unwrap_or(text);
    let text = text.strip_prefix("invalid value: ").unwrap_or(text);
    let (found, expected) = text.split_once(", expected ").unwrap_or((text, "another value"));
    let found = match found.strip_prefix("invalid length ") {
        Some(count) => format!("a list of {count}"),
        None => found.replace('`', ""),
    };
    let found = match found.strip_prefix("floating point ") {
        Some(number) => format!("number {number}"),
        None => found,
    };
    let found = match found.strip_prefix("found ").unwrap_or(&found) {
        "sequence" => "a list",
        "map" => "an object",
        found => found,
    };
    let expected = match expected {
        "f64" | "f32" => "a number",
        "u32" | "u64" => "a whole number, 0 or greater",
        "a sequence of 3 f32 values" => "a list of 3 numbers",
        "an array of length 2" => "a list of 2 numbers",
        "an array of length 4" => "a list of 4 numbers",
        "a sequence" => "a list",
        expected if expected.starts_with("struct ") => "an object",
        expected => expected,
    };
    format!("found {found}, expected {}", expected.replace('`', ""))
}

/// The known name that `found` is most likely to mean, or all.
pub(crate) fn nearest(found: &str, known: &[&str]) -> String {
    const ALIKE: f64 = 0.8;
    let likeness = known.iter().map(|name| (strsim::jaro_winkler(found, name), name));
    match likeness.max_by(|a, b| a.0.total_cmp(&b.0)) {
        Some((likeness, name)) if likeness >= ALIKE => format!("{name:?}"),
        _ => format!("one of {}", known.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn docstrings_become_plain_text() {
        let doc = "As [`A::b`], before [`c`](D::c) in [0, 1];\nsee there.\n\n```text\nx\ny\n```";
        let text = "As `A::b`, before `c` in [0, 1]; see there.\n\n```text\nx\ny\n```";
        assert_eq!(without_markup(doc), text);
    }
}
