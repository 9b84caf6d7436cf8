//! `selvedge image`: compares pictures, tells about them and rewrites them.

pub mod convert;
pub mod diff;
pub mod info;

use crate::{Outcome, args::ImageCommand};

/// Does what the command line says about pictures.
///
/// # Errors
///
/// When a picture cannot be read or used, or the output cannot be written; then no output is left
/// behind.
pub fn run(command: &ImageCommand) -> anyhow::Result<Outcome> {
    match command {
        ImageCommand::Diff(options) => diff::run(options),
        ImageCommand::Info(options) => info::run(options).map(|()| Outcome::Done),
        ImageCommand::Convert(options) => convert::run(options).map(|()| Outcome::Done),
    }
}

/// `x` to six significant digits, without an exponent where that is short.
fn significant(x: f64) -> String {
    let magnitude = x.abs().log10().floor();
    if x == 0.0 || !x.is_finite() {
        format!("{x}")
    } else if (-5.0..9.0).contains(&magnitude) {
        let digits = (5.0 - magnitude).max(0.0) as usize;
        let text = format!("{x:.digits$}");
        match text.contains('.') {
            true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
            false => text,
        }
    } else {
        format!("{x:.5e}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_told_to_six_digits() {
        let cases = [
            (0.0, "0"),
            (1.0, "1"),
            (1200.0, "1200"),
            (-0.25, "-0.25"),
            (1.0 / 3.0, "0.333333"),
            (0.000_012_345_678, "0.0000123457"),
            (1e-7, "1.00000e-7"),
            (123_456_789.0, "123456789"),
            (1e12, "1.00000e12"),
            (f64::INFINITY, "inf"),
        ];
        for (number, expected) in cases {
            assert_eq!(significant(number), expected);
        }
    }
}
