//! Numbers as a person reads them: an uncertainty to two significant digits, its value to the same place.

/// What stands for a number that is not known.
pub(crate) const UNKNOWN: &str = "unknown";

/// Digits of a value whose uncertainty is unknown.
const DIGITS: i32 = 3;

/// No value is stated that is smaller than this, in its unit: 10 nm of a length in mm.
const LEAST: f64 = 1e-5;

/// Decimals that show `value` with this number of significant digits; below 0 tens and hundreds are rounded.
/// Rounding counts: 0.0996 is 0.10.
fn decimals(value: f64, digits: i32) -> i32 {
    if value == 0.0 {
        return 0;
    }
    let by = |value: f64| digits - 1 - value.abs().log10().floor() as i32;
    let first = by(value);
    by(round_to(value, first))
}

fn round_to(value: f64, decimals: i32) -> f64 {
    let scale = 10_f64.powi(decimals.abs());
    if decimals >= 0 { (value * scale).round() / scale } else { (value / scale).round() * scale }
}

/// With this many decimals, and a real minus sign; zero has none.
pub(crate) fn fixed(value: f64, decimals: i32) -> String {
    if !value.is_finite() {
        return UNKNOWN.to_owned();
    }
    let rounded = if decimals < 0 { round_to(value, decimals) } else { value };
    let text = format!("{:.*}", decimals.max(0) as usize, rounded.abs());
    let is_zero = text.chars().all(|letter| letter == '0' || letter == '.');
    if value < 0.0 && !is_zero { format!("\u{2212}{text}") } else { text }
}

/// With a number of significant digits.
pub(crate) fn significant(value: f64, digits: i32) -> String {
    if value.is_finite() { fixed(value, decimals(value, digits)) } else { UNKNOWN.to_owned() }
}

/// An uncertainty alone, with its unit: two significant digits.
pub(crate) fn sigma(value: f64, unit: &str) -> String {
    stated(value, 2, unit)
}

/// A value with its unit; one that is smaller than [`LEAST`] only as that. Nobody reads six zeros.
fn stated(value: f64, digits: i32, unit: &str) -> String {
    match value {
        _ if !value.is_finite() => UNKNOWN.to_owned(),
        _ if value != 0.0 && value.abs() < LEAST => with_unit(format!("less than {LEAST}"), unit),
        _ => with_unit(significant(value, digits), unit),
    }
}

/// A share has no unit.
fn with_unit(number: String, unit: &str) -> String {
    if unit.is_empty() { number } else { format!("{number} {unit}") }
}

/// A value to the place of the second digit of `size`, such as its scatter, with its unit.
pub(crate) fn to_place_of(value: f64, size: f64, unit: &str) -> String {
    match known(Some(size)) {
        Some(size) if value.is_finite() => with_unit(fixed(value, decimals(size, 2)), unit),
        _ => stated(value, DIGITS, unit),
    }
}

/// A value with half the width of its interval of 95 % coverage, for which alone the sign between them stands.
pub(crate) fn with_interval(value: f64, half_width: Option<f64>, unit: &str) -> String {
    match known(half_width) {
        _ if !value.is_finite() => UNKNOWN.to_owned(),
        Some(half_width) => {
            let [value, half_width] =
                [value, half_width].map(|number| with_unit(fixed(number, decimals(half_width, 2)), unit));
            format!("{value} \u{b1} {half_width}")
        }
        None => format!("{}, uncertainty unknown", with_unit(significant(value, DIGITS), unit)),
    }
}

/// A value with its standard uncertainty. A value that is zero to the last digit that is known is 0.
pub(crate) fn with_sigma(value: f64, sigma: Option<f64>, unit: &str) -> String {
    match known(sigma) {
        _ if !value.is_finite() => UNKNOWN.to_owned(),
        Some(sigma) => {
            let decimals = decimals(sigma, 2);
            let value =
                if round_to(value, decimals) == 0.0 { "0".to_owned() } else { fixed(value, decimals) };
            format!("{value} {unit}, standard uncertainty {} {unit}", fixed(sigma, decimals))
        }
        None => format!("{} {unit}, uncertainty unknown", significant(value, DIGITS)),
    }
}

fn known(uncertainty: Option<f64>) -> Option<f64> {
    uncertainty.filter(|size| size.is_finite() && *size > 0.0)
}

/// A value that is stated without an uncertainty, with its unit.
pub(crate) fn plain(value: f64, unit: &str) -> String {
    stated(value, DIGITS, unit)
}

/// A share in per cent: two digits, and a decimal from 10 % on, where a share of 99.9 % is not all.
pub(crate) fn percent(share: f64) -> String {
    let value = 100.0 * share;
    match value.abs() >= 9.95 {
        true => format!("{} %", fixed(value, 1)),
        false => format!("{} %", significant(value, 2)),
    }
}

/// A share of a whole in per cent: what is left of nothing or of all is not rounded away.
pub(crate) fn share(share: f64) -> String {
    match share {
        _ if share > 0.0 && share < 0.001 => "below 0.1 %".to_owned(),
        _ if share > 0.999 && share < 1.0 => "above 99.9 %".to_owned(),
        _ if share == 1.0 => "100 %".to_owned(),
        _ => percent(share),
    }
}

