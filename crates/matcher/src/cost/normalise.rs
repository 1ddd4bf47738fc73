//! Local normalisation: each pixel less the mean of its surroundings, over their standard deviation.
//!
//! If light or exposure differ from frame to frame, so do the intensities along a line, and their variance
//! tells little. A normalised pixel does not depend on a gain and an offset that its window shares. The
//! search for the least variance then finds nearly what the best correlation of windows with their mean would
//! find, at the price of plain variance, and the fit needs no change.
//!
//! The window is about half as wide as it is high. It moves with the texture, so it shifts no line on a
//! surface whose disparity is constant across it. Errors come from texture that enters or leaves the window
//! on the way: at the sides of the frames, at depth edges, and on slanted surfaces. All of these lie along x.
//! Measured on simulated scenes with a noise of 1 DN, as the RMS error over that of plain intensities, for
//! windows of 7 x 7, 15 x 3, 5 x 9 and 3 x 15 pixels (wide x high): plane 1.47, 3.7, 1.19, 1.20; plane that
//! slants along x 1.49, 3.4, 1.22, 1.19; along y 1.40, 3.7, 1.16, 1.31; cube edge 2.05, 4.0, 1.90, 1.65.

use std::ops::Range;

use fearless_simd::{Level, Simd, dispatch};

use crate::aggregation::window_sums::window_sums;
use epirig_core::statistics::quantile_of_sorted;
use epirig_core::volume::Volume;

/// Levels for one local standard deviation, around the level of the local mean. Values beyond four deviations
/// are clipped. In 8 bit a level is as fine as the camera's own for a local standard deviation of 32 DN, and
/// finer for less.
const LEVELS_PER_DEVIATION: f32 = 32.0;
const MEAN_LEVEL: f32 = 128.0;
/// Noise of this many times its standard deviation is added to that of each window, so that featureless
/// surfaces do not become texture.
const FLOOR_OVER_NOISE: f64 = 2.0;
/// The noise is that of the calmest tenth of blocks of this side, in px.
const BLOCK_PX: usize = 16;
const CALM_SHARE: f64 = 0.1;
/// Rows that a thread processes at a time. They share the sums of their windows, and the rows around them are
/// copied first.
const BAND_ROWS: usize = 64;

/// Height of the window of [`Method::Normalised`](crate::Method::Normalised): with 45 pixels, mean and
/// deviation of noise are known to a tenth.
pub(crate) const NORMALISING_WINDOW_PX: usize = 9;

/// `volume` with a local mean of 128 and a local standard deviation of 32 DN in windows `window_px` (odd)
/// high and about half as wide, cut off at the borders of the frames.
///
/// Samples are 8 bit wide if those of `volume` are, and else [fine](Volume::fine) ones of 8 bit, so that they
/// take no more memory; they change in their place unless they are shared. Most of the time does not depend
/// on the window. Frames' gains are applied, though they hardly matter here.
pub(crate) fn locally_normalised(volume: Volume, window_px: usize) -> Volume {
    let fine = volume.is_fine() || volume.bit_depth() > 8;
    let floor = FLOOR_OVER_NOISE * FLOOR_OVER_NOISE * noise_variance(&volume);
    let (rows, columns, level) = (volume.rows(), volume.columns(), Level::new());
    volume.refilled((8, fine), (BAND_ROWS, window_px / 2), |band_rows, _, values, band| {
        let mut window = Window::new(rows, columns, window_px);
        dispatch!(level, simd => window.normalise(simd, band_rows, values, floor, band));
    })
}

/// A window that slides over one frame, with running sums over its rows.
///
/// In double precision the sums of whole levels are exact, so samples that leave the window leave no rounding
/// error.
struct Window {
    /// Rows and columns of the frame.
    rows: usize,
    columns: usize,
    /// Rows and columns that the window reaches to either side.
    half_rows: usize,
    half_columns: usize,
    /// Sums of values and of squares over the window's rows, for each column; with zeros for the columns
    /// beyond the borders.
    by_column: [Vec<f64>; 2],
    /// The same over the window's columns, too.
    sums: [Vec<f64>; 2],
    /// Columns of the image that the window covers around each.
    covered: Vec<f64>,
}

impl Window {
    fn new(rows: usize, columns: usize, window_px: usize) -> Self {
        let half = window_px / 4;
        let covered = |x: usize| ((x + half + 1).min(columns) - x.saturating_sub(half)) as f64;
        Self {
            rows,
            columns,
            half_rows: window_px / 2,
            half_columns: half,
            by_column: [0, 1].map(|_| vec![0.0; columns + 2 * half]),
            sums: [0, 1].map(|_| vec![0.0; columns]),
            covered: (0..columns).map(covered).collect(),
        }
    }

