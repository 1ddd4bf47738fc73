//! Steps from frame to frame, against those that are taken for them.

use super::{COST_PX, SIGNIFICANT, TextureMotion};
use epirig_core::statistics::{median, root_mean_square, upper_median};

/// A step jumps if it is off by more than this share of the usual step: the nearest number of whole steps is then
/// another than the one that is taken.
const JUMP: f64 = 0.5;

/// A step between two frames, in units of the usual step from a frame to the next.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// The frame that it begins at.
    pub from: usize,
    /// The frame that it leads to.
    pub to: usize,
    /// How far it goes.
    pub length: f64,
    /// Standard uncertainty of that.
    pub sigma: f64,
    /// How far it is taken to go.
    pub taken: f64,
}

/// A step that does not go on.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Return {
    /// It cannot be told from none.
    Repeated,
    /// It goes back so far.
    Back(f64),
}

impl Step {
    /// Whether it differs from `length` by more than its uncertainty allows.
    fn is_not(&self, length: f64) -> bool {
        (self.length - length).abs() > SIGNIFICANT * self.sigma
    }

    /// Whether it does not go on: it goes back, or it may be none and is not the step that is taken. Of steps that are
    /// smaller than their uncertainty nothing is known.
    pub fn returns(&self) -> Option<Return> {
        let is_short = self.length < self.taken && self.is_not(self.taken);
        match self.is_not(0.0) {
            true if self.length < 0.0 => Some(Return::Back(-self.length)),
            false if is_short => Some(Return::Repeated),
            _ => None,
        }
    }

    /// Whether it contradicts the one that is taken: frames are missing, or the camera was bumped.
    pub fn jumps(&self) -> bool {
        (self.length - self.taken).abs() > JUMP && self.is_not(self.taken)
    }
}

/// Places in any unit, in units of the usual step between them.
pub fn in_usual_steps(places: &[f64]) -> Vec<f64> {
    let mut steps: Vec<f64> = places.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let usual = median(&mut steps).filter(|usual| *usual != 0.0).unwrap_or(1.0);
    places.iter().map(|place| place / usual).collect()
}

impl TextureMotion {
    /// The steps between these frames, which are taken to stand at `places` in usual steps. Their scale is the one on
    /// which the usual step is the one that is taken.
    pub fn steps(&self, frames: &[usize], places: &[f64]) -> Vec<Step> {
        let pairs = || frames.windows(2).zip(places.windows(2));
        let measured = |frames: &[usize]| self.tau[frames[1]] - self.tau[frames[0]];
        let taken = |places: &[f64]| places[1] - places[0];
        // One of the values, not a mean of two: at least one step is as it is taken to be.
        let mut ratios: Vec<f64> = pairs()
            .filter(|(_, places)| taken(places) != 0.0)
            .map(|(frames, places)| measured(frames) / taken(places))
            .collect();
        let scale = upper_median(&mut ratios).unwrap_or(f64::NAN);
        pairs()
            .map(|(frames, places)| {
                let between = &self.step_sigma[frames[0]..frames[1]];
                let sigma = between.iter().fold(0.0, |sum: f64, sigma| sum.hypot(*sigma));
                Step {
                    from: frames[0],
                    to: frames[1],
                    length: measured(frames) / scale,
                    sigma: sigma / scale.abs(),
                    taken: taken(places),
                }
            })
            .collect()
    }

