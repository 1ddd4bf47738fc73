//! How much of the cameras' motion the tracks can tell: tested on points that the cameras were not adjusted to.
//!
//! Residuals of one track are not independent, so an F-test finds rotations everywhere. Half of the points adjust
//! the cameras, and the other half judges them.

use super::TextureMotionError;
use super::bundle::{adjust, adjust_again, residuals_of_unseen};
use super::cameras::Cameras;
use super::fit::Fit;
use super::model::MotionModel;
use super::track::Track;
use epirig_core::statistics::median;

/// A model with more unknowns has to lower the mean square of the unseen residuals to this share. Where the camera does
/// not turn, it has been seen from 0.95 to 1.04; where it turns by as much as points are known to, it is
/// below 0.5. What lowers it by less moves rows by less than a third of that.
const IMPROVES: f64 = 0.9;

/// The model that was chosen.
pub(super) struct Chosen {
    pub(super) fit: Fit,
    /// Whether every model could be tested: else frames have too few points.
    pub(super) is_tested: bool,
}

/// Adjusts the cameras with as many unknowns as improve the prediction of unseen points.
pub(super) fn choose(
    tracks: &[Track],
    start: &Cameras,
    may: MotionModel,
) -> Result<Chosen, TextureMotionError> {
    let mut chosen = Chosen {
        fit: adjust(tracks, &start.straight(), MotionModel { pan: may.pan, ..MotionModel::default() })?,
        is_tested: true,
    };
    let mut unseen = if (MotionModel { pan: false, ..may }) == MotionModel::default() {
        Some(0.0)
    } else {
        prediction(tracks, &chosen.fit)
    };
    // Offsets are tried where rotations help: either moves the rows of a frame.
    // Rotations hide a distortion, so that is tried without and with them.
    let more: [fn(MotionModel) -> MotionModel; 4] = [
        |best| MotionModel { k1: true, ..best },
        |best| MotionModel { rotations: true, ..best },
        |best| MotionModel { k1: true, ..best },
        |best| MotionModel { offsets: best.rotations, ..best },
    ];
    let mut tried = vec![chosen.fit.free];
    for more in more {
        let (best, model) = (chosen.fit.free, more(chosen.fit.free).of_these(may));
        if tried.contains(&model) {
            continue;
        }
        tried.push(model);
        // Large rotations are found from those in smaller pictures.
        let begin = if model.rotations == best.rotations {
            chosen.fit.cameras.clone()
        } else {
            Cameras { k1: chosen.fit.cameras.k1, ..start.clone() }
        };
        // Tracks that do not determine a model do not test it either; what they determine stands.
        let fit = adjust(tracks, &begin, model).ok();
        let after = fit.as_ref().and_then(|fit| prediction(tracks, fit));
        match (unseen, fit.zip(after)) {
            (Some(before), Some((fit, after))) if after < IMPROVES * before => {
                (chosen.fit, unseen) = (fit, Some(after))
            }
            (Some(_), Some(_)) => {}
            _ => chosen.is_tested = false,
        }
    }
    Ok(chosen)
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
        let lengths = residuals_of_unseen(&unseen, &cameras);
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
