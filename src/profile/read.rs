//! Builds the typed profile from settings, with the rules across keys.

use std::ops::RangeInclusive;

use super::Profile;
use super::error::{Mistake, Problem, ProfileError};
use super::schema::{
    BoardProfile, CameraProfile, FocalLength, LimitsProfile, OpticsProfile, PlanProfile, ReportProfile,
    SceneName, SimProfile, StageProfile, TargetProfile, default_of, stage,
};
use super::settings::{Settings, control_path};
use super::value::{self, interpret};
use super::whole::Sections;
use epirig_core::settings::{Key, Setting};

/// The profile of the settings.
///
/// # Errors
/// [`ProfileError`] with all mistakes in them.
pub(super) fn read(settings: Settings) -> Result<Profile, ProfileError> {
    let (sections, reader) = Reader::read(settings);
    let Reader { settings, mistakes } = reader;
    if mistakes.is_empty() { Ok(Profile { sections, settings }) } else { Err(ProfileError { mistakes }) }
}

/// The sections of the settings, mistakes or not: a wrong value is replaced by its default, or by `None`.
pub(super) fn sections(settings: Settings) -> Sections {
    Reader::read(settings).0
}

/// The settings that count: without those of a replaced driver, camera or scene.
pub(super) fn settled(settings: Settings) -> Settings {
    let mut reader = Reader { settings, mistakes: Vec::new() };
    reader.leave_out_what_was_overridden();
    reader.settings
}

/// Whether the key belongs to the simulator, and neither stage nor camera is simulated.
pub(super) fn is_of_no_simulator(key: &Key, sections: &Sections) -> bool {
    key.section == "sim" && !sections.stage.is_simulated() && !sections.camera.is_simulated()
}

/// Whether the key belongs to the tile, and another scene is simulated.
fn is_of_other_scene(key: &Key, sections: &Sections) -> bool {
    key.is("sim.bow") && sections.sim.scene != SceneName::Tile
}

/// Why a key has no effect, if it has none: the words behind "no effect".
pub(super) fn ignored(key: &Key, sections: &Sections) -> Option<String> {
    let driver = sections.stage.driver;
    Some(if !stage::belongs_to(key, driver) {
        format!("with driver = \"{}\"", driver.name())
    } else if is_of_no_simulator(key, sections) {
        "without driver = \"sim\" or port = \"sim\" of the stage, or device = \"sim\" of the camera"
            .to_owned()
    } else if is_of_other_scene(key, sections) {
        "without scene = \"tile\"".to_owned()
    } else if key.is("target.band_distance") && sections.target.bands != 2 {
        "without bands = 2".to_owned()
    } else {
        return None;
    })
}

/// A chess-board needs all of these.
const PRINT: [&str; 3] = ["target.square", "target.columns", "target.rows"];
const BOARD: [&str; 3] = ["board.square", "board.columns", "board.rows"];

struct Reader {
    settings: Settings,
    mistakes: Vec<Mistake>,
}

impl Reader {
    fn read(mut settings: Settings) -> (Sections, Self) {
        let mistakes = std::mem::take(&mut settings.mistakes);
        let mut reader = Self { settings, mistakes };
        reader.leave_out_what_was_overridden();
        let sections = reader.sections();
        // Consequences of a wrong value are not reported.
        if reader.mistakes.is_empty() {
            reader.refuse_what_is_ignored(&sections);
            reader.ask_for_what_is_needed(&sections);
            reader.refuse_impossible_optics(&sections);
        }
        (sections, reader)
    }

    fn sections(&mut self) -> Sections {
        let mut value = |key| self.value(key);
        let mut sections = Sections {
            stage: StageProfile::read(&mut value),
            camera: CameraProfile::read(&mut value),
            plan: PlanProfile::read(&mut value),
            optics: OpticsProfile::read(&mut value),
            target: TargetProfile::read(&mut value),
            board: BoardProfile::read(&mut value),
            limits: LimitsProfile::read(&mut value),
            report: ReportProfile::read(&mut value),
            sim: SimProfile::read(&mut value),
        };
        for key in sections.stage.driver.keys() {
            if let Some(value) = self.value(key) {
                sections.stage.settings.set(key, value);
            }
        }
        sections.camera.controls = self.controls();
        sections
    }

    /// The value of a key, or its default.
    fn value(&mut self, key: &'static Key) -> Option<Setting> {
        if let Some(setting) = self.settings.setting(&key.path()) {
            match interpret(key, setting.unit, &setting.given) {
                Ok(value) => return Some(value),
                Err(problem) => self.mistakes.push(Mistake { place: setting.place.clone(), problem }),
            }
        }
        default_of(key)
    }

    fn controls(&mut self) -> Vec<(String, String)> {
        let mut controls = Vec::new();
        for control in &self.settings.controls {
            match value::control(&control_path(&control.name), &control.given) {
                Ok(value) => controls.push((control.name.clone(), value)),
                Err(problem) => self.mistakes.push(Mistake { place: control.place.clone(), problem }),
            }
        }
        controls
    }

    /// Drops keys of a replaced driver, camera or scene: they belong to the former one.
    fn leave_out_what_was_overridden(&mut self) {
        let known = self.mistakes.len();
        let sections = self.sections();
        // All values are read again later, and mistakes are reported then.
        self.mistakes.truncate(known);
        let driver = sections.stage.driver;
        self.settings.leave_out_below(&["stage.driver"], |key| !stage::belongs_to(key, driver));
        self.settings
            .leave_out_below(&["stage.driver", "camera.device"], |key| is_of_no_simulator(key, &sections));
        self.settings.leave_out_below(&["sim.scene"], |key| is_of_other_scene(key, &sections));
    }

