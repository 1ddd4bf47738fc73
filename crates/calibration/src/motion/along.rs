//! Direction and steps of a motion, from points that are followed through reduced frames.

use super::doubt::Doubt;
use super::reduced::Reduced;
use crate::reduction::reduced;
use crate::texture_motion::{Frames, TextureMotion, texture_motion};
use epirig_core::grid::Grid;
use epirig_core::statistics::{median, root_mean_square};

/// Frames that are looked at, at most; of more, every second or third.
pub(super) const MOST_FRAMES: usize = 400;
/// Places of points in frames: enough for steps of a hundredth of a reduced pixel.
const OBSERVATIONS: usize = 30_000;
/// A frame stands where the one before it does if its step is less than this share of the usual one, and it goes
/// back below the negative of it.
const NO_STEP: f64 = 0.3;
/// A step that is so many times as long as the usual one is a gap.
const GAP: f64 = 1.5;
/// What is not this many standard uncertainties off is not told.
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

/// The motion in px of the frames, and the frames that it was measured in; `None` if their texture does not tell it.
pub(super) fn measured(frames: &[(usize, &Reduced)]) -> Option<(TextureMotion, Vec<usize>)> {
    let size = |frame: &Reduced| (frame.fine.rows(), frame.fine.columns());
    let first = frames.first()?.1;
    if frames.iter().any(|frame| size(frame.1) != size(first)) {
        return None;
    }
    let stride = frames.len().div_ceil(MOST_FRAMES);
    let places: Vec<usize> = (0..frames.len()).step_by(stride).collect();
    let looked = ReducedFrames(places.iter().map(|&place| frames[place].1).collect());
    let mut motion = texture_motion(&looked, OBSERVATIONS).ok()?;
    let factor = first.factor as f64;
    motion.position_px.iter_mut().for_each(|position| *position *= factor);
    motion.residual_px *= factor;
    Some((motion, places))
}

/// What is wrong with a motion of these frames, which are taken to stand at `given`.
pub(super) fn doubts(motion: &TextureMotion, numbers: &[usize], given: &[f64]) -> Vec<Doubt> {
    let mut doubts = Vec::new();
    if motion.turn_costs() {
        doubts.push(Doubt::Oblique {
            degrees: motion.angle_rad.to_degrees(),
            drift_px: Some(motion.drift_px().abs()),
        });
    }
    let steps = motion.steps();
    let returns = steps
        .iter()
        .enumerate()
        .filter(|(_, (step, sigma))| *step < NO_STEP && NO_STEP - step > SIGNIFICANT * sigma);
    let returns: Vec<(usize, f64)> = returns.map(|(place, (step, _))| (numbers[place + 1], *step)).collect();
    if !returns.is_empty() {
        doubts.push(Doubt::Returns(returns));
    } else if let Some(displacement_px) = motion.displacement_px(given) {
        // Steps against those that are given: 1 where both agree.
        let known: Vec<f64> = given.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let usual = median(&mut known.clone()).unwrap_or(1.0);
        let against = |place: usize| steps[place].0 * usual / known[place];
        let (gaps, even): (Vec<usize>, Vec<usize>) =
            (0..steps.len()).partition(|&place| against(place) > GAP);
        let off: Vec<f64> = even.iter().map(|&place| against(place) - 1.0).collect();
        let noise: Vec<f64> = even.iter().map(|&place| steps[place].1).collect();
        let (off, noise) = (root_mean_square(&off), root_mean_square(&noise));
        doubts.push(Doubt::Uneven {
            displacement_px,
            share: if off > SIGNIFICANT * noise { off } else { 0.0 },
            gaps: gaps.iter().map(|&place| (numbers[place], numbers[place + 1], against(place))).collect(),
        });
    }
    doubts
}
