//! What a calibration was made of, so that it is noticed when that changes.

use serde::{Deserialize, Serialize};

use epirig_data::sequence::{FrameKind, FrameRecord, Sequence};

/// Hashes of all frames that a calibration was made of.
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
    /// Frames of the scan, dark, flat and board frames.
    pub counts: [usize; 4],
}

/// What has changed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Stale {
    /// The frames that have.
    pub kind: FrameKind,
    /// How many there were.
    pub before: usize,
    /// How many there are.
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
    /// Those of a sequence as its journal names them; the files are checked against it whenever they are read.
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

    /// What is different in `now`; `None` if nothing is.
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
        // Positions count: tau is made of them.
        let position = frame.reported_mm.or(frame.commanded_mm).unwrap_or(f64::NAN);
        hasher.update(frame.blake3.as_bytes()).update(&position.to_le_bytes());
    }
    hasher.finalize().to_hex().to_string()
}
