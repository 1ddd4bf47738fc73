//! Memory that the steps need, before they begin.
//!
//! The numbers are peaks of the whole process as counted by the kernel. They were measured with 12 to 101
//! frames of 512 x 512 to 4096 x 3072 pixels, with 8 and 16 bit, for every way of matching, and rounded up by
//! about 5 %. So they are upper bounds.

use crate::calibrate::{MatchedFrames, PositionSource};
use epirig_calibration::texture_motion;
use epirig_core::volume::VolumeShape;
use epirig_matcher::MatchOptions;

/// Memory of the program without frames, and of each of its threads, in bytes.
const PROGRAM: u64 = 32 << 20;
const THREAD: u64 = 16 << 20;
/// Maps and images of a match, in bytes per pixel.
const MATCH: u64 = 172;
const FIRST_LOOK: u64 = 132;
/// The same of a block of rows, whose results are written later, in bytes per pixel of the block; and what writing the
/// results takes, in bytes per pixel of all.
const BLOCK: u64 = 100;
const RESULTS: u64 = 44;
/// The maps of a match whose blocks are joined in memory.
const JOINED: u64 = 17;
/// The maps of two matches and their differences, in bytes per pixel.
const EVALUATION: u64 = 100;
/// The same of steps of a calibration: dark level and flat field; the shift between two frames; and what the first one
/// leaves, its maps.
const PHOTOMETRY: u64 = 54;
const REGISTRATION: u64 = 36;
const MAPS: u64 = 8;
/// The same of a rectification, and of a surface.
const RECTIFICATION: u64 = 26;
const SURFACE: u64 = 156;
/// A band of the windows that tell how bright frames are, in bytes for each column of each frame: 64 rows of 16 bit, of
/// which 16 are looked at as 32 bit numbers, and two sums.
const BAND_OF_WINDOWS: u64 = 204;
/// Frames of a scan in memory, including those of a simulated rig; without and with averaging.
const SCAN: u64 = 35;
const AVERAGED_SCAN: u64 = 50;
/// An imported image: four channels of 16 bit, decoded, converted to grey, and encoded again.
const IMPORT: u64 = 24;

/// Number and size of frames in memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Frames {
    /// Number of frames.
    pub count: usize,
    /// Rows per frame.
    pub rows: usize,
    /// Columns per frame.
    pub columns: usize,
    /// Bytes per sample: 1 up to 8 bit, 2 for more, and for rectified frames.
    pub sample_bytes: usize,
}

impl Frames {
    /// Those of a volume of this shape.
    pub fn of(shape: &VolumeShape) -> Self {
        let sample_bytes = if shape.stored_bit_depth() > 8 { 2 } else { 1 };
        Self { count: shape.tau.frames(), rows: shape.rows, columns: shape.columns, sample_bytes }
    }

    fn pixels(self) -> u64 {
        self.rows as u64 * self.columns as u64
    }

    /// Bytes of all samples, and of a few rows of each frame as 32 bit numbers.
    fn bytes(self) -> u64 {
        let rows_at_once = 16 * threads() * self.columns as u64 * self.count as u64;
        self.pixels() * self.count as u64 * self.sample_bytes as u64 + rows_at_once
    }

    fn with(self, each_pixel: u64) -> u64 {
        self.bytes() + each_pixel * self.pixels() + PROGRAM + THREAD * threads()
    }
}

/// Number of worker threads, without starting them: that might fail if memory is short.
fn threads() -> u64 {
    std::thread::available_parallelism().map_or(1, |count| count.get() as u64)
}

/// Where the frames of a match are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Held {
    /// All of them in memory.
    InMemory,
    /// On disk as an array, of which the rows of a block are read.
    Packed,
}

