//! A check without truth: frames that were left out of the match are predicted from the disparity.
//!
//! Each pixel of the disparity map is carried to the left-out frame along its line; nearer surfaces occlude
//! farther ones. The predicted intensity is the mean of the nearest frames before and after, sampled along
//! the line. The error is reported beside that of repeating the nearest frame, which uses no disparity.

use std::sync::Arc;

use rayon::prelude::*;
use serde::Serialize;
use thiserror::Error;

use crate::cost::interpolation::{Interpolation, SampledEpi};
use crate::some_frames::SomeFrames;
use crate::{Blocks, DisparityMaps, MatchError, MatchOptions, Matcher, ReferenceFrame, RowSource};
use epirig_core::fault::{Blame, Fault};
use epirig_core::progress::Progress;
use epirig_core::tau::Tau;
use epirig_core::volume::Volume;

/// Why frames cannot be left out.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum LeaveOutError {
    /// Too few frames would be left, or none left out.
    #[error(
        "leaving out every {every}th of {frames} frames leaves nothing to compare; give a number from 2 to {} and at \
         least 5 frames", frames.saturating_sub(1)
    )]
    Every {
        /// Which frames were to be left out.
        every: usize,
        /// Frames of the sequence.
        frames: usize,
    },
    /// The other frames cannot be matched.
    #[error(transparent)]
    Match(#[from] MatchError),
}

impl Fault for LeaveOutError {
    fn blame(&self) -> Blame {
        match self {
            Self::Every { .. } => Blame::Request,
            Self::Match(error) => error.blame(),
        }
    }
}

/// Errors of the predicted left-out frames, over all of them.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[non_exhaustive]
pub struct LeaveOutReport {
    /// Indices of the frames that were left out.
    pub frames: Vec<usize>,
    /// Pixels of those frames.
    pub pixels: usize,
    /// Share of them that a disparity reaches, so that they are predicted.
    pub predicted: f64,
    /// Mean |error| of the prediction over the predicted pixels, in DN.
    pub prediction_error_dn: f64,
    /// Mean |error| of repeating the nearest frame over the same pixels, in DN.
    pub repetition_error_dn: f64,
    /// Share of all pixels that are predicted with at most half of the error of repetition, pixel by pixel.
    pub halved: f64,
}

/// Matches `source` without every `every`th frame and predicts those. The first, the last and the reference
/// frame stay.
///
/// # Errors
/// [`LeaveOutError`] if too few frames are left or they cannot be matched.
pub fn leave_out(
    source: &(impl RowSource + Clone + 'static),
    every: usize,
    options: &MatchOptions,
    progress: &dyn Progress,
) -> Result<(LeaveOutReport, DisparityMaps), LeaveOutError> {
    let shape = source.shape();
    let frames = shape.tau.frames();
    let reference = options.reference_index(&shape.tau)?;
    let left: Vec<usize> =
        (1..frames - 1).filter(|&t| every >= 2 && t % every == every - 1 && t != reference).collect();
    let kept: Vec<usize> = (0..frames).filter(|t| !left.contains(t)).collect();
    if left.is_empty() || kept.len() < 3 {
        return Err(LeaveOutError::Every { every, frames });
    }
    let positions: Vec<f64> = kept.iter().map(|&t| shape.tau.values()[t]).collect();
    let tau = Tau::from_positions(&positions).map_err(|_| LeaveOutError::Every { every, frames })?;
    let index = kept.iter().position(|&t| t == reference).unwrap_or(0);
    let options = MatchOptions { reference: ReferenceFrame::Index(index), ..options.clone() };
    let shown = SomeFrames { of: source.clone(), frames: kept.clone(), tau };
    let blocks = Blocks::new(&shown.shape(), options)?;
    let maps = Matcher::of_source(Arc::new(shown), blocks, progress)?.matched(progress)?;

    let pixels = left.len() * shape.rows * shape.columns;
    let mut tallies = Vec::with_capacity(shape.rows);
    for first in (0..shape.rows).step_by(ROWS_TOGETHER) {
        let rows = first..(first + ROWS_TOGETHER).min(shape.rows);
        let volume =
            source.rows_of_all(&rows.clone().collect::<Vec<_>>(), progress).map_err(MatchError::from)?;
        let of_row = |y: usize| {
            let epi = SampledEpi::new(&volume, y - first, Interpolation::BSpline, 0);
            let mut tally = Tally::default();
            for &t in &left {
                let row = LeftOutRow { y: y - first, t, reference, disparity: maps.disparity.row(y) };
                tally.add_row(&volume, &epi, row, &kept);
            }
            tally
        };
        tallies.par_extend(rows.into_par_iter().map(of_row));
    }
    let total = tallies.into_iter().fold(Tally::default(), Tally::joined);
    let predicted = total.predicted.max(1) as f64;
    let report = LeaveOutReport {
        frames: left,
        pixels,
        predicted: total.predicted as f64 / pixels as f64,
        prediction_error_dn: total.prediction / predicted,
        repetition_error_dn: total.repetition / predicted,
        halved: total.halved as f64 / pixels as f64,
    };
    Ok((report, maps))
}

/// Rows of all frames that are in memory at a time.
const ROWS_TOGETHER: usize = 64;

/// Row `y` of the left-out frame `t` in a part of the frames, and the disparities of that row of the reference frame.
struct LeftOutRow<'a> {
    y: usize,
    t: usize,
    reference: usize,
    disparity: &'a [f32],
}

