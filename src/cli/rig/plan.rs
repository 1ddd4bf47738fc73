//! What is to be done with the rig.

use clap::Args;

use super::profile::Options;

/// The plan of a scan.
#[derive(Debug, Args)]
#[command(next_help_heading = "The plan")]
pub(in crate::cli) struct PlanArguments {
    /// Distance between stops
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    step_mm: Option<String>,
    /// Number of frames
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    frames: Option<String>,
    /// Position of the first frame, from home
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    start_mm: Option<String>,
    /// How long the stage swings after a move [default: 200]
    #[arg(long, value_name = "MS", allow_negative_numbers = true)]
    settle_ms: Option<String>,
    /// Average so many frames to one of 16 bit at each stop [default: 1]
    #[arg(long, value_name = "K", allow_negative_numbers = true)]
    average: Option<String>,
    /// How long to wait for a camera or a stage that goes in the middle of the scan [default: 300]
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    wait_s: Option<String>,
    /// Focal length of the lens, in px; the principal point is taken to be the middle of the image
    #[arg(long, value_name = "PX", allow_negative_numbers = true)]
    focal_length_px: Option<String>,
}

impl PlanArguments {
    /// As keys of a profile.
    pub(in crate::cli) fn options(&self, options: &mut Options) {
        options.add("plan.step_mm", "--step-mm", self.step_mm.as_ref());
        options.add("plan.frames", "--frames", self.frames.as_ref());
        options.add("plan.start_mm", "--start-mm", self.start_mm.as_ref());
        options.add("plan.settle_ms", "--settle-ms", self.settle_ms.as_ref());
        options.add("plan.average", "--average", self.average.as_ref());
        options.add("limits.wait_s", "--wait-s", self.wait_s.as_ref());
        options.add("optics.focal_length_px", "--focal-length-px", self.focal_length_px.as_ref());
    }
}
