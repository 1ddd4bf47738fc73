//! Checks by rules, from plan, stage and settings without a picture.

use super::flicker::{nearest_exposure_us, suits_mains};
use super::{Check, Verdict};
use crate::capture::CapturePlan;
use epirig_devices::camera::Configuration;

/// Mains frequencies, in Hz.
const MAINS_HZ: [f64; 2] = [50.0, 60.0];
/// Free space below this multiple of the largest size of the frames is short.
const SPARE: u64 = 2;
/// Most bytes per frame besides its samples: its journal line and a block of the file system.
const BESIDES_BYTES: u64 = 8192;
const MB: f64 = 1e6;
const US_PER_MS: f64 = 1e3;

/// Whether all positions are within the travel.
pub(super) fn travel(positions_mm: &[f64], travel_mm: f64) -> Check {
    let least = positions_mm.iter().copied().fold(f64::INFINITY, f64::min);
    let greatest = positions_mm.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let finding = format!(
        "the plan goes from {least:.3} mm to {greatest:.3} mm, the stage's travel from 0 to {travel_mm:.3} mm"
    );
    let is_within = least >= 0.0 && greatest <= travel_mm;
    let verdict = if is_within { Verdict::Good } else { Verdict::Bad };
    Check::new("travel", verdict, finding, "choose fewer or shorter steps, or another start")
}

/// Whether the motor holds the carriage at rest.
pub(super) fn holding(holds: Option<bool>) -> Check {
    let (verdict, finding, advice) = match holds {
        Some(true) => (Verdict::Good, "the motor is energised at rest", ""),
        Some(false) => (
            Verdict::Bad,
            "the motor is without current at rest: the carriage may move before a frame is taken",
            "set the stage so that it holds",
        ),
        None => (
            Verdict::Unknown,
            "the stage does not report whether its motor is energised at rest",
            "try to turn the spindle by hand: it must resist",
        ),
    };
    Check::new("holding", verdict, finding.to_owned(), advice)
}

/// Whether the frames of `plan` fit on a disk with `free_bytes`, calculated without compression. `present` frames
/// are there already.
pub fn disk(
    plan: &CapturePlan,
    present: usize,
    free_bytes: Option<u64>,
    configuration: &Configuration,
) -> Check {
    const NAME: &str = "disk";
    let frames = (plan.positions_mm.len() + plan.calibration_frames()).saturating_sub(present);
    let needed = (plan.frame_bytes(configuration) + BESIDES_BYTES) * frames as u64;
    let what = if present == 0 { "the sequence takes" } else { "the frames that are missing take" };
    let needs = format!("{what} {:.1} MB at most", needed as f64 / MB);
    let Some(free) = free_bytes else {
        return Check::new(NAME, Verdict::Unknown, needs, "make sure that there is enough free space");
    };
    let finding = format!("{needs}, {:.1} MB are free", free as f64 / MB);
    if free < needed {
        Check::new(NAME, Verdict::Bad, finding, "free some space, or write to another disk")
    } else {
        let verdict = if free < SPARE * needed { Verdict::Warning } else { Verdict::Good };
        Check::new(NAME, verdict, finding, "other programs may fill the disk: free some space")
    }
}

/// Whether any control is automatic.
pub(super) fn automatic_controls(configuration: &Configuration) -> Check {
    let (verdict, finding) = if configuration.notes.is_empty() {
        let watched = configuration.pinned.len();
        (Verdict::Good, format!("no control is automatic; {watched} controls are watched"))
    } else {
        (Verdict::Warning, configuration.notes.join("; "))
    };
    let advice = "use another format, or set the controls by hand if the camera allows it";
    Check::new("settings", verdict, finding, advice)
}

