//! Reading a sequence's records and frames.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use super::error::SequenceError;
use super::pixels::{Header, decode_grey, header, with_bit_depth};
use super::record::{
    Event, ExitStatus, FORMAT_VERSION, FrameKind, FrameRecord, Origin, SequenceRecord, StopRecord,
};
use super::start_keys::StartKeys;
use crate::storage::{
    LARGEST_RECORD, hash, is_there, parse_record, read_file, read_inside, read_record, record_of_kinds,
};
use epirig_core::choice::Choice as _;
use epirig_core::frame::Frame;
use epirig_core::grid::area;
use epirig_core::tau::Tau;

/// The start record.
pub(super) const START: &str = "sequence.json";
/// Name of the journal in the folder of a sequence: what happened, one line per event.
pub const JOURNAL: &str = "journal.jsonl";
/// The final record.
pub(super) const STOP: &str = "stop.json";

/// Most frames that a sequence has, as in a profile's plan.
pub(super) const MOST_FRAMES: usize = 100_000;
/// Most lines of a journal: each frame may be taken again a few times.
const MOST_LINES: usize = 5 * MOST_FRAMES;
/// Largest journal: [`MOST_FRAMES`] lines, each ten times as long as a frame's usually is.
pub(super) const LARGEST_JOURNAL: u64 = 1 << 30;

