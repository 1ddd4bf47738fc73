//! The plain reference of the benches.

use epirig_core::volume::Volume;
use epirig_matcher::DisparityRange;

/// Variance with linear interpolation as a good first attempt has it: pixel by pixel, frame by frame. The sum
/// of the least variances of row `y` over the disparities of `range`, one every `disparity_step_px`.
pub(crate) fn plain_variance(
    volume: &Volume,
    y: usize,
    range: DisparityRange,
    disparity_step_px: f64,
) -> f64 {
    let columns = volume.columns();
    let mut rows = vec![vec![0.0_f32; columns]; volume.frames()];
    rows.iter_mut().enumerate().for_each(|(t, row)| volume.copy_row(y, t, row));
    let candidates = ((range.maximum_px - range.minimum_px) / disparity_step_px).round() as u32 + 1;
    let mut least = 0.0;
    for x in 0..columns {
        let mut best = f64::INFINITY;
        for k in 0..candidates {
            let (mut sum, mut squares, mut count) = (0.0_f64, 0.0_f64, 0.0);
            for (row, tau) in rows.iter().zip(volume.tau().values()) {
                let position = x as f64 + (range.minimum_px + f64::from(k) * disparity_step_px) * tau;
                let whole = position.floor() as usize;
                if whole + 1 < columns {
                    let f = (position - whole as f64) as f32;
                    let value = f64::from(row[whole] + f * (row[whole + 1] - row[whole]));
                    sum += value;
                    squares += value * value;
                    count += 1.0;
                }
            }
            best = best.min((squares - sum * sum / count) / (count - 1.0));
        }
        least += best;
    }
    least
}
