//! The scripted faults of a simulated rig, at the positions of its plan.

use super::RigError;
use crate::profile::Profile;

/// The faults with the position of the frame of each, in mm from home.
///
/// # Errors
/// [`RigError`] if the plan has no such frame.
pub(super) fn at_positions<F: Copy>(
    faults: &[F],
    frame: impl Fn(&F) -> u32,
    profile: &Profile,
) -> Result<Vec<(f64, F)>, RigError> {
    if faults.is_empty() {
        return Ok(Vec::new());
    }
    let positions_mm =
        profile.plan.positions_mm().ok_or(RigError::NoPlan("plan.step and plan.frames are"))?;
    let at = |fault: &F| {
        let frame = frame(fault) as usize;
        let position_mm = positions_mm.get(frame).copied();
        position_mm.map(|position_mm| (position_mm, *fault)).ok_or_else(|| {
            let last = positions_mm.len().saturating_sub(1);
            faulty(format!("there is no frame {frame}; the plan has frames 0 to {last}"))
        })
    };
    faults.iter().map(at).collect()
}

pub(super) fn faulty(reason: String) -> RigError {
    RigError::Value { key: "sim.faults", reason }
}
