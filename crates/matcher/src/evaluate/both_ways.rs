//! Two matches compared: from the first frame, and from the last.

use std::sync::Arc;

use serde::Serialize;

use super::share;
use crate::one_surface::OneSurface;
use crate::{Blocks, DisparityMaps, MatchError, MatchOptions, Matcher, ReferenceFrame, RowSource};
use epirig_core::grid::Grid;
use epirig_core::progress::Progress;
use epirig_core::statistics::quantile_of_sorted;

/// Agreement of the answers of the first frame with those of the last.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
#[non_exhaustive]
pub struct BothWaysReport {
    /// Share of the first frame's pixels that are answered with a point inside the last frame.
    pub carried: f64,
    /// Share of these where the last frame is answered, too. The shares below are of these.
    pub compared: f64,
    /// Share that agrees within 3 sigma of both.
    pub within_3_sigma: f64,
    /// Share that agrees within 0.1 px.
    pub within_0_1_px: f64,
    /// Share that agrees within 1 px.
    pub within_1_px: f64,
    /// Median of |difference|, in px over the whole baseline.
    pub median_px: f64,
}

/// Matches `source` with the first and with the last frame as reference (whatever `options` say), carries
/// each answered pixel of the first frame along its line to the last, and compares the disparities there.
///
/// Both matches use the same frames, so their errors of noise are nearly the same, and 3 sigma is a wide
/// limit. Where they differ by more, one of them is wrong, or the point is occluded in the other.
///
/// # Errors
/// [`MatchError`] if the frames cannot be matched.
pub fn both_ways(
    source: &(impl RowSource + Clone + 'static),
    options: &MatchOptions,
    progress: &dyn Progress,
) -> Result<BothWaysReport, MatchError> {
    let matched = |reference| {
        let blocks = Blocks::new(&source.shape(), MatchOptions { reference, ..options.clone() })?;
        Matcher::of_source(Arc::new(source.clone()), blocks, progress)?.matched(progress)
    };
    Ok(compared(&matched(ReferenceFrame::First)?, &matched(ReferenceFrame::Last)?))
}

fn compared(first: &DisparityMaps, last: &DisparityMaps) -> BothWaysReport {
    let (rows, columns) = (first.disparity.rows(), first.disparity.columns());
    let mut carried = 0;
    let mut differences = Vec::new();
    let mut within_3_sigma = 0;
    for y in 0..rows {
        for x in 0..columns {
            let disparity = first.disparity.at(x, y);
            let place = x as f64 + f64::from(disparity);
            // An unanswered pixel is carried nowhere: NaN lies in no interval.
            if !(0.0..=(columns - 1) as f64).contains(&place) {
                continue;
            }
            carried += 1;
            let Some((other, sigma)) = seen_at(last, place, y) else { continue };
            let difference = f64::from((disparity - other).abs());
            within_3_sigma += usize::from(difference <= 3.0 * f64::from(first.sigma.at(x, y).hypot(sigma)));
            differences.push(difference);
        }
    }
    differences.sort_unstable_by(f64::total_cmp);
    let within = |limit: f64| share(differences.partition_point(|&value| value <= limit), differences.len());
    BothWaysReport {
        carried: share(carried, rows * columns),
        compared: share(differences.len(), carried),
        within_3_sigma: share(within_3_sigma, differences.len()),
        within_0_1_px: within(0.1),
        within_1_px: within(1.0),
        median_px: quantile_of_sorted(&differences, 0.5).unwrap_or(0.0),
    }
}

/// Disparity and sigma of `maps` at column `place` of row `y`, which may lie between pixels; `None` if the
/// nearest pixel has no answer.
fn seen_at(maps: &DisparityMaps, place: f64, y: usize) -> Option<(f32, f32)> {
    let nearest = place.round() as usize;
    let left = place.floor() as usize;
    let right = (left + 1).min(maps.disparity.columns() - 1);
    let own = maps.disparity.at(nearest, y);
    if own.is_nan() {
        return None;
    }
    let pair = |plane: &Grid<f32>| [plane.at(left, y), plane.at(right, y)];
    let [before, after] = pair(&maps.disparity);
    let share = (place - left as f64) as f32;
    // Between two surfaces nothing is interpolated; nor where a neighbour has no answer.
    let one_surface = OneSurface::ROUGH.holds(before - after, 0.0);
    Some((if one_surface { before + share * (after - before) } else { own }, maps.sigma.at(nearest, y)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{DisparityRange, OrderingUsed, Validity};
    use epirig_core::progress::Silent;
    use epirig_simulator::{Simulator, SimulatorConfig};

    fn maps(disparity: Vec<f32>, reference: usize) -> DisparityMaps {
        let columns = disparity.len();
        DisparityMaps {
            disparity: Grid::from_values(1, columns, disparity).unwrap(),
            sigma: Grid::filled(1, columns, 0.02),
            cost: Grid::filled(1, columns, 0.0),
            confidence: Grid::filled(1, columns, 1.0),
            validity: Grid::filled(1, columns, Validity::Found),
            reference,
            range: DisparityRange { minimum_px: 0.0, maximum_px: 4.0 },
            range_found: false,
            ordering: OrderingUsed::Off,
            locking: None,
            light: None,
        }
    }

    #[test]
    fn pixels_are_compared_where_they_arrive() {
        let nan = f32::NAN;
        // They arrive at 1.5, nowhere, 3, 4.5, 7 (outside) and 6.
        let first = maps(vec![1.5, nan, 1.0, 1.5, 3.0, 1.0, nan], 0);
        // 1.5 between 1.4 and 1.6 is 1.5; at 3 nothing is known; 4.5 lies between two surfaces, and 5 is
        // taken; at 6 lies another.
        let last = maps(vec![nan, 1.4, 1.6, nan, 4.0, 1.45, 3.0], 6);
        let report = compared(&first, &last);
        assert!((report.carried - 4.0 / 7.0).abs() < 1e-12 && (report.compared - 3.0 / 4.0).abs() < 1e-12);
        // Differences 0, 0.05 and 2; three sigma are 0.085.
        for value in [report.within_3_sigma, report.within_0_1_px, report.within_1_px] {
            assert!((value - 2.0 / 3.0).abs() < 1e-12, "{report:?}");
        }
        assert!((report.median_px - 0.05).abs() < 1e-6, "{report:?}");
    }

    #[test]
    fn a_plane_is_the_same_from_both_ends() {
        let mut config = SimulatorConfig::textured_plane(128, 48, 17);
        config.sensor.read_noise_dn = 1.0;
        let volume = Simulator::new(config).unwrap().render_volume(&Silent).unwrap();
        let report = both_ways(&volume, &MatchOptions::default(), &Silent).unwrap();
        // 8 of 128 columns leave the image either way. Both matches see the same noise; nine in ten is what
        // 0.1 px, ten sigma here, cannot miss.
        assert!(report.carried > 0.9 && report.compared > 0.97, "{report:?}");
        assert!(report.within_3_sigma > 0.97 && report.within_0_1_px > 0.99, "{report:?}");
        assert!(report.within_1_px >= report.within_0_1_px && report.median_px < 0.02, "{report:?}");
    }
}
