//! Settings by key, with their places: from a file, and overrides.

use serde_json::Value as Json;
use toml::Spanned;
use toml::de::{DeString, DeTable, DeValue};

use super::error::{Mistake, Place, Problem, did_you_mean};
use super::given::Given;
use super::overrides::Override;
use super::schema::{CONTROLS, SECTIONS, Section, find_key, find_section};
use epirig_core::settings::Key;
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
            Ok(table) => settings.add_sections(file.entries(table.get_ref())),
            Err(error) => {
                let place = file.place(error.span().map_or(0, |span| span.start));
                let reason = error.message().lines().collect::<Vec<_>>().join("; ");
                settings.mistakes.push(Mistake { place, problem: Problem::NotToml(reason) });
            }
        }
        settings
    }

    /// The settings in a record, which has the sections and keys of a file.
    pub(super) fn of_record(rig: &Json) -> Self {
        let mut settings = Self::default();
        match recorded_entries(rig) {
            Some(sections) => settings.add_sections(sections),
            None => settings.note(Place::Record, Problem::NotASection("rig".to_owned())),
        }
        settings
    }

    fn add_sections(&mut self, sections: Vec<Entry>) {
        for Entry { name, place, item } in sections {
            if self.is_full() {
                return;
            }
            match (find_section(&name), item) {
                (Ok(section), Item::Table(entries)) => self.add_section(section, entries),
                (Ok(_), _) => self.note(place, Problem::NotASection(name)),
                (Err(problem), Item::Table(_)) => self.note(place, problem),
                (Err(_), _) => self.note(place, outside(&name)),
            }
        }
    }

    fn add_section(&mut self, section: &Section, entries: Vec<Entry>) {
        for Entry { name, place, item } in entries {
            if self.is_full() {
                return;
            }
            let is_controls = section.name == "camera" && name == CONTROLS;
            match item {
                Item::Table(controls) if is_controls => {
                    for Entry { name, place, item } in controls {
                        self.add_control(&name, item.given(), place);
                    }
                }
                _ if is_controls => {
                    self.note(place, Problem::NotASection(format!("camera.{CONTROLS}")));
                }
                item => self.add_key(section, &name, item.given(), place),
            }
        }
    }

    fn add_key(&mut self, section: &Section, name: &str, given: Given, place: Place) {
        match find_key(section, name) {
            Ok((key, unit)) => match self.setting(&key.path()).map(|first| first.place.clone()) {
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
                self.forget(&key.path());
                self.settings.push(Setting { key, unit, given, place });
            }
            Err(problem) => self.note(place, problem),
        }
    }

    /// Drops keys that `is_ignored` selects, if their place has a lower rank than one of the keys `by`: they
    /// belong to the replaced choice.
    pub(super) fn leave_out_below(&mut self, by: &[&str], is_ignored: impl Fn(&Key) -> bool) {
        let rank = by.iter().filter_map(|path| self.setting(path)).map(|setting| setting.place.rank()).max();
        self.settings.retain(|setting| !is_ignored(setting.key) || Some(setting.place.rank()) >= rank);
    }

    /// Drops the key at a path.
    pub(super) fn forget(&mut self, path: &str) {
        self.settings.retain(|setting| !setting.key.is(path));
    }

    /// The setting of the key at a path.
    pub(super) fn setting(&self, path: &str) -> Option<&Setting> {
        self.settings.iter().find(|setting| setting.key.is(path))
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

/// What stands in a file or a record, before its keys are looked up.
struct Entry {
    name: String,
    place: Place,
    item: Item,
}

enum Item {
    Table(Vec<Entry>),
    Value(Given),
}

impl Item {
    fn given(self) -> Given {
        match self {
            Self::Table(_) => Given::Other("a table"),
            Self::Value(given) => given,
        }
    }
}

/// The entries of a table in a record: an object, or pairs of name and value if their order counts.
fn recorded_entries(value: &Json) -> Option<Vec<Entry>> {
    let entry = |name: &str, value: &Json| Entry {
        name: name.to_owned(),
        place: Place::Record,
        item: recorded_entries(value).map_or_else(|| Item::Value(Given::of_record(value)), Item::Table),
    };
    match value {
        Json::Object(entries) => Some(entries.iter().map(|(name, value)| entry(name, value)).collect()),
        Json::Array(pairs) => pairs
            .iter()
            .map(|pair| match pair.as_array()?.as_slice() {
                [Json::String(name), value] => Some(entry(name, value)),
                _ => None,
            })
            .collect(),
        _ => None,
    }
}

struct File<'a> {
    source: &'a str,
    /// Start of each line except the first, in bytes.
    lines: Vec<usize>,
}

impl File<'_> {
    /// The entries of a table in the order of the file.
    fn entries(&self, table: &DeTable<'_>) -> Vec<Entry> {
        let mut entries: Vec<_> = table.iter().collect();
        entries.sort_by_key(|(name, _)| name.span().start);
        let entry = |(name, value): (&Spanned<DeString<'_>>, &Spanned<DeValue<'_>>)| Entry {
            name: name.get_ref().to_string(),
            place: self.place(name.span().start),
            item: match value.get_ref() {
                DeValue::Table(table) => Item::Table(self.entries(table)),
                value => Item::Value(Given::of(value)),
            },
        };
        entries.into_iter().map(entry).collect()
    }

    fn place(&self, byte: usize) -> Place {
        let line = 1 + self.lines.partition_point(|start| *start <= byte);
        Place::Line { source: self.source.to_owned(), line }
    }
}
