//! Quantities with units, as a person writes them.

/// What is measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// mm and its multiples.
    Length,
    /// s and its multiples.
    Time,
    /// Hz.
    Frequency,
    /// mm/s.
    Velocity,
    /// mm/s2.
    Acceleration,
    /// A part of a whole, in %.
    Share,
    /// deg or rad.
    Angle,
    /// A length in an image, in px.
    Pixels,
    /// Grey levels of 255, in DN.
    Levels,
}

impl Quantity {
    /// With its article, for messages.
    pub fn noun(self) -> &'static str {
        match self {
            Self::Length => "a length",
            Self::Time => "a time",
            Self::Frequency => "a frequency",
            Self::Velocity => "a velocity",
            Self::Acceleration => "an acceleration",
            Self::Share => "a share",
            Self::Angle => "an angle",
            Self::Pixels => "a number of pixels",
            Self::Levels => "a number of grey levels",
        }
    }

    /// The names of its units, for messages.
    pub fn unit_names(self) -> String {
        let names: Vec<&str> =
            UNITS.iter().filter(|unit| unit.quantity == self).map(|unit| unit.name).collect();
        names.join(", ")
    }
}

/// A unit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Unit {
    /// What it measures.
    pub quantity: Quantity,
    /// Behind a number: `mm/s`.
    pub name: &'static str,
    /// Behind a key and `_`: `mm_s`.
    pub suffix: &'static str,
    /// How many of the quantity's smallest unit it is. Of two units of a quantity the larger is a multiple of the smaller; not so of
    /// angles, whose size means nothing.
    size: u64,
}

const fn unit(quantity: Quantity, name: &'static str, suffix: &'static str, size: u64) -> Unit {
    Unit { quantity, name, suffix, size }
}

/// Nanometre.
pub const NM: Unit = unit(Quantity::Length, "nm", "nm", 1);
/// Micrometre.
pub const UM: Unit = unit(Quantity::Length, "um", "um", 1_000);
/// Millimetre.
pub const MM: Unit = unit(Quantity::Length, "mm", "mm", 1_000_000);
const CM: Unit = unit(Quantity::Length, "cm", "cm", 10_000_000);
const M: Unit = unit(Quantity::Length, "m", "m", 1_000_000_000);
/// Nanosecond.
pub const NS: Unit = unit(Quantity::Time, "ns", "ns", 1);
/// Microsecond.
pub const US: Unit = unit(Quantity::Time, "us", "us", 1_000);
/// Millisecond.
pub const MS: Unit = unit(Quantity::Time, "ms", "ms", 1_000_000);
/// Second.
pub const S: Unit = unit(Quantity::Time, "s", "s", 1_000_000_000);
/// Minute.
pub const MIN: Unit = unit(Quantity::Time, "min", "min", 60_000_000_000);
const H: Unit = unit(Quantity::Time, "h", "h", 3_600_000_000_000);
/// Hertz.
pub const HZ: Unit = unit(Quantity::Frequency, "Hz", "hz", 1);
const KHZ: Unit = unit(Quantity::Frequency, "kHz", "khz", 1_000);
const UM_S: Unit = unit(Quantity::Velocity, "um/s", "um_s", 1);
/// Millimetre a second.
pub const MM_S: Unit = unit(Quantity::Velocity, "mm/s", "mm_s", 1_000);
const M_S: Unit = unit(Quantity::Velocity, "m/s", "m_s", 1_000_000);
/// Millimetre a second squared.
pub const MM_S2: Unit = unit(Quantity::Acceleration, "mm/s2", "mm_s2", 1);
/// Per cent.
pub const PERCENT: Unit = unit(Quantity::Share, "%", "percent", 1);
/// Degree.
pub const DEG: Unit = unit(Quantity::Angle, "deg", "deg", 1);
/// Radian.
pub const RAD: Unit = unit(Quantity::Angle, "rad", "rad", 1);
/// Pixel.
pub const PX: Unit = unit(Quantity::Pixels, "px", "px", 1);
/// Grey level of 255.
pub const DN: Unit = unit(Quantity::Levels, "DN", "dn", 1);

/// All units.
pub const UNITS: &[Unit] =
    &[NM, UM, MM, CM, M, NS, US, MS, S, MIN, H, HZ, KHZ, UM_S, MM_S, M_S, MM_S2, PERCENT, DEG, RAD, PX, DN];

/// A number with a unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measure {
    /// The number, as it was written.
    pub value: f64,
    /// The unit behind it.
    pub unit: Unit,
}

