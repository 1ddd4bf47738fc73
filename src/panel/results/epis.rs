//! Rows of all frames, at once: EPIs without the volume in memory.

use std::ops::Range;
use std::sync::{Condvar, Mutex, PoisonError};
use std::time::{Duration, Instant};

use tracing::info;

use crate::calibrate::{Calibration, MatchedFrames};
use crate::panel::PanelError;
use crate::panel::background::background;
use crate::pipeline::{PipelineError, packed_volume};
use epirig_calibration::photometry::Maps;
use epirig_core::frame::{Frame, Samples};
use epirig_core::progress::Silent;
use epirig_core::volume::{Volume, VolumeShape};
use epirig_data::packed::PackedVolume;
use epirig_data::sequence::Sequence;
use epirig_data::storage::ScratchFile;

/// Longest time that an answer waits for frames.
const PATIENCE: Duration = Duration::from_secs(20);

/// The frames of a sequence as the matcher saw them: its packed volume, or a file without a name, of rows x frames x
/// columns of 16-bit counts. So an EPI is one piece of the file.
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

enum Ready {
    /// The volume on disk.
    Packed(PackedVolume),
    Unpacked {
        file: ScratchFile,
        shape: VolumeShape,
    },
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

    /// Opens the packed volume; or reads the frames, a few at a time, and puts each of their rows in its place.
    fn kept(&self) -> Result<Ready, PanelError> {
        let Self { sequence, calibration, .. } = self;
        if let Some(packed) = packed_volume(sequence, calibration.as_ref(), &Silent)? {
            return Ok(Ready::Packed(packed));
        }
        let frames =
            MatchedFrames::of(sequence, calibration.as_ref().map(|(calibration, maps)| (calibration, maps)))?;
        let shape = frames.shape().clone();
        let file = ScratchFile::on_the_disk_of(sequence.folder()).map_err(PanelError::Keep)?;
        let all = frames.records().len();
        for first in (0..all).step_by(MatchedFrames::TOGETHER) {
            let few = frames.group(first)?;
            let count = MatchedFrames::TOGETHER.min(all - first);
            for y in 0..shape.rows {
                let place = ((y * all + first) * shape.columns * 2) as u64;
                file.write_at(&counts(&few, y, count), place).map_err(PanelError::Keep)?;
            }
            *self.lock() = State::Reading { done: first + count };
        }
        Ok(Ready::Unpacked { file, shape })
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

impl Ready {
    fn rows(&self, rows: Range<usize>) -> Result<Volume, PanelError> {
        let shape = match self {
            Self::Unpacked { shape, .. } => shape,
            Self::Packed(packed) => packed.shape(),
        };
        let rows = rows.start.min(shape.rows)..rows.end.min(shape.rows);
        let file = match self {
            Self::Unpacked { file, .. } => file,
            Self::Packed(packed) => return Ok(packed.rows(rows, &Silent).map_err(PipelineError::from)?),
        };
        let (frames, columns) = (shape.tau.frames(), shape.columns);
        let mut bytes = vec![0; rows.len() * frames * columns * 2];
        file.read_at(&mut bytes, (rows.start * frames * columns * 2) as u64).map_err(PanelError::Keep)?;
        let counts: Vec<u16> =
            bytes.chunks_exact(2).map(|pair| u16::from_le_bytes([pair[0], pair[1]])).collect();
        let mut volume = shape.of_rows(rows.len());
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
        Ok(volume)
    }
}
