//! Numbers as people read them.

/// `x` to `digits` significant digits, without an exponent where that is short: `0.0123`, `1.2e-7`.
pub fn significant(x: f64, digits: usize) -> String {
    let magnitude = x.abs().log10().floor();
    if x == 0.0 || !x.is_finite() {
        return format!("{x}");
    }
    let last = digits.saturating_sub(1);
    let text = if (-4.0..9.0).contains(&magnitude) {
        let decimals = (last as f64 - magnitude).max(0.0) as usize;
        format!("{x:.decimals$}")
    } else {
        format!("{x:.last$e}")
    };
    let (mantissa, exponent) = text.split_once('e').map_or((&*text, None), |(m, e)| (m, Some(e)));
    let mantissa = match mantissa.contains('.') {
        true => mantissa.trim_end_matches('0').trim_end_matches('.'),
        false => mantissa,
    };
    exponent.map_or_else(|| mantissa.to_owned(), |exponent| format!("{mantissa}e{exponent}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_as_short_as_they_can_be() {
        let cases = [
            (0.0, "0"),
            (1.0, "1"),
            (-0.25, "-0.25"),
            (1234.5, "1234"),
            (0.012_343, "0.01234"),
            (9.999_96, "10"),
            (1.5e-9, "1.5e-9"),
            (2e-12, "2e-12"),
            (123_456_789_012.0, "1.235e11"),
            (f64::NAN, "NaN"),
            (f64::INFINITY, "inf"),
        ];
        for (x, expected) in cases {
            assert_eq!(significant(x, 4), expected, "{x:e}");
        }
    }
}