/// Most bytes that matching `frames` takes.
pub fn match_need(frames: Frames, options: &MatchOptions, held: Held) -> u64 {
    let in_blocks = at_once(frames, options) != frames;
    let by_blocks = || band_need(frames, options).max(merge_need(frames, options));
    match held {
        Held::InMemory if in_blocks => by_blocks() + JOINED * frames.pixels() + frames.bytes(),
        Held::Packed if in_blocks => by_blocks(),
        _ => of_rows(frames, if options.quick { FIRST_LOOK } else { MATCH }, options),
    }
}

/// The rows of `frames` that are matched in one go.
fn at_once(frames: Frames, options: &MatchOptions) -> Frames {
    let Frames { count, rows, columns, sample_bytes } = frames;
    Frames { rows: options.rows_at_once(rows, columns, count * sample_bytes), ..frames }
}

/// Bytes for rows that are matched in one go, and so many for each pixel of theirs.
fn of_rows(frames: Frames, each_pixel: u64, options: &MatchOptions) -> u64 {
    // Bands of costs take up to half of the size of the frames.
    let bands = if options.semi_global { (frames.bytes() / 2).max(32 << 20) } else { 0 };
    frames.with(each_pixel) + bands
}

/// Most bytes that matching a band of `frames` takes: its blocks one after the other.
pub fn band_need(frames: Frames, options: &MatchOptions) -> u64 {
    match at_once(frames, options) {
        all if all == frames => match_need(frames, options, Held::InMemory),
        block => of_rows(block, BLOCK, options),
    }
}

/// Most bytes that merging the bands of `frames` takes.
pub fn merge_need(frames: Frames, options: &MatchOptions) -> u64 {
    match at_once(frames, options) {
        // Then the frames are in memory.
        all if all == frames => match_need(frames, options, Held::InMemory),
        _ => Frames { count: 0, ..frames }.with(RESULTS),
    }
}

/// Most bytes that a calibration takes, with the `frames` of a scan and `others`: the number of dark, flat
/// and board frames of the same size, which are held raw.
pub fn calibration_need(frames: Frames, others: usize, positions: PositionSource, held: Held) -> u64 {
    let rectified = match held {
        Held::InMemory => Frames { sample_bytes: 2, ..frames },
        Held::Packed => Frames { count: 0, ..frames },
    };
    let texture = match positions {
        PositionSource::Texture | PositionSource::Automatic => {
            rectified.with(MAPS) + texture_motion::need(frames.count, frames.rows, frames.columns)
        }
        _ => 0,
    };
    let windows = BAND_OF_WINDOWS * threads() * (frames.columns * frames.count) as u64;
    // One after the other.
    [
        Frames { count: others, ..frames }.with(PHOTOMETRY),
        rectification_need(frames),
        rectified.with(REGISTRATION),
        rectified.with(MAPS) + windows,
        texture,
    ]
    .into_iter()
    .fold(0, u64::max)
}

/// Most bytes that rectifying `frames` takes, and that packing them takes: some at a time are in memory.
pub fn rectification_need(frames: Frames) -> u64 {
    Frames { count: MatchedFrames::TOGETHER, sample_bytes: 2, ..frames }.with(RECTIFICATION)
}

/// Most bytes that the analysis of a surface of `rows` x `columns` heights takes.
pub fn surface_need(rows: usize, columns: usize) -> u64 {
    Frames { count: 0, rows, columns, sample_bytes: 1 }.with(SURFACE)
}

/// Most bytes that matching two halves of `frames` takes, for the analysis of their surface.
pub fn halves_need(frames: Frames, options: &MatchOptions, held: Held) -> u64 {
    let half = Frames { count: frames.count / 2 + 1, ..frames };
    // The maps of both halves stay, and are counted with the surface.
    let surface = surface_need(frames.rows, frames.columns);
    match held {
        // One half is copied and matched at a time, beside all frames.
        Held::InMemory => half.with(MATCH) + frames.bytes() + surface,
        Held::Packed => band_need(half, options) + surface,
    }
}

