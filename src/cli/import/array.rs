//! Frames of a Zarr array that other software wrote.

use std::path::Path;

use super::super::CliError;
use epirig_core::progress::Progress;
use epirig_data::packed::ForeignArray;
use epirig_data::sequence::encode_png;
use epirig_data::storage::{Disk as _, RealDisk, Scratch};

/// The frames of an array as grey PNG files: every `every`-th, the first `most` of them if it is given. They are in
/// a hidden folder beside `out`, which goes when it is dropped.
pub(super) fn extract(
    path: &Path,
    out: &Path,
    (every, most): (usize, Option<usize>),
    progress: &dyn Progress,
) -> Result<Scratch, CliError> {
    let array = ForeignArray::open(path)?;
    let scratch =
        Scratch::beside(out).map_err(|(path, source)| CliError::file("make a folder in", &path)(source))?;
    let taken: Vec<usize> = (0..array.frames()).step_by(every).take(most.unwrap_or(usize::MAX)).collect();
    progress.begin("reading the array", taken.len() as u64);
    for t in taken {
        progress.unless_cancelled()?;
        let file = scratch.path().join(format!("frame_{t:06}.png"));
        let png = encode_png(&array.frame(t)?).map_err(std::io::Error::other);
        png.and_then(|png| RealDisk.write(&file, &png)).map_err(CliError::file("write", &file))?;
        progress.advance(1);
    }
    progress.end();
    Ok(scratch)
}
