//! What JSON holds, or where what is wrong with it.

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
    serde_json::from_slice(text).map_err(|error| describe(&error, more))
}

/// The error as `line 3, column 7: found, expected`.
fn describe(
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
    } else {
        let text = text.strip_prefix("invalid type: ").unwrap_or(text);
        let text = text.strip_prefix("invalid value: ").unwrap_or(text);
        let mut text = text.replace('`', "");
        for (of_rust, plain) in [
            ("f64", "a number"),
            ("f32", "a number"),
            ("u32", "a whole number"),
            ("u64", "a whole number"),
        ] {
            text = text.replace(&format!("expected {of_rust}"), &format!("expected {plain}"));
        }
        text
    };
    format!("line {line}, column {column}: {what}")
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
