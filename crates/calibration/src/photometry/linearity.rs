//! Linearity of the sensor: whether twice the light gives twice the number.

use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::CellGrid;
use epirig_core::frame::Frame;
use epirig_core::image::reduced_frame;
use epirig_core::statistics::upper_median;

/// Cells from this share of full scale on do not count: noise begins to be cut off there. Standard EMVA 1288
/// judges linearity up to the same share.
const MOST_LEVEL: f64 = 0.95;
/// Exposures that a line with an offset needs to be contradicted by anything.
const LEAST_EXPOSURES: usize = 3;

/// The mean levels of the cells of a flat frame, or of an average of some, at one exposure.
#[derive(Debug, Clone, PartialEq)]
pub struct ExposureLevel {
    /// Exposure in any unit, not negative.
    pub relative_exposure: f64,
    /// Means of the cells, in DN, in the same order for all exposures; see [`CellGrid`](super::CellGrid).
    pub cells_dn: Vec<f64>,
}

impl ExposureLevel {
    /// The levels of a flat frame.
    pub fn of(relative_exposure: f64, frame: &Frame) -> Self {
        let grid = CellGrid::of(&reduced_frame(frame, 1));
        Self { relative_exposure, cells_dn: grid.cells().iter().map(|cell| cell.mean).collect() }
    }
}

/// The linearity of the sensor's response.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Linearity {
    /// Level at exposure zero, in DN, the median over the cells: the dark level, if the exposures are right.
    pub offset_dn: f64,
    /// Largest departure of a cell from its own straight line, in % of full scale.
    pub largest_departure_percent: f64,
    /// The level at which it is, in DN.
    pub at_dn: f64,
    /// Root mean square of all departures over their degrees of freedom, in % of full scale.
    pub departure_rms_percent: f64,
    /// Means that were left out, because they are near full scale.
    pub left_out: usize,
    /// The limit of the largest departure, in % of full scale.
    pub limit_percent: f64,
}

impl Linearity {
    /// The usual limit, in % of full scale. A response that bends like a parabola and departs from its best
    /// line by e leaves up to 0.9 e of a vignetting of 30 %, if the flat frames are half as bright as the
    /// object: 6 e (0.5 - 0.35). A flat field is good to 0.3 %.
    pub const USUAL_LIMIT_PERCENT: f64 = 0.33;

    /// Whether the response is a straight line within the limit.
    pub fn is_linear(&self) -> bool {
        self.largest_departure_percent <= self.limit_percent
    }
}

/// Why linearity cannot be measured.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum LinearityError {
    /// Too few exposures at which a cell is not saturated.
    #[error(
        "no cell has {least} different exposures below {percent} % of full scale, so a bend cannot be seen; take flat frames at five exposures \
         from a tenth to nine tenths of full scale"
    )]
    TooFewExposures {
        /// Exposures that are needed.
        least: usize,
        /// Share of full scale from which on levels do not count, in %.
        percent: f64,
    },
    /// Exposures with different numbers of cells.
    #[error(
        "exposure {index} has {found} cells, the first has {expected}; take all with the same frame size"
    )]
    Cells {
        /// Index of the exposure, from 0.
        index: usize,
        /// Its number of cells.
        found: usize,
        /// Number of cells of the first.
        expected: usize,
    },
    /// An exposure or a level that is no number.
    #[error(
        "exposure {index} holds {value}; exposures and levels must be finite, and exposures not negative"
    )]
    NoNumber {
        /// Index of the exposure, from 0.
        index: usize,
        /// The value.
        value: f64,
    },
}

/// The straight line through the levels of each cell, and the largest departure from it. Cells have lines of
/// their own, because vignetting gives each its own slope.
///
/// # Errors
/// [`LinearityError`] if there are fewer than three exposures that count, or they do not fit together.
///
/// ```
/// use epirig_calibration::photometry::{ExposureLevel, Linearity, linearity};
///
/// let level = |exposure: f64| ExposureLevel { relative_exposure: exposure, cells_dn: vec![2.0 + 50.0 * exposure; 4] };
/// let series = [level(1.0), level(2.0), level(4.0)];
/// let found = linearity(&series, 255, Linearity::USUAL_LIMIT_PERCENT)?;
/// assert!(found.is_linear() && (found.offset_dn - 2.0).abs() < 1e-9);
/// # Ok::<(), epirig_calibration::photometry::LinearityError>(())
/// ```
pub fn linearity(
    series: &[ExposureLevel],
    full_scale: u16,
    limit_percent: f64,
) -> Result<Linearity, LinearityError> {
    check(series)?;
    let full_scale_dn = f64::from(full_scale);
    let mut offsets = Vec::new();
    let (mut largest, mut at_dn, mut squares, mut degrees, mut left_out) = (0.0_f64, 0.0, 0.0, 0, 0);
    for cell in 0..series.first().map_or(0, |first| first.cells_dn.len()) {
        let all = series.iter().map(|level| (level.relative_exposure, level.cells_dn[cell]));
        let points: Vec<(f64, f64)> =
            all.filter(|(_, level_dn)| *level_dn < MOST_LEVEL * full_scale_dn).collect();
        left_out += series.len() - points.len();
        let Some((offset_dn, slope)) = line(&points) else { continue };
        offsets.push(offset_dn);
        degrees += points.len() - 2;
        for (exposure, level_dn) in points {
            let departure = level_dn - offset_dn - slope * exposure;
            squares += departure * departure;
            if departure.abs() > largest {
                (largest, at_dn) = (departure.abs(), level_dn);
            }
        }
    }
    let too_few = LinearityError::TooFewExposures { least: LEAST_EXPOSURES, percent: 100.0 * MOST_LEVEL };
    let offset_dn = upper_median(&mut offsets).ok_or(too_few)?;
    Ok(Linearity {
        offset_dn,
        largest_departure_percent: 100.0 * largest / full_scale_dn,
        at_dn,
        departure_rms_percent: 100.0 * (squares / f64::from(degrees.max(1) as u32)).sqrt() / full_scale_dn,
        left_out,
        limit_percent,
    })
}

