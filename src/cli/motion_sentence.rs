//! What a calibration found of the motion, in words.

use crate::calibrate::{Calibration, CameraMotionRecord, PositionSource};
use crate::number::{ascii, significant};
use epirig_core::statistics::root_mean_square;

/// A step of more usual steps than this is a gap.
const GAP: f64 = 1.5;
/// A step of less than this share of the mean one, which cannot be told from none, is no step: two frames of one place.
const NO_STEP: f64 = 0.1;

/// What was found of the motion: how the camera is turned to it, and how the steps differ. "turned by 1.97 degrees, steps
/// differ by 11 %, 2 gaps".
pub(super) fn motion_sentence(calibration: &Calibration) -> String {
    let turned = turn(calibration);
    let steps = match calibration.positions.source {
        PositionSource::Stage => vec!["positions as given".to_owned()],
        _ => steps(&calibration.positions.tau, step_sigma(calibration)),
    };
    turned.into_iter().chain(steps).collect::<Vec<_>>().join(", ")
}

/// How the camera is turned to the motion, and by itself; nothing of angles that are not significant.
fn turn(calibration: &Calibration) -> Vec<String> {
    let angles = match (&calibration.stage_axis, &calibration.camera_motion) {
        (Some(axis), _) => {
            let pan_sigma_deg = axis.pan_sigma_deg;
            [
                (axis.roll_deg, axis.roll_sigma_deg, axis.roll_sigma_deg),
                (axis.pan_deg, pan_sigma_deg, pan_sigma_deg),
            ]
        }
        (None, Some(motion)) if motion.is_applied => {
            let CameraMotionRecord { roll_deg, roll_sigma_deg, pan_deg, pan_sigma_deg, .. } = *motion;
            // Without a focal length the angle between motion and picture is there, but how large it is is not known.
            [(roll_deg, roll_sigma_deg, roll_sigma_deg), (pan_deg, motion.pan_own_sigma_deg, pan_sigma_deg)]
        }
        (None, _) => return Vec::new(),
    };
    let significant = ["turned by", "panned by"].into_iter().zip(angles);
    let significant = significant.filter(|(_, (degrees, own_sigma, _))| degrees.abs() > 3.0 * own_sigma);
    let words = significant.map(|(word, (degrees, _, sigma))| {
        let (about, digits) = match sigma {
            large if large > 0.5 => (" about", 0),
            large if large > 0.05 => ("", 1),
            _ => ("", 2),
        };
        format!("{word}{about} {:.digits$} degrees", degrees.abs())
    });
    let wobble = calibration.camera_motion.as_ref().filter(|motion| motion.model.rotations).map(|motion| {
        let rms_deg = root_mean_square(&motion.rotation_rms_deg());
        format!("wobbling by {} degrees", ascii(&crate::number::significant(rms_deg, 2)))
    });
    words.chain(wobble).collect()
}

/// How well steps are known, as a share of the path: where frames turn by themselves, a turn looks like a step.
fn step_sigma(calibration: &Calibration) -> f64 {
    calibration.camera_motion.as_ref().map_or(0.0, |motion| motion.position_sigma_px / motion.moved_px.abs())
}

/// How steps differ from the usual one, but for gaps; and how many gaps there are. Steps are known to `sigma`, in the unit
/// of tau.
fn steps(tau: &[f64], sigma: f64) -> Vec<String> {
    let steps: Vec<f64> = tau.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let none = (3.0 * sigma).min(NO_STEP / steps.len().max(1) as f64);
    let (repeated, steps): (Vec<f64>, Vec<f64>) = steps.into_iter().partition(|step| *step < none);
    let usual = median(&steps);
    let shares = steps.iter().map(|step| step / usual);
    let (gaps, others): (Vec<f64>, Vec<f64>) = shares.partition(|share| *share > GAP);
    let squares: f64 = others.iter().map(|share| (share - 1.0).powi(2)).sum();
    let percent = 100.0 * (squares / others.len().max(1) as f64).sqrt();
    // Below a hundredth of a percent there is nothing to tell, nor where steps are not known so well.
    let known_percent = 100.0 * sigma / usual;
    let differ = match percent {
        _ if 3.0 * known_percent >= 100.0 => "steps not known".to_owned(),
        small if small < 3.0 * known_percent => format!(
            "steps equal to {} %, as far as they are known",
            ascii(&significant(3.0 * known_percent, 1))
        ),
        small if small < 0.005 => "equal steps".to_owned(),
        small if small < 0.1 => format!("steps differ by {small:.2} %"),
        large => format!("steps differ by {} %", ascii(&significant(large, 2))),
    };
    let gaps = match gaps.len() {
        0 => None,
        1 => Some("1 gap".to_owned()),
        count => Some(format!("{count} gaps")),
    };
    let repeated = match repeated.len() {
        0 => None,
        1 => Some("1 frame at the place of another".to_owned()),
        count => Some(format!("{count} frames at places of others")),
    };
    std::iter::once(differ).chain(gaps).chain(repeated).collect()
}

/// The middle value: of an even number the lower one of the two, because gaps are the upper ones. 1 of none.
fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len().saturating_sub(1) / 2).copied().unwrap_or(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn said(lengths: &[f64]) -> String {
        said_known(lengths, 0.0)
    }

    /// With steps that are known to `sigma`, in the unit of all together.
    fn said_known(lengths: &[f64], sigma: f64) -> String {
        let whole: f64 = lengths.iter().sum();
        let places = lengths.iter().scan(0.0, |place, length| {
            *place += length;
            Some(*place / whole)
        });
        let tau: Vec<f64> = std::iter::once(0.0).chain(places).collect();
        steps(&tau, sigma).join(", ")
    }

    #[test]
    fn steps_are_compared_with_the_usual_one_and_gaps_are_counted() {
        assert_eq!(said(&[1.0; 9]), "equal steps");
        assert_eq!(said(&[1.0, 0.89, 1.0, 1.11, 1.0, 1.11, 0.89]), "steps differ by 8.3 %");
        assert_eq!(said(&[1.0, 0.5, 1.4, 1.0, 1.0]), "steps differ by 29 %");
        assert_eq!(said(&[1.0, 1.0003, 1.0, 0.9997, 1.0]), "steps differ by 0.02 %");
        assert_eq!(said(&[1.0, 2.0, 1.0, 1.0, 1.0]), "equal steps, 1 gap");
        let twice = [1.0, 0.001, 1.0, 0.0, 1.0, -0.0, 1.0];
        assert_eq!(
            said_known(&twice, 1e-3),
            "steps equal to 1 %, as far as they are known, 3 frames at places of others"
        );
        assert_eq!(said(&[1.1, 2.0, 0.9, 1.0, 3.0, 1.0]), "steps differ by 7.1 %, 2 gaps");
    }
}
