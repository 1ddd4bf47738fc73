//! Brightness and sharpness of a frame.

use epirig_core::frame::{Frame, Samples};

/// Bins of a histogram, for any bit depth.
const BINS: usize = 256;

/// Brightness and sharpness of a frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Assessment {
    /// Mean, in DN.
    pub mean_dn: f64,
    /// The darkest sample.
    pub minimum_dn: u16,
    /// The brightest sample.
    pub maximum_dn: u16,
    /// Samples at full scale.
    pub saturated: usize,
    /// Samples at zero.
    pub black: usize,
    /// Number of samples in each of 256 equal parts of full scale (fewer parts below 8 bit); bins of
    /// [`bin_width_dn`](Self::bin_width_dn) from 0 up.
    pub histogram: Vec<u64>,
    /// Number of levels per bin.
    pub bin_width_dn: u32,
    /// Sharpness: mean squared gradient by Sobel's 3 x 3 operator over the squared mean (Tenengrad,
    /// normalised; Groen, Young and Ligthart 1985). Comparable between frames of the same object only: it is
    /// largest where the object is in focus. 0 for images without an inner pixel.
    pub focus: f64,
}

impl Assessment {
    /// The values of a frame.
    pub fn of(frame: &Frame) -> Self {
        let bins = BINS.min(usize::from(frame.full_scale()) + 1);
        let bin_width_dn = (u32::from(frame.full_scale()) + 1) / bins as u32;
        let mut histogram = vec![0_u64; bins];
        let samples = frame.samples();
        let count = |level: u16| {
            if let Some(bin) = histogram.get_mut((u32::from(level) / bin_width_dn) as usize) {
                *bin += 1;
            }
        };
        let (minimum_dn, energy) = match samples {
            Samples::U8(values) => least_and_energy(values, frame.columns(), count),
            Samples::U16(values) => least_and_energy(values, frame.columns(), count),
        };
        let mean_dn = samples.mean();
        Self {
            mean_dn,
            minimum_dn,
            maximum_dn: samples.maximum(),
            saturated: samples.count_at_least(frame.full_scale()),
            black: samples.len() - samples.count_at_least(1),
            histogram,
            bin_width_dn,
            focus: if mean_dn > 0.0 { energy / (mean_dn * mean_dn) } else { 0.0 },
        }
    }
}

/// Counts all samples; the least of them, and the mean squared gradient.
fn least_and_energy<T: Copy + Into<u16> + Into<i32>>(
    values: &[T],
    columns: usize,
    count: impl FnMut(u16),
) -> (u16, f64) {
    let levels = || values.iter().map(|&value| -> u16 { value.into() });
    levels().for_each(count);
    (levels().min().unwrap_or(0), gradient_energy(values, columns))
}

/// Mean squared gradient of the inner pixels, in DN2 per px2.
fn gradient_energy<T: Copy + Into<i32>>(values: &[T], columns: usize) -> f64 {
    /// Sobel's operator weights differences over 2 px by 1, 2, 1.
    const SOBEL: f64 = 8.0;
    let rows: Vec<&[T]> = values.chunks_exact(columns).collect();
    let inner = |above: &[T], here: &[T], below: &[T], x: usize| {
        let [a, b, c] = [above[x - 1].into(), above[x].into(), above[x + 1].into()];
        let [d, e] = [here[x - 1].into(), here[x + 1].into()];
        let [f, g, h] = [below[x - 1].into(), below[x].into(), below[x + 1].into()];
        let across = i64::from(c + 2 * e + h - a - 2 * d - f);
        let down = i64::from(f + 2 * g + h - a - 2 * b - c);
        (across * across + down * down) as f64
    };
    let of_row = |rows: &[&[T]]| -> f64 {
        (1..columns.saturating_sub(1)).map(|x| inner(rows[0], rows[1], rows[2], x)).sum()
    };
    let count = rows.len().saturating_sub(2) * columns.saturating_sub(2);
    let sum: f64 = rows.windows(3).map(of_row).sum();
    sum / (count.max(1) as f64 * SOBEL * SOBEL)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sine(sigma_px: f64) -> Frame {
        // Blurring a sine by a Gaussian only weakens it.
        let weight = (-0.5 * (0.9 * sigma_px).powi(2)).exp();
        let samples =
            (0..64 * 64).map(|index| (2000.0 + 1000.0 * weight * (0.9 * f64::from(index % 64)).sin()) as u16);
        Frame::new(64, 64, 12, Samples::U16(samples.collect())).unwrap()
    }

    #[test]
    fn counts_and_histogram_are_those_of_the_samples() {
        let frame = Frame::new(1, 6, 8, Samples::U8(vec![0, 0, 7, 255, 254, 255])).unwrap();
        let found = Assessment::of(&frame);
        assert_eq!((found.saturated, found.black, found.minimum_dn, found.maximum_dn), (2, 2, 0, 255));
        assert_eq!((found.histogram[0], found.histogram[7], found.histogram[255]), (2, 1, 2));
        assert_eq!(found.histogram.iter().sum::<u64>(), 6);
        assert_eq!(found.focus, 0.0, "there is no inner pixel");
        let deep = Frame::new(1, 3, 12, Samples::U16(vec![15, 16, 4095])).unwrap();
        let found = Assessment::of(&deep);
        assert_eq!((found.bin_width_dn, found.histogram.len()), (16, 256));
        assert_eq!((found.histogram[0], found.histogram[1], found.histogram[255]), (1, 1, 1));
        let shallow = Frame::new(1, 2, 4, Samples::U8(vec![3, 15])).unwrap();
        assert_eq!(Assessment::of(&shallow).histogram.len(), 16);
    }

    #[test]
    fn a_ramp_has_the_gradient_that_it_has() {
        let samples: Vec<u8> =
            (0..32 * 32).map(|index| (3 * (index % 32) + 2 * (index / 32)) as u8).collect();
        let energy = gradient_energy(&samples, 32);
        assert!((energy - 13.0).abs() < 1e-12, "3^2 + 2^2, found {energy}");
    }

    #[test]
    fn focus_is_best_where_the_blur_is_least() {
        let focus: Vec<f64> = [0.0, 0.5, 1.0, 2.0].map(|sigma| Assessment::of(&sine(sigma)).focus).to_vec();
        assert!(focus.windows(2).all(|pair| pair[0] > pair[1]), "{focus:?}");
        // The energy falls with the squared contrast: exp(-(0.9 sigma)^2).
        let expected = (-(0.9_f64 * 1.0).powi(2)).exp();
        assert!((focus[2] / focus[0] - expected).abs() < 0.01, "{focus:?}");
    }
}