/// Whether the exposure avoids flicker of lamps on mains.
pub(super) fn exposure(exposure_us: Option<f64>, mains_hz: Option<f64>) -> Check {
    const NAME: &str = "exposure";
    let Some(exposure_us) = exposure_us else {
        let finding = "the camera does not report its exposure time".to_owned();
        return Check::new(NAME, Verdict::Unknown, finding, "use a lamp that does not flicker");
    };
    let possible = mains_hz.map_or(MAINS_HZ.to_vec(), |mains_hz| vec![mains_hz]);
    let (suiting, others): (Vec<f64>, Vec<f64>) =
        possible.iter().partition(|mains_hz| suits_mains(exposure_us, **mains_hz));
    let names = |mains: &[f64]| {
        mains.iter().map(|mains_hz| format!("{mains_hz:.0} Hz")).collect::<Vec<_>>().join(" or ")
    };
    let exposure_ms = exposure_us / US_PER_MS;
    let nearest = possible.iter().map(|&mains_hz| {
        format!("{:.0} us at {mains_hz:.0} Hz mains", nearest_exposure_us(exposure_us, mains_hz))
    });
    let nearest = nearest.collect::<Vec<_>>().join(", ");
    let advice = format!("expose for {nearest}, or use a lamp that does not flicker");
    let whole = "a whole number of half periods of mains of";
    let (verdict, finding, first) = match (suiting.is_empty(), others.is_empty()) {
        (_, true) => (Verdict::Good, format!("is {whole} {}", names(&suiting)), ""),
        (true, _) => (Verdict::Warning, format!("is not {whole} {}", names(&others)), ""),
        (false, false) => (
            Verdict::Unknown,
            format!("is {whole} {}, not of {}", names(&suiting), names(&others)),
            "set camera.mains; or ",
        ),
    };
    Check::new(NAME, verdict, format!("{exposure_ms:.2} ms {finding}"), format!("{first}{advice}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::profile::PlanProfile;

    #[test]
    fn exposures_are_judged_by_the_mains_there_are() {
        let verdict = |exposure_us, mains_hz| exposure(Some(exposure_us), mains_hz).verdict;
        assert_eq!(verdict(20_000.0, Some(50.0)), Verdict::Good);
        assert_eq!(verdict(20_000.0, Some(60.0)), Verdict::Warning);
        assert_eq!(verdict(20_000.0, None), Verdict::Unknown);
        assert_eq!(verdict(50_000.0, None), Verdict::Good, "five and six half periods");
        assert_eq!(verdict(1_000.0, None), Verdict::Warning);
        let check = exposure(Some(12_000.0), Some(60.0));
        assert_eq!(
            check.advice.unwrap(),
            "expose for 8333 us at 60 Hz mains, or use a lamp that does not flicker"
        );
        assert_eq!(exposure(None, None).verdict, Verdict::Unknown);
    }

    #[test]
    fn a_plan_stays_on_the_travel() {
        assert_eq!(travel(&[0.0, 50.0, 100.0], 100.0).verdict, Verdict::Good);
        assert_eq!(travel(&[0.0, 100.1], 100.0).verdict, Verdict::Bad);
        assert_eq!(travel(&[-0.1, 10.0], 100.0).verdict, Verdict::Bad);
        let holding = [Some(true), Some(false), None].map(|holds| holding(holds).verdict);
        assert_eq!(holding, [Verdict::Good, Verdict::Bad, Verdict::Unknown]);
    }

    #[test]
    fn frames_of_16_bit_take_twice_the_room() {
        let configuration = Configuration {
            format: epirig_devices::camera::ActiveFormat {
                four_cc: epirig_devices::camera::pixels::FourCc(*b"GREY"),
                size: epirig_devices::camera::Size { columns: 1000, rows: 500 },
                stride: 1000,
                image_bytes: 500_000,
                interlaced: false,
            },
            rows: 500,
            columns: 1000,
            bit_depth: 8,
            interval: None,
            exposure_us: None,
            pinned: Vec::new(),
            notes: vec!["the images come compressed".to_owned()],
        };
        let plan = |average| CapturePlan {
            section: PlanProfile { average, ..PlanProfile::default() },
            ..CapturePlan::at(vec![0.0; 10])
        };
        let verdict = |averaged, free_bytes| disk(&plan(averaged), 0, free_bytes, &configuration).verdict;
        // 10 x 500 kB; twice that averaged; and 82 kB besides.
        assert_eq!(verdict(1, Some(10_200_000)), Verdict::Good);
        assert_eq!(verdict(4, Some(10_200_000)), Verdict::Warning);
        assert_eq!(verdict(4, Some(10_000_000)), Verdict::Bad);
        assert_eq!(verdict(1, None), Verdict::Unknown);
        // Half of the frames are there already.
        let rest = disk(&plan(4), 5, Some(10_100_000), &configuration);
        assert_eq!(rest.verdict, Verdict::Good);
        assert!(rest.finding.starts_with("the frames that are missing take 5.0 MB"), "{}", rest.finding);
        assert_eq!(automatic_controls(&configuration).verdict, Verdict::Warning);
    }
}
