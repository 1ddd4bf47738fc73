//! How much memory the stations take, before they begin.
//!
//! The numbers are peaks of the whole process as the kernel counts them, measured with 12 to 101 frames of 512 x 512 to 4096 x 3072 pixels of 8 and
//! 16 bit in every way of matching, and rounded up by some 5 %: a need that is told is not exceeded.

use epirig_matcher::{Effort, MatchOptions};

/// What a process of this program takes before it holds any frame, in bytes, and what each of its threads takes.
const PROGRAM: u64 = 32 << 20;
const THREAD: u64 = 16 << 20;
/// Maps and planes of a match, in bytes for each pixel.
const MATCH: u64 = 172;
const FIRST_LOOK: u64 = 132;
/// Those of a calibration, of a rectification, and of what is asked of a surface.
const CALIBRATION: u64 = 50;
const RECTIFICATION: u64 = 26;
const SURFACE: u64 = 156;
/// Frames of a scan on their way, what a simulated rig renders of them included; and with those of an average.
const SCAN: u64 = 35;
const AVERAGED_SCAN: u64 = 50;
/// An image that is imported: of four channels of 16 bit, decoded, made grey, and encoded again.
const IMPORT: u64 = 24;

/// Frames and what is held of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Frames {
    /// How many.
    pub count: usize,
    /// Rows of each.
    pub rows: usize,
    /// Columns of each.
    pub columns: usize,
    /// Bytes of a sample: 1 of up to 8 bit, 2 of more, and of all frames that are rectified.
    pub sample_bytes: usize,
}

impl Frames {
    fn pixels(self) -> u64 {
        self.rows as u64 * self.columns as u64
    }

    /// All samples, with those of a few rows of each frame as numbers of 32 bit.
    fn bytes(self) -> u64 {
        let rows_at_once = 16 * threads() * self.columns as u64 * self.count as u64;
        self.pixels() * self.count as u64 * self.sample_bytes as u64 + rows_at_once
    }

    fn with(self, each_pixel: u64) -> u64 {
        self.bytes() + each_pixel * self.pixels() + PROGRAM + THREAD * threads()
    }
}

/// As many as work together, without starting them: where memory is short, that could fail.
fn threads() -> u64 {
    std::thread::available_parallelism().map_or(1, |count| count.get() as u64)
}

/// Bytes that matching `frames` takes at most.
pub fn match_need(frames: Frames, options: &MatchOptions) -> u64 {
    let need = frames.with(if options.effort == Effort::Quick { FIRST_LOOK } else { MATCH });
    // Bands of costs take up to half of what the frames take.
    let bands = if options.semi_global { (frames.bytes() / 2).max(32 << 20) } else { 0 };
    need + bands
}

/// Bytes that a calibration takes at most, of the `frames` of a scan and so many others, dark, flat and board frames, of the same size.
pub fn calibration_need(frames: Frames, others: usize) -> u64 {
    // The scan's frames are held rectified, the others as they are.
    let rectified = Frames { sample_bytes: 2, ..frames };
    rectified.with(CALIBRATION) + others as u64 * frames.pixels() * frames.sample_bytes as u64
}

/// Bytes that rectifying `frames` takes at most.
pub fn rectification_need(frames: Frames) -> u64 {
    Frames { sample_bytes: 2, ..frames }.with(RECTIFICATION)
}

/// Bytes that questions about a surface of `rows` x `columns` heights take at most.
pub fn surface_need(rows: usize, columns: usize) -> u64 {
    Frames { count: 0, rows, columns, sample_bytes: 1 }.with(SURFACE)
}

/// Bytes that taking frames of `rows` x `columns` takes at most; `deep`: of more than 8 bit, or averaged.
pub fn capture_need(rows: usize, columns: usize, deep: bool) -> u64 {
    let frames = Frames { count: 0, rows, columns, sample_bytes: 1 };
    frames.with(if deep { AVERAGED_SCAN } else { SCAN })
}

/// Bytes that importing images of `rows` x `columns` takes at most, whose files have up to `file_bytes`.
pub fn import_need(rows: usize, columns: usize, file_bytes: u64) -> u64 {
    Frames { count: 0, rows, columns, sample_bytes: 1 }.with(IMPORT) + file_bytes
}

/// The most of `frames` that matching takes no more than `bytes` for; `None` if not even two fit.
pub fn frames_that_fit(frames: Frames, options: &MatchOptions, bytes: u64) -> Option<usize> {
    let fits = |count: &usize| match_need(Frames { count: *count, ..frames }, options) <= bytes;
    (2..=frames.count).rev().find(fits)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_need_is_that_of_its_frames_and_of_its_maps() {
        let frames = Frames { count: 100, rows: 1000, columns: 1000, sample_bytes: 1 };
        let options = MatchOptions::default();
        let need = match_need(frames, &options);
        assert!((100_000_000 + 172_000_000..500_000_000).contains(&need), "{need}");
        assert!(match_need(frames, &options.clone().quick()) < need);
        assert_eq!(frames_that_fit(frames, &options, need), Some(100));
        let fewer = frames_that_fit(frames, &options, need - 50_000_000);
        assert!(fewer.is_some_and(|count| (50..60).contains(&count)), "{fewer:?}");
        assert_eq!(frames_that_fit(frames, &options, 100_000_000), None);
    }
}
