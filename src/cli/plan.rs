//! `epirig plan`.

use std::time::Duration;

use clap::Args;
use serde::Serialize;

use super::rig::RigArguments;
use super::{CliError, Talk};
use crate::capture::{CapturePlan, Estimate};
use crate::profile::Profile;
use crate::rig::capture_plan;
use epirig_devices::camera::SimDevice;
use epirig_devices::stage::{SimStage, SimStageConfig, Stage};

/// Print what a scan would do: positions, time, bytes
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  epirig plan                                        of rig.toml
  epirig plan --rig sim --json
  epirig plan --step-mm 1.5 --frames 101

No device is used. Time and bytes are known only if the profile holds size, rate and velocity; else
`epirig capture --dry-run` asks the rig.")]
pub(super) struct Plan {
    #[command(flatten)]
    rig: RigArguments,
}

/// A plan in numbers.
#[derive(Debug, Serialize)]
pub(super) struct PlanOutput {
    positions_mm: Vec<f64>,
    moving_s: Option<f64>,
    settling_s: f64,
    exposing_s: Option<f64>,
    total_s: Option<f64>,
    bytes: Option<u64>,
}

impl PlanOutput {
    pub(super) fn new(plan: &CapturePlan, estimate: &Estimate) -> Self {
        let seconds = |time: Option<Duration>| time.map(|time| time.as_secs_f64());
        Self {
            positions_mm: plan.positions_mm.clone(),
            moving_s: seconds(estimate.moving),
            settling_s: estimate.settling.as_secs_f64(),
            exposing_s: seconds(estimate.exposing),
            total_s: seconds(estimate.total()),
            bytes: estimate.bytes,
        }
    }

    pub(super) fn describe(&self) -> String {
        let positions = &self.positions_mm;
        let ends = positions.first().zip(positions.last()).map_or(String::new(), |(first, last)| {
            format!("from {first:.3} mm to {last:.3} mm, {:.3} mm in all", last - first)
        });
        let known = |seconds: Option<f64>| seconds.map_or("not known".to_owned(), minutes);
        let total = self.total_s.map_or_else(
            || "unknown without rate and velocity; `epirig capture --dry-run` asks the rig".to_owned(),
            |seconds| format!("{}, without homing", minutes(seconds)),
        );
        let bytes = self.bytes.map_or("unknown without the camera".to_owned(), |bytes| {
            format!("{:.1} MB at most", bytes as f64 / 1e6)
        });
        format!(
            "frames   {}\nstops    {ends}\ntime     {total}\n         moving {}, settling {}, exposing {}\ndisk     {bytes}\n",
            positions.len(),
            known(self.moving_s),
            minutes(self.settling_s),
            known(self.exposing_s),
        )
    }
}

fn minutes(seconds: f64) -> String {
    if seconds < 60.0 {
        format!("{seconds:.1} s")
    } else {
        let whole = seconds.round() as u64;
        format!("{} min {:02} s", whole / 60, whole % 60)
    }
}

impl Plan {
    pub(super) fn run(self, talk: &Talk) -> Result<(), CliError> {
        let profile = self.rig.profile()?;
        let plan = capture_plan(&profile)?;
        let output = PlanOutput::new(&plan, &estimate(&profile, &plan));
        talk.result(&output, || output.describe())
    }
}

/// The estimate without a rig, from the profile alone.
fn estimate(profile: &Profile, plan: &CapturePlan) -> Estimate {
    /// Bytes per sample if the profile does not tell; the deepest frames have 16 bit.
    const SAMPLE_BYTES: usize = 2;
    let simulated = profile.camera.is_simulated();
    let sample_bytes = if simulated && plan.section.average == 1 { 1 } else { SAMPLE_BYTES };
    let frame_bytes = profile.camera.size.map(|size| (size.columns * size.rows * sample_bytes) as u64);
    let rate_hz = profile.camera.rate_hz.or(simulated.then_some(f64::from(SimDevice::RATE_HZ)));
    let interval = rate_hz.and_then(|rate_hz| Duration::try_from_secs_f64(1.0 / rate_hz).ok());
    let config = SimStageConfig::of_settings(&profile.stage.settings, profile.sim.seed);
    let stage = (!profile.stage.driver.has_line()).then(|| SimStage::new(config));
    plan.estimate(frame_bytes, interval, |mm| stage.as_ref()?.expected_duration(mm))
}
