//! The sections `plan` and `limits`: what is scanned, and how well.

use std::time::Duration;

use super::section::{Allowed, Kind, measure, section};
use epirig_core::settings::quantity::{MIN, MM, MS, PERCENT, PX, UM};

section! {
    /// The scan: positions and frames.
    pub struct PlanProfile in "plan" {
        /// Position of the first frame, from home.
        "start" => start_mm: f64 = measure(MM, Allowed::ZeroOrMore), like "10 mm" or "0 mm";
        /// Distance between stops.
        "step" => step_mm: Option<f64> = measure(MM, Allowed::Positive), like "1.5 mm";
        /// Number of frames: one more than steps.
        "frames" => frames: Option<usize> = Kind::Whole(2, 100_000), like "101";
        /// Time for which the stage vibrates after a move.
        "settle" => settle: Duration = measure(MS, Allowed::ZeroOrMore), like "100 ms" or "200 ms";
        /// Number of frames averaged at each stop, into one of 16 bit.
        "average" => average: usize = Kind::Whole(1, 65_536), like "4" or "1";
        /// Number of dark frames, taken without light.
        "dark" => dark: usize = Kind::Whole(0, 1_000), like "16" or "0";
        /// Number of frames of a uniform target, for the flat field.
        "flat" => flat: usize = Kind::Whole(0, 1_000), like "16" or "0";
        /// Number of frames of the hand-held chess-board of [board], each in a different pose, to calibrate
        /// the lens.
        "board" => board: usize = Kind::Whole(0, 1_000), like "20" or "0";
    }
}

section! {
    /// The limits of a scan.
    pub struct LimitsProfile in "limits" {
        /// Retakes of a frame before the scan stops.
        "retakes" => retakes: usize = Kind::Whole(0, 100), like "5" or "3";
        /// Share of a frame's pixels that may be saturated.
        "saturated" => saturated: f64 = measure(PERCENT, Allowed::UpTo(100.0)), like "0.5 %" or "1 %";
        /// Largest distance of the reported from the commanded position.
        // The default is a motor step of usual stages, and a fraction of the smallest usual scan step.
        "position" => position_mm: f64 = measure(UM, Allowed::Positive), like "10 um" or "20 um";
        /// Longest wait for a device that has disconnected.
        "wait" => wait: Duration = measure(MIN, Allowed::ZeroOrMore), like "10 min" or "5 min";
        /// Largest shift of the picture when a stop is taken again.
        "shift" => shift_px: f64 = measure(PX, Allowed::Positive), like "0.2 px" or "0.1 px";
    }
}

impl PlanProfile {
    /// Positions of all frames, from home, in mm: start + index x step. `None` without step or number of
    /// frames.
    pub fn positions_mm(&self) -> Option<Vec<f64>> {
        let (step_mm, frames) = (self.step_mm?, self.frames?);
        Some((0..frames).map(|index| self.start_mm + index as f64 * step_mm).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn positions_are_those_of_the_plan() {
        let plan =
            PlanProfile { start_mm: 10.0, step_mm: Some(1.5), frames: Some(4), ..PlanProfile::default() };
        assert_eq!(plan.positions_mm(), Some(vec![10.0, 11.5, 13.0, 14.5]));
        assert_eq!(PlanProfile { frames: None, ..plan.clone() }.positions_mm(), None);
        assert_eq!(PlanProfile { step_mm: None, ..plan }.positions_mm(), None);
    }
}
