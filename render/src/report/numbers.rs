//! Numbers for people.

/// A number with as many digits as it needs: 0.05, 200, 10⁶.
pub(super) fn plain(value: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    let exponent = value.abs().log10().floor() as i32;
    if (-3..=4).contains(&exponent) {
        let digits = usize::try_from(1 - exponent).unwrap_or(0);
        let text = format!("{value:.digits$}");
        return if text.contains('.') {
            text.trim_end_matches('0').trim_end_matches('.').to_owned()
        } else {
            text
        };
    }
    // Two digits, so that 9.96 becomes the next power and not ten times this one.
    let mantissa = (value / 10_f64.powi(exponent) * 10.0).round() / 10.0;
    let (mantissa, exponent) = if mantissa.abs() >= 10.0 {
        (mantissa / 10.0, exponent + 1)
    } else {
        (mantissa, exponent)
    };
    let power: String = exponent.to_string().chars().map(superscript).collect();
    if (mantissa - 1.0).abs() < 1e-6 {
        format!("10{power}")
    } else {
        format!("{}·10{power}", plain(mantissa))
    }
}

/// A ratio in per cent.
pub(super) fn percent(value: f64) -> String {
    format!("{} %", plain(100.0 * value))
}

fn superscript(character: char) -> char {
    match character {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        '4' => '⁴',
        '5' => '⁵',
        '6' => '⁶',
        '7' => '⁷',
        '8' => '⁸',
        '9' => '⁹',
        _ => '⁰',
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_the_digits_they_need() {
        for (value, expected) in [
            (0.0, "0"),
            (0.05, "0.05"),
            (1.5, "1.5"),
            (200.0, "200"),
            (1e6, "10⁶"),
            (2e-5, "2·10⁻⁵"),
            (9.98e-6, "10⁻⁵"),
            (1.04e6, "10⁶"),
        ] {
            assert_eq!(plain(value), expected);
        }
        assert_eq!(percent(0.015), "1.5 %");
    }
}
