//! Limits of lengths, as a person writes them.

use std::fmt;
use std::str::FromStr;

use serde::Serialize;
use thiserror::Error;

use super::Characteristic;
use epirig_core::choice::Choice as _;
use epirig_core::settings::LARGEST;
use epirig_core::settings::quantity::{MM, NoMeasure, Quantity, measure, number};

/// Limits of a length: one or both of them, the lower below the upper.
///
/// ```
/// use epirig_surface::conformity::Limits;
///
/// let limits: Limits = "0.2 +- 0.01 mm".parse()?;
/// assert_eq!(limits, "190..210 um".parse()?);
/// assert_eq!((limits.lower_mm(), limits.upper_mm()), (Some(0.19), Some(0.21)));
/// assert_eq!("..5 um".parse::<Limits>()?.to_string(), "at most 0.005 mm");
/// # Ok::<(), epirig_surface::conformity::NoTolerance>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Limits {
    lower_mm: Option<f64>,
    upper_mm: Option<f64>,
}

/// A text that is no [`Tolerance`].
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("{text}: {why}; a tolerance is {}", Tolerance::ALLOWED)]
pub struct NoTolerance {
    /// The part of the text.
    pub text: String,
    /// What is wrong with it.
    pub why: &'static str,
}

impl Limits {
    /// These limits in mm; `None` if there is none, one is no number, or the lower is not below the upper.
    pub fn new(lower_mm: Option<f64>, upper_mm: Option<f64>) -> Option<Self> {
        let is_usual = |limit: Option<f64>| limit.is_none_or(|mm| mm.is_finite() && mm.abs() <= LARGEST);
        let are_apart = match (lower_mm, upper_mm) {
            (Some(lower), Some(upper)) => lower < upper,
            (None, None) => false,
            _ => true,
        };
        (are_apart && is_usual(lower_mm) && is_usual(upper_mm)).then_some(Self { lower_mm, upper_mm })
    }

    /// The lower limit, in mm.
    pub fn lower_mm(self) -> Option<f64> {
        self.lower_mm
    }

    /// The upper limit, in mm.
    pub fn upper_mm(self) -> Option<f64> {
        self.upper_mm
    }

    /// Whether a length lies within them; a limit itself does.
    pub fn hold(self, value_mm: f64) -> bool {
        self.lower_mm.is_none_or(|lower| lower <= value_mm)
            && self.upper_mm.is_none_or(|upper| value_mm <= upper)
    }

    /// These limits, each moved outwards by so many mm; inwards if that is negative. `None` if nothing is left between
    /// them.
    pub fn widened_by(self, mm: f64) -> Option<Self> {
        Self::new(self.lower_mm.map(|lower| lower - mm), self.upper_mm.map(|upper| upper + mm))
    }
}

impl FromStr for Limits {
    type Err = NoTolerance;

    fn from_str(text: &str) -> Result<Self, NoTolerance> {
        let refused = |why| NoTolerance { text: text.trim().to_owned(), why };
        let plain = text.replace('\u{b1}', "+-");
        let (parts, is_about) = match (plain.split_once("+-"), plain.split_once("..")) {
            (Some(parts), _) => (parts, true),
            (None, Some(parts)) => (parts, false),
            (None, None) => return Err(refused("it has neither .. nor +-")),
        };
        let (one_mm, other_mm) = lengths(parts).map_err(refused)?;
        let found = match (one_mm, other_mm, is_about) {
            (Some(middle), Some(half), true) => {
                Self::new(Some(rounded(middle - half)), Some(rounded(middle + half)))
            }
            (_, _, true) => return Err(refused("a length is missing beside +-")),
            (lower, upper, false) => Self::new(lower, upper),
        };
        found.ok_or_else(|| refused("the lower limit must lie below the upper"))
    }
}

/// To a millionth of a micrometre: 0.2 + 0.01 is 0.21.
fn rounded(mm: f64) -> f64 {
    (mm * 1e9).round() / 1e9
}

/// Two lengths in mm; `None` for one that is empty. If only one has a unit, both have it.
fn lengths((one, other): (&str, &str)) -> Result<(Option<f64>, Option<f64>), &'static str> {
    let unit = [other, one].into_iter().find_map(|text| Some(measure(text).ok()?.unit));
    let unit = unit.ok_or("a length and its unit are missing")?;
    if unit.quantity != Quantity::Length {
        return Err("the unit is not that of a length");
    }
    let length = |text: &str| {
        if text.trim().is_empty() {
            return Ok(None);
        }
        let found = match measure(text) {
            Err(NoMeasure::UnitMissing) => {
                number(text.trim()).and_then(|value| measure(&format!("{value} {}", unit.name)).ok())
            }
            found => found.ok(),
        };
        let found = found.filter(|found| found.unit.quantity == Quantity::Length);
        found.map(|found| Some(found.in_unit(MM))).ok_or("a length must be a number with a unit of length")
    };
    Ok((length(one)?, length(other)?))
}

impl fmt::Display for Limits {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.lower_mm, self.upper_mm) {
            (Some(lower), Some(upper)) => write!(f, "{lower} mm to {upper} mm"),
            (Some(lower), None) => write!(f, "at least {lower} mm"),
            (None, Some(upper)) => write!(f, "at most {upper} mm"),
            (None, None) => Ok(()),
        }
    }
}

