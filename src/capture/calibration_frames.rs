//! Dark frames and frames of a uniform target, before the scan.

use super::archive::Archive;
use super::rig::Arrangement;
use super::scan::Scan;
use super::{CaptureError, records};
use crate::sequence::{Event, FrameFacts, FrameKind};

/// Calibration frames that a sequence has.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Present {
    dark: usize,
    flat: usize,
}

impl Present {
    pub(super) fn of(events: &[Event]) -> Self {
        let count = |wanted: fn(&Event) -> bool| events.iter().filter(|event| wanted(event)).count();
        Self {
            dark: count(|event| matches!(event, Event::Dark(_))),
            flat: count(|event| matches!(event, Event::Flat(_))),
        }
    }
}

impl Scan<'_, '_> {
    /// Takes those that are planned and not yet there.
    pub(super) fn calibration_frames(
        &mut self,
        archive: &mut Archive,
        present: Present,
    ) -> Result<(), CaptureError> {
        let wanted = [
            (FrameKind::Dark, Arrangement::Dark, present.dark..self.plan.dark),
            (FrameKind::Flat, Arrangement::Flat, present.flat..self.plan.flat),
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