/// The problem of a scan that was not closed.
const NOT_CLOSED: &str =
    "the scan was not closed: the rig did not stay as it was, so the positions of its frames are wrong";

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
    /// [`SequenceError`] naming the record that is missing, of another version, not to be understood, or
    /// holds what cannot be.
    pub fn open(folder: &Path) -> Result<Self, SequenceError> {
        let path = folder.join(START);
        if path.symlink_metadata().is_err() {
            return Err(SequenceError::NotASequence(folder.to_owned()));
        }
        let bytes = read_file(&path, LARGEST_RECORD)?;
        let record: SequenceRecord = record_of_kinds::<_, StartKeys>(&path, bytes, FORMAT_VERSION)?;
        if let Some(reason) = impossible(&record) {
            return Err(SequenceError::BadRecord { path, line: None, reason });
        }
        let stop_path = folder.join(STOP);
        let ended = is_there(&stop_path).map_err(SequenceError::io("look at", &stop_path))?;
        let stop = if ended { Some(read_record(&stop_path, FORMAT_VERSION)?) } else { None };
        let events = read_journal(&folder.join(JOURNAL))?;
        let frames = named_frames(&events, FrameKind::Scan);
        Ok(Self { folder: folder.to_owned(), record, frames, events, stop })
    }

    /// The folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Name of the folder, as a person calls the sequence.
    pub fn name(&self) -> String {
        let absolute = std::path::absolute(&self.folder).unwrap_or_else(|_| self.folder.clone());
        let name = absolute.file_name().map(|name| name.to_string_lossy().into_owned());
        name.unwrap_or_else(|| absolute.display().to_string())
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

    /// The events of the journal, line by line, frames included.
    pub fn events(&self) -> &[Event] {
        &self.events
    }

    /// The final record, if the sequence has ended.
    pub fn stop(&self) -> Option<&StopRecord> {
        self.stop.as_ref()
    }

    /// How the scan ended, as results have it: the status in `stop.json`, or `unfinished` without one.
    pub fn ended(&self) -> &'static str {
        self.stop.as_ref().map_or("unfinished", |stop| stop.exit_status.name())
    }

    /// The end of the scan in words, for a person; `None` if it is complete.
    pub fn end_in_words(&self) -> Option<String> {
        let (there, planned) = (self.frames.len(), self.record.frames);
        let how = match self.stop.as_ref().map(|stop| stop.exit_status) {
            Some(ExitStatus::Complete) if there == planned => return None,
            Some(ExitStatus::Complete) => {
                format!("the scan is recorded as complete, but {there} of {planned} planned frames are there")
            }
            Some(ExitStatus::NotClosed) => NOT_CLOSED.to_owned(),
            Some(ExitStatus::Aborted | ExitStatus::Failed) => {
                format!(
                    "the scan ended before it was complete: {there} of {planned} planned frames are there"
                )
            }
            None => format!("the scan has not ended: {there} of {planned} planned frames are there"),
        };
        let reason = self.stop.as_ref().and_then(|stop| stop.reason.as_ref());
        Some(reason.map_or(how.clone(), |reason| format!("{how} ({reason})")))
    }

    /// Refuses a scan whose positions are known to be wrong.
    ///
    /// # Errors
    /// [`SequenceError::NotClosed`].
    pub fn check_closed(&self) -> Result<(), SequenceError> {
        match &self.stop {
            Some(stop) if stop.exit_status == ExitStatus::NotClosed => Err(SequenceError::NotClosed {
                folder: self.folder.clone(),
                reason: stop.reason.clone().unwrap_or_else(|| "no reason is recorded".to_owned()),
            }),
            _ => Ok(()),
        }
    }

    /// tau of the frames that are there: from reported positions, else from commanded ones, else by count.
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

    /// Reads a frame and checks it against the records: its hash first, then its size and format, and only
    /// then its pixels.
    ///
    /// # Errors
    /// [`SequenceError`] if the file is missing, changed, outside the sequence's folder or no file at all;
    /// and [`SequenceError::RecordAtFault`] if it is as it was written, but the records say otherwise.
    pub fn read(&self, named: &FrameRecord) -> Result<Frame, SequenceError> {
        let bytes = self.bytes(named)?;
        // From here on the file is the one that was written, so a contradiction is one of the records.
        let (record, file) = (&self.record, &named.file);
        let wrong = |record: &str, reason: String| {
            Err(SequenceError::RecordAtFault { path: self.folder.join(record), reason })
        };
        if bytes.len() as u64 != named.bytes {
            let found = format!("it says that {file} has {} bytes, but it has {}", named.bytes, bytes.len());
            return wrong(JOURNAL, found);
        }
        let stored_bits = if record.bit_depth <= 8 { 8 } else { 16 };
        let expected = describe(record.rows, record.columns, stored_bits);
        let found = match header(&bytes) {
            Ok(Header { rows, columns, bits }) => describe(rows, columns, bits),
            Err(fault) => {
                return wrong(START, format!("it says {expected}, but {file} is no such image: {fault}"));
            }
        };
        if found != expected {
            return wrong(START, format!("it says {expected}, but {file} is {found}"));
        }
        match decode_grey(&bytes).map_err(|fault| fault.to_string()).and_then(|image| {
            with_bit_depth(image.frame, record.bit_depth).map_err(|fault| fault.to_string())
        }) {
            Ok(frame) => match brightness(&frame) {
                (mean_dn, saturated) if (mean_dn, saturated) == (named.mean_dn, named.saturated) => Ok(frame),
                (mean_dn, saturated) => wrong(
                    JOURNAL,
                    format!(
                        "it says that {file} has a mean of {} DN and {} samples at full scale, but it has {mean_dn} DN and {saturated}",
                        named.mean_dn, named.saturated
                    ),
                ),
            },
            Err(fault) => wrong(START, format!("it says {} bit, but {file}: {fault}", record.bit_depth)),
        }
    }

    /// The bytes of a frame's file, checked against its hash.
    pub(super) fn bytes(&self, named: &FrameRecord) -> Result<Vec<u8>, SequenceError> {
        let path = self.path(named);
        let bytes = read_inside(&self.folder, &named.file, self.largest_file()).map_err(|error| {
            if error.is_missing() { SequenceError::MissingFrame(path.clone()) } else { error.into() }
        })?;
        if hash(&bytes) != named.blake3 {
            return Err(match self.is_as_described(named, &bytes) {
                true => SequenceError::RecordAtFault {
                    path: self.folder.join(JOURNAL),
                    reason: format!(
                        "its hash of {} is not the file's, but all else that it says of it is",
                        named.file
                    ),
                },
                false => SequenceError::HashMismatch(path),
            });
        }
        Ok(bytes)
    }

    /// Whether a file with another hash than the journal's has the size and the brightness that the journal
    /// tells: then the hash is wrong.
    fn is_as_described(&self, record: &FrameRecord, bytes: &[u8]) -> bool {
        let (rows, columns) = (self.record.rows, self.record.columns);
        let is_so_large = header(bytes).is_ok_and(|header| (header.rows, header.columns) == (rows, columns));
        if !is_so_large || bytes.len() as u64 != record.bytes {
            return false;
        }
        let image = decode_grey(bytes).ok();
        let frame = image.and_then(|image| with_bit_depth(image.frame, self.record.bit_depth).ok());
        frame.is_some_and(|frame| brightness(&frame) == (record.mean_dn, record.saturated))
    }

    /// Largest number of bytes of a frame's file: incompressible samples become little larger, and some
    /// programs add text.
    fn largest_file(&self) -> u64 {
        const TEXT: u64 = 16 << 20;
        let samples = (self.record.rows * self.record.columns) as u64;
        2 * samples * u64::from(self.record.bit_depth.div_ceil(8)) + TEXT
    }
}

