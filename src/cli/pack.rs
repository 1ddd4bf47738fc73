//! `epirig pack`.

use std::path::PathBuf;

use clap::Args;
use serde::Serialize;

use super::files::refuse_taken;
use super::scan_end::AnywayArgument;
use super::{CliError, Talk};
use crate::calibrate::{CALIBRATION, read_calibration};
use crate::pipeline::{PACKED, Packed, pack_sequence};
use epirig_core::shell::quoted;
use epirig_data::sequence::bundle;

/// Pack the frames as one Zarr array, or all as one file to send
///
/// The frames are corrected and rectified as `epirig match` does it, and written as one array of frames x rows x
/// columns: Zarr version 3 with the metadata of OME-NGFF, which Python, Dask and napari open. `match`, `view` and
/// `evaluate` read the array in the folder of its sequence instead of the images: with the same results, and sooner.
/// One that was interrupted goes on where it was. It may be removed at any time.
///
/// With --bundle the sequence goes into one zip file: its records and all its frames, with a list of hashes. Who
/// unpacks it has the sequence, and can repeat the measurement.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  epirig pack tile                                  tile/volume.zarr
  epirig pack tile --out for-napari.zarr
  epirig pack tile --bundle tile.zip                for a colleague
  epirig pack tile --bundle tile.zip --with-results")]
pub(super) struct Pack {
    /// Folder of the sequence
    seq: PathBuf,
    /// Folder of the array [default: SEQ/volume.zarr]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Pack the frames as captured, without the calibration of `epirig calibrate`
    #[arg(long)]
    as_captured: bool,
    /// Write the sequence as one zip file instead; an existing file is refused
    #[arg(long, value_name = "FILE.zip", conflicts_with_all = ["out", "as_captured"])]
    bundle: Option<PathBuf>,
    /// With --bundle: calibration and results, too
    #[arg(long, requires = "bundle")]
    with_results: bool,
    #[command(flatten)]
    anyway: AnywayArgument,
}

/// What is derived from the frames of a sequence, in its folder.
const DERIVED: [&str; 3] = [CALIBRATION, "calibration", "results"];

#[derive(Serialize)]
struct Output {
    out: String,
    #[serde(flatten)]
    packed: Packed,
}

impl Pack {
    pub(super) fn run(self, talk: &Talk) -> Result<(), CliError> {
        let sequence = self.anyway.open(&self.seq, talk)?;
        if let Some(out) = &self.bundle {
            refuse_taken(out)?;
            let also = if self.with_results { &DERIVED[..] } else { &[] };
            let bundle = bundle(&sequence, also, out, talk)?;
            return talk.result(&bundle, || {
                format!(
                    "{}: {} files of {}; to whom you give it: unzip, and `epirig verify {}`\n",
                    quoted(out),
                    bundle.files.len(),
                    sequence.name(),
                    quoted(sequence.name().as_ref())
                )
            });
        }
        let calibration = if self.as_captured { None } else { read_calibration(&sequence)? };
        let out = self.out.unwrap_or_else(|| self.seq.join(PACKED));
        let packed = pack_sequence(&sequence, calibration.as_ref(), &out, talk)?;
        let Packed { frames, rows, columns, bit_depth, packed_before } = packed;
        if packed_before > 0 {
            talk.say(&format!("note: {packed_before} of {frames} frames were packed before"));
        }
        let kind = if calibration.is_some() { "corrected and rectified" } else { "as captured" };
        let output = Output { out: out.display().to_string(), packed };
        talk.result(&output, || {
            format!("{}: {frames} frames of {columns} x {rows}, {bit_depth} bit, {kind}\n", quoted(&out))
        })
    }
}
