//! Repeatability of the stage, measured in the picture.

use std::time::Duration;

use serde::Serialize;

use super::error::MotionError;
use super::motion::look;
use epirig_calibration::registration::shift_between;
use epirig_devices::camera::Camera;
use epirig_devices::stage::Stage;

const UM_PER_MM: f64 = 1000.0;
/// Default number of returns.
pub(super) const RETURNS: usize = 5;

/// Repeatability of a position, approached from above and from below in turn.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Repeatability {
    /// Position of the picture after each return relative to the first arrival, along the direction of its
    /// motion, in px.
    pub returns_px: Vec<f64>,
    /// Standard deviation after removal of drift and reversal error, in px.
    pub sigma_px: f64,
    /// The same in um of the stage.
    pub sigma_um: f64,
    /// Drift from the first arrival to the last, in um.
    pub drift_um: f64,
    /// Reversal error: position reached from above minus that reached from below, in um. Backlash that the
    /// approach does not remove.
    pub reversal_um: f64,
    /// Standard deviation expected from picture noise alone, in px.
    pub noise_px: f64,
}

/// Moves away from `position_mm` by `away_mm`, downwards and upwards in turn as far as there is room, and
/// returns. This is done `returns` times (at least 4) after a first arrival. A mm of the stage moves the
/// picture by `px_per_mm` along x and y.
///
/// # Errors
/// [`MotionError`] if stage or camera fail, or a picture cannot be compared with the first.
pub(super) fn measure_repeatability(
    stage: &mut dyn Stage,
    camera: &mut dyn Camera,
    settle: Duration,
    [position_mm, away_mm]: [f64; 2],
    px_per_mm: [f64; 2],
    returns: usize,
) -> Result<Repeatability, MotionError> {
    let above_mm = (position_mm + away_mm).min(stage.travel_mm());
    // The first arrival is from above, as every second return.
    let below_mm = if position_mm >= away_mm { position_mm - away_mm } else { above_mm };
    stage.move_to(above_mm)?;
    stage.move_to(position_mm)?;
    let first = look(camera, settle)?;
    let length = px_per_mm[0].hypot(px_per_mm[1]);
    let (mut returns_px, mut noise_px) = (Vec::new(), 0.0_f64);
    for index in 1..=returns.max(4) {
        stage.move_to(if index % 2 == 0 { above_mm } else { below_mm })?;
        stage.move_to(position_mm)?;
        let shift = shift_between(&first, &look(camera, settle)?)?;
        returns_px.push((shift.x_px * px_per_mm[0] + shift.y_px * px_per_mm[1]) / length);
        noise_px = noise_px.max(shift.sigma_px);
    }
    // A shift has the noise of two frames.
    Ok(Repeatability::of(returns_px, length, noise_px / std::f64::consts::SQRT_2))
}

impl Repeatability {
    /// The result from shifts relative to the first arrival, in px, of a picture that moves by `px_per_mm`,
    /// with the uncertainty `noise_px`.
    fn of(returns_px: Vec<f64>, px_per_mm: f64, noise_px: f64) -> Self {
        let count = returns_px.len() + 1;
        let places: Vec<f64> = std::iter::once(0.0).chain(returns_px.iter().copied()).collect();
        let same = vec![1.0; count];
        let time: Vec<f64> = (0..count).map(|index| index as f64).collect();
        let side: Vec<f64> = (0..count).map(|index| if index % 2 == 0 { 0.5 } else { -0.5 }).collect();
        let (drift_px, _) = last_coefficient(&places, &[&same, &side, &time]);
        let (reversal_px, squares) = last_coefficient(&places, &[&same, &time, &side]);
        let um = UM_PER_MM / px_per_mm;
        let sigma_px = (squares / (count - 3) as f64).sqrt();
        Self {
            returns_px,
            sigma_px,
            sigma_um: sigma_px * um,
            drift_um: drift_px * (count - 1) as f64 * um,
            reversal_um: reversal_px * um,
            noise_px,
        }
    }
}

/// The last coefficient of the least-squares fit of `values` by `basis`, and the residual sum of squares. The
/// basis is made orthogonal (Gram-Schmidt), so that the coefficient of the last function is independent of
/// the others.
fn last_coefficient(values: &[f64], basis: &[&[f64]]) -> (f64, f64) {
    let product = |one: &[f64], other: &[f64]| one.iter().zip(other).map(|(a, b)| a * b).sum::<f64>();
    let mut left = values.to_vec();
    let mut free: Vec<Vec<f64>> = Vec::new();
    let mut coefficient = 0.0;
    for function in basis {
        let mut function = function.to_vec();
        for other in &free {
            let share = product(&function, other) / product(other, other);
            function.iter_mut().zip(other).for_each(|(value, other)| *value -= share * other);
        }
        coefficient = product(&left, &function) / product(&function, &function);
        left.iter_mut().zip(&function).for_each(|(value, function)| *value -= coefficient * function);
        free.push(function);
    }
    (coefficient, product(&left, &left))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn drift_and_reversal_are_no_scatter() {
        // 2 px per mm; drift of 5 um a time, 30 um more from above, nothing else. The first arrival is from
        // above.
        let place =
            |index: u32| 2e-3 * (5.0 * f64::from(index) + if index.is_multiple_of(2) { 30.0 } else { 0.0 });
        let returns = (1..=5).map(|index| place(index) - place(0)).collect();
        let found = Repeatability::of(returns, 2.0, 0.001);
        assert!((found.drift_um - 25.0).abs() < 1e-9 && (found.reversal_um - 30.0).abs() < 1e-9, "{found:?}");
        assert!(found.sigma_um < 1e-9, "{found:?}");
    }

    #[test]
    fn the_rest_is_scatter() {
        // 0, 1, -1, -1, 1, 0 about nothing: orthogonal to constant and line; with the side (0.5, -0.5, ...)
        // it has 0.5 * (0 - 1 - 1 + 1 + 1 - 0) = 0 in common. So 4 squares over 6 - 3.
        let found = Repeatability::of(vec![1.0, -1.0, -1.0, 1.0, 0.0], 1000.0, 0.0);
        assert!((found.sigma_px - (4.0 / 3.0_f64).sqrt()).abs() < 1e-12, "{found:?}");
        assert!((found.sigma_um - found.sigma_px).abs() < 1e-12 && found.reversal_um.abs() < 1e-12);
    }
}
