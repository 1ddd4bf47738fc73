//! Settings by key, with their places: from a file, and overrides.

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::error::{Mistake, Place, Problem, did_you_mean};
use super::given::Given;
use super::overrides::Override;
use super::schema::{CONTROLS, Key, SECTIONS, Section, find_key, find_section};
use epirig_core::settings::quantity::Unit;
use epirig_devices::camera::Control;

/// Most mistakes that are listed.
const MOST_MISTAKES: usize = 50;
/// More controls than any camera has.
const MOST_CONTROLS: usize = 1000;

/// A key with its value.
#[derive(Debug, Clone)]
pub(super) struct Setting {
    pub(super) key: &'static Key,
    /// The unit in the name of the key.
    pub(super) unit: Option<Unit>,
    pub(super) given: Given,
    pub(super) place: Place,
}

/// A control of the camera with its value.
#[derive(Debug, Clone)]
pub(super) struct ControlSetting {
    /// As in commands.
    pub(super) name: String,
    pub(super) given: Given,
    pub(super) place: Place,
}

/// All settings.
#[derive(Debug, Clone, Default)]
pub(super) struct Settings {
    pub(super) settings: Vec<Setting>,
    pub(super) controls: Vec<ControlSetting>,
    pub(super) mistakes: Vec<Mistake>,
}

impl Settings {
    /// The settings of a file; `source` is its name.
    pub(super) fn of_file(text: &str, source: &str) -> Self {
        let lines = text.bytes().enumerate().filter(|(_, byte)| *byte == b'\n').map(|(place, _)| place + 1);
        let file = File { source, lines: lines.collect() };
        let mut settings = Self::default();
        match DeTable::parse(text) {
            Ok(table) => {
                for (name, value) in in_order(table.get_ref()) {
                    if settings.is_full() {
                        break;
                    }
                    settings.add_section(&file, name, value);
                }
            }
            Err(error) => {
                let place = file.place(error.span().map_or(0, |span| span.start));
                let reason = error.message().lines().collect::<Vec<_>>().join("; ");
                settings.mistakes.push(Mistake { place, problem: Problem::NotToml { reason } });
            }
        }
        settings
    }

    fn add_section(&mut self, file: &File<'_>, name: &Name<'_>, value: &DeValue<'_>) {
        let section = match (find_section(name.get_ref()), value) {
            (Ok(section), DeValue::Table(table)) => Ok((section, table)),
            (Ok(_), _) => Err(Problem::NotASection { name: name.get_ref().to_string() }),
            (Err(problem), DeValue::Table(_)) => Err(problem),
            (Err(_), _) => Err(outside(name.get_ref())),
        };
        match section {
            Ok((section, table)) => {
                for (name, value) in in_order(table) {
                    if self.is_full() {
                        return;
                    }
                    self.add_entry(file, section, name, value);
                }
            }
            Err(problem) => self.note(file.place_of(name), problem),
        }
    }

    fn add_entry(&mut self, file: &File<'_>, section: &Section, name: &Name<'_>, value: &DeValue<'_>) {
        let place = file.place_of(name);
        let is_controls = section.name == "camera" && name.get_ref() == CONTROLS;
        match value {
            DeValue::Table(table) if is_controls => {
                for (name, value) in in_order(table) {
                    self.add_control(name.get_ref(), Given::of(value), file.place_of(name));
                }
            }
            _ if is_controls => self.note(place, Problem::NotASection { name: format!("camera.{CONTROLS}") }),
            value => self.add_key(section, name.get_ref(), Given::of(value), place),
        }
    }

    fn add_key(&mut self, section: &Section, name: &str, given: Given, place: Place) {
        match find_key(section, name) {
            Ok((key, unit)) => match self.setting(key).map(|first| first.place.clone()) {
                Some(first) => self.note(place, Problem::Twice { key: key.path(), first }),
                None => self.settings.push(Setting { key, unit, given, place }),
            },
            Err(problem) => self.note(place, problem),
        }
    }

    fn add_control(&mut self, name: &str, given: Given, place: Place) {
        let name = match control_name(name) {
            Ok(_) if self.controls.len() >= MOST_CONTROLS => {
                return self.note(place, Problem::TooMany { what: "controls", most: MOST_CONTROLS });
            }
            Ok(name) => name,
            Err(problem) => return self.note(place, problem),
        };
        match self.controls.iter().find(|known| known.name == name).map(|first| first.place.clone()) {
            Some(first) => self.note(place, Problem::Twice { key: control_path(&name), first }),
            None => self.controls.push(ControlSetting { name, given, place }),
        }
    }