    /// Refuses keys without effect.
    fn refuse_what_is_ignored(&mut self, sections: &Sections) {
        for setting in &self.settings.settings {
            if let Some(with) = ignored(setting.key, sections) {
                let problem = Problem::MeansNothing { key: setting.key.path(), with };
                self.mistakes.push(Mistake { place: setting.place.clone(), problem });
            }
        }
    }

    /// Refuses lengths that no lens has.
    fn refuse_impossible_optics(&mut self, sections: &Sections) {
        /// Focal length over width of the sensor: views of 157 deg and of 0.6 deg.
        const WIDTHS: RangeInclusive<f64> = 0.1..=100.0;
        /// Size of the picture over that of the object: more than macro lenses have.
        const LARGEST_PICTURE: f64 = 10.0;
        let (optics, relief_mm) = (&sections.optics, sections.target.relief_mm);
        let columns = sections.camera.size.map(|size| size.columns as f64);
        // In widths of the sensor.
        let widths = match optics.focal_length {
            Some(FocalLength::Mm(mm)) => optics.sensor_width_mm.map(|width_mm| mm / width_mm),
            Some(FocalLength::Px(px)) => columns.map(|columns| px / columns),
            None => None,
        };
        if let Some(widths) = widths.filter(|widths| !WIDTHS.contains(widths)) {
            let view_deg = 2.0 * (0.5 / widths).atan().to_degrees();
            let reason = format!(
                "it is {widths:.4} times the width of the sensor, and the camera would see {view_deg:.3} deg; {} to {} times \
                 are allowed: check focal length, width of the sensor and their units",
                WIDTHS.start(),
                WIDTHS.end()
            );
            self.contradict("optics.focal_length", reason);
            return;
        }
        let Some(distance_mm) = optics.distance_mm else { return };
        let focal_mm = match optics.focal_length {
            Some(FocalLength::Mm(mm)) => Some(mm),
            _ => widths.zip(optics.sensor_width_mm).map(|(widths, width_mm)| widths * width_mm),
        };
        if let Some(focal_mm) = focal_mm {
            // The lens equation.
            let picture = focal_mm / (distance_mm - focal_mm);
            if distance_mm <= focal_mm {
                let reason = format!(
                    "a lens of {focal_mm} mm shows only what is farther away than its focal length; check both lengths and \
                     their units"
                );
                self.contradict("optics.distance", reason);
            } else if picture > LARGEST_PICTURE {
                let reason = format!(
                    "a lens of {focal_mm} mm would show the object {picture:.1} times as large as it is; {LARGEST_PICTURE} times \
                     are allowed: check both lengths and their units"
                );
                self.contradict("optics.distance", reason);
            }
        }
        if relief_mm.is_some_and(|relief_mm| relief_mm >= distance_mm) {
            let reason = format!("it must be less than the distance of the object, {distance_mm} mm");
            self.contradict("target.relief", reason);
        }
    }

    fn contradict(&mut self, path: &str, reason: String) {
        let Some(setting) = self.settings.setting(path) else { return };
        let value = match setting.unit {
            Some(unit) => format!("{} {}", setting.given, unit.name),
            None => setting.given.to_string(),
        };
        let problem = Problem::Contradicts { key: path.to_owned(), value, reason };
        self.mistakes.push(Mistake { place: setting.place.clone(), problem });
    }

    fn ask_for_what_is_needed(&mut self, sections: &Sections) {
        let driver = sections.stage.driver;
        // A simulated device brings what it needs.
        if !sections.stage.is_simulated() {
            for key in driver.keys() {
                if let Some(advice) = key.needed {
                    self.need("stage.driver", driver.name(), &key.path(), advice);
                }
            }
        }
        if let Some(FocalLength::Mm(_)) = sections.optics.focal_length {
            let advice = "add it, or give the focal length in px";
            self.need("optics.focal_length", "a length", "optics.sensor_width", advice);
        }
        for name in ["k1", "k2", "p1", "p2", "k3", "focal_length_sigma"] {
            let advice = "give the focal length, too";
            self.need(&format!("optics.{name}"), "given", "optics.focal_length", advice);
        }
        self.need_all(&[&PRINT[..], &["target.bands", "target.band_distance"]].concat(), &PRINT);
        self.need_all(&BOARD, &BOARD);
        if sections.target.print().is_some() && sections.target.bands == 2 {
            let advice = "measure it with a ruler, or give one band";
            self.need("target.bands", "2", "target.band_distance", advice);
        }
        let [x, y] = ["optics.principal_point_x", "optics.principal_point_y"];
        for (half, other) in [(x, y), (y, x)] {
            self.need(half, "given", other, "give both or none");
        }
    }

    /// If any key of `given` is given, all of `needed` must be.
    fn need_all(&mut self, given: &[&str], needed: &[&str]) {
        let Some(first) = given.iter().find(|path| self.settings.setting(path).is_some()) else { return };
        for key in needed {
            self.need(first, "given", key, "give square, columns and rows, or none");
        }
    }

    /// Asks for the key `needed` if the one at `path` is given, and it is not.
    fn need(&mut self, path: &str, state: &str, needed: &str, advice: &str) {
        let Some(setting) = self.settings.setting(path) else { return };
        if self.settings.setting(needed).is_none() {
            let (key, needed) = (format!("{path} ({state})"), needed.to_owned());
            let problem = Problem::Needs { key, needed, advice: advice.to_owned() };
            self.mistakes.push(Mistake { place: setting.place.clone(), problem });
        }
    }
}
