//! The scripted faults of a simulated rig, at the positions of its plan.

use super::RigError;
use super::plan::missing;
use crate::profile::Profile;
use epirig_devices::stage::StagePosition;
use epirig_devices::stage::simulator::{FaultInlet, StageFault};

/// A fault that has not yet happened.
#[derive(Debug, Clone, Copy)]
enum Planned {
    Stage(StageFault),
    /// That of the camera with this number.
    Camera(usize),
}

/// Faults that have not yet happened, each with the position of its frame, in mm from home.
#[derive(Debug, Default)]
pub(super) struct PlannedFaults(Vec<(f64, Planned)>);

impl PlannedFaults {
    /// Those of a profile; `has_line` says whether its stage is a simulated device at the end of a line.
    ///
    /// # Errors
    /// [`RigError`] if one of them cannot happen: the plan has no such frame, or stage or camera are of another kind.
    pub(super) fn of(profile: &Profile, has_line: bool) -> Result<Self, RigError> {
        let faults = &profile.sim.faults;
        if faults.stage.is_empty() && faults.camera.is_empty() {
            return Ok(Self::default());
        }
        if !faults.camera.is_empty() && !profile.camera.is_simulated() {
            return Err(faulty("the camera is not simulated; set camera.device = \"sim\"".to_owned()));
        }
        let positions_mm = profile.plan.positions_mm().ok_or_else(|| missing(&profile.plan))?;
        let at = |frame: u32, fault| {
            let position_mm = positions_mm.get(frame as usize).copied();
            position_mm.map(|position_mm| (position_mm, fault)).ok_or_else(|| {
                let last = positions_mm.len().saturating_sub(1);
                faulty(format!("there is no frame {frame}; the plan has frames 0 to {last}"))
            })
        };
        let of_stage = faults.stage.iter().map(|fault| match fault.lost_mm() {
            None if !has_line => Err(faulty(format!(
                "{fault} needs a stage at the end of a simulated line; set stage.driver to that of a stage with a line, such as native, \
                 and stage.port = \"sim\""
            ))),
            Some(_) if !profile.stage.is_simulated() => {
                Err(faulty(format!("{fault} needs a simulated stage; set stage.driver or stage.port to \"sim\"")))
            }
            _ => at(fault.number(), Planned::Stage(*fault)),
        });
        let of_camera =
            faults.camera.iter().enumerate().map(|(index, (frame, _))| at(*frame, Planned::Camera(index)));
        of_stage.chain(of_camera).collect::<Result<_, _>>().map(Self)
    }

    /// Lets those happen that belong to a position to which the stage is being sent.
    pub(super) fn sent_to(&mut self, sent_to_mm: f64, watch: &StagePosition, line: Option<&FaultInlet>) {
        /// Far below a step of any stage.
        const SAME_MM: f64 = 1e-6;
        for (_, fault) in
            self.0.extract_if(.., |(position_mm, _)| (*position_mm - sent_to_mm).abs() < SAME_MM)
        {
            match (fault, line) {
                (Planned::Camera(index), _) => watch.set_due(index),
                (Planned::Stage(fault), Some(line)) => line.in_next_move(fault),
                (Planned::Stage(fault), None) => watch.lose_steps(fault.lost_mm().unwrap_or_default()),
            }
        }
    }
}

fn faulty(reason: String) -> RigError {
    RigError::Value { key: "sim.faults", reason }
}
