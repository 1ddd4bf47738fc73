//! Several frames of one view: their mean, noise, texture and brightness.

use epirig_core::frame::{Frame, Samples};
use epirig_core::grid::Grid;
use epirig_devices::camera::{Camera, CameraError};

/// Variance of rounding to whole DN, in squared DN: the least noise of integer samples.
const ROUNDING_DN2: f64 = 1.0 / 12.0;

/// Sums over frames of one view.
#[derive(Debug, Clone)]
pub(super) struct View {
    sum: Grid<f32>,
    latest: Grid<f32>,
    row_means_dn: Vec<Vec<f64>>,
    /// Sum over pairs of neighbouring frames of the mean squared difference, with rows scaled to one
    /// brightness.
    differences_dn2: f64,
}

impl View {
    /// A view of one frame.
    pub(super) fn new(frame: &Frame) -> Self {
        let latest = plane(frame);
        Self { sum: latest.clone(), row_means_dn: vec![row_means(&latest)], latest, differences_dn2: 0.0 }
    }

    /// Takes `frames` frames (at least 1) of the present view.
    ///
    /// # Errors
    /// [`CameraError`] if a frame cannot be taken.
    pub(super) fn take(camera: &mut dyn Camera, frames: usize) -> Result<Self, CameraError> {
        let moment = camera.now();
        let mut view = Self::new(&camera.grab_after(moment)?.frame);
        for _ in 1..frames {
            let next = camera.grab_after(moment)?.frame;
            if !view.add(&next) {
                let asked = format!("{} x {}", view.columns(), view.sum.rows());
                let got = format!("{} x {}", next.columns(), next.rows());
                return Err(CameraError::substituted(&camera.identity().name(), asked, got));
            }
        }
        Ok(view)
    }

    /// Adds a frame. Returns `false` if its size differs.
    pub(super) fn add(&mut self, frame: &Frame) -> bool {
        if (frame.rows(), frame.columns()) != (self.sum.rows(), self.sum.columns()) {
            return false;
        }
        let next = plane(frame);
        self.sum.values_mut().iter_mut().zip(next.values()).for_each(|(sum, value)| *sum += value);
        let columns = self.columns();
        let mut squares = 0.0;
        for y in 0..next.rows() {
            let (mut sum, mut square) = (0.0, 0.0);
            for (&one, &other) in self.latest.row(y).iter().zip(next.row(y)) {
                let difference = f64::from(other) - f64::from(one);
                sum += difference;
                square += difference * difference;
            }
            squares += square - sum * sum / columns as f64;
        }
        let freedom = next.rows() * columns.saturating_sub(1);
        self.differences_dn2 += squares / freedom.max(1) as f64;
        self.row_means_dn.push(row_means(&next));
        self.latest = next;
        true
    }

    /// Width of the frames.
    pub(super) fn columns(&self) -> usize {
        self.sum.columns()
    }

    /// The mean of each row, frame by frame, in DN.
    pub(super) fn row_means_dn(&self) -> &[Vec<f64>] {
        &self.row_means_dn
    }

    /// Standard deviation of a frame's samples, in DN, from differences of neighbouring frames; changes
    /// common to a row are light, not noise. At least that of rounding, which is also the value for a single
    /// frame.
    pub(super) fn noise_dn(&self) -> f64 {
        let pairs = (self.row_means_dn.len() - 1).max(1) as f64;
        (self.differences_dn2 / (2.0 * pairs)).max(ROUNDING_DN2).sqrt()
    }

    /// Root mean square of the gradient along x, in DN per px: from central differences, with the noise
    /// subtracted.
    pub(super) fn gradient_dn_per_px(&self) -> f64 {
        let frames = self.row_means_dn.len() as f64;
        let mut squares = 0.0;
        for y in 0..self.sum.rows() {
            let row = self.sum.row(y);
            squares += row.windows(3).map(|three| f64::from(three[2] - three[0]).powi(2)).sum::<f64>();
        }
        let count = self.sum.rows() * self.columns().saturating_sub(2);
        let measured = squares / (4.0 * frames * frames * count.max(1) as f64);
        // Half the difference of two samples has half the variance of one.
        let by_noise = self.noise_dn().powi(2) / (2.0 * frames);
        (measured - by_noise).max(0.0).sqrt()
    }
}

