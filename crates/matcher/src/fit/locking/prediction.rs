//! The predicted bias of each pixel by pixel locking, as far as it is significant.

use rayon::prelude::*;

use super::products::{Products, Regression, TERMS, Turns, fraction};
use super::{LineSums, RowLines, RowSums};
use crate::lines::EpiLines;
use crate::locking::{LOCKING_HARMONICS, LockingAmplitudes, LockingHarmonic};

/// At least so many rows, or their scatter is too uncertain.
const LEAST_ROWS: usize = 8;
/// An amplitude from lines is used if its standard deviation is at most one over this of the amplitude from
/// texture.
const KNOWN_BY_LINES: f64 = 3.0;
/// A bias is significant if it exceeds this many of its standard deviations. Its square is exceeded once in a
/// thousand by chi squared of four degrees of freedom (the amplitudes of two harmonics), so chance makes a
/// bias at any disparity significant no more often (Scheffe 1953).
const SIGNIFICANT_SIGMAS: f64 = 4.3;
/// Predictions are tabulated at this distance, in px: the second harmonic turns by 0.4 rad at most from one
/// to the next, so that a straight line between them misses 2 % of it.
const TABLE_STEP_PX: f64 = 1.0 / 32.0;
/// Points whose first and last frames differ by less than this part of the baseline are seen alike.
const SEEN_ALIKE: f64 = 0.02;

/// The measured amplitudes, and how well they are known.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::fit) struct Amplitudes {
    /// Whether lines tell them; else the texture alone does, and biases are rough.
    from_lines: bool,
    all: Products,
    /// The products without each row (Tukey's jackknife): their scatter shows the effect of noise and
    /// texture.
    without: Vec<Products>,
    /// Amplitude that errors of the frames' positions may cause, in px.
    feigned_px: f64,
}

impl Amplitudes {
    /// From all rows: by lines, unless too few lines are usable and texture shows that there is a bias.
    pub(in crate::fit) fn of(rows: &[RowSums]) -> Option<Self> {
        let by_lines: Vec<&LineSums> = rows.iter().filter_map(|row| row.lines.as_ref()).collect();
        let lines = Self::of_products(by_lines.iter().map(|row| row.products).collect()).map(|lines| Self {
            from_lines: true,
            feigned_px: feigned(&by_lines),
            ..lines
        });
        let texture = Self::of_products(rows.iter().filter_map(|row| row.texture).collect());
        let (Some(by_lines), Some(by_texture)) = (&lines, &texture) else { return lines.or(texture) };
        let least = by_texture.harmonics()[0].interpolation_px.abs() / KNOWN_BY_LINES;
        let uncertain = by_lines.harmonics()[0].interpolation_sigma_px > least;
        if by_texture.are_significant() && uncertain { texture } else { lines }
    }

    fn of_products(rows: Vec<Products>) -> Option<Self> {
        let mut all = Products::default();
        rows.iter().for_each(|row| all.add(row, 1.0));
        let mut without = rows;
        for row in &mut without {
            let own = *row;
            *row = all;
            row.add(&own, -1.0);
        }
        let known = without.len() >= LEAST_ROWS && without.iter().all(|products| products.square > 0.0);
        known.then_some(Self { from_lines: false, all, without, feigned_px: 0.0 })
    }

    /// Standard deviation of a quantity by the jackknife.
    fn sigma(&self, quantity: impl Fn(&Products) -> f64) -> f64 {
        let count = self.without.len() as f64;
        let (mut sum, mut squares) = (0.0, 0.0);
        // Differences from the whole, so that squares lose nothing.
        let whole = quantity(&self.all);
        for without in &self.without {
            let difference = quantity(without) - whole;
            sum += difference;
            squares += difference * difference;
        }
        ((squares - sum * sum / count).max(0.0) * (count - 1.0) / count).sqrt()
    }

    /// The amplitudes of the harmonics with their sigmas.
    fn harmonics(&self) -> [LockingHarmonic; LOCKING_HARMONICS] {
        let amplitudes = self.all.amplitudes();
        std::array::from_fn(|index| {
            let sigma = |kind: usize| self.sigma(|products| products.amplitudes()[index][kind]);
            LockingHarmonic {
                interpolation_px: amplitudes[index][0],
                interpolation_sigma_px: sigma(0).hypot(self.feigned_px),
                aliasing_px: amplitudes[index][1],
                aliasing_sigma_px: sigma(1),
            }
        })
    }

    /// As they are handed on.
    pub(in crate::fit) fn stated(&self) -> LockingAmplitudes {
        LockingAmplitudes { harmonics: self.harmonics(), from_lines: self.from_lines }
    }

