//! From settings to the typed profile, with the rules that hold across keys.

use std::time::Duration;

use super::Profile;
use super::error::{Mistake, Place, Problem};
use super::parts::{
    AxisName, BAYER_USES, CameraProfile, Driver, FocalLength, LimitsProfile, OpticsProfile, PlanProfile,
    SceneName, SimProfile, StageProfile, TargetProfile,
};
use super::quantity::{DN, HZ, MM, MM_S, MM_S2, Measure, NS, PERCENT, PX, Quantity, UM, US, Unit};
use super::schema::{Key, camera, limits, optics, plan, sim, stage, target};
use super::settings::{Given, Settings, control_path};
use super::value::{self, Value, interpret};
use crate::camera::Size;

/// The profile that the settings make, and all that is wrong with them; what is wrong has its default in it, or nothing.
pub(super) fn read(mut settings: Settings) -> (Profile, Vec<Mistake>) {
    let mistakes = std::mem::take(&mut settings.mistakes);
    let mut reader = Reader { settings, mistakes };
    reader.leave_out_what_was_overridden();
    let profile = Profile {
        stage: reader.stage(),
        camera: reader.camera(),
        plan: reader.plan(),
        optics: reader.optics(),
        target: TargetProfile { relief_mm: reader.number(&target::RELIEF, MM) },
        limits: reader.limits(),
        sim: reader.sim(),
    };
    // What follows from a wrong value would be noise.
    if reader.mistakes.is_empty() {
        reader.refuse_what_is_ignored(&profile);
        reader.ask_for_what_is_needed(&profile);
    }
    (profile, reader.mistakes)
}

/// Whether the key means nothing with this driver of the stage.
fn is_of_other_driver(key: &Key, driver: Driver) -> bool {
    !key.drivers.is_empty() && !key.drivers.contains(&driver.name())
}

