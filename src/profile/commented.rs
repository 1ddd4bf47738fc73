//! A profile that lists every key with its explanation, as a template.

use super::schema::{CONTROLS, SECTIONS, stage};
use super::value::line;
use epirig_core::settings::Key;
use epirig_core::settings::quantity::UNITS;

/// Columns of a comment.
const WIDTH: usize = 100;

/// The connected devices. Without findings the template says nothing of them.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Findings {
    /// USB serial ports as [`PortChoice`](epirig_devices::link::PortChoice) parses them, the most likely first;
    /// `None` if nobody looked for them.
    pub ports: Option<Vec<String>>,
    /// Cameras, the most likely first; `None` if nobody looked for them.
    pub cameras: Option<Vec<FoundCamera>>,
}

/// A connected camera.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct FoundCamera {
    /// The name that [`CameraChoice`](epirig_devices::camera::CameraChoice) parses.
    pub choice: String,
    /// Model name that the device reports.
    pub model: String,
    /// Codes of the pixel formats that it offers.
    pub formats: Vec<String>,
}

/// The text of a profile template. Port and camera are filled in if exactly one of each was found; several
/// are listed for a choice. Every other key is commented out, with its meaning, its allowed values, its
/// default and an example. [`Profile::read`](super::Profile::read) accepts the text as it is.
pub fn commented(findings: &Findings) -> String {
    template(findings, &|_| None, &[])
}

/// The same with values: `set` gives that of a key, as it is written, or `None` for a key that stays commented
/// out; `controls` are those of the camera.
pub(super) fn template(
    findings: &Findings,
    set: &dyn Fn(&Key) -> Option<String>,
    controls: &[(String, String)],
) -> String {
    let mut text = Lines::default();
    text.comment("A rig and a scan, for epirig. Lines that begin with # are comments: take the # away from a key to set it.");
    text.comment(
        "A quantity has its unit in the value (step = \"1.5 mm\") or in the key (step_mm = 1.5). Units:",
    );
    for units in UNITS.chunk_by(|one, next| one.quantity == next.quantity) {
        let quantity = units[0].quantity;
        text.comment(&format!("  {}: {}", quantity.noun(), quantity.unit_names()));
    }
    text.comment("In a key, units are in small letters, with _ for / and percent for %: velocity_mm_s, rate_hz, saturated_percent.");
    for section in SECTIONS {
        text.blank();
        text.comment(&format!("{}.", section.meaning));
        text.line(&format!("[{}]", section.name));
        for key in section.keys() {
            text.blank();
            text.key(key, findings, set(key));
            // The table of controls follows all keys of its section: keys after its heading would be controls.
            let is_last = section.keys().last().is_some_and(|last| std::ptr::eq(*last, key));
            if section.name == "camera" && is_last {
                text.controls(controls);
            }
        }
    }
    text.0
}

#[derive(Default)]
struct Lines(String);

impl Lines {
    fn line(&mut self, line: &str) {
        self.0.push_str(line);
        self.0.push('\n');
    }

    fn blank(&mut self) {
        self.line("");
    }

    /// Adds a comment in lines of at most [`WIDTH`] columns, unless a word is longer. Leading blanks indent
    /// it.
    fn comment(&mut self, text: &str) {
        // Names reported by devices may hold any characters.
        let text = text.replace(char::is_control, " ");
        let indent = &text[..text.len() - text.trim_start().len()];
        let mut line = format!("# {indent}");
        let mut words = 0;
        for word in text.split_whitespace() {
            if words > 0 && line.chars().count() + 1 + word.chars().count() > WIDTH {
                self.line(&line);
                line = format!("# {indent}");
                words = 0;
            }
            if words > 0 {
                line.push(' ');
            }
            line.push_str(word);
            words += 1;
        }
        self.line(&line);
    }

    fn key(&mut self, key: &'static Key, findings: &Findings, set: Option<String>) {
        self.comment(&format!("{}.", key.meaning));
        let mut facts = format!("Value: {}", key.kind.allowed());
        if let Some(default) = key.default {
            facts.push_str(&format!("; default: {default}"));
        }
        let drivers = stage::drivers_with(key);
        if !drivers.is_empty() {
            facts.push_str(&format!("; only with driver {}", drivers.join(", ")));
        }
        self.comment(&format!("{facts}."));
        let found = if key.is("stage.port") {
            self.ports(findings.ports.as_deref())
        } else if key.is("camera.device") {
            self.cameras(findings.cameras.as_deref())
        } else {
            None
        };
        match set.as_deref().or(found) {
            Some(value) => self.line(&line(key, &escaped(value))),
            None => self.line(&format!("# {}", line(key, key.default.unwrap_or(key.example)))),
        }
    }

    fn controls(&mut self, controls: &[(String, String)]) {
        self.blank();
        self.comment("Controls of the camera, with the names that `epirig camera get` lists. Values: a number, true, false or text.");
        self.line(&format!("[camera.{CONTROLS}]"));
        if controls.is_empty() {
            self.line("# gain = 10");
        }
        for (name, value) in controls {
            // Numbers and truth values stand without quotes; anything else is text.
            let is_plain = value.parse::<i64>().is_ok() || matches!(value.as_str(), "true" | "false");
            let quote = if is_plain { "" } else { "\"" };
            self.line(&format!("{name} = {quote}{}{quote}", escaped(value)));
        }
    }

