//! The profile recorded with a sequence.

use std::path::PathBuf;

use serde_json::Value;
use thiserror::Error;

use super::settings::Settings;
use super::{Profile, read};
use epirig_core::fault::{Blame, Fault};
use epirig_core::grid::area;
use epirig_core::settings::{LARGEST, SMALLEST};
use epirig_data::sequence::{Finding, Origin, Sequence};
use epirig_data::storage::{RecordFault, parse_value};

/// A recorded rig that cannot be read.
#[derive(Debug, Error)]
#[error(
    "{}: its recorded rig cannot be read: rig.{source}; use the program that wrote it ({program}), or restore the file from a copy",
    path.display()
)]
pub struct RecordedRigError {
    /// The start record.
    pub path: PathBuf,
    /// The program that wrote it.
    pub program: String,
    /// What is wrong.
    pub source: RecordFault,
}

impl Fault for RecordedRigError {
    fn blame(&self) -> Blame {
        Blame::Data
    }
}

/// Fields that are used as divisors.
const DIVISORS: [&str; 4] = ["camera.rate_hz", "plan.step_mm", "optics.sensor_width_mm", "board.square_mm"];
/// Seeds may be any integer.
const SEEDS: [&str; 2] = ["sim.seed", "sim.texture_seed"];

impl Profile {
    /// The rig of the frames of `sequence`: complete for a scan. For imported images only lens and targets
    /// are recorded; stage, camera and plan have their defaults. `None` if no rig was recorded.
    ///
    /// # Errors
    /// [`RecordedRigError`].
    pub fn of_sequence(sequence: &Sequence) -> Result<Option<Self>, RecordedRigError> {
        let record = sequence.record();
        let profile = record.origin.rig().map(Self::of_record).transpose();
        profile.map_err(|source| RecordedRigError {
            path: sequence.folder().join("sequence.json"),
            program: record.program.clone(),
            source,
        })
    }

    /// Parses a record; numbers that are impossible for a rig are refused.
    ///
    /// # Errors
    /// The key and its fault.
    pub fn of_record(rig: &Value) -> Result<Self, RecordFault> {
        let profile: Self = parse_value(rig.clone())?;
        let fault = |key: String, reason: String| RecordFault { line: 0, key, reason };
        if let Some((key, number)) = impossible_number(rig, String::new()) {
            return Err(fault(key, format!("{number} is impossible")));
        }
        let stage = &profile.stage;
        stage
            .settings
            .check(&stage.driver.keys())
            .map_err(|source| fault("stage.settings".to_owned(), source.to_string()))?;
        let plan = &profile.plan;
        let boards = profile.board.into_iter().chain(profile.target.print.map(|print| print.board));
        let corners: Vec<usize> = boards.flat_map(|board| [board.columns, board.rows]).collect();
        let size = profile.camera.size.map_or(Some(1), |size| area(size.rows, size.columns));
        // The ranges of the keys in TOML.
        for (key, is_possible) in [
            ("plan.frames", plan.frames.is_none_or(|frames| (2..=100_000).contains(&frames))),
            ("plan.average", (1..=65_536).contains(&plan.average)),
            ("plan.dark", plan.dark <= 1000),
            ("plan.flat", plan.flat <= 1000),
            ("plan.board", plan.board <= 1000),
            ("optics.focal_length_sigma", (0.0..=1.0).contains(&profile.optics.focal_length_sigma)),
            ("limits.retakes", profile.limits.retakes <= 100),
            ("board or target.print", corners.iter().all(|count| (2..=1000).contains(count))),
            ("camera.size", size.is_some()),
        ] {
            if !is_possible {
                return Err(fault(key.to_owned(), "out of range".to_owned()));
            }
        }
        Ok(profile)
    }

    /// Lens and targets only; all other sections have their defaults.
    pub fn of_lens_and_targets(self) -> Self {
        let Self { optics, target, board, .. } = self;
        // No keys are given, so there are no mistakes.
        let (nothing, _) = read::read(Settings::default());
        Self { optics, target, board, ..nothing }
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

/// The first impossible number, with its key.
fn impossible_number(value: &Value, key: String) -> Option<(String, f64)> {
    match value {
        Value::Number(number) => {
            let size = number.as_f64().unwrap_or(f64::INFINITY).abs();
            let least = if DIVISORS.iter().any(|divisor| key.ends_with(divisor)) { SMALLEST } else { 0.0 };
            (!(least..=LARGEST).contains(&size) && !SEEDS.contains(&key.as_str())).then_some((key, size))
        }
        Value::Array(values) => values
            .iter()
            .enumerate()
            .find_map(|(index, value)| impossible_number(value, format!("{key}[{index}]"))),
        Value::Object(entries) => entries.iter().find_map(|(name, value)| {
            let key = if key.is_empty() { name.clone() } else { format!("{key}.{name}") };
            impossible_number(value, key)
        }),
        Value::Null | Value::Bool(_) | Value::String(_) => None,
    }
}
