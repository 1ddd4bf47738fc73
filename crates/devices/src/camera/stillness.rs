//! Compares two frames of one view: nothing has moved, neither is torn, lamp and settings are steady.
//!
//! Frames of one view differ by noise, which is uniform over the image or grows with the light. So the
//! differences are compared block by block: nine blocks in ten define the noise, and no block may differ by
//! much more. (Nine, not five: with a small bright object before a black background, most blocks have no
//! noise at all.)

use epirig_core::frame::{Frame, Samples, full_scale};

/// Rows of a block: few, because a torn frame may differ in a few rows only.
const BLOCK_ROWS: usize = 4;
/// Columns of a block.
const BLOCK_COLUMNS: usize = 16;
/// Every n-th sample of a row is compared. Faults affect whole rows, and a camera with 60 frames per second
/// leaves little time.
const EVERY: usize = 2;

/// Largest noise as a share of the brightest sample. No usable camera has more; a picture that changes
/// everywhere does.
const MOST_NOISE: f64 = 0.1;
/// Largest noise without light, as a share of full scale: that of the electronics. This is the worst camera
/// (37 dB; industrial cameras have 45 dB and better).
const MOST_DARK_NOISE: f64 = 0.02;
/// Largest ratio of any block to nine in ten. Shot noise grows with the root of the intensity: by 3 between
/// blocks of 1/9 of the brightest light and the brightest. A block's own value scatters by 13 % (32 samples).
const BLOCK_OVER_TYPICAL: f64 = 4.0;
/// Additional allowance as a share of the brightest sample, for flicker of a lamp, ...
const FLICKER: f64 = 0.01;
/// ... at least this, in DN, for quantisation.
const LEVEL_DN: f64 = 1.0;
/// Largest ratio of the typical difference to that of a steady picture. Noise doubles where the light grows
/// fourfold, because another part of the object is in view ...
const OVER_STEADY: f64 = 2.0;
/// ... with an allowance of half a level.
const HALF_LEVEL_DN: f64 = 0.5;

/// Difference of two frames, in DN.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Difference {
    /// Root mean square within a block, which nine blocks in ten do not exceed.
    pub typical_dn: f64,
    /// Root mean square of the block that differs most.
    pub largest_dn: f64,
    /// First row of that block.
    pub row: usize,
    /// First column of that block.
    pub column: usize,
    /// The brightest sample of the second frame, from one row in four.
    pub brightest_dn: u16,
    /// The largest possible sample.
    pub full_scale_dn: u16,
    /// Relative increase of brightness from the first frame to the second, from one row in four.
    pub lighter: f64,
}

impl Difference {
    /// The difference between two frames; `None` if their sizes differ.
    ///
    /// ```
    /// use epirig_devices::camera::Difference;
    /// use epirig_core::frame::{Frame, Samples};
    ///
    /// let grey = |level| Frame::new(8, 16, 8, Samples::U8(vec![level; 128]));
    /// let difference = Difference::between(&grey(10)?, &grey(13)?).unwrap();
    /// assert_eq!((difference.typical_dn, difference.largest_dn), (3.0, 3.0));
    /// # Ok::<(), epirig_core::frame::FrameError>(())
    /// ```
    pub fn between(one: &Frame, other: &Frame) -> Option<Self> {
        let shape = |frame: &Frame| (frame.rows(), frame.columns(), frame.bit_depth());
        if shape(one) != shape(other) {
            return None;
        }
        let columns = one.columns();
        let (squares, brightest_dn, lighter) = match (one.samples(), other.samples()) {
            (Samples::U8(a), Samples::U8(b)) => {
                (block_squares(a, b, columns), brightest(b, columns), lighter(a, b, columns))
            }
            (Samples::U16(a), Samples::U16(b)) => {
                (block_squares(a, b, columns), brightest(b, columns), lighter(a, b, columns))
            }
            _ => return None,
        };
        let across = one.columns().div_ceil(BLOCK_COLUMNS);
        let largest = (0..squares.len()).max_by(|&a, &b| squares[a].total_cmp(&squares[b]))?;
        let mut sorted = squares.clone();
        let nine_tenths = (sorted.len() * 9 / 10).min(sorted.len() - 1);
        let (_, typical, _) = sorted.select_nth_unstable_by(nine_tenths, f64::total_cmp);
        Some(Self {
            typical_dn: typical.sqrt(),
            largest_dn: squares[largest].sqrt(),
            row: largest / across * BLOCK_ROWS,
            column: largest % across * BLOCK_COLUMNS,
            brightest_dn,
            full_scale_dn: full_scale(one.bit_depth()),
            lighter,
        })
    }

