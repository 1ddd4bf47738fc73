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

impl InputHashes {
    /// Hashes from the journal of a sequence. Files are checked against the journal whenever they are read.
    pub fn of(sequence: &Sequence) -> Self {
        let [dark, flat, board] = [FrameKind::Dark, FrameKind::Flat, FrameKind::Board]
            .map(|kind| sequence.calibration_frames(kind));
        Self {
            frames: hash(sequence.frames()),
            dark: hash(&dark),
            flat: hash(&flat),
            board: hash(&board),
            counts: [sequence.frames().len(), dark.len(), flat.len(), board.len()],
        }
    }

    /// The first difference to `now` in words; `None` if there is none.
    pub fn difference(&self, now: &Self) -> Option<String> {
        let hashes =
            |inputs: &Self| [&inputs.frames, &inputs.dark, &inputs.flat, &inputs.board].map(String::clone);
        let changed = hashes(self).into_iter().zip(hashes(now)).position(|(before, now)| before != now)?;
        let kind = ["frames of the scan", "dark frames", "flat frames", "board frames"][changed];
        let (before, now) = (self.counts[changed], now.counts[changed]);
        Some(match before == now {
            true => format!("the {kind} have changed since it was made"),
            false => format!("it was made of {before} {kind}, now there are {now}"),
        })
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
