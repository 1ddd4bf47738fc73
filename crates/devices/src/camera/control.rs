//! Controls of a camera: exposure, gain and all others of its driver.

use std::fmt;

use serde::Serialize;

use super::CameraError;

epirig_core::choices! {
    /// The type of a control's values.
    pub enum ControlKind {
        /// Integers from minimum to maximum.
        Integer = "integer",
        /// 0 or 1.
        Boolean = "boolean",
        /// One of the items, by index.
        Menu = "menu",
        /// A set of bits.
        Bitmask = "bitmask",
        /// No value: writing it triggers an action.
        Button = "button",
        /// Text, arrays and others, which are neither read nor written here.
        Other = "other",
    }
}

/// A control as its driver describes it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Control {
    /// The driver's id of the control.
    #[serde(skip)]
    pub id: u32,
    /// Name in commands: the driver's name in lower case, with `_` for all other characters than letters and
    /// digits.
    pub name: String,
    /// Type of the values.
    pub kind: ControlKind,
    /// The smallest value.
    pub minimum: i64,
    /// The largest value.
    pub maximum: i64,
    /// Distance between values.
    pub step: u64,
    /// Value after power-up.
    pub default: i64,
    /// Present value; `None` if it cannot be read.
    pub value: Option<i64>,
    /// Whether it is read-only.
    pub read_only: bool,
    /// Whether it has no effect at present, because another control overrides it.
    pub inactive: bool,
    /// Items of a menu: index and name.
    pub items: Vec<(i64, String)>,
}

impl Control {
    /// The name in commands of a control with the driver's name `title`, as in `v4l2-ctl`.
    pub fn command_name(title: &str) -> String {
        let words = title.split(|character: char| !character.is_ascii_alphanumeric());
        words.filter(|word| !word.is_empty()).map(str::to_ascii_lowercase).collect::<Vec<_>>().join("_")
    }

    /// Parses a value: a number, the name of a menu item, or `on` and `off`.
    ///
    /// # Errors
    /// [`CameraError::ControlRefused`] if the control does not accept the value.
    pub fn parse(&self, camera: &str, text: &str) -> Result<i64, CameraError> {
        let named = self.items.iter().find(|(_, name)| name.eq_ignore_ascii_case(text));
        let value = match (named, text.to_ascii_lowercase().as_str()) {
            (Some((index, _)), _) => Some(*index),
            (None, "on" | "true") if self.kind == ControlKind::Boolean => Some(1),
            (None, "off" | "false") if self.kind == ControlKind::Boolean => Some(0),
            (None, text) => text
                .strip_prefix("0x")
                .map_or_else(|| text.parse().ok(), |digits| i64::from_str_radix(digits, 16).ok()),
        };
        let value = value.ok_or_else(|| self.refused(camera, text, self.values()))?;
        self.check(camera, value)?;
        Ok(value)
    }

    /// Checks a value.
    ///
    /// # Errors
    /// [`CameraError::ControlRefused`] with the allowed values.
    pub fn check(&self, camera: &str, value: i64) -> Result<(), CameraError> {
        let reason = match self.kind {
            _ if self.read_only => Some("it is read-only".to_owned()),
            _ if self.inactive => Some(
                "it has no effect at present, because another control (perhaps an automatic one) overrides it".to_owned(),
            ),
            ControlKind::Other => Some("controls of its kind are not supported".to_owned()),
            ControlKind::Menu if !self.items.iter().any(|(index, _)| *index == value) => Some(self.values()),
            ControlKind::Integer | ControlKind::Boolean if !self.on_grid(value) => Some(self.values()),
            // A mask of 32 bits may be signed or unsigned.
            ControlKind::Bitmask if value & !(self.maximum | 0xffff_ffff) != 0 => Some(self.values()),
            _ => None,
        };
        reason.map_or(Ok(()), |reason| Err(self.refused(camera, value, reason)))
    }

    /// The error for a value that it does not take.
    pub(super) fn refused(&self, camera: &str, value: impl ToString, reason: String) -> CameraError {
        let (name, value) = (self.name.clone(), value.to_string());
        CameraError::ControlRefused { camera: camera.to_owned(), name, value, reason }
    }

    fn on_grid(&self, value: i64) -> bool {
        let above = i128::from(value) - i128::from(self.minimum);
        value <= self.maximum && above >= 0 && above % i128::from(self.step.max(1)) == 0
    }

