//! Memory that a verb needs, compared with the memory available.

use super::{CliError, Talk};
use crate::calibrate::{Calibration, CalibrationPlan};
use crate::memory::{Available, Bound, available};
use crate::pipeline::{Frames, Held, calibration_held, frames_that_fit, held, match_need};
use epirig_calibration::photometry::Maps;
use epirig_core::fault::Blame;
use epirig_data::sequence::Sequence;
use epirig_matcher::MatchOptions;

/// Size of the frames as they are held for matching: rectified, if the sequence is calibrated.
pub(super) fn frames_of(sequence: &Sequence, calibration: Option<&(Calibration, Maps)>) -> Frames {
    let record = sequence.record();
    let count = sequence.frames().len();
    match calibration.map(|(calibration, _)| calibration.mapping.camera) {
        Some(camera) => Frames { count, rows: camera.rows, columns: camera.columns, sample_bytes: 2 },
        None => Frames {
            count,
            rows: record.rows,
            columns: record.columns,
            sample_bytes: usize::from(record.bit_depth.div_ceil(8)),
        },
    }
}

/// Holds the frames of a calibration on disk if they are more than memory should hold, so that it takes `limit` bytes or
/// half of what is free. Refuses one that does not fit.
pub(super) fn check_calibration(
    sequence: &Sequence,
    plan: &mut CalibrationPlan,
    limit: Option<u64>,
    talk: &Talk,
) -> Result<(), CliError> {
    let (held, need) = calibration_held(sequence, plan, limit);
    refuse_more_than_allowed("calibrating", need, limit)?;
    check("calibrating", need, talk, close_others)?;
    plan.frames_on_disk = held == Held::Packed;
    Ok(())
}

/// Refuses a match that does not fit into memory, or takes more than `limit` bytes, and suggests one that fits.
pub(super) fn check_match(
    frames: Frames,
    options: &MatchOptions,
    limit: Option<u64>,
    talk: &Talk,
) -> Result<(), CliError> {
    let held = held(|held| match_need(frames, options, held), limit);
    let need = match_need(frames, options, held);
    refuse_more_than_allowed("matching", need, limit)?;
    check_match_of(frames, options, held, talk)
}

/// Refuses `what` if it needs more than the `limit` of --memory.
pub(super) fn refuse_more_than_allowed(what: &str, need: u64, limit: Option<u64>) -> Result<(), CliError> {
    let refused = |limit| {
        let (need, limit) = (size(need), size(limit));
        CliError::usage(format!(
            "{what} needs up to {need} of memory at least, and --memory allows {limit}; give it more"
        ))
    };
    limit.filter(|&limit| need > limit).map_or(Ok(()), |limit| Err(refused(limit)))
}

/// The same for frames that are where `held` says.
pub(super) fn check_match_of(
    frames: Frames,
    options: &MatchOptions,
    held: Held,
    talk: &Talk,
) -> Result<(), CliError> {
    let need = match_need(frames, options, held);
    check("matching", need, talk, |available| {
        let first_look = match_need(frames, &options.clone().quick(), held);
        let fewer = frames_that_fit(frames, available.bytes, |frames| match_need(frames, options, held));
        let fewer = fewer.map(|count| {
            format!(
                "{count} of the {} frames would fit (`epirig import --frames` takes a part)",
                frames.count
            )
        });
        let part = match () {
            () if first_look <= available.bytes && first_look < need => {
                format!("`--quick` needs {}", size(first_look))
            }
            () => fewer.unwrap_or_else(|| "no smaller part would fit".to_owned()),
        };
        format!("{part}; or {}", close_others(available))
    })
}

/// Prints how much memory `what` needs, and refuses it if there is less. `advice` suggests what to do.
pub(super) fn check(
    what: &str,
    bytes: u64,
    talk: &Talk,
    advice: impl FnOnce(Available) -> String,
) -> Result<(), CliError> {
    if available().is_some() {
        refuse_more_than_there_is(what, bytes, advice)?;
        talk.say(&format!("{what} needs up to {} of memory", size(bytes)));
    }
    Ok(())
}

/// The same, but prints nothing if there is enough.
pub(super) fn refuse_more_than_there_is(
    what: &str,
    bytes: u64,
    advice: impl FnOnce(Available) -> String,
) -> Result<(), CliError> {
    match available().filter(|available| bytes > available.bytes) {
        None => Ok(()),
        Some(available) => Err(CliError::new(
            Blame::System,
            format!(
                "{what} needs up to {} of memory, and {} {}; {}",
                size(bytes),
                size(available.bytes),
                available.bound,
                advice(available)
            ),
        )),
    }
}

/// Advice for a task that cannot be made smaller.
pub(super) fn close_others(available: Available) -> String {
    match available.bound {
        Bound::Process => "raise the limit (`ulimit -v`, `ulimit -d`)",
        Bound::ControlGroup => "give the container or job more memory",
        Bound::Machine => "close other programs, or use a machine with more memory",
    }
    .to_owned()
}

pub(super) fn size(bytes: u64) -> String {
    match bytes as f64 {
        small if small < 1e9 => format!("{:.0} MB", (small / 1e6).ceil()),
        large => format!("{:.1} GB", (large / 1e8).ceil() / 10.0),
    }
}
