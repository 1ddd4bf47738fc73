//! Inputs of a calibration, to notice when they change.

use serde::{Deserialize, Serialize};

use epirig_data::sequence::{FrameKind, FrameRecord, Sequence};

/// Hashes of all frames that a calibration used.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct InputHashes {
    /// BLAKE3 over names and hashes of the frames of the scan.
    pub frames: String,
    /// The same for dark frames.
    pub dark: String,
    /// The same for flat frames.
    pub flat: String,
    /// The same for board frames.
    pub board: String,
    /// Numbers of frames: scan, dark, flat, board.
    pub counts: [usize; 4],
}

/// A change of the inputs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Stale {
    /// The kind of the frames.
    pub kind: FrameKind,
    /// Former number of frames.
    pub before: usize,
    /// Present number of frames.
    pub now: usize,
}

impl std::fmt::Display for Stale {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let kind = match self.kind {
            FrameKind::Scan => "frames of the scan",
            FrameKind::Dark => "dark frames",
            FrameKind::Flat => "flat frames",
            FrameKind::Board => "board frames",
        };
        if self.before == self.now {
            write!(formatter, "the {kind} have changed since it was made")
        } else {
            write!(formatter, "it was made of {} {kind}, now there are {}", self.before, self.now)
        }
    }
}

const KINDS: [FrameKind; 3] = [FrameKind::Dark, FrameKind::Flat, FrameKind::Board];

impl InputHashes {
    /// Hashes from the journal of a sequence. Files are checked against the journal whenever they are read.
    pub fn of(sequence: &Sequence) -> Self {
        let [dark, flat, board] = KINDS.map(|kind| sequence.calibration_frames(kind));
        Self {
            frames: hash(sequence.frames()),
            dark: hash(&dark),
            flat: hash(&flat),
            board: hash(&board),
            counts: [sequence.frames().len(), dark.len(), flat.len(), board.len()],
        }
    }

    /// The first difference to `now`; `None` if there is none.
    pub fn difference(&self, now: &Self) -> Option<Stale> {
        let hashes =
            |inputs: &Self| [&inputs.frames, &inputs.dark, &inputs.flat, &inputs.board].map(String::clone);
        let changed = hashes(self).into_iter().zip(hashes(now)).position(|(before, now)| before != now)?;
        let kind = [FrameKind::Scan, KINDS[0], KINDS[1], KINDS[2]][changed];
        Some(Stale { kind, before: self.counts[changed], now: now.counts[changed] })
    }
}

fn hash(frames: &[FrameRecord]) -> String {
    let mut hasher = blake3::Hasher::new();
    for frame in frames {
        // Positions are included, because tau depends on them.
        let position = frame.reported_mm.or(frame.commanded_mm).unwrap_or(f64::NAN);
        hasher.update(frame.blake3.as_bytes()).update(&position.to_le_bytes());
    }
    hasher.finalize().to_hex().to_string()
}