/// The limits of characteristics, each once.
///
/// ```
/// use epirig_surface::conformity::{Characteristic, Tolerance};
///
/// let tolerance: Tolerance = "0.2 +- 0.01 mm, sa ..5 um".parse()?;
/// let of: Vec<Characteristic> = tolerance.limits().iter().map(|(of, _)| *of).collect();
/// assert_eq!(of, [Characteristic::Depth, Characteristic::Sa]);
/// # Ok::<(), epirig_surface::conformity::NoTolerance>(())
/// ```
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Tolerance(Vec<(Characteristic, Limits)>);

impl Tolerance {
    /// What a text of a tolerance is, for a person.
    pub const ALLOWED: &'static str = "a list such as \"depth 0.19..0.21 mm, sa ..5 um\": depth (or no name), each-depth, flatness, sa, sq or sz, and \
                                       limits: 0.19..0.21 mm, 0.2 +- 0.01 mm, 0.1 mm.. or ..5 um";

    /// The limits, in the order in which they were written.
    pub fn limits(&self) -> &[(Characteristic, Limits)] {
        &self.0
    }

    /// The limits of a characteristic.
    pub fn of(&self, characteristic: Characteristic) -> Option<Limits> {
        self.0.iter().find(|(of, _)| *of == characteristic).map(|(_, limits)| *limits)
    }
}

impl FromStr for Tolerance {
    type Err = NoTolerance;

    fn from_str(text: &str) -> Result<Self, NoTolerance> {
        let mut found = Self::default();
        for part in text.split([',', ';']) {
            let refused = |why| NoTolerance { text: part.trim().to_owned(), why };
            let part = part.trim();
            if part.is_empty() {
                return Err(refused("a part of the list is empty"));
            }
            // A name begins with a letter, and limits do not.
            let is_named = part.starts_with(|letter: char| letter.is_ascii_alphabetic());
            let is_of_name = |letter: char| letter.is_ascii_alphabetic() || letter == '-';
            let end = part.find(|letter| !is_of_name(letter)).filter(|_| is_named);
            let (name, limits) = part.split_at(end.unwrap_or(if is_named { part.len() } else { 0 }));
            let characteristic = match name {
                "" => Characteristic::Depth,
                name => Characteristic::from_name(name)
                    .ok_or_else(|| refused("there is no such characteristic"))?,
            };
            if found.of(characteristic).is_some() {
                return Err(refused("the characteristic has limits already"));
            }
            found.0.push((characteristic, limits.trim().trim_start_matches('=').parse()?));
        }
        Ok(found)
    }
}

impl fmt::Display for Tolerance {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, (characteristic, limits)) in self.0.iter().enumerate() {
            let separator = if index == 0 { "" } else { "; " };
            write!(f, "{separator}{characteristic} {limits}")?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn limits(text: &str) -> (Option<f64>, Option<f64>) {
        let found: Limits = text.parse().unwrap_or_else(|error| panic!("{error}"));
        (found.lower_mm, found.upper_mm)
    }

    #[test]
    fn limits_are_written_as_on_drawings() {
        for text in
            ["0.19..0.21 mm", "0.19 mm .. 0.21 mm", "190 um..0.21mm", "0.2 +- 0.01 mm", "0.2 mm \u{b1} 10 um"]
        {
            assert_eq!(limits(text), (Some(0.19), Some(0.21)), "{text}");
        }
        assert_eq!(limits("..5 um"), (None, Some(0.005)));
        assert_eq!(limits("0.1 mm.."), (Some(0.1), None));
        assert_eq!(limits("-0.1..0.1 mm"), (Some(-0.1), Some(0.1)));
        assert_eq!("0.1 mm..".parse::<Limits>().unwrap().to_string(), "at least 0.1 mm");
    }

    #[test]
    fn what_is_no_tolerance_is_refused_with_the_reason() {
        for (text, why) in [
            ("0.2 mm", "neither"),
            ("0.19..0.21", "unit"),
            ("0.19..0.21 s", "unit"),
            ("0.21..0.19 mm", "below"),
            ("0.2..0.2 mm", "below"),
            ("..", "missing"),
            ("0.2 +- mm", "missing"),
            ("+- 0.1 mm", "missing"),
            ("a..b mm", "no such characteristic"),
            ("depth", "neither"),
            ("depht 0.1..0.2 mm", "no such characteristic"),
            ("0.1..0.2 mm, depth 0.1..0.2 mm", "already"),
            ("0.1..0.2 mm,", "empty"),
            ("0.1..1e300 m", "below"),
            ("", "empty"),
        ] {
            let error = text.parse::<Tolerance>().unwrap_err();
            assert!(error.why.contains(why), "{text}: {error}");
        }
    }

    #[test]
    fn a_tolerance_names_its_characteristics() {
        let tolerance: Tolerance = "depth=0.19..0.21mm,sa=..5um; each-depth 0.18..0.22 mm".parse().unwrap();
        assert_eq!(
            tolerance.to_string(),
            "depth 0.19 mm to 0.21 mm; sa at most 0.005 mm; each-depth 0.18 mm to 0.22 mm"
        );
        let named = |choice: &Characteristic| Tolerance::ALLOWED.contains(choice.name());
        assert!(Characteristic::ALL.iter().all(named), "{}", Tolerance::ALLOWED);
    }

    proptest! {
        #[test]
        fn any_text_is_a_tolerance_or_an_error(text in "[a-z0-9.+ ,;=\u{b1}-]{0,24}|.{0,16}") {
            if let Ok(found) = text.parse::<Tolerance>() {
                prop_assert!(!found.limits().is_empty());
                let is_valid = |limits: &Limits| Limits::new(limits.lower_mm, limits.upper_mm) == Some(*limits);
                prop_assert!(found.limits().iter().all(|(_, limits)| is_valid(limits)));
            }
        }
    }
}
