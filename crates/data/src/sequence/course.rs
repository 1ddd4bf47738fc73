//! When things happened by the records, and what the camera counted meanwhile.

use super::Sequence;
use super::finding::{Finding, RESTORE};
use super::reader::{JOURNAL, START, STOP};
use super::record::{Event, ExposureRecord, FrameRecord};

/// What in names, dates, times and counts cannot be.
pub(super) fn findings(sequence: &Sequence) -> Vec<Finding> {
    let record = sequence.record();
    let mut found = Vec::new();
    if uuid::Uuid::parse_str(&record.uid).is_err() {
        let problem = format!("its uid is no UUID: {:?}; {RESTORE}", record.uid);
        found.push(Finding::new(START, problem));
    }
    found.extend(no_date(START, "created", &record.created));
    found.extend(sequence.stop().and_then(|stop| no_date(STOP, "stopped", &stop.stopped)));
    // The frames before, as long as nothing has come between.
    let mut before: Vec<&FrameRecord> = Vec::new();
    for event in sequence.events() {
        found.extend(match event {
            Event::Retake(retake) => no_date(JOURNAL, "at", &retake.at),
            Event::Resumed(resumed) => no_date(JOURNAL, "at", &resumed.at),
            Event::Frame(frame) | Event::Dark(frame) | Event::Flat(frame) | Event::Board(frame) => {
                no_date(&frame.file, "written", &frame.written)
            }
        });
        let frame = event.frame().map(|(_, frame)| frame);
        if let Some(exposure) = frame.and_then(|frame| frame.exposure.as_ref())
            && let Some(problem) = wrong_stamp(exposure)
        {
            let file = frame.map_or(JOURNAL, |frame| &frame.file);
            found.push(Finding::new(file, format!("{problem}; {RESTORE}")));
        }
        let Event::Frame(frame) = event else {
            before.clear();
            continue;
        };
        if let Some(problem) = before.last().and_then(|before| too_early(before, frame)) {
            found.push(Finding::new(format!("frame {}", frame.index), format!("{problem}; {RESTORE}")));
        }
        if let [.., first, middle] = before[..]
            && let Some(problem) = counted_elsewhere(first, middle, frame)
        {
            found.push(Finding::new(format!("frame {}", middle.index), format!("{problem}; {RESTORE}")));
        }
        before.push(frame);
    }
    found
}

fn no_date(file: &str, key: &str, text: &str) -> Option<Finding> {
    let wrong = text.parse::<jiff::Timestamp>().is_err();
    wrong.then(|| Finding::new(file, format!("{key} is no date: {text:?}; {RESTORE}")))
}

/// What is wrong with the driver's time stamp. Where frames were counted, stamps are of no use.
fn wrong_stamp(exposure: &ExposureRecord) -> Option<String> {
    let ExposureRecord { exposure_start_ns, stamp_ns, received_ns, ref timing, .. } = *exposure;
    // A stamp may be as far in the future as the start was found before the arrival: by a frame's time.
    let latest_ns = received_ns.saturating_add(received_ns.saturating_sub(exposure_start_ns));
    let is_possible = match timing.as_str() {
        "counted" => true,
        "start-of-exposure" | "end-of-frame" => (exposure_start_ns..=latest_ns).contains(&stamp_ns),
        other => return Some(format!("{other:?} is no way to know when an exposure begins")),
    };
    (!is_possible).then(|| {
        format!("its stamp of {stamp_ns} ns is not between its exposure ({exposure_start_ns} ns) and its arrival ({received_ns} ns)")
    })
}

/// That a frame was asked for before the one before it was there.
fn too_early(before: &FrameRecord, frame: &FrameRecord) -> Option<String> {
    let (earlier, later) = (before.exposure.as_ref()?, frame.exposure.as_ref()?);
    (later.requested_ns < earlier.received_ns)
        .then(|| format!("it was asked for before frame {} had been received", before.index))
}

/// That the camera's count of a frame does not lie between those of its neighbours. Where these do not follow each other either, the camera has begun
/// to count anew, or does not count at all.
fn counted_elsewhere(before: &FrameRecord, frame: &FrameRecord, after: &FrameRecord) -> Option<String> {
    let [last, count, next] = [before.camera_sequence?, frame.camera_sequence?, after.camera_sequence?];
    let anew = |frame: &FrameRecord| frame.exposure.as_ref().is_none_or(|exposure| exposure.restarts > 0);
    // The count has 32 bit and goes on from its end with 0.
    let span = next.wrapping_sub(last);
    let is_counting = (1..=u32::MAX / 2).contains(&span) && !anew(frame) && !anew(after);
    (is_counting && !(1..span).contains(&count.wrapping_sub(last))).then(|| {
        format!("the camera counted it as {count}, the frames before and after it as {last} and {next}")
    })
}