    /// Why the frames do not show the same, if they do not. `steady_dn` is the typical difference of frames
    /// of a steady picture, if known.
    pub fn objection(&self, steady_dn: Option<f64>) -> Option<String> {
        let brightest = f64::from(self.brightest_dn);
        let dark_limit = (MOST_DARK_NOISE * f64::from(self.full_scale_dn)).max(LEVEL_DN);
        let typical_limit = steady_dn
            .map_or((MOST_NOISE * brightest).max(dark_limit), |steady| OVER_STEADY * steady + HALF_LEVEL_DN)
            + self.lighter.abs().min(FLICKER) * brightest;
        if self.typical_dn > typical_limit {
            return Some(format!(
                "two frames in a row differ by {:.1} DN over the whole image; {typical_limit:.1} DN are allowed",
                self.typical_dn
            ));
        }
        let largest_limit = BLOCK_OVER_TYPICAL * self.typical_dn + (FLICKER * brightest).max(LEVEL_DN);
        (self.largest_dn > largest_limit).then(|| {
            format!(
                "two frames in a row differ by {:.1} DN around row {}, column {}; {largest_limit:.1} DN are allowed there",
                self.largest_dn, self.row, self.column
            )
        })
    }
}

/// A flickering lamp brightens the whole frame; motion brightens some parts and darkens others.
fn lighter<T: Copy + Into<u16>>(one: &[T], other: &[T], columns: usize) -> f64 {
    let light = |samples: &[T]| -> u64 {
        let rows = samples.chunks(columns).step_by(BLOCK_ROWS);
        rows.flatten().map(|&sample| u64::from(sample.into())).sum()
    };
    light(other) as f64 / light(one).max(1) as f64 - 1.0
}

fn brightest<T: Copy + Into<u16> + Ord>(samples: &[T], columns: usize) -> u16 {
    let rows = samples.chunks(columns).step_by(BLOCK_ROWS);
    rows.filter_map(|row| row.iter().copied().max()).max().map_or(0, Into::into)
}

