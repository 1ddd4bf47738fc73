//! Going on with a scan that was interrupted at any moment.

use std::path::Path;

use super::calibration_frames::Present;
use super::records::camera_record;
use super::rig::Rig;
use super::scan::{GoodFrame, Scan};
use super::{CaptureError, CapturePlan, interrupted};
use crate::progress::Progress;
use crate::sequence::{
    ClosureRecord, Disk, Event, ExitStatus, FrameRecord, Origin, Sequence, SequenceWriter,
};

/// Takes the frames that the sequence in `folder` lacks, as [`capture`](super::capture) would have done.
///
/// Frames that the journal names are checked first, and damaged ones are taken again. The stage is homed, the last good
/// frame before the first missing one is taken again and compared. A sequence that is complete is left as it is, and one that has lost
/// its position unnoticed is refused: a rig that has been mended would find nothing wrong with it.
///
/// # Errors
/// [`CaptureError`] as of [`capture`](super::capture); [`CaptureError::NotThisScan`] if the folder's scan has another plan or was taken with
/// another camera setting, [`CaptureError::Moved`] if the picture is not what it was.
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
    let Origin::Captured { configuration: camera_before, .. } = &record.origin else {
        return Err(unlike("its frames were imported; there is nothing to go on with"));
    };
    if record.positions_mm.as_ref() != Some(&plan.positions_mm) {
        return Err(unlike("its positions are not those of the plan"));
    }
    let ended = sequence.stop().map(|stop| stop.exit_status);
    if ended == Some(ExitStatus::NotClosed) {
        return Err(unlike(
            "its frames do not show what their positions say (see stop.json); take the scan again",
        ));
    }
    let good = good_frames(&sequence, rig.progress);
    let missing: Vec<usize> =
        (0..record.frames).filter(|index| !good.iter().any(|frame| frame.index == *index)).collect();
    if missing.is_empty() && ended == Some(ExitStatus::Complete) {
        return Ok(sequence.stop().and_then(|stop| stop.closure.clone()));
    }
    let mut scan = Scan::begin(rig, plan)?;
    if camera_before.as_ref() != Some(&camera_record(&scan.configuration, plan.averaged)) {
        return Err(unlike(&format!(
            "the camera is now set to {}, which is not what sequence.json says; set it as it was, or begin a new scan",
            scan.configuration
        )));
    }
    let read = |record: Option<&FrameRecord>| record.map(|record| sequence.read(record)).transpose();
    scan.first = read(good.iter().copied().find(|frame| frame.index == 0))?;
    let next = missing.first().copied().unwrap_or(record.frames);
    let before = good.iter().copied().rfind(|frame| frame.index < next).or(good.first().copied());
    scan.latest = read(before)?.zip(before).map(|(frame, record)| GoodFrame { index: record.index, frame });
    let resumed = scan.go_on("an interruption".to_owned())?;
    let present = Present::of(sequence.events());
    let writer = SequenceWriter::resume_on(disk, folder)?;
    let finished = scan.finish(writer, &missing, |scan, archive| {
        archive.note(Event::Resumed(resumed))?;
        scan.calibration_frames(archive, present)
    });
    finished.map_err(|error| interrupted(error, folder, record.frames))
}

/// The frames that the journal names and that are on disk as they were written.
fn good_frames<'s>(sequence: &'s Sequence, progress: &dyn Progress) -> Vec<&'s FrameRecord> {
    progress.begin("checking frames", sequence.frames().len() as u64);
    let check = |frame: &&FrameRecord| {
        let read = sequence.read(frame);
        progress.advance(1);
        read.inspect_err(|error| progress.note(&format!("frame {} is taken again: {error}", frame.index)))
            .is_ok()
    };
    let good = sequence.frames().iter().filter(check).collect();
    progress.end();
    good
}
