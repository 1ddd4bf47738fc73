//! From raw frames to the volume, eight at a time.

use std::ops::Range;
use std::sync::Mutex;

use fearless_simd::{Level, dispatch};
use rayon::prelude::*;

use super::correction::{Replaced, correct_row, mean_around, prepared, replaced_in_row};
use super::kernels::{self, LANES, Pixel, Taps};
use super::spline::{BEFORE, HORIZON, PAD, filter_gain, mirrored};
use super::view::ROUNDING_PX;
use super::whole::WholeFrames;
use super::{FramePose, Mapping, RectifyError};
use crate::photometry::Correction;
use epirig_core::frame::{Frame, FrameFormat, Samples};
use epirig_core::spline::quintic::TAPS;
use epirig_core::tau::Tau;
use epirig_core::volume::{Volume, VolumeShape};

/// Rectified rows that are made together. Each band filters the raw rows that it needs for itself, with
/// [`HORIZON`] more on either side. So bands are independent, and the result does not depend on the number of
/// threads.
const BAND: usize = 64;
/// If bands, each for itself, would filter the raw rows together more often than this, whole frames are
/// filtered instead: a row that is turned by 8 deg leads through many raw ones.
const MOST_FILTERED: usize = 8;

/// Puts frames, corrected and resampled, into a volume.
///
/// ```
/// use epirig_core::frame::{Frame, Samples};
/// use epirig_calibration::lens::Lens;
/// use epirig_calibration::photometry::Correction;
/// use epirig_calibration::rectification::{Mapping, Rectifier};
/// use epirig_core::tau::Tau;
///
/// let mapping = Mapping::fitting(Lens::pinhole(1000.0, 31.5, 23.5), 0.01, 0.0, 48, 64)?;
/// let rectifier = Rectifier::new(mapping, Correction::default())?;
/// let frame = Frame::new(48, 64, 8, Samples::U8(vec![100; 48 * 64]))?;
/// let mut volume = rectifier.volume(8, Tau::equidistant(3)?);
/// rectifier.insert(&mut volume, 0, &[frame.clone(), frame.clone(), frame])?;
/// let mut row = vec![0.0; volume.columns()];
/// volume.copy_row(5, 2, &mut row);
/// assert!(row.iter().all(|&value| (value - 100.0).abs() <= 1.0 / 128.0));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct Rectifier {
    mapping: Mapping,
    correction: Correction,
    replaced: Vec<Replaced>,
    /// For each rectified pixel the first of its coefficients in the padded raw image; empty for the
    /// identity, like the next two.
    starts: Vec<u32>,
    /// Its column less the whole part.
    fractions_x: Vec<f32>,
    /// Its row less the whole part.
    fractions_y: Vec<f32>,
    /// Rows of the padded raw image that the taps of each band lie in.
    bands: Vec<Range<usize>>,
    /// What samples whole frames; `None`: bands of eight frames are sampled.
    pub(super) whole: Option<WholeFrames>,
    /// Buffers that are not in use.
    buffers: Mutex<Vec<Buffers>>,
    level: Level,
}

/// Buffers of one band.
#[derive(Debug, Default)]
struct Buffers {
    coefficients: Vec<Pixel>,
    across: Vec<f32>,
    down: Vec<f32>,
    counts: Vec<[u16; LANES]>,
}

impl Rectifier {
    /// For frames of the mean camera: finds the place of every rectified pixel in the raw image.
    ///
    /// # Errors
    /// [`RectifyError`] if a rectified pixel lies outside the raw image, or the correction does not fit it.
    pub fn new(mapping: Mapping, correction: Correction) -> Result<Self, RectifyError> {
        let mut rectifier = Self::without_places(mapping, correction)?;
        rectifier.find_places()?;
        Ok(rectifier)
    }

    /// For frames with poses of their own: `poses[i]` is that of the frame at place i of the volume. No
    /// poses: all frames have the mean camera.
    ///
    /// Unlike [`Self::new`] it takes any mapping: a pixel that a frame does not show takes the value of the
    /// nearest place on the frame's border. [`Mapping::seen`] tells these pixels. With poses frames are
    /// sampled one after the other, each by all threads.
    ///
    /// # Errors
    /// [`RectifyError`] if the images are too large, or the correction does not fit the raw image.
    pub fn with_poses(
        mapping: Mapping,
        correction: Correction,
        poses: Vec<FramePose>,
    ) -> Result<Self, RectifyError> {
        let mut rectifier = Self::without_places(mapping, correction)?;
        // Frames of one camera that show every pixel have their places in common. The only error is a pixel
        // that they do not show.
        if !poses.is_empty() || rectifier.find_places().is_err() {
            rectifier.whole = Some(WholeFrames::new(&mapping, &poses));
        }
        Ok(rectifier)
    }

