//! Frames as pictures: raw, or corrected and rectified.

use std::sync::{Arc, Mutex, PoisonError};

use serde::{Deserialize, Serialize};

use super::pyramid::{Pyramid, Reduction};
use crate::calibrate::{Calibration, frames_in_order, rectifier};
use crate::panel::PanelError;
use crate::pipeline::frame_in_dn;
use epirig_calibration::photometry::Maps;
use epirig_calibration::rectification::Rectifier;
use epirig_data::sequence::Sequence;

/// Frames that are kept in memory, for somebody who plays them up and down.
const KEPT: usize = 8;

/// Whether a frame is as captured, or corrected and rectified.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(rename_all = "kebab-case")]
pub(in crate::panel) enum FrameKind {
    Raw,
    Rectified,
}

/// A frame that was asked for lately.
type Kept = (usize, FrameKind, Arc<Pyramid>);

pub(super) struct Frames {
    sequence: Sequence,
    calibration: Option<(Calibration, Maps)>,
    rectifier: Mutex<Option<Arc<Rectifier>>>,
    kept: Mutex<Vec<Kept>>,
}

impl Frames {
    pub(super) fn new(sequence: Sequence, calibration: Option<(Calibration, Maps)>) -> Self {
        Self { sequence, calibration, rectifier: Mutex::default(), kept: Mutex::default() }
    }

    /// The kinds that there are.
    pub(super) fn kinds(&self) -> Vec<FrameKind> {
        let rectified = self.calibration.is_some().then_some(FrameKind::Rectified);
        std::iter::once(FrameKind::Raw).chain(rectified).collect()
    }

    /// Frame `t`, raw or of another kind.
    ///
    /// # Errors
    /// [`PanelError`] if there is no such frame, or it cannot be read.
    pub(super) fn picture_of(&self, t: usize, kind: Option<FrameKind>) -> Result<Arc<Pyramid>, PanelError> {
        let kind = kind.unwrap_or(FrameKind::Raw);
        if !self.kinds().contains(&kind) {
            return Err(PanelError::NotThere("there is no rectified frame".to_owned()));
        }
        self.picture(t, kind)
    }

    /// The frame as the matcher saw it.
    pub(super) fn as_matched(&self, t: usize) -> Result<Arc<Pyramid>, PanelError> {
        self.picture(t, if self.calibration.is_some() { FrameKind::Rectified } else { FrameKind::Raw })
    }

    fn picture(&self, t: usize, kind: FrameKind) -> Result<Arc<Pyramid>, PanelError> {
        let lock = || self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((.., picture)) = lock().iter().find(|(index, of, _)| (*index, *of) == (t, kind)) {
            return Ok(Arc::clone(picture));
        }
        if t >= self.sequence.frames().len() {
            return Err(PanelError::NotThere(format!("there is no frame {t}")));
        }
        let rectifier = match (kind, &self.calibration) {
            (FrameKind::Rectified, Some((calibration, maps))) => Some(self.rectifier(calibration, maps)?),
            _ => None,
        };
        let calibration = self.calibration.as_ref().map(|(calibration, _)| calibration);
        let frames = frames_in_order(&self.sequence, calibration);
        let grid = frame_in_dn(&self.sequence, &frames, t, rectifier.as_deref())?;
        let picture = Arc::new(Pyramid::new(grid, Reduction::Mean));
        let mut kept = lock();
        if kept.len() == KEPT {
            kept.remove(0);
        }
        kept.push((t, kind, Arc::clone(&picture)));
        Ok(picture)
    }

    /// Made once: it has a place for each pixel.
    fn rectifier(&self, calibration: &Calibration, maps: &Maps) -> Result<Arc<Rectifier>, PanelError> {
        let mut made = self.rectifier.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(rectifier) = &*made {
            return Ok(Arc::clone(rectifier));
        }
        let new = Arc::new(rectifier(&self.sequence, calibration, maps)?);
        *made = Some(Arc::clone(&new));
        Ok(new)
    }
}
