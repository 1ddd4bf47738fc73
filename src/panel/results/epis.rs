//! Rows of all frames, at once: EPIs without the volume in memory.

use std::ops::Range;
use std::sync::{Condvar, Mutex, PoisonError};
use std::time::{Duration, Instant};

use rayon::prelude::*;
use tracing::info;

use crate::calibrate::{Calibration, frames_in_order, rectifier};
use crate::panel::PanelError;
use crate::panel::background::background;
use epirig_calibration::photometry::Maps;
use epirig_core::frame::{Frame, Samples};
use epirig_core::tau::Tau;
use epirig_core::volume::Volume;
use epirig_data::sequence::{Sequence, SequenceError};
use epirig_data::storage::ScratchFile;

/// Frames that are read together; the lanes of the rectifier.
const TOGETHER: usize = 8;
/// Longest time that an answer waits for frames.
const PATIENCE: Duration = Duration::from_secs(20);

/// The frames of a sequence as the matcher saw them, in a file without a name: rows x frames x columns of
/// 16-bit counts. So an EPI is one piece of the file.
pub(super) struct Epis {
    sequence: Sequence,
    calibration: Option<(Calibration, Maps)>,
    state: Mutex<State>,
    changed: Condvar,
}

enum State {
    /// Nothing was asked for yet.
    Waiting,
    Reading {
        done: usize,
    },
    Ready(Box<Ready>),
    Failed(String),
}

struct Ready {
    file: ScratchFile,
    shape: Shape,
}

/// The volume without its samples.
#[derive(Debug, Clone)]
struct Shape {
    rows: usize,
    columns: usize,
    bit_depth: u8,
    fine: bool,
    tau: Tau,
    gains: Vec<f32>,
}

impl Epis {
    pub(super) fn new(sequence: Sequence, calibration: Option<(Calibration, Maps)>) -> Self {
        Self { sequence, calibration, state: Mutex::new(State::Waiting), changed: Condvar::new() }
    }

    /// Reads all frames, unless they are read or being read.
    pub(super) fn read(&self) {
        let mut state = self.lock();
        if !matches!(*state, State::Waiting) {
            return;
        }
        *state = State::Reading { done: 0 };
        drop(state);
        let begun = Instant::now();
        // What is asked for meanwhile comes first.
        let kept = match background("frames", 0) {
            Some(pool) => pool.install(|| self.kept()),
            None => self.kept(),
        };
        let found = match kept {
            Ok(ready) => State::Ready(Box::new(ready)),
            Err(error) => State::Failed(error.to_string()),
        };
        info!(seconds = begun.elapsed().as_secs_f64(), "frames read for the view");
        *self.lock() = found;
        self.changed.notify_all();
    }

