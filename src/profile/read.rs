//! Builds the typed profile from settings, with the rules across keys.

use std::ops::RangeInclusive;
use std::time::Duration;

use super::Profile;
use super::error::{Mistake, Place, Problem};
use super::given::{Given, Value};
use super::parts::{
    BoardProfile, CameraProfile, FIRST_TEXTURE, FocalLength, LimitsProfile, OpticsProfile, PlanProfile,
    PrintProfile, SceneName, SimFaults, SimProfile, StageProfile, TargetProfile,
};
use super::schema::{Key, board, camera, limits, optics, plan, sim, stage, target};
use super::settings::{Settings, control_path};
use super::value::{self, interpret};
use epirig_calibration::lens::Distortion;
use epirig_core::choice::Choice;
use epirig_core::settings::Settings as DriverSettings;
use epirig_core::settings::quantity::{DN, HZ, MM, Measure, NS, PERCENT, PX, Quantity, RAD, UM, US, Unit};
use epirig_devices::camera::Size;
use epirig_devices::stage::Driver;

/// The profile of the settings, and all mistakes in them. A wrong value is replaced by its default, or by
/// `None`.
pub(super) fn read(mut settings: Settings) -> (Profile, Vec<Mistake>) {
    let mistakes = std::mem::take(&mut settings.mistakes);
    let mut reader = Reader { settings, mistakes };
    reader.leave_out_what_was_overridden();
    let profile = Profile {
        stage: reader.stage(),
        camera: reader.camera(),
        plan: reader.plan(),
        optics: reader.optics(),
        target: reader.target(),
        board: reader.board(&BOARD),
        limits: reader.limits(),
        sim: reader.sim(),
    };
    // Consequences of a wrong value are not reported.
    if reader.mistakes.is_empty() {
        reader.refuse_what_is_ignored(&profile);
        reader.ask_for_what_is_needed(&profile);
        reader.refuse_impossible_optics(&profile);
    }
    (profile, reader.mistakes)
}

/// The settings that count: without those of a replaced driver, camera or scene.
pub(super) fn settled(settings: Settings) -> Settings {
    let mut reader = Reader { settings, mistakes: Vec::new() };
    reader.leave_out_what_was_overridden();
    reader.settings
}

/// Whether the key belongs to the simulator, and neither stage nor camera is simulated.
pub(super) fn is_of_no_simulator(key: &Key, stage: &StageProfile, camera: &CameraProfile) -> bool {
    key.section == "sim" && !stage.is_simulated() && !camera.is_simulated()
}

/// Whether the key belongs to the tile, and another scene is simulated.
fn is_of_other_scene(key: &Key, sim: &SimProfile) -> bool {
    std::ptr::eq(key, &sim::BOW) && sim.scene != SceneName::Tile
}

