//! Dark level: what the sensor gives without light.

use serde::{Deserialize, Serialize};

use super::PhotometryError;
use super::average::{Sums, check_alike};
use super::outliers::{Outlier, OutlierKind, departing};
use epirig_core::frame::Frame;
use epirig_core::grid::Grid;

/// If more than this share of the samples is 0, the sensor may cut off the values below, and the mean is too
/// high. With Gaussian noise and this share, 1.28 standard deviations from the end, the mean errs by at most
/// 5 % of the noise, and by less where the noise is about a DN, because values rounded to 0 are not cut off.
/// Beyond this share the error soon is as large as the noise.
const MOST_ZEROS: f64 = 0.1;
/// A defective pixel departs from its neighbours by more than this, in DN: less is lost in the rounding ...
const LEAST_DEPARTURE_DN: f64 = 1.0;
/// ... and by more than this over the root of the number of frames: six times half a DN, which noise may have
/// where rounding removes it from the robust standard deviation.
const ROUNDED_DEPARTURE_DN: f64 = 3.0;

/// The dark level that is subtracted.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum DarkModel {
    /// The same level everywhere, in DN: the pixels differ by less than the noise of their means, which a map
    /// would add to every frame as a fixed pattern.
    LevelDn(f64),
    /// A map of the means.
    Map,
    /// Nothing: this share of the samples (0 to 1) is 0, so the level may have been cut off and its mean is
    /// wrong.
    CutOff(f64),
}

/// The result of dark frames.
#[derive(Debug, Clone, PartialEq)]
pub struct DarkFrame {
    /// What is recorded.
    pub record: DarkRecord,
    /// Mean of every pixel, in DN.
    pub mean: Grid<f32>,
    /// Pixels too bright or too dark, by row and column.
    pub outliers: Vec<Outlier>,
}

/// The part of the dark frames' result that is recorded.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DarkRecord {
    /// The dark level that is subtracted.
    pub model: DarkModel,
    /// Mean of the pixels that are no outliers, in DN.
    pub level_dn: f64,
    /// Standard deviation of a sample from frame to frame (read noise, rounding), in DN, of pixels that are
    /// no outliers; `None` for a single frame.
    pub noise_dn: Option<f64>,
    /// Standard deviation of the means over the pixels that noise does not explain, in DN: the fixed pattern.
    /// `None` for a single frame.
    pub pattern_dn: Option<f64>,
    /// Number of frames.
    pub frames: usize,
}

/// Level, noise, fixed pattern and defective pixels from dark frames; they are summed up one after the other.
///
/// A pixel is defective if its mean departs from the median of its neighbours by more than six robust
/// standard deviations (of all pixels' departures) and by more than 1 DN (3 DN of a single frame).
///
/// # Errors
/// [`PhotometryError::NoFrames`] and [`PhotometryError::Shapes`].
pub fn dark_frame(frames: &[Frame]) -> Result<DarkFrame, PhotometryError> {
    check_alike("dark", frames)?;
    let (rows, columns) = (frames[0].rows(), frames[0].columns());
    let sums = Sums::of(rows, columns, frames.iter());
    let mean = sums.mean();
    let least_dn = LEAST_DEPARTURE_DN.max(ROUNDED_DEPARTURE_DN / (frames.len() as f64).sqrt());
    let outliers = departing(&mean, least_dn, false, [OutlierKind::Hot, OutlierKind::Cold]);
    let places: Vec<(usize, usize)> = outliers.iter().map(|outlier| (outlier.x, outlier.y)).collect();
    let count = (rows * columns - places.len()).max(1) as f64;
    let over_good = |value: &dyn Fn(f32) -> f64| {
        let all: f64 = mean.values().iter().map(|&mean| value(mean)).sum();
        (all - places.iter().map(|&(x, y)| value(mean.at(x, y))).sum::<f64>()) / count
    };
    let level_dn = over_good(&|mean| mean.into());
    let variance = over_good(&|mean| (f64::from(mean) - level_dn).powi(2));
    let noise_variance = sums.variance_dn2(&places);
    let of_mean = noise_variance.map(|noise| noise / frames.len() as f64);
    let pattern_variance = of_mean.map(|noise| (variance - noise).max(0.0));
    let samples = frames.iter().map(|frame| frame.samples().len()).sum::<usize>().max(1);
    let zeros =
        frames.iter().map(|frame| frame.samples().len() - frame.samples().count_at_least(1)).sum::<usize>();
    let zeros = zeros as f64 / samples as f64;
    let model = match (pattern_variance, of_mean) {
        _ if zeros > MOST_ZEROS => DarkModel::CutOff(zeros),
        (Some(pattern), Some(noise)) if pattern > noise => DarkModel::Map,
        _ => DarkModel::LevelDn(level_dn),
    };
    let record = DarkRecord {
        model,
        level_dn,
        noise_dn: noise_variance.map(f64::sqrt),
        pattern_dn: pattern_variance.map(f64::sqrt),
        frames: frames.len(),
    };
    Ok(DarkFrame { record, mean, outliers })
}
