//! A frame made smaller: each value is the mean of a square of pixels.

use epirig_core::frame::{Frame, Samples};
use epirig_core::grid::area;
use epirig_core::image::square_sums;

/// The time of a map grows as its number of values times the number of frames and this: the search and the
/// windows of the fit take as long as so many frames, however many there are.
const FRAMES_OF_THE_REST: usize = 220;
/// Largest of these products. The map of 110 frames of 256 x 256 values takes 0.3 s on one core of a desktop
/// computer. The shortest stops of a scan take 0.5 s.
const MOST_WORK: usize = 65_536 * (FRAMES_OF_THE_REST + 110);
/// Fewer values than this show no map, however many frames there are.
const FEWEST_VALUES: usize = 64 * 64;

/// Counts of a [fine volume](epirig_core::volume::Volume::fine) from 0 to full scale.
const FINE_COUNTS: u64 = 32_768;

/// A frame of means.
#[derive(Debug, Clone)]
pub(super) struct Binned {
    /// Side of the squares, in px.
    pub(super) bin: usize,
    /// Bit depth of the camera.
    pub(super) bit_depth: u8,
    /// The means in counts of a fine volume, which keep fractions of the camera's levels.
    pub(super) counts: Frame,
}

/// The smallest squares by which a map of `planned` frames of `rows` x `columns` is made in time; their side
/// in px.
pub(super) fn bin_for(rows: usize, columns: usize, planned: usize) -> usize {
    let most = (MOST_WORK / FRAMES_OF_THE_REST.saturating_add(planned)).max(FEWEST_VALUES);
    let largest = rows.min(columns).max(1);
    (1..largest).find(|bin| (rows / bin) * (columns / bin) <= most).unwrap_or(largest)
}

impl Binned {
    /// Means of `bin` x `bin` pixels of `frame`; `None` if it has no pixels.
    pub(super) fn of(frame: &Frame, bin: usize) -> Option<Self> {
        area(frame.rows(), frame.columns())?;
        let sums: Vec<u64> = match frame.samples() {
            Samples::U8(samples) => square_sums(samples, frame.columns(), bin),
            Samples::U16(samples) => square_sums(samples, frame.columns(), bin),
        };
        let divisor = ((bin * bin) as u64) << frame.bit_depth();
        let means = sums.iter().map(|sum| ((sum * FINE_COUNTS + divisor / 2) / divisor) as u16).collect();
        let counts = Frame::new(frame.rows() / bin, frame.columns() / bin, 16, Samples::U16(means)).ok()?;
        Some(Self { bin, bit_depth: frame.bit_depth(), counts })
    }

    /// Whether both can be frames of one scan.
    pub(super) fn is_like(&self, other: &Self) -> bool {
        let kind = |one: &Self| (one.bin, one.bit_depth, one.counts.rows(), one.counts.columns());
        kind(self) == kind(other)
    }
}