/// The same text for a terminal, in ASCII.
pub(crate) fn ascii(text: &str) -> String {
    text.replace('\u{b1}', "+-").replace('\u{2212}', "-")
}

/// A time stamp as in RFC 3339, to the second.
pub(crate) fn moment(stamp: &str) -> String {
    let (seconds, rest) = stamp.split_once('.').unwrap_or((stamp, ""));
    let zone = rest.trim_start_matches(|letter: char| letter.is_ascii_digit());
    format!("{}{zone}", seconds.replacen('T', " ", 1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_value_ends_where_its_uncertainty_ends() {
        let cases = [
            (0.20034, 0.0012, "0.2003 mm \u{b1} 0.0012 mm"),
            (20.441_71, 0.006_26, "20.4417 mm \u{b1} 0.0063 mm"),
            (0.2, 0.0996, "0.20 mm \u{b1} 0.10 mm"),
            (-0.0512, 0.0104, "\u{2212}0.051 mm \u{b1} 0.010 mm"),
            (0.001, 0.25, "0.00 mm \u{b1} 0.25 mm"),
            (-0.001, 0.25, "0.00 mm \u{b1} 0.25 mm"),
            (1234.0, 187.0, "1230 mm \u{b1} 190 mm"),
            (987.4, 12.3, "987 mm \u{b1} 12 mm"),
            (4.0, 99.6, "0 mm \u{b1} 100 mm"),
        ];
        assert_eq!(with_interval(1.0291, Some(0.0124), ""), "1.029 \u{b1} 0.012");
        assert_eq!(to_place_of(400.1234, 0.0156, "mm"), "400.123 mm");
        assert_eq!(
            (to_place_of(0.25, 0.0, ""), to_place_of(0.25, 0.013, "")),
            ("0.250".to_owned(), "0.250".to_owned())
        );
        for (value, sigma, shown) in cases {
            assert_eq!(with_interval(value, Some(sigma), "mm"), shown);
        }
    }

    #[test]
    fn what_is_not_known_is_said() {
        assert_eq!(with_interval(0.2, None, "mm"), "0.200 mm, uncertainty unknown");
        assert_eq!(with_interval(0.2, Some(f64::NAN), "mm"), "0.200 mm, uncertainty unknown");
        assert_eq!(with_interval(f64::NAN, Some(0.1), "mm"), UNKNOWN);
        assert_eq!(
            (plain(f64::INFINITY, "mm"), sigma(f64::NAN, "mm")),
            (UNKNOWN.to_owned(), UNKNOWN.to_owned())
        );
    }

    #[test]
    fn a_standard_uncertainty_is_named() {
        let of = |value, sigma| with_sigma(value, Some(sigma), "px");
        assert_eq!(of(2844.44, 56.9), "2844 px, standard uncertainty 57 px");
        assert_eq!(of(-0.000_000_2, 0.000_078), "0 px, standard uncertainty 0.000078 px");
        assert_eq!(of(-0.0512, 0.0104), "\u{2212}0.051 px, standard uncertainty 0.010 px");
        assert_eq!(with_sigma(0.2, Some(0.0), "px"), "0.200 px, uncertainty unknown");
    }

    #[test]
    fn stamps_end_at_the_second() {
        assert_eq!(moment("2026-11-24T13:48:36.768908489Z"), "2026-11-24 13:48:36Z");
        assert_eq!(moment("2026-11-24T13:48:36+01:00"), "2026-11-24 13:48:36+01:00");
        assert_eq!(moment("2026-11-24T13:48:36.7+01:00"), "2026-11-24 13:48:36+01:00");
        assert_eq!(moment("yesterday"), "yesterday");
    }

    #[test]
    fn digits_are_significant() {
        assert_eq!(significant(0.0996, 2), "0.10");
        assert_eq!((significant(0.0, 2), sigma(0.0, "mm")), ("0".to_owned(), "0 mm".to_owned()));
        assert_eq!(significant(1530.0, 3), "1530");
        assert_eq!(sigma(9.3e-6, "mm"), "less than 0.00001 mm");
        assert_eq!(
            (sigma(1e-5, "mm"), plain(-6.2e-7, "px")),
            ("0.000010 mm".to_owned(), "less than 0.00001 px".to_owned())
        );
        assert_eq!(
            (percent(0.999), percent(0.0123), percent(0.0), percent(1.0)),
            ("99.9 %".to_owned(), "1.2 %".to_owned(), "0 %".to_owned(), "100.0 %".to_owned())
        );
        let shares = [0.0, 2e-7, 0.0012, 0.5, 0.9989, 0.9998, 1.0].map(share);
        assert_eq!(shares, ["0 %", "below 0.1 %", "0.12 %", "50.0 %", "99.9 %", "above 99.9 %", "100 %"]);
    }

    #[test]
    fn a_terminal_gets_ascii() {
        assert_eq!(ascii(&with_interval(-0.0512, Some(0.0104), "mm")), "-0.051 mm +- 0.010 mm");
    }
}