    /// Normalises the given rows into `band`, rows x columns; `values` are theirs and those of the rows
    /// within reach.
    #[inline(always)]
    fn normalise<S: Simd>(
        &mut self,
        _simd: S,
        rows: Range<usize>,
        values: &[f32],
        floor: f64,
        band: &mut [f32],
    ) {
        let (all, columns, half) = (self.rows, self.columns, self.half_rows);
        let first = rows.start.saturating_sub(half);
        let row = |y: usize| &values[(y - first) * columns..(y - first + 1) * columns];
        let mut paths = first..first;
        for (y, out) in rows.zip(band.chunks_exact_mut(columns)) {
            let wanted = y.saturating_sub(half)..(y + half + 1).min(all);
            for entering in paths.end..wanted.end {
                self.add(row(entering), 1.0);
            }
            for leaving in paths.start..wanted.start {
                self.add(row(leaving), -1.0);
            }
            paths = wanted;
            for (sums, by_column) in self.sums.iter_mut().zip(&self.by_column) {
                window_sums(by_column, 2 * self.half_columns + 1, sums);
            }
            let [sums, squares] = &self.sums;
            deviations(row(y), [sums, squares, &self.covered], paths.len() as f64, floor, out);
        }
    }

    /// Adds a row to the sums over rows, or takes it away again.
    #[inline(always)]
    fn add(&mut self, row: &[f32], sign: f64) {
        let own = self.half_columns..self.half_columns + row.len();
        let [sums, squares] = &mut self.by_column;
        let (sums, squares) = (&mut sums[own.clone()], &mut squares[own]);
        for x in 0..row.len() {
            let value = f64::from(row[x]);
            sums[x] += sign * value;
            squares[x] += sign * value * value;
        }
    }
}

/// Levels of a row, from the sums of its windows: values, squares and columns, over `rows` rows.
#[inline(always)]
fn deviations(row: &[f32], [sums, squares, covered]: [&[f64]; 3], rows: f64, floor: f64, out: &mut [f32]) {
    let columns = out.len();
    let (row, sums, squares, covered) =
        (&row[..columns], &sums[..columns], &squares[..columns], &covered[..columns]);
    for x in 0..columns {
        let count = rows * covered[x];
        let mean = sums[x] / count;
        let variance = squares[x] / count - mean * mean;
        let variance = if variance > 0.0 { variance } else { 0.0 } + floor;
        let deviation = (f64::from(row[x]) - mean) as f32 / (variance as f32).sqrt();
        out[x] = MEAN_LEVEL + LEVELS_PER_DEVIATION * deviation;
    }
}