    fn without_places(mapping: Mapping, correction: Correction) -> Result<Self, RectifyError> {
        let (rows, columns) = (mapping.raw_rows, mapping.raw_columns);
        let camera = mapping.camera;
        let too_large = |rows: usize, columns: usize| rows.saturating_mul(columns) > u32::MAX as usize;
        if too_large(rows.saturating_add(2 * PAD), WholeFrames::stride(columns)) {
            return Err(RectifyError::TooLarge { rows, columns });
        }
        if too_large(camera.rows, camera.columns) {
            return Err(RectifyError::TooLarge { rows: camera.rows, columns: camera.columns });
        }
        let replaced = prepared(&correction, rows, columns)?;
        Ok(Self {
            mapping,
            correction,
            replaced,
            starts: Vec::new(),
            fractions_x: Vec::new(),
            fractions_y: Vec::new(),
            bands: Vec::new(),
            whole: None,
            buffers: Mutex::default(),
            level: Level::new(),
        })
    }

    /// The mapping.
    pub fn mapping(&self) -> &Mapping {
        &self.mapping
    }

    /// An empty volume for rectified frames of a camera of `bit_depth` bits.
    pub fn volume(&self, bit_depth: u8, tau: Tau) -> Volume {
        Volume::fine(self.mapping.camera.rows, self.mapping.camera.columns, bit_depth, tau)
    }

    /// The same without its samples.
    pub fn shape(&self, bit_depth: u8, tau: Tau) -> VolumeShape {
        let (rows, columns) = (self.mapping.camera.rows, self.mapping.camera.columns);
        VolumeShape { rows, columns, bit_depth, fine: true, frame_gains: vec![1.0; tau.frames()], tau }
    }

    /// Corrects and resamples `frames` and puts them into a fine `volume`, the first at place `first_index`.
    /// Eight at a time go as fast as one.
    ///
    /// # Errors
    /// [`RectifyError`] if the volume is not one that [`Self::volume`] makes or has no such places, or a
    /// frame has no pose, or not the raw size or the volume's bit depth. The volume is then as it was.
    pub fn insert(
        &self,
        volume: &mut Volume,
        first_index: usize,
        frames: &[Frame],
    ) -> Result<(), RectifyError> {
        self.insert_as(volume, (first_index, first_index), frames)
    }

    /// The same for a volume of other frames: the first of `frames` goes to a place of it, and has the pose with
    /// another number.
    ///
    /// # Errors
    /// As [`Self::insert`].
    pub fn insert_as(
        &self,
        volume: &mut Volume,
        (first_index, first_pose): (usize, usize),
        frames: &[Frame],
    ) -> Result<(), RectifyError> {
        self.check(volume, (first_index, first_pose), frames)?;
        let (all, columns) = (volume.frames(), volume.columns());
        let counts_per_dn = 1.0 / volume.dn_per_count();
        let Some(counts) = volume.fine_counts_mut() else { return Ok(()) };
        if let Some(whole) = &self.whole {
            for (offset, frame) in frames.iter().enumerate() {
                let index = first_index + offset;
                let load = |y: usize, row: &mut [f32]| {
                    correct_row(&self.correction, &self.replaced, frame, y, row);
                };
                let epis = counts.par_chunks_exact_mut((all * columns).max(1));
                let rows = epis.map(|epi| &mut epi[index * columns..(index + 1) * columns]);
                whole.make(first_pose + offset, counts_per_dn, load, rows);
            }
            return Ok(());
        }
        for (chunk, frames) in frames.chunks(LANES).enumerate() {
            let first = (first_index + LANES * chunk) * columns;
            let places = first..first + frames.len() * columns;
            // The first frame stands in for missing ones; their results are dropped.
            let lanes: [&Frame; LANES] = std::array::from_fn(|lane| frames.get(lane).unwrap_or(&frames[0]));
            counts.par_chunks_mut((BAND * all * columns).max(1)).enumerate().for_each(|(band, epis)| {
                let taken = self.buffers.lock().ok().and_then(|mut free| free.pop());
                let mut buffers = taken.unwrap_or_default();
                let rows = epis.chunks_exact_mut((all * columns).max(1)).map(|epi| &mut epi[places.clone()]);
                self.fill_band(band, lanes, counts_per_dn, rows, &mut buffers);
                if let Ok(mut free) = self.buffers.lock() {
                    free.push(buffers);
                }
            });
        }
        Ok(())
    }