/// The middle of a frame, of at most `most_px` columns and rows; a smaller frame is unchanged.
pub(super) fn middle(frame: Frame, most_px: usize) -> Frame {
    let (rows, columns) = (frame.rows().min(most_px), frame.columns().min(most_px));
    if (rows, columns) == (frame.rows(), frame.columns()) {
        return frame;
    }
    let (top, left) = ((frame.rows() - rows) / 2, (frame.columns() - columns) / 2);
    let starts = (top..top + rows).map(|y| y * frame.columns() + left);
    let samples = match frame.samples() {
        Samples::U8(all) => {
            Samples::U8(starts.flat_map(|start| &all[start..start + columns]).copied().collect())
        }
        Samples::U16(all) => {
            Samples::U16(starts.flat_map(|start| &all[start..start + columns]).copied().collect())
        }
    };
    // Samples of a frame suit its bit depth, in every part of it.
    Frame::new(rows, columns, frame.bit_depth(), samples).unwrap_or(frame)
}

fn plane(frame: &Frame) -> Grid<f32> {
    let mut plane = Grid::filled(frame.rows(), frame.columns(), 0.0);
    frame.samples().copy_to_f32(0, plane.values_mut());
    plane
}

fn row_means(plane: &Grid<f32>) -> Vec<f64> {
    let mean = |y| plane.row(y).iter().map(|&value| f64::from(value)).sum::<f64>() / plane.columns() as f64;
    (0..plane.rows()).map(mean).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use epirig_simulator::{Simulator, SimulatorConfig};

    #[test]
    fn noise_and_texture_are_told_apart() {
        let mut config = SimulatorConfig::textured_plane(160, 120, 9);
        let silent = Simulator::new(config.clone()).unwrap();
        config.sensor.read_noise_dn = 4.0;
        let noisy = Simulator::new(config).unwrap();
        let look = |simulator: &Simulator| {
            let mut view = View::new(&simulator.expose(20.0, 0));
            (1..9).for_each(|exposure| assert!(view.add(&simulator.expose(20.0, exposure))));
            view
        };
        let (silent, noisy) = (look(&silent), look(&noisy));
        assert!((silent.noise_dn() - 12_f64.sqrt().recip()).abs() < 1e-12, "rounding is all there is");
        // Rounding adds 1/12; 8 x 19200 differences tell the deviation to 0.2 %.
        let expected = (16.0 + 1.0 / 12.0_f64).sqrt();
        assert!((noisy.noise_dn() / expected - 1.0).abs() < 0.01, "{}", noisy.noise_dn());
        // The gradient is that of the picture, with noise or without.
        let ratio = noisy.gradient_dn_per_px() / silent.gradient_dn_per_px();
        assert!((ratio - 1.0).abs() < 0.01, "{ratio}");
        assert!(!View::new(&noisy_frame(8)).add(&noisy_frame(9)));
    }

    #[test]
    fn a_ramp_has_the_gradient_that_it_has_and_light_is_no_noise() {
        let ramp = |light: u16| {
            let samples = (0..40 * 30).map(|index| 500 + light + 7 * (index % 40)).collect();
            Frame::new(30, 40, 12, epirig_core::frame::Samples::U16(samples)).unwrap()
        };
        let mut view = View::new(&ramp(0));
        assert!(view.add(&ramp(20)) && view.add(&ramp(3)));
        assert!((view.noise_dn() - 12_f64.sqrt().recip()).abs() < 1e-9);
        // Rounding of three frames is taken off: 49 - 1/72.
        assert!((view.gradient_dn_per_px() - (49.0 - 1.0 / 72.0_f64).sqrt()).abs() < 1e-4);
    }

    #[test]
    fn a_big_frame_is_cropped_to_its_middle() {
        let wide = Frame::new(3, 9, 12, Samples::U16((0..27).collect())).unwrap();
        // Columns 2 to 6 of 0 to 8, all rows.
        let expected = [2, 3, 4, 5, 6, 11, 12, 13, 14, 15, 20, 21, 22, 23, 24];
        let part = middle(wide.clone(), 5);
        assert_eq!((part.rows(), part.columns(), part.bit_depth()), (3, 5, 12));
        assert_eq!(part.samples(), &Samples::U16(expected.to_vec()));
        assert_eq!(middle(wide.clone(), 9), wide);
        let tall = Frame::new(4, 2, 8, Samples::U8((0..8).collect())).unwrap();
        assert_eq!(middle(tall, 2).samples(), &Samples::U8(vec![2, 3, 4, 5]));
        let huge = Frame::new(1100, 1300, 8, Samples::U8(vec![7; 1100 * 1300])).unwrap();
        let part = middle(huge, 512);
        assert_eq!((part.rows(), part.columns(), part.samples().len()), (512, 512, 512 * 512));
    }

    fn noisy_frame(columns: usize) -> Frame {
        Frame::new(2, columns, 8, epirig_core::frame::Samples::U8(vec![3; 2 * columns])).unwrap()
    }
}
