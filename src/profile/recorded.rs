//! The profile recorded with a sequence: what a person could have written, in JSON.

use std::path::PathBuf;

use serde_json::{Map, Value as Json, json};
use thiserror::Error;

use super::error::{ProfileError, one_line};
use super::read::{ignored, read};
use super::schema::{CONTROLS, SECTIONS, SimProfile, default_of};
use super::settings::Settings;
use super::value::interpret;
use super::{Override, Profile};
use epirig_core::fault::{Blame, Fault};
use epirig_core::settings::Setting;
use epirig_core::settings::quantity::Measure;
use epirig_data::sequence::{Finding, Origin, Sequence};

/// A recorded rig that cannot be read.
#[derive(Debug, Error)]
#[error(
    "{}: its recorded rig cannot be read: {problems}; use the program that wrote it ({program}), or restore the file from a copy",
    path.display()
)]
pub struct RecordedRigError {
    /// The start record.
    pub path: PathBuf,
    /// The program that wrote it.
    pub program: String,
    /// What is wrong with it.
    pub problems: String,
}

impl Fault for RecordedRigError {
    fn blame(&self) -> Blame {
        Blame::Data
    }
}

impl Profile {
    /// The rig of the frames of `sequence`: complete for a scan. For imported images only lens and targets
    /// are recorded; stage, camera and plan have their defaults. `None` if no rig was recorded. Scripted faults of
    /// a simulated rig are left out: they have happened.
    ///
    /// # Errors
    /// [`RecordedRigError`].
    pub fn of_sequence(sequence: &Sequence) -> Result<Option<Self>, RecordedRigError> {
        let record = sequence.record();
        let profile = record.origin.rig().map(|rig| {
            let mut rig = rig.clone();
            if let Some(sim) = rig.get_mut(SimProfile::SECTION.name).and_then(Json::as_object_mut) {
                sim.remove("faults");
            }
            Self::of_record(&rig)
        });
        let profile = profile.transpose();
        let problems = |error: ProfileError| -> Vec<String> {
            error.mistakes.iter().map(|mistake| one_line(&mistake.problem)).collect()
        };
        profile.map_err(|error| RecordedRigError {
            path: sequence.folder().join("sequence.json"),
            program: record.program.clone(),
            problems: problems(error).join("; "),
        })
    }

    /// Reads a [`record`](Self::record), as [`read`](Self::read) does a file.
    ///
    /// # Errors
    /// [`ProfileError`] with all mistakes.
    pub fn of_record(rig: &Json) -> Result<Self, ProfileError> {
        let mut settings = Settings::of_record(rig);
        // A record names the defaults, too. These were not given, and need nothing beside them.
        settings.settings.retain(|setting| {
            let value = interpret(setting.key, setting.unit, &setting.given).ok();
            value.is_none() || value != default_of(setting.key)
        });
        read(settings)
    }

    /// This profile as a record: an object for each section with all values, given or by default, but for
    /// keys without effect. Quantities have their unit. The round trip is exact.
    ///
    /// Controls are pairs of name and value, because their order counts.
    pub fn record(&self) -> Json {
        let mut record = Map::new();
        for section in SECTIONS {
            let mut values = Map::new();
            for key in section.keys().into_iter().filter(|key| ignored(key, self).is_none()) {
                let given = self.settings.setting(&key.path());
                let value = given.and_then(|setting| interpret(key, setting.unit, &setting.given).ok());
                if let Some(value) = value.or_else(|| default_of(key)) {
                    values.insert(key.name.to_owned(), recorded(value));
                }
            }
            if section.name == "camera" && !self.camera.controls.is_empty() {
                let pairs = self.camera.controls.iter().map(|(name, value)| json!([name, value]));
                values.insert(CONTROLS.to_owned(), pairs.collect());
            }
            record.insert(section.name.to_owned(), Json::Object(values));
        }
        Json::Object(record)
    }

    /// This profile, changed by `overrides`.
    ///
    /// # Errors
    /// [`ProfileError`] with all mistakes in the overrides, and with all contradictions to the other values.
    pub fn changed(self, overrides: &[Override]) -> Result<Self, ProfileError> {
        let mut settings = self.settings;
        for value in overrides {
            settings.replace(value);
            // With one band, the distance of the bands has no meaning and is dropped.
            if value.key == "target.bands" && value.value == "1" {
                settings.forget("target.band_distance");
            }
        }
        read(settings)
    }

    /// Lens and targets only; all other sections have their defaults.
    ///
    /// # Errors
    /// [`ProfileError`] if they contradict each other.
    pub fn of_lens_and_targets(mut self) -> Result<Self, ProfileError> {
        self.settings.controls.clear();
        self.settings
            .settings
            .retain(|setting| matches!(setting.key.section, "optics" | "target" | "board" | "report"));
        read(self.settings)
    }

    /// Contradictions to the other records of the sequence.
    pub fn contradictions(&self, sequence: &Sequence) -> Vec<Finding> {
        let record = sequence.record();
        let mut found = Vec::new();
        let mut contradicts = |what: &str| {
            found.push(Finding {
                file: "sequence.json".to_owned(),
                problem: format!("{what} differ from the recorded rig; restore the file from a copy"),
            });
        };
        let captured = matches!(record.origin, Origin::Captured { .. });
        if let Some(planned) = self.plan.positions_mm()
            && captured
            && Some(&planned) != record.positions_mm.as_ref()
        {
            contradicts("the planned positions");
        }
        let limits = self.scan_limits();
        if record.origin.limits().is_some_and(|recorded| {
            (recorded.position_mm, recorded.shift_px) != (limits.position_mm, limits.shift_px)
        }) {
            contradicts("the limits");
        }
        let lens = self
            .optics
            .lens(record.columns, record.rows)
            .map(|lens| [lens.focal_length_x_px, lens.principal_point_x_px, lens.principal_point_y_px]);
        let recorded = record.intrinsics.map(|intrinsics| {
            [intrinsics.focal_length_px, intrinsics.principal_point_x_px, intrinsics.principal_point_y_px]
        });
        // The same formula with another order of factors: equal except for rounding.
        let differ =
            |(one, other): (f64, f64)| (one - other).abs() > 1e-9 * one.abs().max(other.abs()).max(1.0);
        if let Some(lens) = lens
            && recorded.is_none_or(|recorded| lens.into_iter().zip(recorded).any(differ))
        {
            contradicts("focal length and principal point");
        }
        found
    }
}

/// A value as records have it: what a file could have, with the unit in the value.
fn recorded(value: Setting) -> Json {
    match value {
        Setting::Text(text) => text.into(),
        Setting::Whole(number) => number.into(),
        Setting::Number(number) => number.into(),
        Setting::Flag(flag) => flag.into(),
        Setting::Measure(Measure { value, unit }) => format!("{value} {}", unit.name).into(),
    }
}