#[derive(Debug, Default, Clone, Copy)]
struct Tally {
    predicted: usize,
    halved: usize,
    prediction: f64,
    repetition: f64,
}

impl Tally {
    fn joined(self, other: Self) -> Self {
        Self {
            predicted: self.predicted + other.predicted,
            halved: self.halved + other.halved,
            prediction: self.prediction + other.prediction,
            repetition: self.repetition + other.repetition,
        }
    }

    /// Adds a row, predicted from the frames that were `kept`.
    fn add_row(&mut self, volume: &Volume, epi: &SampledEpi, row: LeftOutRow<'_>, kept: &[usize]) {
        let LeftOutRow { y, t, reference, disparity } = row;
        let tau = volume.tau().values();
        let columns = volume.columns();
        let carried = carry(disparity, tau[t] - tau[reference]);
        let after = kept.partition_point(|&other| other < t);
        let neighbours = [kept[after - 1], kept[after]];
        let nearest = if tau[t] - tau[neighbours[0]] <= tau[neighbours[1]] - tau[t] { 0 } else { 1 };
        let mut actual = vec![0.0; columns];
        let mut repeated = vec![0.0; columns];
        volume.copy_row(y, t, &mut actual);
        volume.copy_row(y, neighbours[nearest], &mut repeated);
        for (x, &disparity) in carried.iter().enumerate() {
            let samples = neighbours.map(|other| {
                let position = x as f64 + f64::from(disparity) * (tau[other] - tau[t]);
                epi.at(other, position)
            });
            let (sum, count) =
                samples.iter().flatten().fold((0.0, 0.0), |(sum, n), value| (sum + value, n + 1.0));
            if count == 0.0 {
                continue;
            }
            let prediction = f64::from((sum / count - actual[x]).abs());
            let repetition = f64::from((repeated[x] - actual[x]).abs());
            self.predicted += 1;
            self.halved += usize::from(prediction <= 0.5 * repetition);
            self.prediction += prediction;
            self.repetition += repetition;
        }
    }
}

/// The disparity of each column of a frame `offset` of the baseline away, from that of the reference frame's
/// columns.
///
/// Neighbouring pixels of one surface carry the stretch between them along; of several candidates the nearest
/// surface, that of the largest |disparity|, is seen.
fn carry(disparity: &[f32], offset: f64) -> Vec<f32> {
    // Neighbours belong to one surface while it is not stretched to more than twice its width.
    const LARGEST_ELONGATION: f64 = 2.0;
    let mut carried = vec![f32::NAN; disparity.len()];
    let mut see = |column: f64, value: f32| {
        if column >= 0.0 && column < carried.len() as f64 {
            let seen = &mut carried[column as usize];
            if seen.is_nan() || value.abs() > seen.abs() {
                *seen = value;
            }
        }
    };
    let place = |x: usize| x as f64 + f64::from(disparity[x]) * offset;
    for x in 0..disparity.len() {
        let here = place(x);
        if here.is_nan() {
            continue;
        }
        see(here.round(), disparity[x]);
        let Some(next) = (x + 1 < disparity.len()).then(|| place(x + 1)) else { continue };
        if next > here && next - here <= LARGEST_ELONGATION {
            let mut column = here.ceil();
            while column <= next {
                let share = ((column - here) / (next - here)) as f32;
                see(column, disparity[x] + share * (disparity[x + 1] - disparity[x]));
                column += 1.0;
            }
        }
    }
    carried
}

#[cfg(test)]
mod tests {
    use super::*;
    use epirig_core::progress::Silent;
    use epirig_simulator::{Simulator, SimulatorConfig};

    #[test]
    fn nearer_surfaces_occlude_farther_ones() {
        // Columns 2 and 3 move by 4, the others by 2: at half the baseline by 2 and 1.
        let carried = carry(&[2.0, 2.0, 4.0, 4.0, 2.0, 2.0, 2.0, 2.0], 0.5);
        assert!(carried[0].is_nan());
        assert_eq!(carried[1..], [2.0, 2.0, 3.0, 4.0, 4.0, 2.0, 2.0]);
    }

    #[test]
    fn frames_of_the_simulator_are_predicted_to_its_noise() {
        let simulator = Simulator::new(SimulatorConfig::textured_plane(96, 40, 13)).unwrap();
        let volume = simulator.render_volume(&Silent).unwrap();
        let (report, _) = leave_out(&volume, 4, &MatchOptions::default(), &Silent).unwrap();
        assert_eq!(report.frames, [3, 7, 11]);
        // Two samples of quantisation noise averaged against a third: the mean of |error| is about 0.35 DN,
        // and interpolation adds its own.
        assert!(report.prediction_error_dn < 1.0, "{report:?}");
        assert!(report.repetition_error_dn > 4.0 * report.prediction_error_dn, "{report:?}");
        assert!(report.predicted > 0.85, "{report:?}");
        assert!(matches!(
            leave_out(&volume, 1, &MatchOptions::default(), &Silent),
            Err(LeaveOutError::Every { .. })
        ));
        assert!(leave_out(&volume, 40, &MatchOptions::default(), &Silent).is_err());
    }
}