    fn check(
        &self,
        volume: &Volume,
        (first_index, first_pose): (usize, usize),
        frames: &[Frame],
    ) -> Result<(), RectifyError> {
        let camera = self.mapping.camera;
        let needed = first_index.saturating_add(frames.len());
        let (frames_there, found) = (volume.frames(), (volume.rows(), volume.columns()));
        let expected = (camera.rows, camera.columns);
        if found != expected || !volume.is_fine() || needed > frames_there {
            return Err(RectifyError::Volume { frames: frames_there, found, needed, expected });
        }
        let posed = self.whole.as_ref().and_then(WholeFrames::posed);
        let needed = first_pose.saturating_add(frames.len());
        if let Some(poses) = posed.filter(|&poses| poses < needed) {
            return Err(RectifyError::Poses { poses, needed });
        }
        let (rows, columns) = (self.mapping.raw_rows, self.mapping.raw_columns);
        let expected = FrameFormat { rows, columns, bit_depth: volume.bit_depth() };
        let unlike =
            (first_index..).zip(frames.iter().map(Frame::format)).find(|(_, found)| *found != expected);
        let Some((index, found)) = unlike else { return Ok(()) };
        Err(RectifyError::Frame { index, found, expected })
    }

    /// Finds the places that all frames have in common, or that whole frames are to be sampled.
    fn find_places(&mut self) -> Result<(), RectifyError> {
        let mapping = self.mapping;
        let (rows, columns) = (mapping.camera.rows, mapping.camera.columns);
        if mapping.is_identity() && (rows, columns) == (mapping.raw_rows, mapping.raw_columns) {
            return Ok(());
        }
        let stride = mapping.raw_columns + 2 * PAD;
        let rotation = mapping.rotation();
        let mut all_starts = vec![0; rows * columns];
        let mut all_fractions_x = vec![0.0; rows * columns];
        let mut all_fractions_y = vec![0.0; rows * columns];
        let within = |place: f64, size: usize| {
            let last = size as f64 - 1.0;
            (place >= -ROUNDING_PX && place <= last + ROUNDING_PX).then(|| place.clamp(0.0, last.max(0.0)))
        };
        let width = columns.max(1);
        let lines = all_starts.par_chunks_mut(width).zip(all_fractions_x.par_chunks_mut(width));
        let lines = lines.zip(all_fractions_y.par_chunks_mut(width)).enumerate();
        let outside: Vec<_> = lines
            .map(|(y, ((starts, fractions_x), fractions_y))| {
                let places = starts.iter_mut().zip(fractions_x).zip(fractions_y);
                for (x, ((start, fraction_x), fraction_y)) in places.enumerate() {
                    let (a, b) = mapping.raw_ray(&rotation, x as f64, y as f64);
                    let (raw_x, raw_y) = mapping.lens.pixel(a, b);
                    let places = (within(raw_x, mapping.raw_columns), within(raw_y, mapping.raw_rows));
                    let (Some(raw_x), Some(raw_y)) = places else {
                        return Some(RectifyError::Outside { x, y });
                    };
                    let (column, row) = (raw_x.floor(), raw_y.floor());
                    let first = (row as usize + PAD - BEFORE) * stride + column as usize + PAD - BEFORE;
                    *start = first as u32;
                    *fraction_x = (raw_x - column) as f32;
                    *fraction_y = (raw_y - row) as f32;
                }
                None
            })
            .collect();
        if let Some(error) = outside.into_iter().flatten().next() {
            return Err(error);
        }
        let rows_of = |starts: &[u32]| {
            let first = starts.iter().min().map_or(0, |&start| start as usize / stride);
            let last = starts.iter().max().map_or(0, |&start| start as usize / stride);
            first..last + TAPS
        };
        let bands: Vec<Range<usize>> = all_starts.chunks(BAND * width).map(rows_of).collect();
        let filtered: usize = bands.iter().map(|rows| rows.len() + 2 * HORIZON).sum();
        if filtered > MOST_FILTERED * (mapping.raw_rows + 2 * HORIZON) {
            self.whole = Some(WholeFrames::new(&mapping, &[]));
            return Ok(());
        }
        self.bands = bands;
        (self.starts, self.fractions_x, self.fractions_y) = (all_starts, all_fractions_x, all_fractions_y);
        Ok(())
    }

