//! Dark frames, flat frames of a uniform target, and frames of a hand-held chess-board, taken before the
//! scan.

use std::collections::BTreeSet;

use tracing::{info, info_span, warn};

use super::archive::Archive;
use super::rig::Arrangement;
use super::scan::Scan;
use super::trust::{Trust, lost_trust};
use super::{CaptureError, CapturePlan, records};
use epirig_core::frame::Frame;
use epirig_data::sequence::{FrameFacts, FrameKind};
use epirig_devices::camera;

/// Existing calibration frames of a sequence: kind and index.
#[derive(Debug, Clone, Default)]
pub(super) struct Present(pub(super) BTreeSet<(FrameKind, usize)>);

impl Present {
    /// Whether all calibration frames of the plan exist.
    pub(super) fn is_all_of(&self, plan: &CapturePlan) -> bool {
        FrameKind::CALIBRATION.into_iter().all(|kind| self.lacking(plan, kind).is_empty())
    }

    /// The missing frames of a kind.
    fn lacking(&self, plan: &CapturePlan, kind: FrameKind) -> Vec<usize> {
        (0..plan.count(kind)).filter(|index| !self.0.contains(&(kind, *index))).collect()
    }
}

/// The arrangement in front of the camera for a frame of the plan.
fn arrangement(plan: &CapturePlan, kind: FrameKind, index: usize) -> Arrangement {
    match kind {
        FrameKind::Scan => Arrangement::Object,
        FrameKind::Dark => Arrangement::Dark,
        FrameKind::Flat => Arrangement::Flat,
        FrameKind::Board => Arrangement::Board { pose: index, poses: plan.section.board },
    }
}

/// Refuses a plan that needs an operator if none is present, before anything moves.
pub(super) fn refuse_unattended(plan: &CapturePlan) -> Result<(), CaptureError> {
    let first = FrameKind::CALIBRATION.into_iter().find(|kind| plan.count(*kind) > 0);
    first.map_or(Ok(()), |kind| Err(CaptureError::NotArranged(arrangement(plan, kind, 0).words())))
}

impl Scan<'_, '_> {
    /// Takes the missing calibration frames of the plan.
    pub(super) fn calibration_frames(
        &mut self,
        archive: &mut Archive,
        present: &Present,
    ) -> Result<(), CaptureError> {
        let mut arranged = Arrangement::Object;
        for kind in FrameKind::CALIBRATION {
            for index in present.lacking(self.plan, kind) {
                let _span = info_span!("frame", kind = kind.folder(), index).entered();
                let wanted = arrangement(self.plan, kind, index);
                let (frame, exposures) = if wanted == arranged {
                    self.look_now()?
                } else {
                    arranged = wanted;
                    self.look_at(wanted)?
                };
                let facts = FrameFacts {
                    camera_sequence: exposures.last().map(|exposure| exposure.sequence),
                    exposure: records::exposure_record(&exposures),
                    ..FrameFacts::default()
                };
                info!(sequence = facts.camera_sequence, "calibration frame taken");
                self.rig.watcher.frame(kind, index, &frame, &facts);
                archive.frame(kind, index, frame, facts)?;
                if self.rig.pause.pressed() {
                    return Err(CaptureError::Paused);
                }
            }
        }
        if arranged == Arrangement::Object { Ok(()) } else { self.arrange(Arrangement::Object) }
    }

    /// Asks for an arrangement, and takes a frame of it. A board that does not hold still is asked for again.
    fn look_at(&mut self, wanted: Arrangement) -> Result<(Frame, Vec<camera::FrameFacts>), CaptureError> {
        let mut attempt = 1;
        loop {
            let seen = self.arrange(wanted).and_then(|()| self.look_now());
            match seen {
                Err(error)
                    if matches!(wanted, Arrangement::Board { .. })
                        && lost_trust(&error) == Some(Trust::CameraStopped)
                        && attempt <= self.plan.limits.retakes =>
                {
                    warn!(attempt, reason = %error, "the frame is taken again");
                    self.rig.progress.note(&format!("{}, attempt {attempt}: {error}", wanted.words()));
                    attempt += 1;
                }
                other => return other,
            }
        }
    }

    fn look_now(&mut self) -> Result<(Frame, Vec<camera::FrameFacts>), CaptureError> {
        let now = self.camera().now();
        self.look(now)
    }

    /// Asks for an arrangement, and waits until the picture is steady.
    fn arrange(&mut self, arrangement: Arrangement) -> Result<(), CaptureError> {
        if !self.rig.assistant.arrange(arrangement, self.rig.camera) {
            return Err(CaptureError::NotArranged(arrangement.words()));
        }
        Ok(self.camera().start()?)
    }
}