    /// The volume of these rows alone, with all frames.
    ///
    /// # Errors
    /// [`PanelError`] if frames cannot be read, or are not all there yet.
    pub(super) fn rows(&self, rows: Range<usize>) -> Result<Volume, PanelError> {
        let until = Instant::now() + PATIENCE;
        if matches!(*self.lock(), State::Waiting) {
            self.read();
        }
        let mut state = self.lock();
        loop {
            match &*state {
                State::Ready(ready) => return ready.rows(rows),
                State::Failed(reason) => return Err(PanelError::Wrong(reason.clone())),
                State::Waiting | State::Reading { .. } => {}
            }
            let left = until.saturating_duration_since(Instant::now());
            if left.is_zero() {
                let done = if let State::Reading { done } = *state { done } else { 0 };
                return Err(PanelError::Reading { done, all: self.sequence.frames().len() });
            }
            let waited = self.changed.wait_timeout(state, left);
            state = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Reads the frames, a few at a time, and puts each of their rows in its place.
    fn kept(&self) -> Result<Ready, PanelError> {
        let Self { sequence, calibration, .. } = self;
        let record = sequence.record();
        let calibrated = match calibration {
            Some((calibration, maps)) => Some((calibration, rectifier(sequence, calibration, maps)?)),
            None => None,
        };
        let (rows, columns) =
            calibrated.as_ref().map_or((record.rows, record.columns), |(calibration, _)| {
                (calibration.mapping.camera.rows, calibration.mapping.camera.columns)
            });
        let original_bits = record.origin.original_bit_depth();
        let tau = match &calibrated {
            Some((calibration, _)) => Tau::from_positions(&calibration.positions.tau)?,
            None => sequence.tau()?,
        };
        let gains = calibrated.as_ref().and_then(|(calibration, _)| calibration.gains());
        let shape = Shape {
            rows,
            columns,
            bit_depth: original_bits.unwrap_or(record.bit_depth),
            fine: calibrated.is_some() || original_bits.is_some(),
            gains: gains.map_or_else(
                || vec![1.0; tau.frames()],
                |gains| gains.iter().map(|gain| (1.0 / gain) as f32).collect(),
            ),
            tau,
        };
        let file = ScratchFile::on_the_disk_of(sequence.folder()).map_err(PanelError::Keep)?;
        let all = shape.tau.frames();
        let in_order = frames_in_order(sequence, calibration.as_ref().map(|(calibration, _)| calibration));
        for (chunk, records) in in_order.chunks(TOGETHER).enumerate() {
            let frames: Result<Vec<Frame>, SequenceError> =
                records.par_iter().map(|record| sequence.read(record)).collect();
            let mut few = shape.volume(rows, Tau::equidistant(TOGETHER)?);
            match &calibrated {
                Some((_, rectifier)) => rectifier.insert_as(&mut few, (0, chunk * TOGETHER), &frames?)?,
                None => {
                    for (index, frame) in frames?.iter().enumerate() {
                        let put = if shape.fine {
                            few.insert_counts(index, frame)
                        } else {
                            few.insert(index, frame)
                        };
                        put?;
                    }
                }
            }
            for y in 0..rows {
                let bytes = counts(&few, y, records.len());
                let place = ((y * all + chunk * TOGETHER) * columns * 2) as u64;
                file.write_at(&bytes, place).map_err(PanelError::Keep)?;
            }
            *self.lock() = State::Reading { done: (chunk * TOGETHER + records.len()).min(all) };
        }
        Ok(Ready { file, shape })
    }
}

/// Row `y` of the first `frames` frames as 16-bit counts.
fn counts(volume: &Volume, y: usize, frames: usize) -> Vec<u8> {
    let mut row = vec![0.0; volume.columns()];
    let mut bytes = Vec::with_capacity(2 * frames * row.len());
    let per_dn = 1.0 / volume.dn_per_count();
    for t in 0..frames {
        volume.copy_row(y, t, &mut row);
        // Counts are whole numbers up to 65535, which 32-bit floats hold exactly.
        bytes.extend(row.iter().flat_map(|dn| ((dn * per_dn).round() as u16).to_le_bytes()));
    }
    bytes
}

impl Shape {
    /// An empty volume of this kind.
    fn volume(&self, rows: usize, tau: Tau) -> Volume {
        match self.fine {
            true => Volume::fine(rows, self.columns, self.bit_depth, tau),
            false => Volume::new(rows, self.columns, self.bit_depth, tau),
        }
    }
}

impl Ready {
    fn rows(&self, rows: Range<usize>) -> Result<Volume, PanelError> {
        let Self { file, shape } = self;
        let (frames, columns) = (shape.tau.frames(), shape.columns);
        let rows = rows.start.min(shape.rows)..rows.end.min(shape.rows);
        let mut bytes = vec![0; rows.len() * frames * columns * 2];
        file.read_at(&mut bytes, (rows.start * frames * columns * 2) as u64).map_err(PanelError::Keep)?;
        let counts: Vec<u16> =
            bytes.chunks_exact(2).map(|pair| u16::from_le_bytes([pair[0], pair[1]])).collect();
        let mut volume = shape.volume(rows.len(), shape.tau.clone());
        if let Some(target) = volume.fine_counts_mut() {
            target.copy_from_slice(&counts);
        } else {
            for t in 0..frames {
                let of_frame = (0..rows.len()).flat_map(|y| {
                    let start = (y * frames + t) * columns;
                    counts[start..start + columns].iter().copied()
                });
                let samples = match shape.bit_depth {
                    ..=8 => Samples::U8(of_frame.map(|count| count as u8).collect()),
                    _ => Samples::U16(of_frame.collect()),
                };
                let frame = Frame::new(rows.len(), columns, shape.bit_depth, samples);
                let frame = frame.map_err(|error| PanelError::Wrong(error.to_string()))?;
                volume.insert(t, &frame)?;
            }
        }
        for (t, gain) in shape.gains.iter().enumerate() {
            volume.set_frame_gain(t, *gain);
        }
        Ok(volume)
    }
}