/// Mean squared difference of each block, in rows of blocks.
fn block_squares<T: Copy + Into<i32>>(one: &[T], other: &[T], columns: usize) -> Vec<f64> {
    let strip = BLOCK_ROWS * columns;
    let mut squares = Vec::with_capacity(one.len() / (BLOCK_ROWS * BLOCK_COLUMNS) + columns);
    for (one, other) in one.chunks(strip).zip(other.chunks(strip)) {
        let first = squares.len();
        squares.resize(first + columns.div_ceil(BLOCK_COLUMNS), 0.0);
        for (one, other) in one.chunks_exact(columns).zip(other.chunks_exact(columns)) {
            let blocks = one.chunks(BLOCK_COLUMNS).zip(other.chunks(BLOCK_COLUMNS));
            for (sum, (one, other)) in squares[first..].iter_mut().zip(blocks) {
                // 16 squares of 16-bit differences fit into 64 bits.
                let block: i64 = one
                    .iter()
                    .step_by(EVERY)
                    .zip(other.iter().step_by(EVERY))
                    .map(|(&a, &b)| {
                        let difference = i64::from(a.into() - b.into());
                        difference * difference
                    })
                    .sum();
                *sum += block as f64;
            }
        }
        let rows = one.len() / columns;
        for (index, sum) in squares[first..].iter_mut().enumerate() {
            let width = BLOCK_COLUMNS.min(columns - index * BLOCK_COLUMNS);
            *sum /= (rows * width.div_ceil(EVERY)) as f64;
        }
    }
    squares
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, Normal};

    use super::*;

    const ROWS: usize = 96;
    const COLUMNS: usize = 150;

    /// A sine of 40 DN amplitude, shifted, with noise of the root of the intensity times `noise`.
    fn frame(shift_px: f64, noise: f64, seed: u64) -> Frame {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let normal = Normal::new(0.0, 1.0).unwrap();
        let samples = (0..ROWS * COLUMNS).map(|index| {
            let x = (index % COLUMNS) as f64 - shift_px;
            let light = 20.0 + 80.0 * (index / COLUMNS) as f64 / ROWS as f64 + 20.0 * (x * 0.6).sin();
            (light + noise * light.sqrt() * normal.sample(&mut random)).round().clamp(0.0, 255.0) as u8
        });
        Frame::new(ROWS, COLUMNS, 8, Samples::U8(samples.collect())).unwrap()
    }

    fn torn(above: &Frame, below: &Frame, rows_above: usize) -> Frame {
        let (Samples::U8(a), Samples::U8(b)) = (above.samples(), below.samples()) else { panic!() };
        let samples = [&a[..rows_above * COLUMNS], &b[rows_above * COLUMNS..]].concat();
        Frame::new(ROWS, COLUMNS, 8, Samples::U8(samples)).unwrap()
    }

    fn objection(a: &Frame, b: &Frame, steady_dn: Option<f64>) -> Option<String> {
        Difference::between(a, b).unwrap().objection(steady_dn)
    }

    #[test]
    fn noise_and_flicker_are_no_movement() {
        for noise in [0.0, 0.1, 0.5, 1.0] {
            let steady =
                Difference::between(&frame(0.0, noise, 1), &frame(0.0, noise, 2)).unwrap().typical_dn;
            for seed in 3..40 {
                let pair = (frame(0.0, noise, seed), frame(0.0, noise, seed + 100));
                assert_eq!(objection(&pair.0, &pair.1, Some(steady)), None, "noise {noise}, seed {seed}");
            }
        }
    }

    #[test]
    fn a_lamp_that_flickers_by_a_hundredth_is_no_movement() {
        let lit = |level: u8| Frame::new(ROWS, COLUMNS, 8, Samples::U8(vec![level; ROWS * COLUMNS])).unwrap();
        // Without noise; 2 of 220 DN are 0.9 %, 6 are 2.7 %.
        assert_eq!(objection(&lit(220), &lit(222), Some(0.0)), None);
        assert!(objection(&lit(220), &lit(226), Some(0.0)).is_some());
    }

    #[test]
    fn a_dark_frame_may_have_the_noise_of_its_electronics() {
        let normal = Normal::new(3.0_f64, 1.43).unwrap();
        let dark = |seed| {
            let mut random = ChaCha8Rng::seed_from_u64(seed);
            let noise = |_| normal.sample(&mut random).round().clamp(0.0, 255.0) as u8;
            Frame::new(ROWS, COLUMNS, 8, Samples::U8((0..ROWS * COLUMNS).map(noise).collect())).unwrap()
        };
        for seed in 0..20 {
            assert_eq!(objection(&dark(seed), &dark(seed + 100), None), None, "seed {seed}");
        }
    }

    #[test]
    fn movement_is_seen_all_over_the_image() {
        let steady = Difference::between(&frame(0.0, 0.1, 1), &frame(0.0, 0.1, 2)).unwrap().typical_dn;
        for shift_px in [0.5, 1.5, 4.7] {
            assert!(
                objection(&frame(0.0, 0.1, 3), &frame(shift_px, 0.1, 4), Some(steady)).is_some(),
                "{shift_px}"
            );
        }
    }

    #[test]
    fn a_torn_frame_is_seen_wherever_it_is_torn() {
        let (old, new) = (frame(0.0, 0.1, 1), frame(4.7, 0.1, 2));
        let steady = Difference::between(&new, &frame(4.7, 0.1, 3)).unwrap().typical_dn;
        for rows_above in [4, 48, 92, 95] {
            let torn = torn(&new, &old, rows_above);
            assert!(objection(&new, &torn, Some(steady)).is_some(), "torn after row {rows_above}");
        }
    }

    #[test]
    fn a_small_bright_object_before_black_may_have_its_noise() {
        // A quarter of the image is lit.
        let lit = |seed| {
            let Samples::U8(samples) = frame(0.0, 0.5, seed).samples().clone() else { panic!() };
            let dark = |(index, sample)| if index / COLUMNS >= ROWS * 3 / 4 { sample } else { 0 };
            Frame::new(ROWS, COLUMNS, 8, Samples::U8(samples.into_iter().enumerate().map(dark).collect()))
                .unwrap()
        };
        let steady = Difference::between(&lit(1), &lit(2)).unwrap().typical_dn;
        for seed in 3..40 {
            assert_eq!(objection(&lit(seed), &lit(seed + 100), Some(steady)), None, "seed {seed}");
        }
    }

    #[test]
    fn frames_of_two_shapes_have_no_difference() {
        let small = Frame::new(1, 2, 8, Samples::U8(vec![0, 1])).unwrap();
        assert_eq!(Difference::between(&small, &frame(0.0, 0.0, 1)), None);
        assert_eq!(Difference::between(&small, &small).unwrap().largest_dn, 0.0);
    }
}
