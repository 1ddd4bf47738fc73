//! EPIs between their pixels, for the fit: quintic B-splines with their first two derivatives.
//!
//! Within an EPI all pixels of a block are sampled at the same fraction of a pixel, so a sample is six neighbours times
//! constant weights. The weights are tabulated: a fraction is known to a thousandth of a pixel at worst, at random from frame
//! to frame, which for a hundred frames is a hundred thousandth of a pixel of disparity.

use fearless_simd::{Level, Simd, dispatch};

use crate::volume::Volume;

/// Neighbours that a sample is made of.
pub(super) const TAPS: usize = 6;
/// Neighbours to the left of the sample's whole pixel.
pub(super) const TAPS_BEFORE: usize = 2;
/// Tabulated fractions of a pixel.
pub(super) const FRACTIONS: usize = 512;
/// Columns beyond both borders for which coefficients are held.
pub(super) const MARGIN: usize = 32;
/// Reach of the prefilter: its poles are -0.431 and -0.043, and 0.431^14 of 255 DN is 0.002 DN.
const PREFILTER_REACH: usize = 14;

/// Variance of the value of a quintic B-spline through white noise, over that of the noise, mean over the positions between
/// pixels.
pub(super) const VALUE_NOISE_GAIN: f64 = 0.918;
/// The same for noise that was resampled by such splines once before, along x and along y: rectified frames.
pub(super) const RESAMPLED_NOISE_GAIN: f64 = 0.793;
/// The same for its derivative, per px^2.
pub(super) const SLOPE_NOISE_GAIN: f64 = 2.678;

/// Weights of the six neighbours for value, first and second derivative at a fraction of a pixel.
pub(super) type Weights = [[f32; TAPS]; 3];

/// What all rows share: the weights by fraction, and the filter from samples to coefficients.
#[derive(Debug)]
pub(super) struct Spline {
    weights: Vec<Weights>,
    prefilter: [f32; PREFILTER_REACH + 1],
    level: Level,
}

impl Spline {
    pub(super) fn new() -> Self {
        let weights = (0..FRACTIONS)
            .map(|index| {
                let fraction = index as f64 / FRACTIONS as f64;
                std::array::from_fn(|order| {
                    std::array::from_fn(|tap| {
                        let offset = tap as f64 - TAPS_BEFORE as f64;
                        basis(offset - fraction, order) as f32
                    })
                })
            })
            .collect();
        Self { weights, prefilter: prefilter().map(|value| value as f32), level: Level::new() }
    }

    /// The weights at fraction `index` / [`FRACTIONS`].
    pub(super) fn weights(&self, index: usize) -> &Weights {
        &self.weights[index]
    }
}

/// The quintic B-spline or its derivative of `order` 1 or 2 (with respect to where it is evaluated, hence the sign) at
/// `offset` = neighbour - position (Unser 1999, equation 4).
fn basis(offset: f64, order: usize) -> f64 {
    let factors = [1.0 / 120.0, 1.0 / 24.0, 1.0 / 6.0];
    let binomials = [1.0, -6.0, 15.0, -20.0, 15.0, -6.0, 1.0];
    let x = -offset;
    let term = |(k, binomial): (usize, &f64)| binomial * (x + 3.0 - k as f64).max(0.0).powi(5 - order as i32);
    factors[order] * binomials.iter().enumerate().map(term).sum::<f64>()
}

/// Impulse response of the filter that turns samples into coefficients, from the middle outwards: the inverse of the
/// B-spline's samples (1, 26, 66, 26, 1) / 120, by its frequency response.
fn prefilter() -> [f64; PREFILTER_REACH + 1] {
    let steps = 256;
    std::array::from_fn(|n| {
        let term = |k: usize| {
            let omega = std::f64::consts::TAU * k as f64 / steps as f64;
            let response = (66.0 + 52.0 * omega.cos() + 2.0 * (2.0 * omega).cos()) / 120.0;
            (omega * n as f64).cos() / response
        };
        (0..steps).map(term).sum::<f64>() / steps as f64
    })
}