fn check(series: &[ExposureLevel]) -> Result<(), LinearityError> {
    let expected = series.first().map_or(0, |first| first.cells_dn.len());
    for (index, level) in series.iter().enumerate() {
        let found = level.cells_dn.len();
        if found != expected {
            return Err(LinearityError::Cells { index, found, expected });
        }
        let bad = |value: &&f64| !value.is_finite();
        let negative = Some(&level.relative_exposure).filter(|&&exposure| exposure < 0.0);
        if let Some(&value) =
            negative.or_else(|| [&level.relative_exposure].into_iter().chain(&level.cells_dn).find(bad))
        {
            return Err(LinearityError::NoNumber { index, value });
        }
    }
    Ok(())
}

/// Offset and slope of the best straight line; `None` with fewer than three different exposures.
fn line(points: &[(f64, f64)]) -> Option<(f64, f64)> {
    let mut exposures: Vec<f64> = points.iter().map(|point| point.0).collect();
    exposures.sort_unstable_by(f64::total_cmp);
    exposures.dedup();
    if exposures.len() < LEAST_EXPOSURES {
        return None;
    }
    let count = points.len() as f64;
    let mean_x = points.iter().map(|point| point.0).sum::<f64>() / count;
    let mean_y = points.iter().map(|point| point.1).sum::<f64>() / count;
    let across: f64 = points.iter().map(|(x, y)| (x - mean_x) * (y - mean_y)).sum();
    let along: f64 = points.iter().map(|(x, _)| (x - mean_x).powi(2)).sum();
    let slope = across / along;
    Some((mean_y - slope * mean_x, slope))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn series(exposures: &[f64], response: impl Fn(f64) -> f64) -> Vec<ExposureLevel> {
        let level = |&exposure: &f64| ExposureLevel {
            relative_exposure: exposure,
            cells_dn: [1.0, 0.8].map(|gain| response(gain * exposure)).to_vec(),
        };
        exposures.iter().map(level).collect()
    }

    #[test]
    fn a_bend_is_found_as_large_as_it_is() {
        // Levels 20, 52, 80 and 108 at exposures 1 to 4: the line is 7.4... By hand: mean 65, slope (1.5 *
        // 88 + 0.5 * 28) / 5 = 29.2, offset -8; residuals -1.2, 1.6, 0.4, -0.8.
        let levels = [20.0, 52.0, 80.0, 108.0];
        let series: Vec<ExposureLevel> = (1..=4)
            .map(|step| ExposureLevel {
                relative_exposure: f64::from(step),
                cells_dn: vec![levels[step as usize - 1]],
            })
            .collect();
        let found = linearity(&series, 200, Linearity::USUAL_LIMIT_PERCENT).unwrap();
        assert!((found.offset_dn + 8.0).abs() < 1e-12, "{found:?}");
        assert!((found.largest_departure_percent - 0.8).abs() < 1e-12 && found.at_dn == 52.0, "{found:?}");
        // Squares 1.44 + 2.56 + 0.16 + 0.64 = 4.8 over 2 degrees.
        assert!((found.departure_rms_percent - 0.5 * 2.4_f64.sqrt()).abs() < 1e-12, "{found:?}");
        assert!(!found.is_linear());
    }

    #[test]
    fn saturated_levels_do_not_bend_the_line() {
        let clipped = series(&[1.0, 2.0, 3.0, 4.0, 5.0], |light| (3.0 + 60.0 * light).min(255.0));
        let found = linearity(&clipped, 255, 0.5).unwrap();
        assert!(found.is_linear() && found.largest_departure_percent < 1e-9, "{found:?}");
        // 243 DN and 255 DN twice, of the brighter cell; 243 DN of the darker one at 5.
        assert_eq!(found.left_out, 3);
        let gamma = series(&[1.0, 2.0, 3.0, 4.0], |light| 255.0 * (light / 5.0).powf(0.8));
        assert!(!linearity(&gamma, 255, 0.5).unwrap().is_linear());
    }

    #[test]
    fn what_cannot_be_judged_is_refused() {
        let two = series(&[1.0, 2.0, 2.0], |light| 10.0 * light);
        assert!(matches!(linearity(&two, 255, 0.5), Err(LinearityError::TooFewExposures { .. })));
        assert!(matches!(linearity(&[], 255, 0.5), Err(LinearityError::TooFewExposures { .. })));
        let mut unlike = series(&[1.0, 2.0, 3.0], |light| 10.0 * light);
        unlike[1].cells_dn.pop();
        assert!(matches!(linearity(&unlike, 255, 0.5), Err(LinearityError::Cells { index: 1, .. })));
        let negative = series(&[1.0, -2.0, 3.0], |light| 10.0 * light);
        assert!(matches!(linearity(&negative, 255, 0.5), Err(LinearityError::NoNumber { index: 1, .. })));
    }
}