/// Variance of the noise in DN^2, at least that of quantisation: from the mixed second differences of the
/// middle frame, of which a surface's texture, seen through a lens, has little, in the calmest blocks.
fn noise_variance(volume: &Volume) -> f64 {
    let t = volume.tau().middle_frame();
    let columns = volume.columns();
    let blocks = columns.div_ceil(BLOCK_PX);
    let mut calm = Vec::new();
    let mut rows = [vec![0.0; columns], vec![0.0; columns]];
    for first in (0..volume.rows()).step_by(BLOCK_PX) {
        let mut sums = vec![(0.0_f64, 0_u32); blocks];
        for y in first + 1..(first + BLOCK_PX).min(volume.rows()) {
            let [above, row] = &mut rows;
            volume.copy_row(y - 1, t, above);
            volume.copy_row(y, t, row);
            for x in 1..columns {
                // Four samples of equal noise: their alternating sum has four times its variance.
                let difference = f64::from(above[x - 1] - above[x] - row[x - 1] + row[x]);
                let (sum, count) = &mut sums[x / BLOCK_PX];
                *sum += difference * difference / 4.0;
                *count += 1;
            }
        }
        calm.extend(sums.iter().filter(|(_, count)| *count > 0).map(|(sum, count)| sum / f64::from(*count)));
    }
    calm.sort_unstable_by(f64::total_cmp);
    let quantisation = f64::from(volume.frame_gain(t)).powi(2) / 12.0;
    quantile_of_sorted(&calm, CALM_SHARE).unwrap_or(0.0).max(quantisation)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate::{ErrorStatistics, compare_with_truth};
    use crate::{MatchOptions, match_volume};
    use epirig_core::frame::{Frame, Samples};
    use epirig_core::progress::Silent;
    use epirig_core::tau::Tau;
    use epirig_simulator::{Simulator, SimulatorConfig};
    use proptest::prelude::*;

    /// Each pixel by the definition, the noise being known.
    fn plain(
        rows: &[Vec<f32>],
        (x, y): (usize, usize),
        (half_x, half_y): (usize, usize),
        noise_variance: f64,
    ) -> f64 {
        let near = |middle: usize, half: usize, count: usize| {
            middle.saturating_sub(half)..(middle + half + 1).min(count)
        };
        let values: Vec<f64> = near(y, half_y, rows.len())
            .flat_map(|row| near(x, half_x, rows[0].len()).map(move |column| f64::from(rows[row][column])))
            .collect();
        let count = values.len() as f64;
        let mean = values.iter().sum::<f64>() / count;
        let variance = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / count;
        128.0 + 32.0 * (f64::from(rows[y][x]) - mean) / (variance + 4.0 * noise_variance).sqrt()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(16))]
        #[test]
        fn samples_are_those_of_the_definition(
            values in prop::collection::vec(0_u16..4096, 150 * 12 * 2),
            window_px in prop::sample::select(vec![1_usize, 3, 7, 9, 21]),
        ) {
            // More rows than two bands.
            let mut volume = Volume::new(150, 12, 12, Tau::equidistant(2).unwrap());
            for (t, values) in values.chunks_exact(150 * 12).enumerate() {
                volume.insert(t, &Frame::new(150, 12, 12, Samples::U16(values.to_vec())).unwrap()).unwrap();
            }
            let noise = noise_variance(&volume);
            let normalised = locally_normalised(volume.clone(), window_px);
            let mut found = [0.0; 12];
            for t in 0..2 {
                let rows: Vec<Vec<f32>> = (0..150).map(|y| {
                    let mut row = vec![0.0; 12];
                    volume.copy_row(y, t, &mut row);
                    row
                }).collect();
                for y in 0..150 {
                    normalised.copy_row(y, t, &mut found);
                    for (x, &value) in found.iter().enumerate() {
                        let expected = plain(&rows, (x, y), (window_px / 4, window_px / 2), noise).max(0.0);
                        // Half a count of 1/128 DN, and 24 bits of some 128 DN.
                        prop_assert!((f64::from(value) - expected).abs() < 0.5 / 128.0 + 1e-4, "{value} {expected}");
                    }
                }
            }
        }
    }

    #[test]
    fn noise_is_that_of_the_featureless_part() {
        let mut config = SimulatorConfig::textured_plane(128, 128, 3);
        config.sensor.read_noise_dn = 2.0;
        config.texture.grain_mm *= 4.0;
        let volume = Simulator::new(config).unwrap().render_volume(&Silent).unwrap();
        let noise = noise_variance(&volume);
        // Noise of 2 DN and quantisation; the least tenth of 64 estimates of 225 differences each lies up to
        // a quarter below, and texture adds a little.
        assert!((3.0..4.6).contains(&noise), "{noise}");
        let dark = Volume::new(20, 20, 8, Tau::equidistant(3).unwrap());
        assert_eq!(noise_variance(&dark), 1.0 / 12.0);
    }

    #[test]
    fn memory_is_that_of_the_frames() {
        for (bit_depth, bytes) in [(8, 800), (12, 1600)] {
            let volume = Volume::new(10, 20, bit_depth, Tau::equidistant(4).unwrap());
            assert_eq!(locally_normalised(volume, 9).bytes(), bytes);
        }
    }

    /// A lamp that travels: from frame to frame and across each frame, gain between 0.55 and 0.85 and offset
    /// between -12 and 12 DN.
    fn unevenly_lit(volume: &Volume) -> Volume {
        let columns = volume.columns();
        let kind = (volume.bit_depth(), volume.is_fine());
        volume.clone().refilled(kind, (16, 0), |rows, t, values, band| {
            for (index, (value, out)) in values.iter().zip(band).enumerate() {
                let (x, y) = (index % columns, rows.start + index / columns);
                let phase = 0.03 * x as f32 + 0.02 * y as f32 + 0.7 * t as f32;
                *out = *value * (0.7 + 0.15 * phase.sin()) + 12.0 * (1.3 * phase).cos();
            }
        })
    }

    #[test]
    fn uneven_light_leaves_the_disparity_as_it_is() {
        let mut config = SimulatorConfig::textured_plane(160, 80, 25);
        config.sensor.read_noise_dn = 1.0;
        let simulator = Simulator::new(config).unwrap();
        let even = simulator.render_volume(&Silent).unwrap();
        let uneven = unevenly_lit(&even);
        let truth = simulator.truth(12).unwrap();
        let errors = |volume: &Volume| -> ErrorStatistics {
            let maps = match_volume(volume, &MatchOptions::default(), &Silent).unwrap();
            let report = compare_with_truth(&maps.disparity, Some(&maps.sigma), &truth.disparity, (0.5, 0.5));
            report.unwrap().in_both_end_frames
        };
        let (reference, plain) = (errors(&even), errors(&uneven));
        // Most pixels have no answer then, or a wrong one: residuals of some 20 DN are taken for noise.
        assert!((plain.answered as f64) < 0.5 * plain.pixels as f64 || plain.median_px > 0.05, "{plain:?}");
        let normalised = errors(&locally_normalised(uneven, NORMALISING_WINDOW_PX));
        assert!(normalised.answered as f64 > 0.99 * normalised.pixels as f64, "{normalised:?}");
        // The window's own error is alike in neighbouring pixels, and larger discs do not average
        // it: it is to be small against the hundredth of a pixel that is wanted.
        assert!(reference.median_px < 0.003 && normalised.median_px < 0.005, "{normalised:?} {reference:?}");
        assert!(normalised.rms_px < 0.02, "{normalised:?} {reference:?}");
        assert!(normalised.bias_px.abs() < 0.005, "{normalised:?}");
    }
}
