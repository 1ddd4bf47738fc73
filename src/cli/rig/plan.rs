//! What is to be done with the rig.

use super::key_options::{KeyGroup, KeyOption, KeyOptions};
use epirig_core::settings::quantity::{MM, MS, PX, S};

/// The plan of a scan.
pub(in crate::cli) type PlanArguments = KeyOptions<PlanKeys>;

/// The options of [`PlanArguments`].
#[derive(Debug)]
pub(in crate::cli) struct PlanKeys;

impl KeyGroup for PlanKeys {
    const HEADING: &'static str = "The plan";

    fn options() -> Vec<KeyOption> {
        [
            KeyOption::quantity("plan.step", MM),
            KeyOption::plain("plan.frames"),
            KeyOption::quantity("plan.start", MM),
            KeyOption::quantity("plan.settle", MS),
            KeyOption::plain("plan.average"),
            KeyOption::quantity("limits.wait", S),
            KeyOption::quantity("optics.focal_length", PX),
        ]
        .into_iter()
        .flatten()
        .collect()
    }
}
