//! The choice of distortion terms by cross-validation over the views.

use super::calibrate::{Solution, Used, calibrate, check, solve};
use super::calibration::{HeldOut, LensCalibration};
use super::error::LensError;
use super::point::{PlanarPoint, View, squared_distance};
use super::pose::BoardPose;
use super::problem::ViewsProblem;
use super::terms::Terms;
use crate::lens::model::Lens;
use epirig_core::least_squares::{Loss, minimise};
use epirig_core::statistics::mean;

/// Views needed, so that three are left when one is held out.
const VIEWS: usize = 4;
/// Groups into which the views are dealt; each is held out once.
const FOLDS: usize = 10;

/// The lens with the simplest terms that predict held-out views no worse than the best terms do; see
/// [`calibrate`].
///
/// K-fold cross-validation over the views. In a held-out view, the board's pose is fitted to every other
/// point with the lens fixed, and judged by the other points; then the halves change places. Terms are worse
/// if their squared error, less that of the best terms in the same views, is above its standard error. Terms
/// with which no lens is found are not in the table. Points that the fit with all terms rejects take no part.
///
/// # Errors
/// As of [`calibrate`]; four views are needed.
pub fn choose_terms(views: &[View], rows: usize, columns: usize) -> Result<LensCalibration, LensError> {
    check(views, VIEWS)?;
    let full = calibrate(views, rows, columns, Terms::All5)?;
    let used: Used =
        full.residuals.iter().map(|view| view.iter().map(|residual| !residual.rejected).collect()).collect();
    let full = Solution { lens: full.estimate.lens, poses: full.poses };
    let mut errors = Vec::with_capacity(Terms::ALL.len());
    for terms in Terms::ALL {
        let judged = solve(views, &used, terms, full.clone(), Loss::Squares)
            .and_then(|(solution, _)| held_out(views, &used, terms, &solution));
        match judged {
            Ok(judged) => errors.push((terms, judged)),
            // Terms with which no lens is found are not chosen.
            Err(LensError::Search(_)) => {}
            Err(other) => return Err(other),
        }
    }
    let told = |view: &usize| errors.iter().all(|(_, errors)| errors[*view].is_finite());
    let judges: Vec<usize> = (0..views.len()).filter(told).collect();
    if judges.len() < VIEWS {
        return Err(LensError::TooFewViews { views: judges.len(), needed: VIEWS });
    }
    for (_, errors) in &mut errors {
        *errors = judges.iter().map(|&view| errors[view]).collect();
    }
    let table = compare(&errors);
    let simplest = table.iter().find(|row| row.excess_px2 <= row.excess_error_px2);
    // The best set is at its own error, so there is one.
    let terms = simplest.map_or(Terms::All5, |row| row.terms);
    Ok(LensCalibration { cross_validation: table, ..calibrate(views, rows, columns, terms)? })
}

/// Mean squared error of each view, in px2, with lenses to which it has not contributed; NaN if unknown.
fn held_out(views: &[View], used: &Used, terms: Terms, all: &Solution) -> Result<Vec<f64>, LensError> {
    let folds = FOLDS.min(views.len());
    let mut errors = vec![f64::NAN; views.len()];
    for fold in 0..folds {
        let kept: Vec<usize> = (0..views.len()).filter(|view| view % folds != fold).collect();
        let kept_views: Vec<View> = kept.iter().map(|&view| views[view].clone()).collect();
        let kept_used: Used = kept.iter().map(|&view| used[view].clone()).collect();
        let poses = kept.iter().map(|&view| all.poses[view]).collect();
        let from = Solution { lens: all.lens, poses };
        let lens = solve(&kept_views, &kept_used, terms, from, Loss::Squares)?.0.lens;
        for view in (fold..views.len()).step_by(folds) {
            let points: Vec<PlanarPoint> = views[view]
                .iter()
                .zip(&used[view])
                .filter(|(_, used)| **used)
                .map(|(point, _)| *point)
                .collect();
            errors[view] = crossed(&lens, &points, all.poses[view]).unwrap_or(f64::NAN);
        }
    }
    Ok(errors)
}

/// Mean squared distance, in px2, between points and their prediction by a pose from the other half of the
/// points; `None` if half of them leave the pose open.
fn crossed(lens: &Lens, points: &[PlanarPoint], start: BoardPose) -> Option<f64> {
    let mut sum = 0.0;
    for half in 0..2 {
        let fitted = points.iter().skip(half).step_by(2).copied().collect();
        let problem = ViewsProblem::new(*lens, 0..0, vec![fitted]);
        let found = minimise(&problem, problem.parameters_of(lens, &[start]), Loss::Squares).ok()?;
        let pose = problem.poses(&found.parameters)[0];
        sum += points
            .iter()
            .skip(1 - half)
            .step_by(2)
            .map(|point| squared_distance(lens, &pose, point))
            .sum::<f64>();
    }
    Some(sum / points.len() as f64)
}

fn compare(errors: &[(Terms, Vec<f64>)]) -> Vec<HeldOut> {
    let Some((_, best)) = errors.iter().min_by(|(_, a), (_, b)| mean(a).total_cmp(&mean(b))) else {
        return Vec::new();
    };
    errors
        .iter()
        .map(|(terms, errors)| {
            let excess: Vec<f64> = errors.iter().zip(best).map(|(error, best)| error - best).collect();
            let excess_px2 = mean(&excess);
            let squares = excess.iter().map(|excess| (excess - excess_px2).powi(2)).sum::<f64>();
            let count = excess.len() as f64;
            let excess_error_px2 = (squares / (count - 1.0) / count).sqrt();
            HeldOut { terms: *terms, rms_px: mean(errors).sqrt(), excess_px2, excess_error_px2 }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_is_what_hand_computation_gives() {
        let errors = [(Terms::None, vec![4.0, 6.0, 8.0, 10.0]), (Terms::K1, vec![1.0, 1.0, 1.0, 1.0])];
        let table = compare(&errors);
        // Excess 3, 5, 7, 9: mean 6, variance 20/3, standard error sqrt(20/3/4).
        assert_eq!((table[0].excess_px2, table[0].rms_px), (6.0, 7.0_f64.sqrt()));
        assert!((table[0].excess_error_px2 - (20.0_f64 / 12.0).sqrt()).abs() < 1e-12);
        assert_eq!((table[1].excess_px2, table[1].excess_error_px2, table[1].rms_px), (0.0, 0.0, 1.0));
    }
}
