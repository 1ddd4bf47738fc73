//! Resuming a scan that was interrupted at any moment.

use std::path::Path;

use tracing::{info, warn};

use super::calibration_frames::Present;
use super::records::camera_record;
use super::rig::Rig;
use super::scan::{GoodFrame, Scan};
use super::{CaptureError, CapturePlan, interrupted};
use epirig_core::progress::Progress;
use epirig_data::sequence::{
    ClosureRecord, Event, ExitStatus, Finding, FrameKind, FrameRecord, Origin, Sequence, SequenceWriter,
    refuse_busy, verify,
};
use epirig_data::storage::Disk;

/// Takes the missing frames of the sequence in `folder`, as [`capture`](super::capture) does.
///
/// First, the frames in the journal are checked. Damaged frames are taken again. Records that contradict each
/// other, or contradict an undamaged frame, are refused.
///
/// The stage is homed, and the last good frame before the first missing one is taken again and compared. A
/// complete sequence is not changed. A sequence that lost its position unnoticed is refused, because a
/// repaired rig would show no difference.
///
/// # Errors
/// [`CaptureError`] as for [`capture`](super::capture); [`CaptureError::NotThisScan`] if the folder's scan
/// has another plan or other camera settings, [`CaptureError::SettingsChanged`] if the stage has other
/// settings, [`CaptureError::Moved`] if the picture has changed.
pub fn resume(
    rig: &mut Rig<'_>,
    plan: &CapturePlan,
    folder: &Path,
    disk: Box<dyn Disk>,
) -> Result<Option<ClosureRecord>, CaptureError> {
    let sequence = Sequence::open(folder)?;
    let record = sequence.record();
    let unlike =
        |reason: &str| CaptureError::NotThisScan { path: folder.to_owned(), reason: reason.to_owned() };
    let Origin::Captured { stage, stage_settings, camera, configuration: Some(set), .. } = &record.origin
    else {
        return Err(unlike("its frames were not taken by this program"));
    };
    if record.positions_mm.as_ref() != Some(&plan.positions_mm) {
        return Err(unlike("its positions differ from the plan"));
    }
    let ended = sequence.stop().map(|stop| stop.exit_status);
    if ended == Some(ExitStatus::NotClosed) {
        return Err(unlike("the positions of its frames are wrong (see stop.json); take the scan again"));
    }
    refuse_busy(folder)?;
    sequence.check_records()?;
    let good = good_frames(&sequence, FrameKind::Scan, rig.progress)?;
    let mut present = Present::default();
    for kind in FrameKind::CALIBRATION {
        let good = good_frames(&sequence, kind, rig.progress)?;
        present.0.extend(good.iter().map(|frame| (kind, frame.index)));
    }
    let found = indices(&good);
    let missing: Vec<usize> = (0..record.frames).filter(|index| !found.contains(index)).collect();
    if missing.is_empty() && present.is_all_of(plan) && ended == Some(ExitStatus::Complete) {
        refuse_what_verify_refuses(&sequence, rig.progress)?;
        rig.progress.note("the scan is already complete");
        return Ok(sequence.stop().and_then(|stop| stop.closure.clone()));
    }
    info!(good = found.len(), missing = missing.len(), "frames checked");
    for &index in &missing {
        let file = FrameKind::Scan.file(index);
        // A program that is killed between writing a frame and its journal line leaves one such file.
        if folder.join(&file).symlink_metadata().is_ok()
            && !sequence.frames().iter().any(|frame| frame.index == index)
        {
            rig.progress.note(&format!("note: {file} is not in the journal and is taken again"));
        }
    }
    let mut held = None;
    let goes_on = || -> Result<_, CaptureError> {
        let mut scan = Scan::begin(rig, plan, Some((set, stage_settings)))?;
        // Another device is reported, not refused; the picture is compared later.
        let now = [scan.stage_now()?.identity().to_string(), scan.camera().identity().to_string()];
        for (was, is) in [stage, camera].into_iter().zip(now).filter(|(was, is)| *was != is) {
            warn!(was, now = is, "the scan was begun with another device");
            scan.rig.progress.note(&format!("note: the scan was begun with {was}; now it is {is}"));
        }
        if *set != camera_record(&scan.configuration, plan.section.average) {
            return Err(unlike(&format!(
                "the camera is now set to {}, which differs from sequence.json; restore the settings, or begin a new scan",
                scan.configuration
            )));
        }
        let read = |record: Option<&FrameRecord>| record.map(|record| sequence.read(record)).transpose();
        scan.first = read(good.iter().find(|frame| frame.index == 0))?;
        let next = missing.first().copied().unwrap_or(record.frames);
        let before = good.iter().rfind(|frame| frame.index < next).or(good.first());
        let frame = read(before)?;
        scan.latest = frame.zip(before).map(|(frame, record)| GoodFrame { index: record.index, frame });
        let resumed = scan.go_on("an interruption".to_owned())?;
        let writer = SequenceWriter::resume_on(disk, folder)?;
        held = Some(writer.folder());
        scan.finish(writer, &missing, |scan, archive| {
            archive.note(Event::Resumed(resumed))?;
            scan.calibration_frames(archive, &present)
        })
    };
    goes_on().map_err(|error| match error {
        CaptureError::NotThisScan { .. } => error,
        other => {
            let folder = held.map_or_else(|| folder.to_owned(), |held| held.whereabouts_or_name());
            interrupted(other, &folder, record.frames)
        }
    })
}

/// Runs the checks of `epirig verify` on a sequence that is recorded as complete.
fn refuse_what_verify_refuses(sequence: &Sequence, progress: &dyn Progress) -> Result<(), CaptureError> {
    let mut findings = verify(sequence, progress)?.findings;
    if findings.is_empty() {
        return Ok(());
    }
    let others = findings.len() - 1;
    let Finding { file, problem } = findings.swap_remove(0);
    Err(CaptureError::NotAsRecorded { folder: sequence.folder().to_owned(), file, problem, others })
}

fn indices(frames: &[FrameRecord]) -> Vec<usize> {
    frames.iter().map(|frame| frame.index).collect()
}

/// The frames in the journal that are undamaged on disk.
fn good_frames(
    sequence: &Sequence,
    kind: FrameKind,
    progress: &dyn Progress,
) -> Result<Vec<FrameRecord>, CaptureError> {
    let named = match kind {
        FrameKind::Scan => sequence.frames().to_vec(),
        other => sequence.calibration_frames(other),
    };
    progress.begin("checking frames", named.len() as u64);
    let mut good = Vec::new();
    let mut checked = Ok(());
    for frame in named {
        match sequence.read(&frame) {
            Ok(_) => good.push(frame),
            Err(error) if error.is_of_the_file() => {
                warn!(file = frame.file, reason = %error, "the frame is taken again");
                progress.note(&format!("{} is taken again: {error}", frame.file));
            }
            // Only damaged files are taken again. An unreadable file may be readable later, and a frame that
            // contradicts a record may be right.
            Err(error) => {
                checked = Err(error);
                break;
            }
        }
        progress.advance(1);
    }
    progress.end();
    checked?;
    Ok(good)
}