    /// The allowed values, as text.
    pub fn values(&self) -> String {
        match self.kind {
            ControlKind::Menu => {
                let items: Vec<String> =
                    self.items.iter().map(|(index, name)| format!("{index} ({name})")).collect();
                format!("one of {}", items.join(", "))
            }
            ControlKind::Boolean => "on (1) or off (0)".to_owned(),
            ControlKind::Bitmask => format!("bits of {:#x}", self.maximum),
            ControlKind::Button => "anything: writing it presses the button".to_owned(),
            ControlKind::Other => "not shown".to_owned(),
            ControlKind::Integer if self.step > 1 => {
                format!("{} to {} in steps of {}", self.minimum, self.maximum, self.step)
            }
            ControlKind::Integer => format!("{} to {}", self.minimum, self.maximum),
        }
    }
}

impl fmt::Display for Control {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        let value = self.value.map_or("-".to_owned(), |value| value.to_string());
        let item = self.items.iter().find(|(index, _)| Some(*index) == self.value);
        let named = item.map_or_else(String::new, |(_, name)| format!(" ({name})"));
        write!(to, "{:<32} {value}{named}; {}, default {}", self.name, self.values(), self.default)?;
        if self.read_only {
            write!(to, ", read-only")?;
        }
        if self.inactive {
            write!(to, ", without effect at present")?;
        }
        Ok(())
    }
}

/// The control named `name`, in any case and with blanks, `-` or `_` between words.
///
/// # Errors
/// [`CameraError::NoSuchControl`] with the most similar name.
pub fn find_control<'a>(
    camera: &str,
    controls: &'a [Control],
    name: &str,
) -> Result<&'a Control, CameraError> {
    let wanted = Control::command_name(name);
    controls.iter().find(|control| control.name == wanted).ok_or_else(|| CameraError::NoSuchControl {
        camera: camera.to_owned(),
        name: name.to_owned(),
        nearest: nearest(&wanted, controls),
    })
}

fn nearest(wanted: &str, controls: &[Control]) -> Option<String> {
    /// Names below this similarity are not suggested.
    const ALIKE: f64 = 0.7;
    let likeness = |control: &Control| strsim::jaro_winkler(wanted, &control.name);
    let best = controls.iter().max_by(|a, b| likeness(a).total_cmp(&likeness(b)))?;
    (likeness(best) >= ALIKE).then(|| best.name.clone())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn control(kind: ControlKind, minimum: i64, maximum: i64, step: u64) -> Control {
        Control {
            id: 1,
            name: "exposure_time_absolute".to_owned(),
            kind,
            minimum,
            maximum,
            step,
            default: minimum,
            value: Some(minimum),
            read_only: false,
            inactive: false,
            items: Vec::new(),
        }
    }

    #[test]
    fn names_are_those_of_v4l2_ctl() {
        assert_eq!(Control::command_name("Exposure Time, Absolute"), "exposure_time_absolute");
        assert_eq!(Control::command_name("White Balance, Automatic"), "white_balance_automatic");
        assert_eq!(Control::command_name("Inject V4L2_BUF_FLAG_ERROR"), "inject_v4l2_buf_flag_error");
    }

    #[test]
    fn values_are_numbers_words_and_items() {
        let number = control(ControlKind::Integer, 3, 2047, 4);
        assert_eq!(number.parse("cam", "7").unwrap(), 7);
        for wrong in ["8", "2", "2051", "fast", "", "9223372036854775807", "-9223372036854775808"] {
            let error = number.parse("cam", wrong).unwrap_err().to_string();
            assert!(error.contains("3 to 2047 in steps of 4"), "{error}");
        }
        assert_eq!(control(ControlKind::Boolean, 0, 1, 1).parse("cam", "off").unwrap(), 0);
        let mut menu = control(ControlKind::Menu, 0, 3, 1);
        menu.items = vec![(1, "Manual Mode".to_owned()), (3, "Aperture Priority Mode".to_owned())];
        assert_eq!(menu.parse("cam", "manual mode").unwrap(), 1);
        assert!(menu.parse("cam", "2").is_err());
        menu.read_only = true;
        assert!(menu.parse("cam", "1").unwrap_err().to_string().contains("read-only"));
    }

    #[test]
    fn the_nearest_name_is_offered() {
        let controls = [control(ControlKind::Integer, 0, 1, 1)];
        assert!(find_control("cam", &controls, "Exposure-Time absolute").is_ok());
        let error = find_control("cam", &controls, "exposure_absolute").unwrap_err().to_string();
        assert!(error.contains("did you mean exposure_time_absolute?"), "{error}");
        let error = find_control("cam", &controls, "zzz").unwrap_err().to_string();
        assert!(!error.contains("did you mean"), "{error}");
    }
}