    /// Whether any amplitude is significant.
    pub(in crate::fit) fn are_significant(&self) -> bool {
        self.harmonics().iter().any(|harmonic| {
            harmonic.interpolation_px.abs() > SIGNIFICANT_SIGMAS * harmonic.interpolation_sigma_px
                || harmonic.aliasing_px.abs() > SIGNIFICANT_SIGMAS * harmonic.aliasing_sigma_px
        })
    }

    /// The bias that they predict, in px; 0 where it is not significant.
    fn bias(&self, regression: &Regression) -> f64 {
        let predicted = self.all.bias(regression);
        let feigned = regression.slope.iter().map(|slope| (self.feigned_px * slope.1).powi(2)).sum::<f64>();
        let sigma = self.sigma(|products| products.bias(regression)).hypot(feigned.sqrt());
        if predicted.abs() > SIGNIFICANT_SIGMAS * sigma { predicted } else { 0.0 }
    }
}

/// Amplitude that errors of the frames' positions may cause, in px: a frame off its position displaces all of
/// its points.
fn feigned(rows: &[&LineSums]) -> f64 {
    let mut frames: Vec<(f64, f64)> = Vec::new();
    for row in rows {
        frames.resize(row.frames.len(), (0.0, 0.0));
        for (sum, frame) in frames.iter_mut().zip(&row.frames) {
            *sum = (sum.0 + frame.0, sum.1 + frame.1);
        }
    }
    let errors = frames.iter().filter(|frame| frame.1 > 0.0).map(|frame| (frame.0 / frame.1).powi(2));
    let freedom = frames.len().saturating_sub(TERMS).max(1) as f64;
    (errors.sum::<f64>() / freedom * 2.0 / frames.len().max(1) as f64).sqrt()
}

/// Predicted biases of points that all frames see, tabulated over the disparity, and of others one by one.
pub(in crate::fit) struct Prediction<'a> {
    amplitudes: &'a Amplitudes,
    turns: &'a Turns,
    lines: &'a EpiLines,
    first_px: f64,
    biases: Vec<f64>,
}

impl<'a> Prediction<'a> {
    /// For disparities from `low` to `high`.
    pub(in crate::fit) fn new(
        amplitudes: &'a Amplitudes,
        turns: &'a Turns,
        lines: &'a EpiLines,
        (low, high): (f32, f32),
    ) -> Self {
        let first_px = f64::from(low);
        let steps = ((f64::from(high) - first_px) / TABLE_STEP_PX).ceil() as usize + 2;
        let mut prediction = Self { amplitudes, turns, lines, first_px, biases: Vec::new() };
        prediction.biases = (0..steps)
            .into_par_iter()
            .map(|index| prediction.of_frames(first_px + index as f64 * TABLE_STEP_PX, (-1.0, 1.0)))
            .collect();
        prediction
    }

    /// The bias of a point of `disparity` that is seen from `first` to `last` tau'.
    fn of_frames(&self, disparity: f64, (first, last): (f64, f64)) -> f64 {
        let seen = self.lines.offsets().iter().filter(|&&tau| tau >= first && tau <= last);
        let regression = Regression::of(self.turns, seen.map(|&tau| (tau, fraction(disparity * tau))));
        self.amplitudes.bias(&regression)
    }

    /// The biases of a row's pixels, in px, into `out`.
    pub(in crate::fit) fn row(&self, row: RowLines<'_>, out: &mut [f32]) {
        let whole = (-self.lines.tau_before(), self.lines.tau_after());
        // Neighbours seen by the same frames share the prediction of the first of them.
        let mut shared = (f64::NAN, whole, 0.0);
        for (x, (out, &disparity)) in out.iter_mut().zip(row.disparities).enumerate() {
            let disparity = f64::from(disparity);
            *out = if disparity.is_nan() {
                0.0
            } else {
                let seen = row.seen(x, disparity);
                if seen == whole {
                    self.tabulated(disparity)
                } else {
                    let alike = (disparity - shared.0).abs() <= TABLE_STEP_PX
                        && (seen.0 - shared.1.0).abs() <= SEEN_ALIKE
                        && (seen.1 - shared.1.1).abs() <= SEEN_ALIKE;
                    if !alike {
                        shared = (disparity, seen, self.of_frames(disparity, seen));
                    }
                    shared.2
                }
            } as f32;
        }
    }

    fn tabulated(&self, disparity: f64) -> f64 {
        let place = ((disparity - self.first_px) / TABLE_STEP_PX).max(0.0);
        let index = (place as usize).min(self.biases.len() - 2);
        let share = place - index as f64;
        self.biases[index] + share * (self.biases[index + 1] - self.biases[index])
    }
}
