//! `epirig rectify`.

use std::path::PathBuf;

use clap::Args;

use super::need::{check, close_others, frames_of};
use super::scan_end::AnywayArgument;
use super::{CliError, Talk};
use crate::calibrate::{CALIBRATION, read_calibration};
use crate::pipeline::{rectification_need, rectify_sequence};
use epirig_core::shell::quoted;

/// Write corrected and rectified frames as a new sequence
///
/// `epirig match` does this by itself, in memory. Here the frames become PNG files of 16 bit for other
/// software, in which the object moves exactly along the rows. Dark level, flat field and frame brightness
/// are corrected, and lens distortion is removed; 32768 is the former full scale. The new sequence has the
/// measured positions and the lens of the rectified frames.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  epirig rectify tile --out tile-rectified
  epirig match tile-rectified                       same result as without it")]
pub(super) struct Rectify {
    /// Folder of the sequence, calibrated by `epirig calibrate`
    seq: PathBuf,
    /// Folder of the new sequence
    #[arg(long, value_name = "SEQ")]
    out: PathBuf,
    #[command(flatten)]
    anyway: AnywayArgument,
}

impl Rectify {
    pub(super) fn run(self, talk: &Talk) -> Result<(), CliError> {
        let sequence = self.anyway.open(&self.seq, talk)?;
        let calibration = read_calibration(&sequence)?.ok_or_else(|| {
            CliError::usage(format!(
                "{0} has no {CALIBRATION}, which rectification needs; run `epirig calibrate {0}` first",
                self.seq.display()
            ))
        })?;
        let need = rectification_need(frames_of(&sequence, Some(&calibration)));
        check("rectifying", need, talk, close_others)?;
        let derived = rectify_sequence(&sequence, &calibration, &self.out, talk)?;
        if derived.intrinsics.is_none() {
            talk.say("note: the lens is unknown, so these frames give no heights in mm either");
        }
        let summary = serde_json::json!({
            "out": self.out.display().to_string(),
            "frames": derived.frames,
            "rows": derived.rows,
            "columns": derived.columns,
            "bit_depth": derived.bit_depth,
            "positions_mm": derived.positions_mm,
            "intrinsics": derived.intrinsics,
            "origin": derived.origin,
        });
        talk.result(&summary, || {
            format!(
                "{0}: {1} frames of {2} x {3}, {4} bit\nnext: epirig match {0}\n",
                quoted(&self.out),
                derived.frames,
                derived.columns,
                derived.rows,
                derived.bit_depth
            )
        })
    }
}