/// The coefficients of one EPI: frames x (columns + 2 margins).
#[derive(Debug, Default)]
pub(super) struct SplineEpi {
    columns: usize,
    coefficients: Vec<f32>,
    padded: Vec<f32>,
}

impl SplineEpi {
    /// Takes in row `y` of `frames` of `volume`.
    pub(super) fn take(
        &mut self,
        spline: &Spline,
        volume: &Volume,
        y: usize,
        frames: impl Iterator<Item = usize>,
    ) {
        let columns = volume.columns();
        self.columns = columns;
        self.coefficients.resize(volume.frames() * self.stride(), 0.0);
        let border = MARGIN + PREFILTER_REACH;
        self.padded.resize(columns + 2 * border, 0.0);
        for t in frames {
            volume.copy_row(y, t, &mut self.padded[border..border + columns]);
            // Turned about the border's pixel, so that value and slope go on without a jump.
            let (first, last) = (self.padded[border], self.padded[border + columns - 1]);
            for offset in 1..=border {
                let inside = mirrored(offset, columns);
                self.padded[border - offset] = 2.0 * first - self.padded[border + inside];
                self.padded[border + columns - 1 + offset] =
                    2.0 * last - self.padded[border + columns - 1 - inside];
            }
            let stride = self.stride();
            let out = &mut self.coefficients[t * stride..(t + 1) * stride];
            dispatch!(spline.level, simd => filter_row(simd, &self.padded, &spline.prefilter, out));
        }
    }

    fn stride(&self) -> usize {
        self.columns + 2 * MARGIN
    }

    /// The coefficients of frame `t` from [`TAPS_BEFORE`] before column `x` on, to the end of the frame's margin.
    pub(super) fn taps(&self, t: usize, x: isize) -> &[f32] {
        let first = (x + (MARGIN - TAPS_BEFORE) as isize) as usize;
        &self.coefficients[t * self.stride() + first..(t + 1) * self.stride()]
    }
}

/// How far inside the image the mirror image of the `offset`th column beyond its border lies.
fn mirrored(offset: usize, columns: usize) -> usize {
    let period = 2 * (columns - 1);
    let place = offset % period;
    place.min(period - place)
}

#[inline(always)]
fn filter_row<S: Simd>(_simd: S, padded: &[f32], prefilter: &[f32; PREFILTER_REACH + 1], out: &mut [f32]) {
    // Several outputs at a time stay in registers over all taps.
    const CHUNK: usize = 64;
    let mut start = 0;
    while start < out.len() {
        let count = CHUNK.min(out.len() - start);
        let mut sums = [0.0_f32; CHUNK];
        let area = &padded[start..start + count + 2 * PREFILTER_REACH];
        if count == CHUNK {
            filter_chunk(area, prefilter, &mut sums);
        } else {
            for (x, sum) in sums[..count].iter_mut().enumerate() {
                *sum = prefilter[0] * area[x + PREFILTER_REACH];
                for reach in 1..=PREFILTER_REACH {
                    *sum += prefilter[reach]
                        * (area[x + PREFILTER_REACH - reach] + area[x + PREFILTER_REACH + reach]);
                }
            }
        }
        out[start..start + count].copy_from_slice(&sums[..count]);
        start += count;
    }
}

#[inline(always)]
fn filter_chunk(area: &[f32], prefilter: &[f32; PREFILTER_REACH + 1], sums: &mut [f32; 64]) {
    let middle = &area[PREFILTER_REACH..PREFILTER_REACH + 64];
    for x in 0..64 {
        sums[x] = prefilter[0] * middle[x];
    }
    for reach in 1..=PREFILTER_REACH {
        let left = &area[PREFILTER_REACH - reach..PREFILTER_REACH - reach + 64];
        let right = &area[PREFILTER_REACH + reach..PREFILTER_REACH + reach + 64];
        for x in 0..64 {
            sums[x] += prefilter[reach] * (left[x] + right[x]);
        }
    }
}
