//! Conditions for the end of a motion.

use std::time::Duration;

use super::StageError;
use super::axis::Kinematics;

/// Rounding of reported positions: dialects round to 1 um or finer.
pub(super) const REPORT_ROUNDING_MM: f64 = 0.0005;

/// Checks a move that ended at `reported_mm` after `took`. `tolerance_mm` is the largest distance of the
/// reported from the commanded position beyond half a step and the rounding of the report.
pub(super) fn check_move(
    tolerance_mm: f64,
    kinematics: &Kinematics,
    from_mm: f64,
    commanded_mm: f64,
    reported_mm: f64,
    took: Duration,
) -> Result<(), StageError> {
    let tolerance_mm = tolerance_mm + kinematics.step_mm / 2.0 + REPORT_ROUNDING_MM;
    let agrees = (reported_mm - commanded_mm).abs() <= tolerance_mm;
    if !agrees {
        return Err(StageError::Disagrees { commanded_mm, reported_mm, tolerance_mm });
    }
    // A stage may be a step early or late, and its ramps are rounded: half of the time is a safe limit.
    let least = kinematics.duration(commanded_mm - from_mm) / 2;
    if took < least && (commanded_mm - from_mm).abs() > 2.0 * kinematics.step_mm {
        return Err(StageError::TooFast {
            distance_mm: (commanded_mm - from_mm).abs(),
            took_s: took.as_secs_f64(),
            least_s: least.as_secs_f64(),
        });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    const KINEMATICS: Kinematics =
        Kinematics { velocity_mm_s: 5.0, acceleration_mm_s2: 20.0, step_mm: 0.004 };

    #[test]
    fn a_wrong_place_and_a_miracle_are_errors() {
        let check = |reported_mm, milliseconds| {
            check_move(0.0, &KINEMATICS, 0.0, 1.5, reported_mm, Duration::from_millis(milliseconds))
        };
        // Half a step of 4 um and half a um of rounding.
        assert_eq!(check(1.5024, 600), Ok(()));
        assert!(matches!(check(1.5026, 600), Err(StageError::Disagrees { .. })));
        assert_eq!(check_move(0.01, &KINEMATICS, 0.0, 1.5, 1.5124, Duration::from_secs(1)), Ok(()));
        assert!(matches!(check(f64::NAN, 600), Err(StageError::Disagrees { .. })));
        // 1.5 mm take 0.55 s.
        assert!(matches!(check(1.5, 6), Err(StageError::TooFast { .. })));
        assert_eq!(check_move(0.0, &KINEMATICS, 1.496, 1.5, 1.5, Duration::ZERO), Ok(()));
    }
}