/// The keys of a chess-board: side of a square, columns and rows.
type BoardKeys = [&'static Key; 3];
const PRINT: BoardKeys = [&target::SQUARE, &target::COLUMNS, &target::ROWS];
const BOARD: BoardKeys = [&board::SQUARE, &board::COLUMNS, &board::ROWS];
const DISTORTION: [&Key; 5] = [&optics::K1, &optics::K2, &optics::P1, &optics::P2, &optics::K3];

struct Reader {
    settings: Settings,
    mistakes: Vec<Mistake>,
}

impl Reader {
    /// The value of a key, or its default.
    fn value(&mut self, key: &'static Key) -> Option<Value> {
        if let Some(setting) = self.settings.setting(key) {
            match interpret(key, setting.unit, &setting.given) {
                Ok(value) => return Some(value),
                Err(problem) => self.mistakes.push(Mistake { place: setting.place.clone(), problem }),
            }
        }
        let default = Given::Plain(key.default?.to_owned());
        interpret(key, None, &default).ok()
    }

    fn text(&mut self, key: &'static Key) -> Option<String> {
        match self.value(key)? {
            Value::Text(text) => Some(text),
            _ => None,
        }
    }

    fn choice<C: Choice>(&mut self, key: &'static Key) -> Option<C> {
        match self.value(key)? {
            Value::Choice(name) => C::from_name(name),
            _ => None,
        }
    }

    fn measure(&mut self, key: &'static Key) -> Option<Measure> {
        match self.value(key)? {
            Value::Measure(measure) => Some(measure),
            _ => None,
        }
    }

    fn number(&mut self, key: &'static Key, unit: Unit) -> Option<f64> {
        self.measure(key).map(|measure| measure.in_unit(unit))
    }

    /// The value of a key with a default.
    fn number_or_default(&mut self, key: &'static Key, unit: Unit) -> f64 {
        self.number(key, unit).unwrap_or_default()
    }

    /// The value of a key with a default, in whole ns.
    fn duration(&mut self, key: &'static Key) -> Duration {
        // The allowed range is far below 2^64.
        Duration::from_nanos(self.number_or_default(key, NS).round() as u64)
    }

    fn whole<T: TryFrom<i64>>(&mut self, key: &'static Key) -> Option<T> {
        match self.value(key)? {
            Value::Whole(number) => T::try_from(number).ok(),
            _ => None,
        }
    }

    /// The value of a key with a default.
    fn plain_number(&mut self, key: &'static Key) -> f64 {
        match self.value(key) {
            Some(Value::Number(number)) => number,
            _ => 0.0,
        }
    }

    /// The value of a key with a default: a share, 0 to 1.
    fn share(&mut self, key: &'static Key) -> f64 {
        self.number_or_default(key, PERCENT) / 100.0
    }

    fn flag(&mut self, key: &'static Key) -> bool {
        self.value(key) == Some(Value::Flag(true))
    }

    fn stage(&mut self) -> StageProfile {
        let driver = match self.value(&stage::DRIVER) {
            Some(Value::Choice(name)) => Driver::named(name),
            _ => None,
        };
        let driver = driver.unwrap_or_else(Driver::usual);
        let mut settings = DriverSettings::default();
        for key in driver.keys() {
            if let Some(value) = self.value(key) {
                settings.set(key, value.setting(key));
            }
        }
        StageProfile {
            driver,
            port: self.text(&stage::PORT),
            approach_mm: self.number_or_default(&stage::APPROACH, MM),
            tolerance_mm: self.number_or_default(&stage::TOLERANCE, MM),
            settings,
        }
    }

    fn camera(&mut self) -> CameraProfile {
        CameraProfile {
            device: self.text(&camera::DEVICE),
            format: self.text(&camera::FORMAT),
            size: self.size(),
            rate_hz: self.number(&camera::RATE, HZ),
            exposure_us: self.number(&camera::EXPOSURE, US),
            bayer: self.choice(&camera::BAYER),
            patience: self.duration(&camera::PATIENCE),
            mains_hz: self.number(&camera::MAINS, HZ),
            controls: self.controls(),
        }
    }

    fn size(&mut self) -> Option<Size> {
        self.text(&camera::SIZE)?.parse().ok()
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

    fn plan(&mut self) -> PlanProfile {
        PlanProfile {
            start_mm: self.number_or_default(&plan::START, MM),
            step_mm: self.number(&plan::STEP, MM),
            frames: self.whole(&plan::FRAMES),
            settle: self.duration(&plan::SETTLE),
            average: self.whole(&plan::AVERAGE).unwrap_or_default(),
            dark: self.whole(&plan::DARK).unwrap_or_default(),
            flat: self.whole(&plan::FLAT).unwrap_or_default(),
            board: self.whole(&plan::BOARD).unwrap_or_default(),
        }
    }

    fn optics(&mut self) -> OpticsProfile {
        let focal_length = self.measure(&optics::FOCAL_LENGTH).map(|length| match length.unit.quantity {
            Quantity::Pixels => FocalLength::Px(length.in_unit(PX)),
            _ => FocalLength::Mm(length.in_unit(MM)),
        });
        let principal_point =
            self.number(&optics::PRINCIPAL_POINT_X, PX).zip(self.number(&optics::PRINCIPAL_POINT_Y, PX));
        OpticsProfile {
            focal_length,
            focal_length_sigma: self.share(&optics::FOCAL_LENGTH_SIGMA),
            sensor_width_mm: self.number(&optics::SENSOR_WIDTH, MM),
            principal_point_px: principal_point,
            distance_mm: self.number(&optics::DISTANCE, MM),
            distortion: {
                let [k1, k2, p1, p2, k3] = DISTORTION.map(|key| self.plain_number(key));
                Distortion { k1, k2, p1, p2, k3 }
            },
        }
    }

    fn target(&mut self) -> TargetProfile {
        let relief_mm = self.number(&target::RELIEF, MM);
        let board = self.board(&PRINT);
        // Always read, so that mistakes are reported.
        let bands: Option<usize> = self.whole(&target::BANDS);
        let band_distance_mm = self.number(&target::BAND_DISTANCE, MM).filter(|_| bands == Some(2));
        TargetProfile { relief_mm, print: board.map(|board| PrintProfile { board, band_distance_mm }) }
    }

    /// A chess-board, if all its keys are given.
    fn board(&mut self, [square, columns, rows]: &BoardKeys) -> Option<BoardProfile> {
        let (square_mm, columns, rows) = (self.number(square, MM), self.whole(columns), self.whole(rows));
        Some(BoardProfile { square_mm: square_mm?, columns: columns?, rows: rows? })
    }

    fn limits(&mut self) -> LimitsProfile {
        LimitsProfile {
            retakes: self.whole(&limits::RETAKES).unwrap_or_default(),
            saturated: self.share(&limits::SATURATED),
            position_mm: self.number_or_default(&limits::POSITION, MM),
            wait: self.duration(&limits::WAIT),
            shift_px: self.number_or_default(&limits::SHIFT, PX),
        }
    }

    fn sim(&mut self) -> SimProfile {
        SimProfile {
            scene: self.choice(&sim::SCENE).unwrap_or(SceneName::Plane),
            noise_dn: self.number_or_default(&sim::NOISE, DN),
            seed: self.whole(&sim::SEED).unwrap_or_default(),
            texture_seed: self.whole(&sim::TEXTURE_SEED).unwrap_or(FIRST_TEXTURE),
            real_time: self.flag(&sim::REAL_TIME),
            faults: SimFaults {
                roll_rad: self.number_or_default(&sim::ROLL, RAD),
                pan_rad: self.number_or_default(&sim::PAN, RAD),
                k1: self.plain_number(&sim::K1),
                vignetting: self.share(&sim::VIGNETTING),
                flicker: self.share(&sim::FLICKER),
                drift: self.share(&sim::DRIFT),
                highlight_dn: self.number_or_default(&sim::HIGHLIGHT, DN),
                step_error_um: self.number_or_default(&sim::STEP_ERROR, UM),
                bow_mm: self.number_or_default(&sim::BOW, MM),
                black_level_dn: self.number_or_default(&sim::BLACK_LEVEL, DN),
                pixel_gains: self.share(&sim::PIXEL_GAINS),
                hot_pixels: self.whole(&sim::HOT_PIXELS).unwrap_or_default(),
            },
        }
    }

    /// Drops keys of a replaced driver, camera or scene: they belong to the former one.
    fn leave_out_what_was_overridden(&mut self) {
        let known = self.mistakes.len();
        let (stage, camera, sim) = (self.stage(), self.camera(), self.sim());
        // All values are read again later, and mistakes are reported then.
        self.mistakes.truncate(known);
        self.settings.leave_out_below(&[&stage::DRIVER], |key| !stage::belongs_to(key, stage.driver));
        self.settings.leave_out_below(&[&stage::DRIVER, &camera::DEVICE], |key| {
            is_of_no_simulator(key, &stage, &camera)
        });
        self.settings.leave_out_below(&[&sim::SCENE], |key| is_of_other_scene(key, &sim));
    }

    /// Refuses keys without effect.
    fn refuse_what_is_ignored(&mut self, profile: &Profile) {
        let driver = profile.stage.driver;
        for setting in &self.settings.settings {
            let key = setting.key;
            let with = if !stage::belongs_to(key, driver) {
                format!("with driver = \"{}\"", driver.name())
            } else if is_of_no_simulator(key, &profile.stage, &profile.camera) {
                "without driver = \"sim\" of the stage or device = \"sim\" of the camera".to_owned()
            } else if is_of_other_scene(key, &profile.sim) {
                "without scene = \"tile\"".to_owned()
            } else if std::ptr::eq(key, &target::BAND_DISTANCE) && self.whole_of(&target::BANDS) != Some(2) {
                "without bands = 2".to_owned()
            } else {
                continue;
            };
            let problem = Problem::MeansNothing { key: key.path(), with };
            self.mistakes.push(Mistake { place: setting.place.clone(), problem });
        }
    }

    /// Refuses lengths that no lens has.
    fn refuse_impossible_optics(&mut self, profile: &Profile) {
        /// Focal length over width of the sensor: views of 157 deg and of 0.6 deg.
        const WIDTHS: RangeInclusive<f64> = 0.1..=100.0;
        /// Size of the picture over that of the object: more than macro lenses have.
        const LARGEST_PICTURE: f64 = 10.0;
        let (optics, relief_mm) = (&profile.optics, profile.target.relief_mm);
        let columns = profile.camera.size.map(|size| size.columns as f64);
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
            self.contradict(&optics::FOCAL_LENGTH, reason);
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
                self.contradict(&optics::DISTANCE, reason);
            } else if picture > LARGEST_PICTURE {
                let reason = format!(
                    "a lens of {focal_mm} mm would show the object {picture:.1} times as large as it is; {LARGEST_PICTURE} times \
                     are allowed: check both lengths and their units"
                );
                self.contradict(&optics::DISTANCE, reason);
            }
        }
        if relief_mm.is_some_and(|relief_mm| relief_mm >= distance_mm) {
            let reason = format!("it must be less than the distance of the object, {distance_mm} mm");
            self.contradict(&target::RELIEF, reason);
        }
    }

    fn contradict(&mut self, key: &'static Key, reason: String) {
        let Some(setting) = self.settings.setting(key) else { return };
        let value = match setting.unit {
            Some(unit) => format!("{} {}", setting.given, unit.name),
            None => setting.given.to_string(),
        };
        let problem = Problem::Contradicts { key: key.path(), value, reason };
        self.mistakes.push(Mistake { place: setting.place.clone(), problem });
    }

    fn ask_for_what_is_needed(&mut self, profile: &Profile) {
        let driver = profile.stage.driver;
        for key in driver.keys() {
            if let Some(advice) = key.needed.filter(|_| !self.is_given(key)) {
                self.need(&stage::DRIVER, driver.name(), key, advice);
            }
        }
        let in_length = matches!(profile.optics.focal_length, Some(FocalLength::Mm(_)));
        if in_length && !self.is_given(&optics::SENSOR_WIDTH) {
            let advice = "add it, or give the focal length in px";
            self.need(&optics::FOCAL_LENGTH, "a length", &optics::SENSOR_WIDTH, advice);
        }
        for key in DISTORTION.into_iter().chain([&optics::FOCAL_LENGTH_SIGMA]) {
            let advice = "give the focal length, too";
            if self.is_given(key) && !self.is_given(&optics::FOCAL_LENGTH) {
                self.need(key, "given", &optics::FOCAL_LENGTH, advice);
            }
        }
        let of_print = PRINT.into_iter().chain([&target::BANDS, &target::BAND_DISTANCE]).collect();
        for (given, needed) in [(of_print, PRINT), (BOARD.to_vec(), BOARD)] {
            self.need_all(&given, &needed);
        }
        let two = profile.target.print.is_some() && self.whole_of(&target::BANDS) == Some(2);
        if two && !self.is_given(&target::BAND_DISTANCE) {
            let advice = "measure it with a ruler, or give one band";
            self.need(&target::BANDS, "2", &target::BAND_DISTANCE, advice);
        }
        let halves = [&optics::PRINCIPAL_POINT_X, &optics::PRINCIPAL_POINT_Y];
        for (half, other) in [(halves[0], halves[1]), (halves[1], halves[0])] {
            if self.is_given(half) && !self.is_given(other) {
                self.need(half, "given", other, "give both or none");
            }
        }
    }

    /// If any key of `given` is given, all of `needed` must be.
    fn need_all(&mut self, given: &[&'static Key], needed: &BoardKeys) {
        let Some(first) = given.iter().find(|key| self.is_given(key)) else { return };
        for key in needed {
            if !self.is_given(key) {
                self.need(first, "given", key, "give square, columns and rows, or none");
            }
        }
    }

    /// An integer that is known to be valid.
    fn whole_of(&self, key: &'static Key) -> Option<i64> {
        let setting = self.settings.setting(key)?;
        match interpret(key, setting.unit, &setting.given) {
            Ok(Value::Whole(number)) => Some(number),
            _ => None,
        }
    }

    fn is_given(&self, key: &'static Key) -> bool {
        self.settings.setting(key).is_some()
    }

    fn need(&mut self, key: &'static Key, state: &str, needed: &'static Key, advice: &str) {
        let Some(setting) = self.settings.setting(key) else { return };
        let place: Place = setting.place.clone();
        let key = format!("{} ({state})", key.path());
        let problem = Problem::Needs { key, needed: needed.path(), advice: advice.to_owned() };
        self.mistakes.push(Mistake { place, problem });
    }
}