    /// Lists the ports that were found; returns the port if there is only one.
    fn ports<'f>(&mut self, ports: Option<&'f [String]>) -> Option<&'f str> {
        match ports? {
            [] => self.comment("No USB serial port was found."),
            [only] => return Some(only),
            several => {
                self.comment("Several serial ports were found; name the one of the stage:");
                several.iter().for_each(|port| self.comment(&format!("  {port}")));
            }
        }
        None
    }

    /// Lists the cameras that were found; returns the camera if there is only one.
    fn cameras<'f>(&mut self, cameras: Option<&'f [FoundCamera]>) -> Option<&'f str> {
        let facts = |camera: &FoundCamera| {
            let formats = if camera.formats.is_empty() {
                "no known format".to_owned()
            } else {
                camera.formats.join(", ")
            };
            format!("{}, formats: {formats}", camera.model)
        };
        match cameras? {
            [] => self.comment("No camera was found."),
            [only] => {
                self.comment(&format!("Found: {}", facts(only)));
                return Some(&only.choice);
            }
            several => {
                self.comment("Several cameras were found; name one of them:");
                for camera in several {
                    self.comment(&format!("  {} ({})", camera.choice, facts(camera)));
                }
            }
        }
        None
    }
}

/// Text with the escapes of a TOML string.
fn escaped(text: &str) -> String {
    let mut escaped = String::new();
    for character in text.chars() {
        match character {
            '"' | '\\' => escaped.extend(['\\', character]),
            control if control.is_control() => escaped.push_str(&format!("\\u{:04X}", u32::from(control))),
            other => escaped.push(other),
        }
    }
    escaped
}

#[cfg(test)]
mod tests {
    use super::super::Profile;
    use super::super::schema::Section;
    use super::super::value::example;
    use super::*;

    #[test]
    fn with_nothing_found_it_sets_nothing_and_has_every_key_once() {
        let text = commented(&Findings { ports: Some(Vec::new()), cameras: Some(Vec::new()) });
        assert_eq!(Profile::read(&text, "rig.toml", &[]), Profile::of(&[]));
        assert!(text.contains("# No USB serial port was found.\n# port = "), "{text}");
        assert!(text.contains("# No camera was found.\n# device = "), "{text}");
        for section in SECTIONS {
            let heading = format!("\n[{}]\n", section.name);
            let body = text.split(&heading).nth(1).unwrap().split("\n[").next().unwrap();
            for key in section.keys() {
                let set = |line: &&str| line.starts_with(&format!("# {} = ", key.name));
                assert_eq!(body.lines().filter(set).count(), 1, "{}", key.path());
            }
        }
        assert!(text.lines().all(|line| line.chars().count() <= WIDTH), "{text}");
    }

    #[test]
    fn what_was_not_looked_for_is_not_said_to_be_missing() {
        let text = commented(&Findings::default());
        assert!(!text.contains("found"), "{text}");
    }

    #[test]
    fn every_line_of_a_key_can_be_taken_as_it_stands() {
        let text = commented(&Findings::default());
        let keys = SECTIONS.iter().flat_map(Section::keys);
        for key in keys.filter(|key| key.default.is_none()) {
            assert!(text.contains(&format!("\n# {}\n", example(key))), "{}", key.path());
        }
    }

    fn camera(choice: &str, formats: &[&str]) -> FoundCamera {
        FoundCamera {
            choice: choice.to_owned(),
            model: "HD Pro\nWebcam \"C920\"".to_owned(),
            formats: formats.iter().map(|&format| format.to_owned()).collect(),
        }
    }

    #[test]
    fn the_only_one_found_is_filled_in() {
        let findings = Findings {
            ports: Some(vec!["usb:A\"1\\\n".to_owned()]),
            cameras: Some(vec![camera("usb:B2", &["GREY", "Y12"])]),
        };
        let text = commented(&findings);
        let profile = Profile::read(&text, "rig.toml", &[]).unwrap();
        assert_eq!(profile.stage.port.as_deref(), Some("usb:A\"1\\\n"));
        assert_eq!(profile.camera.device.as_deref(), Some("usb:B2"));
        assert!(text.contains("# Found: HD Pro Webcam \"C920\", formats: GREY, Y12\n"), "{text}");
        assert!(!text.contains("No USB serial port") && !text.contains("No camera"), "{text}");
    }

    #[test]
    fn of_several_none_is_filled_in_and_all_are_listed() {
        let findings = Findings {
            ports: Some(vec!["usb:A1".to_owned(), "/dev/ttyS0".to_owned()]),
            cameras: Some(vec![camera("usb:B2", &["GREY"]), camera("/dev/video4", &[])]),
        };
        let text = commented(&findings);
        assert_eq!(Profile::read(&text, "rig.toml", &[]), Profile::of(&[]));
        assert!(text.contains("stage:\n#   usb:A1\n#   /dev/ttyS0\n# port = "), "{text}");
        let cameras = "#   usb:B2 (HD Pro Webcam \"C920\", formats: GREY)\n\
                       #   /dev/video4 (HD Pro Webcam \"C920\", formats: no known format)\n\
                       # device = ";
        assert!(text.contains(cameras), "{text}");
    }
}
