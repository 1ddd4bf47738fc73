//! What a calibration found of the motion, in words.

use crate::calibrate::{Calibration, PositionSource};
use crate::number::{ascii, significant};

/// A step of more usual steps than this is a gap.
const GAP: f64 = 1.5;

/// What was found of the motion: how the camera is turned to it, and how the steps differ. "turned by 1.97 degrees, steps
/// differ by 11 %, 2 gaps".
pub(super) fn motion_sentence(calibration: &Calibration) -> String {
    let turned = turn(calibration);
    let steps = match calibration.positions.source {
        PositionSource::Stage => vec!["positions as given".to_owned()],
        _ => steps(&calibration.positions.tau),
    };
    turned.into_iter().chain(steps).collect::<Vec<_>>().join(", ")
}

/// How the camera is turned to the motion; nothing of angles that are not significant.
fn turn(calibration: &Calibration) -> Vec<String> {
    let Some(axis) = &calibration.stage_axis else { return Vec::new() };
    let angles =
        [("turned by", axis.roll_deg, axis.roll_sigma_deg), ("panned by", axis.pan_deg, axis.pan_sigma_deg)];
    let significant = angles.into_iter().filter(|(_, degrees, sigma)| degrees.abs() > 2.0 * sigma);
    significant.map(|(word, degrees, _)| format!("{word} {:.2} degrees", degrees.abs())).collect()
}

/// How steps differ from the usual one, but for gaps; and how many gaps there are.
fn steps(tau: &[f64]) -> Vec<String> {
    let steps: Vec<f64> = tau.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let usual = median(&steps);
    let shares = steps.iter().map(|step| step / usual);
    let (gaps, others): (Vec<f64>, Vec<f64>) = shares.partition(|share| *share > GAP);
    let squares: f64 = others.iter().map(|share| (share - 1.0).powi(2)).sum();
    let percent = 100.0 * (squares / others.len().max(1) as f64).sqrt();
    // Below a hundredth of a percent there is nothing to tell.
    let differ = match percent {
        small if small < 0.005 => "equal steps".to_owned(),
        small if small < 0.1 => format!("steps differ by {small:.2} %"),
        large => format!("steps differ by {} %", ascii(&significant(large, 2))),
    };
    let gaps = match gaps.len() {
        0 => None,
        1 => Some("1 gap".to_owned()),
        count => Some(format!("{count} gaps")),
    };
    std::iter::once(differ).chain(gaps).collect()
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
        let whole: f64 = lengths.iter().sum();
        let places = lengths.iter().scan(0.0, |place, length| {
            *place += length;
            Some(*place / whole)
        });
        let tau: Vec<f64> = std::iter::once(0.0).chain(places).collect();
        steps(&tau).join(", ")
    }

    #[test]
    fn steps_are_compared_with_the_usual_one_and_gaps_are_counted() {
        assert_eq!(said(&[1.0; 9]), "equal steps");
        assert_eq!(said(&[1.0, 0.89, 1.0, 1.11, 1.0, 1.11, 0.89]), "steps differ by 8.3 %");
        assert_eq!(said(&[1.0, 0.5, 1.4, 1.0, 1.0]), "steps differ by 29 %");
        assert_eq!(said(&[1.0, 1.0003, 1.0, 0.9997, 1.0]), "steps differ by 0.02 %");
        assert_eq!(said(&[1.0, 2.0, 1.0, 1.0, 1.0]), "equal steps, 1 gap");
        assert_eq!(said(&[1.1, 2.0, 0.9, 1.0, 3.0, 1.0]), "steps differ by 7.1 %, 2 gaps");
    }
}
