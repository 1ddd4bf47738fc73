//! Dark frames and frames of a uniform target, before the scan.

use super::archive::Archive;
use super::rig::Arrangement;
use super::scan::Scan;
use super::{CaptureError, CapturePlan, records};
use crate::sequence::{FrameFacts, FrameKind};

/// Calibration frames that a sequence has, by index.
#[derive(Debug, Clone, Default)]
pub(super) struct Present {
    pub(super) dark: Vec<usize>,
    pub(super) flat: Vec<usize>,
}

impl Present {
    /// Whether these are all that a plan wants.
    pub(super) fn is_all_of(&self, plan: &CapturePlan) -> bool {
        (0..plan.dark).all(|index| self.dark.contains(&index))
            && (0..plan.flat).all(|index| self.flat.contains(&index))
    }
}

impl Scan<'_, '_> {
    /// Takes those that are planned and not yet there.
    pub(super) fn calibration_frames(
        &mut self,
        archive: &mut Archive,
        present: &Present,
    ) -> Result<(), CaptureError> {
        let lacking = |planned: usize, present: &[usize]| -> Vec<usize> {
            (0..planned).filter(|index| !present.contains(index)).collect()
        };
        let wanted = [
            (FrameKind::Dark, Arrangement::Dark, lacking(self.plan.dark, &present.dark)),
            (FrameKind::Flat, Arrangement::Flat, lacking(self.plan.flat, &present.flat)),
        ];
        let mut arranged = false;
        for (kind, arrangement, indices) in wanted {
            if indices.is_empty() {
                continue;
            }
            self.arrange(arrangement)?;
            arranged = true;
            for index in indices {
                let now = self.camera().now();
                let (frame, exposures) = self.look(now)?;
                let facts = FrameFacts {
                    camera_sequence: exposures.last().map(|exposure| exposure.sequence),
                    exposure: records::exposure_record(&exposures),
                    ..FrameFacts::default()
                };
                archive.frame(kind, index, frame, facts)?;
                if self.rig.pause.pressed() {
                    return Err(CaptureError::Paused);
                }
            }
        }
        if arranged { self.arrange(Arrangement::Object) } else { Ok(()) }
    }

    /// Has something put in front of the camera, and waits until the picture is steady.
    fn arrange(&mut self, arrangement: Arrangement) -> Result<(), CaptureError> {
        if !self.rig.assistant.arrange(arrangement) {
            return Err(CaptureError::NotArranged { what: arrangement.words() });
        }
        Ok(self.camera().start()?)
    }
}
