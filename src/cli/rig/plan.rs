//! What is to be done with the rig.

use super::key_options::{KeyGroup, KeyOption, KeyOptions};

/// The plan of a scan.
pub(in crate::cli) type PlanArguments = KeyOptions<PlanKeys>;

/// The options of [`PlanArguments`].
#[derive(Debug)]
pub(in crate::cli) struct PlanKeys;

impl KeyGroup for PlanKeys {
    const HEADING: &'static str = "The plan";

    fn options() -> Vec<KeyOption> {
        KeyOption::all(&[
            "plan.step_mm",
            "plan.frames",
            "plan.start_mm",
            "plan.settle_ms",
            "plan.average",
            "limits.wait_s",
            "optics.focal_length_px",
        ])
    }
}
