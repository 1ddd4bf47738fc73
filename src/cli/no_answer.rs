//! A match without any answer: what the frames show of the motion.

use super::{CliError, motion_words};
use crate::calibrate::Calibration;
use epirig_calibration::motion::{Doubt, Motion, MotionCheck};
use epirig_calibration::photometry::Maps;
use epirig_core::fault::Blame;
use epirig_core::shell::quoted;
use epirig_data::sequence::Sequence;

/// The failure of a match of which `what` is said, with what is measured in the frames; whether `has_range` was given.
pub(super) fn no_answer(
    sequence: &Sequence,
    calibration: Option<&(Calibration, Maps)>,
    what: &str,
    has_range: bool,
) -> CliError {
    let (motion, calibrate) = measured(sequence, calibration);
    CliError::new(Blame::NoAnswer, format!("{what}; {}", words(&motion, has_range, &calibrate)))
}

/// What the frames show that a match of them does not take for granted, if anything; with what helps.
pub(super) fn cause(sequence: &Sequence, calibration: Option<&(Calibration, Maps)>) -> Option<String> {
    let (motion, calibrate) = measured(sequence, calibration);
    let doubts: Vec<String> = motion.doubts.iter().filter_map(|found| doubt(found, &calibrate)).collect();
    (!doubts.is_empty()).then(|| doubts.join("; "))
}

/// The motion in the frames, without what a calibration corrects; and the command that measures positions.
fn measured(sequence: &Sequence, calibration: Option<&(Calibration, Maps)>) -> (Motion, String) {
    let mut check = MotionCheck::new(sequence.frames().len());
    for frame in sequence.frames() {
        // A frame that cannot be read has been reported before anything was matched.
        if let Ok(frame) = sequence.read(frame) {
            check.look(&frame);
        }
    }
    let calibration = calibration.map(|(calibration, _)| calibration);
    let places = match calibration {
        Some(calibration) => Some(calibration.positions.tau.clone()),
        None => sequence.positions_mm(),
    };
    let mut motion = check.motion(places.as_deref());
    // The frames were turned and ordered by it before they were matched.
    let has = |what: fn(&Calibration) -> bool| calibration.is_some_and(what);
    let (is_turned, is_ordered) =
        (has(|found| found.stage_axis.is_some()), has(|found| found.camera_motion.is_some()));
    motion.doubts.retain(|doubt| match doubt {
        Doubt::Vertical | Doubt::Oblique { .. } => !is_turned && !is_ordered,
        Doubt::Uneven { .. } | Doubt::Returns(_) => !is_ordered,
        _ => true,
    });
    let overwrite = if calibration.is_some() { " --overwrite" } else { "" };
    (motion, format!("epirig measure {}{overwrite}", quoted(sequence.folder())))
}

/// What was measured, and what helps.
fn words(motion: &Motion, has_range: bool, calibrate: &str) -> String {
    let doubts: Vec<String> = motion.doubts.iter().filter_map(|found| doubt(found, calibrate)).collect();
    let measured = match motion.step_px {
        Some((0.0, 0.0)) => "nothing moves in the frames".to_owned(),
        Some((x, y)) => format!(
            "what moves goes by {x:.2} px along the rows and {y:.2} px along the columns from frame to frame"
        ),
        None => "how far anything moves could not be measured: there is too little texture, or it goes too far from frame to frame".to_owned(),
    };
    match doubts.is_empty() {
        false => format!("{measured}: {}", doubts.join("; ")),
        true => {
            let range = if has_range { "leave out --range" } else { "give --range if you know it" };
            format!("{measured}; look at the frames, {range}, or try --semi-global for weak texture")
        }
    }
}

fn doubt(doubt: &Doubt, calibrate: &str) -> Option<String> {
    Some(match doubt {
        Doubt::Foreign(frames) => {
            let frames: Vec<String> = frames.iter().map(usize::to_string).collect();
            format!(
                "frames {} do not show what the others show; import without them (--exclude)",
                frames.join(", ")
            )
        }
        Doubt::Still => "take frames from places along a line".to_owned(),
        Doubt::Disorder(_) => {
            "the frames are not in the order of the motion; import the images with --sort motion".to_owned()
        }
        Doubt::TurnsRound(frame) => {
            format!("the motion turns round at frame {frame}; import one part with --frames")
        }
        other => return motion_words::words(other, &|frame| format!("frame {frame}"), calibrate),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_that_move_are_not_asked_whether_they_do() {
        let moving = Motion { step_px: Some((-3.25, 0.01)), doubts: Vec::new() };
        assert!(words(&moving, false, "").contains("-3.25 px along the rows and 0.01 px along the columns"));
        let vertical = Motion { step_px: Some((0.0, 4.0)), doubts: vec![Doubt::Vertical] };
        assert!(
            words(&vertical, false, "").contains("4.00 px along the columns")
                && words(&vertical, false, "epirig calibrate seq").contains("`epirig calibrate seq` turns")
        );
        let still = Motion { step_px: Some((0.0, 0.0)), doubts: vec![Doubt::Still] };
        assert!(words(&still, false, "").starts_with("nothing moves in the frames: take frames"));
        let unknown = |has_range| words(&Motion::default(), has_range, "");
        assert!(unknown(false).contains("could not be measured") && unknown(false).contains("give --range"));
        assert!(unknown(true).contains("leave out --range"));
    }
}
