//! How much of the cameras' motion the tracks can tell: tested on points that the cameras were not adjusted to.
//!
//! Residuals of one track are not independent, so an F-test finds rotations everywhere. Half of the points adjust
//! the cameras, and the other half judges them.

use super::TextureMotionError;
use super::bundle::{adjust, adjust_again, residuals_of_unseen};
use super::cameras::Cameras;
use super::fit::{Fit, LensPrior};
use super::frames::Frames;
use super::model::MotionModel;
use super::track::Track;
use epirig_core::statistics::median;

/// A model with more unknowns has to lower the mean square of the unseen residuals to this share. Where the camera does
/// not turn, it has been seen from 0.95 to 1.04; where it turns by as much as points are known to, it is
/// below 0.5. What lowers it by less moves rows by less than a third of that.
const IMPROVES: f64 = 0.9;
/// A focal length is known before, and one unknown for all frames. Those that were found right lowered it to 0.985 and less,
/// wrong ones, of scenes that do not tell it, left it at 1.001 and more.
const FOCAL_LENGTH_IMPROVES: f64 = 0.995;

/// The model that was chosen.
pub(super) struct Chosen {
    pub(super) fit: Fit,
    /// Whether every model could be tested: else frames have too few points.
    pub(super) is_tested: bool,
}

/// Adjusts the cameras with as many unknowns as improve the prediction of unseen points; `frames` say whether to go on.
pub(super) fn choose(
    tracks: &[Track],
    start: &Cameras,
    lens: LensPrior,
    may: MotionModel,
    frames: &dyn Frames,
) -> Result<Chosen, TextureMotionError> {
    let simple = MotionModel { pan: may.pan, ..MotionModel::default() };
    let first = adjust(tracks, &start.straight(), lens, simple);
    if may == simple {
        return first.map(|fit| Chosen { fit, is_tested: true });
    }
    // A model that is too simple may leave so many outliers that it connects no frames, and predicts nothing.
    let mut unseen = first.as_ref().ok().and_then(|fit| prediction(tracks, fit));
    let (mut best, mut is_tested, mut tried) = (first, true, vec![simple]);
    loop {
        let (of_best, begin) = match &best {
            Ok(fit) => (fit.free, fit.cameras.clone()),
            Err(_) => (simple, start.straight()),
        };
        for model in more_than(of_best).map(|model| model.of_these(may)) {
            if tried.contains(&model) {
                continue;
            }
            tried.push(model);
            TextureMotionError::if_cancelled(frames)?;
            // Large rotations are found from those in smaller pictures.
            let begin = if model.rotations == of_best.rotations { &begin } else { start };
            // Points that do not determine a model do not test it either; what they determine stands.
            let Some((fit, after)) = adjust(tracks, begin, lens, model)
                .ok()
                .and_then(|fit| prediction(tracks, &fit).map(|after| (fit, after)))
            else {
                is_tested = false;
                continue;
            };
            let share =
                if model.focal_length == of_best.focal_length { IMPROVES } else { FOCAL_LENGTH_IMPROVES };
            if unseen.is_none_or(|before| after < share * before) {
                (best, unseen) = (Ok(fit), Some(after));
            }
        }
        if best.as_ref().map_or(simple, |fit| fit.free) == of_best {
            return best.map(|fit| Chosen { fit, is_tested });
        }
    }
}

/// Models with more unknowns that are tried next, the simpler first. Rotations hide a distortion, so they are tried with
/// it. The others are tried where rotations help: only these show the focal length, and offsets move the rows of a
/// frame, too.
fn more_than(model: MotionModel) -> [MotionModel; 2] {
    if model.rotations {
        [MotionModel { focal_length: true, ..model }, MotionModel { offsets: true, ..model }]
    } else {
        [MotionModel { k1: true, ..model }, MotionModel { rotations: true, k1: true, ..model }]
    }
}

/// Mean square of the residuals of points that the cameras were not adjusted to, in units of what sights state: of each
/// frame the median, so that single points do not count, and single frames do. `None` if half of the points do not
/// connect the frames.
fn prediction(tracks: &[Track], fit: &Fit) -> Option<f64> {
    let half = |track: &Track, which: bool| (track.cell.0 + track.cell.1).rem_euclid(2) == i64::from(which);
    let mut squares = 0.0;
    for which in [false, true] {
        let seen: Vec<Track> = tracks.iter().filter(|track| half(track, which)).cloned().collect();
        let unseen: Vec<Track> = tracks.iter().filter(|track| half(track, !which)).cloned().collect();
        let cameras = adjust_again(&seen, fit).ok()?;
        let lengths = residuals_of_unseen(&unseen, &cameras, fit.prior);
        let mut of_frames = vec![Vec::new(); cameras.frames.len()];
        for (track, lengths) in unseen.iter().zip(&lengths) {
            track.sights.iter().zip(lengths).for_each(|(sight, length)| of_frames[sight.frame].push(*length));
        }
        for lengths in &mut of_frames {
            squares += median(lengths)?.powi(2) / cameras.frames.len() as f64;
        }
    }
    Some(0.5 * squares)
}
