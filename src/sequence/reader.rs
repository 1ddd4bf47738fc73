//! Reading a sequence's records and frames.

use std::fs;
use std::path::{Path, PathBuf};

use serde::de::DeserializeOwned;

use super::error::SequenceError;
use super::pixels::{decode_grey, with_bit_depth};
use super::record::{Event, FORMAT_VERSION, FrameKind, FrameRecord, SequenceRecord, StopRecord};
use crate::frame::Frame;
use crate::tau::Tau;

/// The start record.
pub(super) const START: &str = "sequence.json";
/// What happened.
pub(super) const JOURNAL: &str = "journal.jsonl";
/// The final record.
pub(super) const STOP: &str = "stop.json";

/// A sequence on disk, its records read and understood.
#[derive(Debug, Clone, PartialEq)]
pub struct Sequence {
    folder: PathBuf,
    record: SequenceRecord,
    frames: Vec<FrameRecord>,
    events: Vec<Event>,
    stop: Option<StopRecord>,
}

impl Sequence {
    /// Reads the records in `folder`; frames are read when asked for.
    ///
    /// # Errors
    /// [`SequenceError`] naming the record that is missing, of another version or not to be understood.
    pub fn open(folder: &Path) -> Result<Self, SequenceError> {
        let path = folder.join(START);
        if !path.exists() {
            return Err(SequenceError::NotASequence { path: folder.to_owned() });
        }
        let record: SequenceRecord = read_record(&path)?;
        if record.rows == 0 || record.columns == 0 || !(1..=16).contains(&record.bit_depth) {
            let reason = format!(
                "frames of {} x {} of {} bit cannot be",
                record.columns, record.rows, record.bit_depth
            );
            return Err(SequenceError::BadRecord { path, line: None, reason });
        }
        let stop_path = folder.join(STOP);
        let stop = if stop_path.exists() { Some(read_record(&stop_path)?) } else { None };
        let journal = folder.join(JOURNAL);
        let bytes = fs::read(&journal).map_err(SequenceError::io("read", &journal))?;
        let text = String::from_utf8_lossy(&bytes);
        let bad = |line, reason| SequenceError::BadRecord { path: journal.clone(), line: Some(line), reason };
        let mut events = Vec::new();
        for (index, line) in text.lines().enumerate() {
            match serde_json::from_str(line) {
                Ok(event) => events.push(event),
                // The last line is cut short if the program was killed while it wrote; what it names was not promised.
                Err(_) if index + 1 == text.lines().count() && !text.ends_with('\n') => {}
                Err(error) => return Err(bad(index + 1, error.to_string())),
            }
        }
        let frames = named_frames(&events, FrameKind::Scan);
        Ok(Self { folder: folder.to_owned(), record, frames, events, stop })
    }

    /// The folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The start record.
    pub fn record(&self) -> &SequenceRecord {
        &self.record
    }

    /// The frames that the journal names, by index.
    pub fn frames(&self) -> &[FrameRecord] {
        &self.frames
    }

    /// Calibration frames that the journal names, by index.
    pub fn calibration_frames(&self, kind: FrameKind) -> Vec<FrameRecord> {
        named_frames(&self.events, kind)
    }

    /// What happened, line by line, frames included.
    pub fn events(&self) -> &[Event] {
        &self.events
    }

    /// The final record, if the sequence has ended.
    pub fn stop(&self) -> Option<&StopRecord> {
        self.stop.as_ref()
    }

    /// tau of the frames that are there: from reported positions, else from those asked for, else by count.
    ///
    /// # Errors
    /// [`SequenceError`] if there are fewer than two frames or their positions do not increase.
    pub fn tau(&self) -> Result<Tau, SequenceError> {
        let positions = self.positions_mm();
        let tau = match &positions {
            Some(positions) => Tau::from_positions(positions),
            None => {
                Tau::from_positions(&self.frames.iter().map(|frame| frame.index as f64).collect::<Vec<_>>())
            }
        };
        match tau {
            Ok(tau) => Ok(tau),
            Err(_) if self.frames.len() < 2 => {
                Err(SequenceError::TooFewFrames { path: self.folder.clone(), count: self.frames.len() })
            }
            Err(source) => Err(SequenceError::Positions { path: self.folder.join(JOURNAL), source }),
        }
    }

