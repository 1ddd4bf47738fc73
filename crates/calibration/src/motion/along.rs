//! Direction and steps of a motion, from points that are followed through reduced frames.

use super::doubt::Doubt;
use super::reduced::Reduced;
use crate::texture_motion::{Frames, MotionOptions, Return, Step, TextureMotion, texture_motion};
use epirig_core::grid::Grid;
use epirig_core::image::reduced;
use epirig_core::statistics::root_mean_square;

/// Frames that are looked at, at most; of more, every second or third.
pub(super) const MOST_FRAMES: usize = 400;
/// Places of points in frames: enough for steps of a hundredth of a reduced pixel.
const OBSERVATIONS: usize = 30_000;
/// Steps whose differences are not so many times their uncertainty are not told to differ.
const SIGNIFICANT: f64 = 3.0;

struct ReducedFrames<'a>(Vec<&'a Reduced>);

impl Frames for ReducedFrames<'_> {
    fn count(&self) -> usize {
        self.0.len()
    }

    fn size(&self) -> (usize, usize) {
        let fine = &self.0[0].fine;
        (fine.rows(), fine.columns())
    }

    fn picture(&self, index: usize, factor: usize) -> Grid<f32> {
        reduced(&self.0[index].fine, factor)
    }
}

/// The motion in px of the frames, and the frames that it was measured in, or what else they show; `None` if their
/// texture does not tell it.
pub(super) fn measured(frames: &[(usize, &Reduced)]) -> Option<Result<(TextureMotion, Vec<usize>), Doubt>> {
    let size = |frame: &Reduced| (frame.fine.rows(), frame.fine.columns());
    let first = frames.first()?.1;
    if frames.iter().any(|frame| size(frame.1) != size(first)) {
        return None;
    }
    let factor = first.factor as f64;
    let stride = frames.len().div_ceil(MOST_FRAMES);
    let places: Vec<usize> = (0..frames.len()).step_by(stride).collect();
    let looked = ReducedFrames(places.iter().map(|&place| frames[place].1).collect());
    let mut motion = match texture_motion(&looked, &MotionOptions::of_positions(OBSERVATIONS)) {
        Ok(motion) => motion,
        Err(error) => return error.of_other_motion(factor).map(|error| Err(Doubt::Other(error))),
    };
    motion.position_px.iter_mut().for_each(|position| *position *= factor);
    motion.residual_px *= factor;
    Some(Ok((motion, places)))
}

/// What is wrong with a motion of the frames with these numbers, which are taken to stand at `given` in usual steps;
/// in equal steps if that is `None`.
pub(super) fn doubts(motion: &TextureMotion, numbers: &[usize], given: Option<&[f64]>) -> Vec<Doubt> {
    let mut doubts = Vec::new();
    if motion.turn_costs() {
        doubts.push(Doubt::Oblique {
            degrees: motion.angle_rad.to_degrees(),
            drift_px: Some(motion.drift_px().abs()),
        });
    }
    // Without given places, frames stand at their numbers, also if some are left out.
    let counted: Vec<f64> = numbers.iter().map(|&number| number as f64).collect();
    let places = |frames: &[usize]| match given {
        Some(given) => frames.iter().map(|&frame| given[frame]).collect(),
        None => counted[..frames.len()].to_vec(),
    };
    let all: Vec<usize> = (0..numbers.len()).collect();
    let steps = motion.steps(&all, &places(&all));
    let returns: Vec<(usize, Return)> =
        steps.iter().filter_map(|step| Some((step.to, step.returns()?))).collect();
    // The others are judged without the frames that return: leaving those out helps.
    let mut on = vec![0];
    let mut farthest = motion.tau[0];
    for &frame in &all[1..] {
        if motion.tau[frame] > farthest && !returns.iter().any(|(returned, _)| *returned == frame) {
            on.push(frame);
            farthest = motion.tau[frame];
        }
    }
    if !returns.is_empty() {
        doubts.push(Doubt::Returns(returns.into_iter().map(|(frame, how)| (numbers[frame], how)).collect()));
    }
    let places = places(&on);
    if let Some(displacement_px) = motion.displacement_px(&on, &places) {
        let steps = motion.steps(&on, &places);
        let (gaps, even): (Vec<Step>, Vec<Step>) =
            steps.into_iter().partition(|step| step.jumps() && step.length > step.taken);
        let off: Vec<f64> = even.iter().map(|step| step.length - step.taken).collect();
        let noise: Vec<f64> = even.iter().map(|step| step.sigma).collect();
        let (off, noise) = (root_mean_square(&off), root_mean_square(&noise));
        let numbered = |step: Step| Step { from: numbers[step.from], to: numbers[step.to], ..step };
        doubts.push(Doubt::Uneven {
            displacement_px,
            share: if off > SIGNIFICANT * noise { off } else { 0.0 },
            gaps: gaps.into_iter().map(numbered).collect(),
        });
    }
    doubts
}