    /// Adds a mistake, up to a limit.
    fn note(&mut self, place: Place, problem: Problem) {
        match self.mistakes.len() {
            ..MOST_MISTAKES => self.mistakes.push(Mistake { place, problem }),
            MOST_MISTAKES => {
                let problem = Problem::TooMany { what: "mistakes", most: MOST_MISTAKES };
                self.mistakes.push(Mistake { place, problem });
            }
            _ => {}
        }
    }

    /// Whether the limit of mistakes is reached; the rest is ignored.
    fn is_full(&self) -> bool {
        self.mistakes.len() > MOST_MISTAKES
    }

    /// Replaces a value by an override's.
    pub(super) fn replace(&mut self, new: &Override) {
        let place = Place::Override { from: new.from.clone() };
        let given = Given::Plain(new.value.trim().to_owned());
        let (section, name) = new.key.split_once('.').unwrap_or(("", &new.key));
        let control = name.strip_prefix(CONTROLS).and_then(|rest| rest.strip_prefix('.'));
        if let Some(control) = control.filter(|_| section == "camera") {
            let name = match control_name(control) {
                Ok(name) => name,
                Err(problem) => return self.note(place, problem),
            };
            match self.controls.iter_mut().find(|known| known.name == name) {
                Some(known) => (known.given, known.place) = (given, place),
                None => self.controls.push(ControlSetting { name, given, place }),
            }
            return;
        }
        match find_section(section).and_then(|section| find_key(section, name)) {
            Ok((key, unit)) => {
                self.forget(key);
                self.settings.push(Setting { key, unit, given, place });
            }
            Err(problem) => self.note(place, problem),
        }
    }

    /// Drops keys that `is_ignored` selects, if their place has a lower rank than one of the keys `by`: they
    /// belong to the replaced choice.
    pub(super) fn leave_out_below(&mut self, by: &[&'static Key], is_ignored: impl Fn(&Key) -> bool) {
        let rank = by.iter().filter_map(|key| self.setting(key)).map(|setting| setting.place.rank()).max();
        self.settings.retain(|setting| !is_ignored(setting.key) || Some(setting.place.rank()) >= rank);
    }

    /// Drops a key.
    pub(super) fn forget(&mut self, key: &'static Key) {
        self.settings.retain(|setting| setting.key.path() != key.path());
    }

    /// The setting of a key.
    pub(super) fn setting(&self, key: &'static Key) -> Option<&Setting> {
        self.settings
            .iter()
            .find(|setting| (setting.key.section, setting.key.name) == (key.section, key.name))
    }
}

/// The path of a control.
pub(super) fn control_path(name: &str) -> String {
    format!("camera.{CONTROLS}.{name}")
}

/// A control's name as in commands.
fn control_name(name: &str) -> Result<String, Problem> {
    Some(Control::command_name(name)).filter(|name| !name.is_empty()).ok_or_else(|| Problem::UnknownKey {
        key: control_path(name),
        hint: "`epirig camera get` lists the names of the camera's controls".to_owned(),
    })
}

fn outside(name: &str) -> Problem {
    let home = SECTIONS.iter().find(|section| find_key(section, name).is_ok());
    let hint = home.map_or_else(
        || did_you_mean(name, SECTIONS.iter().map(|section| format!("[{}]", section.name))),
        |section| format!("write it below [{}]", section.name),
    );
    Problem::OutsideSections { name: name.to_owned(), hint }
}

type Name<'i> = Spanned<toml::de::DeString<'i>>;

/// The entries of a table in the order of the file.
fn in_order<'t, 'i>(table: &'t DeTable<'i>) -> Vec<(&'t Name<'i>, &'t DeValue<'i>)> {
    let mut entries: Vec<_> = table.iter().map(|(name, value)| (name, value.get_ref())).collect();
    entries.sort_by_key(|(name, _)| name.span().start);
    entries
}

struct File<'a> {
    source: &'a str,
    /// Start of each line except the first, in bytes.
    lines: Vec<usize>,
}

impl File<'_> {
    fn place_of(&self, name: &Name<'_>) -> Place {
        self.place(name.span().start)
    }

    fn place(&self, byte: usize) -> Place {
        let line = 1 + self.lines.partition_point(|start| *start <= byte);
        Place::Line { source: self.source.to_owned(), line }
    }
}