impl Measure {
    /// The same in another unit of the quantity, rounded once.
    pub fn in_unit(self, other: Unit) -> f64 {
        let converted = match (self.unit, other) {
            (DEG, RAD) => self.value.to_radians(),
            (RAD, DEG) => self.value.to_degrees(),
            (unit, _) if unit.size >= other.size => self.value * (unit.size / other.size) as f64,
            (unit, _) => self.value / (other.size / unit.size) as f64,
        };
        // Minus zero is zero.
        converted + 0.0
    }
}

/// Why a text is no number with a unit.
#[derive(Debug, Clone, PartialEq)]
pub enum NoMeasure {
    /// It does not begin with a number.
    Number,
    /// There is a number and nothing behind it.
    UnitMissing,
    /// What stands behind the number is no unit.
    UnitUnknown(String),
}

/// A finite number: `1.5`, `-2`, `1e-3`.
pub fn number(text: &str) -> Option<f64> {
    // Words such as `inf` would pass as numbers.
    let of_digits = text.bytes().all(|byte| is_of_number(byte.into()));
    text.parse().ok().filter(|value: &f64| of_digits && value.is_finite())
}

fn is_of_number(character: char) -> bool {
    character.is_ascii_digit() || "+-.eE".contains(character)
}

/// A number with a unit: `1.5 mm`, `1.5mm`.
pub fn measure(text: &str) -> Result<Measure, NoMeasure> {
    let text = text.trim();
    let end = text.find(|character| !is_of_number(character)).unwrap_or(text.len());
    let value = number(&text[..end]).ok_or(NoMeasure::Number)?;
    let name = text[end..].trim_start();
    if name.is_empty() {
        return Err(NoMeasure::UnitMissing);
    }
    if name.starts_with(|character: char| character == ',' || character.is_ascii_digit()) {
        return Err(NoMeasure::Number);
    }
    // Unicode has two letters that look like the Greek one.
    let plain = name.replace(['µ', 'μ'], "u").replace('²', "2");
    let unit = UNITS.iter().find(|unit| unit.name == plain).copied();
    unit.map(|unit| Measure { value, unit }).ok_or_else(|| NoMeasure::UnitUnknown(name.to_owned()))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn units_are_those_of_the_si() {
        let converted = |text: &str, unit| measure(text).unwrap().in_unit(unit);
        for (text, mm) in [
            ("1.5 mm", 1.5),
            ("1500um", 1.5),
            ("1500 µm", 1.5),
            ("1500 μm", 1.5),
            ("0.15 cm", 1.5),
            ("1.5e-3 m", 1.5),
            ("1500000 nm", 1.5),
            (" -2 mm ", -2.0),
        ] {
            assert_eq!(converted(text, MM), mm, "{text}");
        }
        assert_eq!(converted("2 h", S), 7200.0);
        assert_eq!(converted("5 min", S), 300.0);
        assert_eq!(converted("8 ms", US), 8000.0);
        assert_eq!(converted("0.025 kHz", HZ), 25.0);
        assert_eq!(converted("0.005 m/s", MM_S), 5.0);
        assert_eq!(converted("5000 um/s", MM_S), 5.0);
        assert_eq!(converted("20 mm/s²", MM_S2), 20.0);
        assert_eq!(converted("0.1 um", MM), 1e-4, "rounded once");
        assert_eq!(converted("180 deg", RAD), std::f64::consts::PI);
        assert_eq!(converted("-0.5rad", DEG), -90.0 / std::f64::consts::PI);
        assert!(converted("-0 mm", MM).is_sign_positive());
    }

    #[test]
    fn what_is_no_quantity_is_refused() {
        for text in
            ["", "mm", "1,5 mm", "1 5 mm", "inf mm", "nan mm", "1e999 mm", "- mm", "1.2.3 mm", "5e mm"]
        {
            assert_eq!(measure(text), Err(NoMeasure::Number), "{text}");
        }
        assert_eq!(measure("3"), Err(NoMeasure::UnitMissing));
        for unit in ["furlongs", "Mm", "MM", "mm mm"] {
            assert_eq!(measure(&format!("3 {unit}")), Err(NoMeasure::UnitUnknown(unit.to_owned())));
        }
    }

    #[test]
    fn of_two_units_the_larger_is_a_multiple() {
        for one in UNITS {
            for other in UNITS.iter().filter(|other| other.quantity == one.quantity) {
                let (large, small) = (one.size.max(other.size), one.size.min(other.size));
                assert_eq!(large % small, 0, "{} and {}", one.name, other.name);
            }
        }
    }

    proptest! {
        #[test]
        fn any_text_is_a_measure_or_an_error(text in ".{0,12}") {
            if let Ok(found) = measure(&text) {
                let written = format!("{} {}", found.value, found.unit.name);
                prop_assert_eq!(measure(&written), Ok(found));
            }
        }
    }
}
