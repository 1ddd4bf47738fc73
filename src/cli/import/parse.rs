//! Values of options of `epirig import`.

use epirig_data::sequence::import::Span;

/// `40..80`.
pub(super) fn parse_frames(text: &str) -> Result<Span, String> {
    let wrong =
        || format!("\"{text}\" is not a range of images; write the first and the last, such as 40..80");
    let (first, last) = text.split_once("..").ok_or_else(wrong)?;
    Ok((first.trim().parse().map_err(|_| wrong())?, last.trim().parse().map_err(|_| wrong())?))
}

/// `12` or `40..80`.
pub(super) fn parse_span(text: &str) -> Result<Span, String> {
    if let Ok(number) = text.trim().parse() {
        return Ok((number, number));
    }
    let wrong = || format!("\"{text}\" is no image; write its number, or a range such as 40..80");
    parse_frames(text).map_err(|_| wrong())
}

/// A finite number above zero.
pub(super) fn parse_positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value.is_finite() && value > 0.0 => Ok(value),
        _ => Err(format!("\"{text}\" is not a positive number")),
    }
}

pub(super) fn parse_point(text: &str) -> Result<(f64, f64), String> {
    let wrong = || format!("\"{text}\" is not a point; write column,row such as 511.5,511.5");
    let (x, y) = text.split_once(',').ok_or_else(wrong)?;
    let number =
        |text: &str| text.trim().parse::<f64>().ok().filter(|value| value.is_finite()).ok_or_else(wrong);
    Ok((number(x)?, number(y)?))
}