    /// How far these frames stand from `places` in any unit on any scale, root mean square in px of a typical point, if
    /// a match that takes them for true loses accuracy by it.
    pub fn displacement_px(&self, frames: &[usize], places: &[f64]) -> Option<f64> {
        let count = places.len() as f64;
        let mean = |values: &[f64]| values.iter().sum::<f64>() / count;
        let of = |values: &[f64]| frames.iter().map(|&frame| values[frame]).collect::<Vec<f64>>();
        let (positions, sigmas) = (of(&self.position_px), of(&self.tau_sigma));
        let (place, position) = (mean(places), mean(&positions));
        let both = || places.iter().zip(&positions).map(|(a, b)| (a - place, b - position));
        let slope = both().map(|(a, b)| a * b).sum::<f64>() / both().map(|(a, _)| a * a).sum::<f64>();
        let squares = both().map(|(a, b)| (b - slope * a).powi(2)).sum::<f64>();
        let apart_px = (squares / (count - 2.0).max(1.0)).sqrt();
        let moved_px = self.position_px.last().copied().unwrap_or(0.0);
        let known_px = moved_px * root_mean_square(&sigmas);
        // A disparity is the slope of a line through frames that are evenly spread over the baseline.
        let cost_px = apart_px * (12.0 / count).sqrt();
        (cost_px > COST_PX && apart_px > SIGNIFICANT * known_px).then_some(apart_px)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::texture_motion::{Cameras, MotionModel};

    /// A motion through `positions` whose steps are known to `sigma`, in the unit of the positions.
    fn motion(positions: &[f64], sigma: f64) -> TextureMotion {
        let span = positions[positions.len() - 1] - positions[0];
        TextureMotion {
            position_px: positions.to_vec(),
            tau: positions.iter().map(|position| (position - positions[0]) / span).collect(),
            tau_sigma: vec![sigma / span; positions.len()],
            step_sigma: vec![sigma / span; positions.len() - 1],
            moves_right: true,
            angle_rad: 0.0,
            angle_sigma_rad: 0.001,
            cameras: Cameras {
                focal_length_px: 1000.0,
                centre_px: [0.0, 0.0],
                k1: 0.0,
                direction: nalgebra::Vector3::x(),
                frames: Vec::new(),
            },
            model: MotionModel::default(),
            is_tested: true,
            pan_sigma_rad: 0.001,
            pan_own_sigma_rad: 0.001,
            k1_sigma: 0.0,
            focal_length_sigma: 0.0,
            rows_sigma_px: 0.001,
            position_sigma_px: 0.001,
            disparity_sigma_px: 0.001,
            bend_sigma_px: 0.001,
            typical_rho: 1.0,
            points: 100,
            rejected: 0.0,
            residual_px: 0.02,
        }
    }

    fn steps(positions: &[f64], sigma: f64, places: &[f64]) -> Vec<Step> {
        let frames: Vec<usize> = (0..positions.len()).collect();
        motion(positions, sigma).steps(&frames, places)
    }

    #[test]
    fn steps_are_measured_in_those_that_are_taken() {
        // Steps of 4, one of 1 and one of 12, in a scan whose positions say so but for the last.
        let found =
            steps(&[0.0, 4.0, 8.0, 9.0, 13.0, 25.0], 0.04, &in_usual_steps(&[1.0, 3.0, 5.0, 5.5, 7.5, 9.5]));
        let lengths: Vec<f64> = found.iter().map(|step| step.length).collect();
        assert_eq!(
            lengths.iter().map(|length| (1000.0 * length).round()).collect::<Vec<_>>(),
            [1000.0, 1000.0, 250.0, 1000.0, 3000.0]
        );
        assert!(found.iter().all(|step| (step.sigma - 0.01).abs() < 1e-12 && step.returns().is_none()));
        assert_eq!(found.iter().map(Step::jumps).collect::<Vec<_>>(), [false, false, false, false, true]);
        // Of two steps that contradict each other, one gives the scale.
        let found = steps(&[0.0, 1.0, 5.0], 0.01, &[0.0, 1.0, 2.0]);
        assert_eq!(found.iter().filter(|step| step.jumps()).count(), 1);
    }

    #[test]
    fn a_step_returns_if_it_may_be_none_and_is_not_the_one_that_is_taken() {
        let of = |length, sigma, taken| Step { from: 0, to: 1, length, sigma, taken }.returns();
        // Short, as it is taken to be or not.
        assert_eq!(of(0.25, 0.01, 0.25), None);
        assert_eq!(of(0.25, 0.01, 1.0), None);
        assert_eq!(of(0.02, 0.01, 1.0), Some(Return::Repeated));
        assert_eq!(of(-0.02, 0.01, 1.0), Some(Return::Repeated));
        assert_eq!(of(-0.2, 0.01, 1.0), Some(Return::Back(0.2)));
        // As good as known: nothing can be said of it.
        assert_eq!(of(0.5, 0.3, 1.0), None);
    }

    #[test]
    fn a_step_jumps_only_if_it_is_known_so_well() {
        let jumps = |length, sigma| Step { from: 0, to: 1, length, sigma, taken: 1.0 }.jumps();
        assert!(jumps(1.6, 0.1) && jumps(0.4, 0.1));
        assert!(!jumps(1.6, 0.3) && !jumps(0.4, 0.3) && !jumps(1.4, 0.01));
    }
}