    /// Makes the rectified rows of one band: all frames of a chunk one after the other in each of `rows`.
    fn fill_band<'a>(
        &self,
        band: usize,
        frames: [&Frame; LANES],
        counts_per_dn: f32,
        rows: impl Iterator<Item = &'a mut [u16]>,
        buffers: &mut Buffers,
    ) {
        let columns = self.mapping.camera.columns;
        buffers.counts.resize(columns, [0; LANES]);
        if self.starts.is_empty() {
            buffers.coefficients.resize(columns, [0.0; LANES]);
            for (y, row) in (band * BAND..).zip(rows) {
                self.load_row(frames, y, &mut buffers.coefficients);
                let Buffers { coefficients, counts, .. } = &mut *buffers;
                dispatch!(self.level, _simd => kernels::scale(coefficients, counts_per_dn, counts));
                kernels::separate(counts, row.chunks_exact_mut(columns));
            }
            return;
        }
        let stride = self.mapping.raw_columns + 2 * PAD;
        let first_row = self.find_coefficients(band, frames, stride, &mut buffers.coefficients);
        buffers.across.resize(TAPS * columns, 0.0);
        buffers.down.resize(TAPS * columns, 0.0);
        for (y, row) in (band * BAND..).zip(rows) {
            let line = y * columns..(y + 1) * columns;
            let factor = counts_per_dn / filter_gain();
            let [right, down] = [&self.fractions_x, &self.fractions_y].map(|all| &all[line.clone()]);
            dispatch!(self.level, _simd => kernels::weight_rows(right, 1.0, &mut buffers.across));
            dispatch!(self.level, _simd => kernels::weight_rows(down, factor, &mut buffers.down));
            let taps = Taps {
                coefficients: &buffers.coefficients,
                stride,
                starts: &self.starts[line],
                offset: first_row * stride,
                across: &buffers.across,
                down: &buffers.down,
            };
            dispatch!(self.level, _simd => kernels::sample(taps, &mut buffers.counts));
            kernels::separate(&buffers.counts, row.chunks_exact_mut(columns));
        }
    }

    /// Fills `coefficients` with those that the taps of a band need; returns the row of the padded image with
    /// which they begin.
    fn find_coefficients(
        &self,
        band: usize,
        frames: [&Frame; LANES],
        stride: usize,
        coefficients: &mut Vec<Pixel>,
    ) -> usize {
        let (raw_rows, raw_columns) = (self.mapping.raw_rows, self.mapping.raw_columns);
        let needed = &self.bands[band];
        let first_row = needed.start - HORIZON;
        let padded = first_row..needed.end + HORIZON;
        coefficients.resize(padded.len() * stride, [0.0; LANES]);
        for (row, line) in padded.zip(coefficients.chunks_exact_mut(stride)) {
            let y = mirrored(row as isize - PAD as isize, raw_rows);
            self.load_row(frames, y, &mut line[PAD..PAD + raw_columns]);
            for outside in (0..PAD).chain(PAD + raw_columns..stride) {
                line[outside] = line[PAD + mirrored(outside as isize - PAD as isize, raw_columns)];
            }
            dispatch!(self.level, _simd => kernels::filter_row(line));
        }
        dispatch!(self.level, _simd => kernels::filter_columns(coefficients, stride));
        first_row
    }

    /// Row `y` of the frames, corrected.
    fn load_row(&self, frames: [&Frame; LANES], y: usize, out: &mut [Pixel]) {
        let range = y * out.len()..(y + 1) * out.len();
        let narrow = frames.map(|frame| match frame.samples() {
            Samples::U8(values) => &values[range.clone()],
            Samples::U16(_) => &[],
        });
        let wide = frames.map(|frame| match frame.samples() {
            Samples::U8(_) => &[],
            Samples::U16(values) => &values[range.clone()],
        });
        // All frames have one bit depth, hence one type.
        if wide[0].is_empty() {
            dispatch!(self.level, _simd => kernels::interleave(narrow, out));
        } else {
            dispatch!(self.level, _simd => kernels::interleave(wide, out));
        }
        if let Some(dark) = &self.correction.subtract {
            dispatch!(self.level, _simd => kernels::subtract(out, dark.row(y)));
        }
        if let Some(gain) = &self.correction.multiply {
            dispatch!(self.level, _simd => kernels::multiply(out, gain.row(y)));
        }
        for pixel in replaced_in_row(&self.replaced, y) {
            out[pixel.x] = frames.map(|frame| mean_around(&self.correction, frame, pixel));
        }
    }
}