/// Whether the key describes the twin, and neither stage nor camera is simulated.
fn is_of_no_twin(key: &Key, stage: &StageProfile, camera: &CameraProfile) -> bool {
    key.section == "sim" && stage.driver != Driver::Sim && !camera.is_simulated()
}

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

    fn choice<T: Copy, const N: usize>(&mut self, key: &'static Key, all: &[(&str, T); N]) -> Option<T> {
        match self.value(key)? {
            Value::Choice(index) => all.get(index).map(|(_, choice)| *choice),
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

    /// Of a key with a default.
    fn number_or_default(&mut self, key: &'static Key, unit: Unit) -> f64 {
        self.number(key, unit).unwrap_or_default()
    }

    /// Of a key with a default, in whole ns.
    fn duration(&mut self, key: &'static Key) -> Duration {
        // The key's range keeps it far below 2^64.
        Duration::from_nanos(self.number_or_default(key, NS).round() as u64)
    }

    fn whole<T: TryFrom<i64>>(&mut self, key: &'static Key) -> Option<T> {
        match self.value(key)? {
            Value::Whole(number) => T::try_from(number).ok(),
            _ => None,
        }
    }

    fn flag(&mut self, key: &'static Key) -> bool {
        self.value(key) == Some(Value::Flag(true))
    }

    fn stage(&mut self) -> StageProfile {
        StageProfile {
            driver: self.choice(&stage::DRIVER, &Driver::ALL).unwrap_or(Driver::Native),
            port: self.text(&stage::PORT),
            axis: self.choice(&stage::AXIS, &AxisName::ALL),
            device: self.whole(&stage::DEVICE),
            microstep_um: self.number(&stage::MICROSTEP, UM),
            approach_mm: self.number_or_default(&stage::APPROACH, MM),
            tolerance_mm: self.number_or_default(&stage::TOLERANCE, MM),
            travel_mm: self.number(&stage::TRAVEL, MM),
            velocity_mm_s: self.number(&stage::VELOCITY, MM_S),
            acceleration_mm_s2: self.number(&stage::ACCELERATION, MM_S2),
            position_noise_um: self.number_or_default(&stage::POSITION_NOISE, UM),
            backlash_um: self.number_or_default(&stage::BACKLASH, UM),
        }
    }

    fn camera(&mut self) -> CameraProfile {
        CameraProfile {
            device: self.text(&camera::DEVICE),
            format: self.text(&camera::FORMAT),
            size: self.size(),
            rate_hz: self.number(&camera::RATE, HZ),
            exposure_us: self.number(&camera::EXPOSURE, US),
            bayer: self.choice(&camera::BAYER, &BAYER_USES),
            patience: self.duration(&camera::PATIENCE),
            mains_hz: self.number(&camera::MAINS, HZ),
            controls: self.controls(),
        }
    }

    fn size(&mut self) -> Option<Size> {
        match self.value(&camera::SIZE)? {
            Value::Size(size) => Some(size),
            _ => None,
        }
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
            sensor_width_mm: self.number(&optics::SENSOR_WIDTH, MM),
            principal_point_px: principal_point,
            distance_mm: self.number(&optics::DISTANCE, MM),
        }
    }

    fn limits(&mut self) -> LimitsProfile {
        LimitsProfile {
            retakes: self.whole(&limits::RETAKES).unwrap_or_default(),
            saturated: self.number_or_default(&limits::SATURATED, PERCENT) / 100.0,
            position_mm: self.number_or_default(&limits::POSITION, MM),
            wait: self.duration(&limits::WAIT),
            shift_px: self.number_or_default(&limits::SHIFT, PX),
        }
    }

    fn sim(&mut self) -> SimProfile {
        SimProfile {
            scene: self.choice(&sim::SCENE, &SceneName::ALL).unwrap_or(SceneName::Plane),
            noise_dn: self.number_or_default(&sim::NOISE, DN),
            seed: self.whole(&sim::SEED).unwrap_or_default(),
            real_time: self.flag(&sim::REAL_TIME),
        }
    }

    /// Whoever overrides the driver or the camera does not mean what the file says of another one.
    fn leave_out_what_was_overridden(&mut self) {
        let known = self.mistakes.len();
        let (stage, camera) = (self.stage(), self.camera());
        // All values are read again, and what is wrong with those that count is told then.
        self.mistakes.truncate(known);
        self.settings.leave_out_below(&[&stage::DRIVER], |key| is_of_other_driver(key, stage.driver));
        self.settings
            .leave_out_below(&[&stage::DRIVER, &camera::DEVICE], |key| is_of_no_twin(key, &stage, &camera));
    }

    /// A key that does nothing would be believed to do something.
    fn refuse_what_is_ignored(&mut self, profile: &Profile) {
        let driver = profile.stage.driver;
        for setting in &self.settings.settings {
            let key = setting.key;
            let with = if is_of_other_driver(key, driver) {
                format!("with driver = \"{}\"", driver.name())
            } else if is_of_no_twin(key, &profile.stage, &profile.camera) {
                "without driver = \"sim\" of the stage or device = \"sim\" of the camera".to_owned()
            } else {
                continue;
            };
            let problem = Problem::MeansNothing { key: key.path(), with };
            self.mistakes.push(Mistake { place: setting.place.clone(), problem });
        }
    }

    fn ask_for_what_is_needed(&mut self, profile: &Profile) {
        if profile.stage.driver == Driver::Zaber && !self.is_given(&stage::MICROSTEP) {
            self.need(&stage::DRIVER, "zaber", &stage::MICROSTEP, "it is in the stage's data sheet");
        }
        let in_length = matches!(profile.optics.focal_length, Some(FocalLength::Mm(_)));
        if in_length && !self.is_given(&optics::SENSOR_WIDTH) {
            let advice = "add it, or give the focal length in px";
            self.need(&optics::FOCAL_LENGTH, "a length", &optics::SENSOR_WIDTH, advice);
        }
        let halves = [&optics::PRINCIPAL_POINT_X, &optics::PRINCIPAL_POINT_Y];
        for (half, other) in [(halves[0], halves[1]), (halves[1], halves[0])] {
            if self.is_given(half) && !self.is_given(other) {
                self.need(half, "given", other, "give both or none");
            }
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