    /// Position of each frame that is there, in mm, if all are known.
    pub fn positions_mm(&self) -> Option<Vec<f64>> {
        self.frames.iter().map(|frame| frame.reported_mm.or(frame.commanded_mm)).collect()
    }

    /// File of a frame.
    pub fn path(&self, frame: &FrameRecord) -> PathBuf {
        self.folder.join(&frame.file)
    }

    /// Reads a frame and checks it against the records.
    ///
    /// # Errors
    /// [`SequenceError`] if the file is missing, changed, damaged or not of the recorded size and bit depth.
    pub fn read(&self, frame: &FrameRecord) -> Result<Frame, SequenceError> {
        let path = self.path(frame);
        let bytes = fs::read(&path).map_err(|source| match source.kind() {
            std::io::ErrorKind::NotFound => SequenceError::MissingFrame { path: path.clone() },
            _ => SequenceError::Io { action: "read", path: path.clone(), source },
        })?;
        let decoded = decode_grey(&bytes);
        if blake3::hash(&bytes).to_hex().as_str() != frame.blake3 {
            return Err(match decoded {
                Err(reason) => SequenceError::BadImage { path, reason },
                Ok(_) => SequenceError::HashMismatch { path },
            });
        }
        let image = decoded.map_err(|reason| SequenceError::BadImage { path: path.clone(), reason })?.frame;
        let record = &self.record;
        let expected = describe(record.rows, record.columns, if record.bit_depth <= 8 { 8 } else { 16 });
        let found = describe(image.rows(), image.columns(), image.bit_depth());
        if found != expected {
            let first = self.folder.join(START);
            return Err(SequenceError::Unlike { path, found, first, expected });
        }
        with_bit_depth(image, record.bit_depth).map_err(|source| SequenceError::BitDepth { path, source })
    }
}

/// The frames of a kind, by index: of those of one index that supersede each other the last.
fn named_frames(events: &[Event], wanted: FrameKind) -> Vec<FrameRecord> {
    let mut frames: Vec<FrameRecord> = Vec::new();
    let named = events.iter().filter_map(Event::frame).filter(|(kind, _)| *kind == wanted);
    for (_, frame) in named {
        match frames.iter_mut().find(|earlier| earlier.index == frame.index) {
            Some(earlier) if frame.supersedes => *earlier = frame.clone(),
            _ => frames.push(frame.clone()),
        }
    }
    frames.sort_by_key(|frame| frame.index);
    frames
}

/// A size and depth in words, for comparing and for saying.
pub(super) fn describe(rows: usize, columns: usize, bits: u8) -> String {
    format!("{columns} x {rows} of {bits} bit")
}

fn read_record<T: DeserializeOwned>(path: &Path) -> Result<T, SequenceError> {
    let bad = |error: serde_json::Error| SequenceError::BadRecord {
        path: path.to_owned(),
        line: Some(error.line()),
        reason: error.to_string(),
    };
    let text = fs::read_to_string(path).map_err(SequenceError::io("read", path))?;
    let value: serde_json::Value = serde_json::from_str(&text).map_err(bad)?;
    // The version is looked at first: the fields of another version would only confuse.
    let found = value.get("format").and_then(serde_json::Value::as_u64).unwrap_or(0) as u32;
    if found != FORMAT_VERSION {
        return Err(SequenceError::Version { path: path.to_owned(), found, expected: FORMAT_VERSION });
    }
    serde_json::from_value(value).map_err(bad)
}