/// Mean in DN, and samples at full scale: the same sums over the same samples, written and read back to the
/// last bit.
fn brightness(frame: &Frame) -> (f64, usize) {
    (frame.samples().mean(), frame.samples().count_at_least(frame.full_scale()))
}

/// The first impossible value of a start record; `None` if all are possible.
fn impossible(record: &SequenceRecord) -> Option<String> {
    let SequenceRecord { rows, columns, bit_depth, frames, .. } = *record;
    if area(rows, columns).is_none() || !(1..=16).contains(&bit_depth) {
        return Some(format!("frames of {columns} x {rows} of {bit_depth} bit cannot be"));
    }
    if !(1..=MOST_FRAMES).contains(&frames) {
        return Some(format!("a plan of {frames} frames cannot be; 1 to {MOST_FRAMES} can"));
    }
    if let Origin::Rectified { original_bit_depth, dn_per_sample, .. } = record.origin
        && !((1..=16).contains(&original_bit_depth) && dn_per_sample > 0.0)
    {
        return Some(format!("the original frames cannot have had {original_bit_depth} bit"));
    }
    if let Origin::Rectified { focal_length_sigma, baseline_sigma, .. } = record.origin
        && let Some(sigma) = [focal_length_sigma, baseline_sigma]
            .into_iter()
            .flatten()
            .find(|sigma| !(sigma.is_finite() && *sigma >= 0.0))
    {
        return Some(format!("a relative standard uncertainty of {sigma} cannot be"));
    }
    record.intrinsics.and_then(|intrinsics| intrinsics.impossible(rows, columns))
}

fn read_journal(path: &Path) -> Result<Vec<Event>, SequenceError> {
    let bytes = read_file(path, LARGEST_JOURNAL).map_err(|error| match error.is_missing() {
        true => {
            SequenceError::BadRecord { path: path.to_owned(), line: None, reason: "it is missing".to_owned() }
        }
        false => error.into(),
    })?;
    let mut events = Vec::new();
    let mut lines = bytes.split_inclusive(|byte| *byte == b'\n').enumerate().peekable();
    while let Some((index, line)) = lines.next() {
        if index == MOST_LINES {
            let reason = format!("a journal has {MOST_LINES} lines at most");
            return Err(SequenceError::BadRecord { path: path.to_owned(), line: Some(index + 1), reason });
        }
        match event(line) {
            Ok(event) => events.push(event),
            // The last line is cut short if the program was killed while it wrote; the frame that it names
            // was not promised.
            Err(_) if lines.peek().is_none() && !line.ends_with(b"\n") => {}
            Err(reason) => {
                return Err(SequenceError::BadRecord {
                    path: path.to_owned(),
                    line: Some(index + 1),
                    reason,
                });
            }
        }
    }
    Ok(events)
}

/// The event in a line of the journal.
pub(super) fn event(line: &[u8]) -> Result<Event, String> {
    let text = std::str::from_utf8(line).map_err(|error| format!("not text in UTF-8 ({error})"))?;
    parse_record(text).map_err(|fault| {
        // The record that the event holds tells which key is wrong, without its kind.
        match parse_record::<FrameRecord>(text) {
            Err(of_frame) if !of_frame.key.is_empty() => of_frame.to_string(),
            _ => fault.to_string(),
        }
    })
}

/// The frames of a kind, by index: of those of one index that supersede each other the last.
fn named_frames(events: &[Event], wanted: FrameKind) -> Vec<FrameRecord> {
    let mut frames: Vec<FrameRecord> = Vec::new();
    let mut places: HashMap<usize, usize> = HashMap::new();
    let named = events.iter().filter_map(Event::frame).filter(|(kind, _)| *kind == wanted);
    for (_, frame) in named {
        match places.get(&frame.index) {
            Some(&earlier) if frame.supersedes => frames[earlier] = frame.clone(),
            _ => {
                places.entry(frame.index).or_insert(frames.len());
                frames.push(frame.clone());
            }
        }
    }
    frames.sort_by_key(|frame| frame.index);
    frames
}

/// A size and depth in words, for comparing and for saying.
pub(super) fn describe(rows: usize, columns: usize, bits: u8) -> String {
    format!("{columns} x {rows} of {bits} bit")
}
