//! A live map is made of the frames so far.

use std::collections::BTreeMap;

use tracing::debug;

use super::binned::Binned;
use super::map::LiveMap;
use epirig_core::progress::Silent;
use epirig_core::statistics::upper_median;
use epirig_core::tau::Tau;
use epirig_core::volume::Volume;
use epirig_matcher::{DisparityMaps, MatchOptions, Matcher, ReferenceFrame, Validity};

/// The windows of the fit grow until sigma is below this, in px of binned frames over the baseline so far.
///
/// So early maps are smooth, and later ones sharpen. On the simulated tile 0.005 px, as for results, washes
/// out hollows of four pixels, and windows that never grow leave early maps twice the error.
const WANTED_SIGMA_PX: f64 = 0.03;

/// Fewer frames make no map. With three, the noise of a pixel is known from one residual only, and a twelfth
/// of the pixels without texture got an answer; with five, two thousandths.
const FEWEST_FRAMES: usize = 5;
/// A map with a smaller share of answers shows noise only.
const SMALLEST_SHARE: f64 = 0.01;

/// The map that `frames`, by their index, tell; `plan` has tau of all frames that the scan is to have. `None`
/// if they tell nothing yet.
pub(super) fn make(plan: &Tau, frames: &BTreeMap<usize, Binned>) -> Option<LiveMap> {
    // The map refers to the first frame: with another one it would shift when that comes.
    let first = frames.get(&0).filter(|_| frames.len() >= FEWEST_FRAMES)?;
    let tau: Vec<f64> = frames.keys().filter_map(|&index| plan.values().get(index).copied()).collect();
    let baseline_share = *tau.last()?;
    let maps = matched(first, &tau, frames)?;
    let answered = maps.share(Validity::Found);
    if answered < SMALLEST_SHARE {
        debug!(answered, frames = frames.len(), "no live map");
        return None;
    }
    let factor = first.bin as f64 / baseline_share;
    let whole = |value: f32| (f64::from(value) * factor) as f32;
    let (disparity, sigma) = (maps.disparity.map(whole), maps.sigma.map(whole));
    let mut known: Vec<f32> = sigma.values().iter().copied().filter(|value| !value.is_nan()).collect();
    let median_sigma_px = f64::from(upper_median(&mut known)?);
    let (frames, planned) = (frames.len(), plan.frames());
    debug!(frames, planned, median_sigma_px, "live map");
    Some(LiveMap { frames, planned, bin: first.bin, disparity, sigma, median_sigma_px })
}

/// Maps in px of binned frames over the baseline of the frames that are there.
fn matched(first: &Binned, tau: &[f64], frames: &BTreeMap<usize, Binned>) -> Option<DisparityMaps> {
    let tau = Tau::from_positions(tau).ok()?;
    let mut volume = Volume::fine(first.counts.rows(), first.counts.columns(), first.bit_depth, tau);
    for (t, frame) in frames.values().enumerate() {
        if let Err(error) = volume.insert_counts(t, &frame.counts) {
            debug!(%error, "no live map");
            return None;
        }
    }
    let options = MatchOptions {
        reference: ReferenceFrame::First,
        wanted_sigma_px: Some(WANTED_SIGMA_PX),
        ..MatchOptions::default()
    };
    let maps = Matcher::new(volume, options).and_then(|matcher| matcher.matched(&Silent));
    maps.inspect_err(|error| debug!(%error, frames = frames.len(), "no live map")).ok()
}
