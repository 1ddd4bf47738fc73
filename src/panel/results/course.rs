//! How the scan went: positions, retakes, interruptions.

use serde::Serialize;

use super::view::ResultsView;
use epirig_data::sequence::Event;

#[derive(Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(super) struct StageInfo {
    frames: Vec<StageFrame>,
    retakes: Vec<StageRetake>,
    events: Vec<StageEvent>,
}

#[derive(Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
struct StageFrame {
    index: usize,
    planned_mm: Option<f64>,
    reported_mm: Option<f64>,
    /// Reported minus planned, in um.
    error_um: Option<f64>,
    /// Measured minus reported, in px of the median disparity, if a calibration has measured positions.
    measured_error_px: Option<f64>,
    retakes: usize,
    mean_dn: f64,
    saturated: usize,
}

#[derive(Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
struct StageRetake {
    frame: usize,
    attempt: usize,
    reason: String,
    at: String,
}

#[derive(Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
struct StageEvent {
    at: String,
    words: String,
}

pub(super) fn course(view: &ResultsView) -> StageInfo {
    let sequence = &view.sequence;
    let opened = view.results.as_ref();
    let calibration = opened.and_then(|opened| opened.calibration.as_ref()).map(|(found, _)| found);
    // Frames that are taken in another order stand not where they were said to.
    let measured =
        calibration.filter(|found| found.positions.order.is_empty()).map(|found| &found.positions.tau);
    let reported = sequence.tau().ok();
    let disparity_px = opened.and_then(|opened| opened.matched.median_disparity_px);
    let measured_error_px = |place: usize| {
        let measured = measured?.get(place)?;
        let reported = reported.as_ref()?.values().get(place)?;
        Some((measured - reported) * disparity_px?)
    };
    let retakes_of = |index: usize| {
        let of_frame = |event: &&Event| matches!(event, Event::Retake(retake) if retake.index == index);
        sequence.events().iter().filter(of_frame).count()
    };
    let frames = sequence.frames().iter().enumerate().map(|(place, frame)| StageFrame {
        index: frame.index,
        planned_mm: frame.commanded_mm,
        reported_mm: frame.reported_mm,
        error_um: frame
            .reported_mm
            .zip(frame.commanded_mm)
            .map(|(reported, planned)| 1e3 * (reported - planned)),
        measured_error_px: measured_error_px(place),
        retakes: retakes_of(frame.index),
        mean_dn: frame.mean_dn,
        saturated: frame.saturated,
    });
    let mut retakes = Vec::new();
    let mut events = Vec::new();
    for event in sequence.events() {
        match event {
            Event::Retake(retake) => retakes.push(StageRetake {
                frame: retake.index,
                attempt: retake.attempt,
                reason: retake.reason.clone(),
                at: retake.at.clone(),
            }),
            Event::Resumed(resumed) => {
                let shift = resumed.home_shift_mm.map_or(String::new(), |shift_mm| {
                    format!("; home was found again within {:.4} mm", shift_mm.abs())
                });
                let words = format!("the scan continued after: {}{shift}", resumed.after);
                events.push(StageEvent { at: resumed.at.clone(), words });
            }
            Event::Frame(_) | Event::Dark(_) | Event::Flat(_) | Event::Board(_) => {}
        }
    }
    if let (Some(stop), Some(words)) = (sequence.stop(), sequence.end_in_words()) {
        events.push(StageEvent { at: stop.stopped.clone(), words });
    }
    StageInfo { frames: frames.collect(), retakes, events }
}