/// Most bytes that comparing two matches of `frames` takes, or predicting some of them.
pub fn evaluation_need(frames: Frames, options: &MatchOptions, held: Held) -> u64 {
    match held {
        Held::InMemory => match_need(Frames { count: 2 * frames.count, ..frames }, options, held),
        Held::Packed => band_need(frames, options) + EVALUATION * frames.pixels(),
    }
}

/// Most bytes that taking frames of `rows` x `columns` takes; `deep`: more than 8 bit, or averaged.
pub fn capture_need(rows: usize, columns: usize, deep: bool) -> u64 {
    let frames = Frames { count: 0, rows, columns, sample_bytes: 1 };
    frames.with(if deep { AVERAGED_SCAN } else { SCAN })
}

/// Most bytes that importing images of `rows` x `columns` takes, with files of up to `file_bytes`.
pub fn import_need(rows: usize, columns: usize, file_bytes: u64) -> u64 {
    Frames { count: 0, rows, columns, sample_bytes: 1 }.with(IMPORT) + file_bytes
}

/// The largest number of `frames` whose `need` is no more than `bytes`; `None` if not even two fit.
pub fn frames_that_fit(frames: Frames, bytes: u64, need: impl Fn(Frames) -> u64) -> Option<usize> {
    (2..=frames.count).rev().find(|&count| need(Frames { count, ..frames }) <= bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_need_is_that_of_its_frames_and_of_its_maps() {
        let frames = Frames { count: 100, rows: 1000, columns: 1000, sample_bytes: 1 };
        let options = MatchOptions::default();
        let need = match_need(frames, &options, Held::InMemory);
        let of_some = |some| match_need(some, &options, Held::InMemory);
        assert!((100_000_000 + 172_000_000..500_000_000).contains(&need), "{need}");
        assert!(match_need(frames, &options.clone().quick(), Held::InMemory) < need);
        assert_eq!(frames_that_fit(frames, need, of_some), Some(100));
        let fewer = frames_that_fit(frames, need - 50_000_000, of_some);
        assert!(fewer.is_some_and(|count| (50..60).contains(&count)), "{fewer:?}");
        assert_eq!(frames_that_fit(frames, 100_000_000, of_some), None);
    }

    #[test]
    fn positions_from_the_texture_take_the_frames_once_more_but_small() {
        // 24 MP, reduced by six: 2.7 MB each. Small frames are held as they are.
        for (rows, columns, each) in [(4000, 6000, 4 * 666 * 1000), (500, 700, 4 * 500 * 700)] {
            let frames = |count| Frames { count, rows, columns, sample_bytes: 1 };
            let need = |count| calibration_need(frames(count), 0, PositionSource::Texture, Held::InMemory);
            let held = |count| Frames { sample_bytes: 2, ..frames(count) }.with(MAPS);
            assert_eq!(need(30_000), held(30_000) + 30_000 * each);
            // Some pictures are held in full size.
            assert!(need(3) >= held(3) + 8 * 4 * (rows * columns) as u64, "{}", need(3));
        }
    }

    #[test]
    fn a_calibration_of_20_megapixels_takes_what_was_measured() {
        // 100 frames of 8 bit, 6 dark and 6 flat ones, with two threads: peaks of 4,655,920 and 1,331,332 KiB.
        let need = |count, held| {
            let frames = Frames { count, rows: 3648, columns: 5472, sample_bytes: 1 };
            calibration_need(frames, 12, PositionSource::Texture, held)
        };
        assert!(need(100, Held::InMemory) >= 4_655_920 << 10, "{}", need(100, Held::InMemory));
        assert!(need(100, Held::Packed) >= 1_331_332 << 10, "{}", need(100, Held::Packed));
        if threads() == 2 {
            assert!(need(100, Held::InMemory) < 6_000_000 << 10, "{}", need(100, Held::InMemory));
            assert!(need(300, Held::Packed) < 1_500_000 << 10, "{}", need(300, Held::Packed));
        }
    }
}
