//! The matcher's options on the command line, shared by the verbs that match.

use clap::Args;

use epirig_matcher::{
    DisparityRange, Interpolation, MatchOptions, Method, Occlusion, OrderingConstraint, ReferenceFrame,
    Search,
};

use super::choice::choice;

/// Options of the matcher.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Matching")]
pub(super) struct MatchArguments {
    /// First look: takes some 60 % of the time. Uses half of the frames if there are a hundred or more, looks
    /// for edges in small discs only, and searches occluding objects at half the resolution, too. Sigma
    /// includes what that costs, except for relief finer than the discs; objects narrower than some 20 px
    /// may be missed
    #[arg(long, conflicts_with = "wanted_sigma")]
    quick: bool,
    /// Cost function: how the samples along a line are compared
    #[arg(long, value_parser = choice::<Method>(), default_value_t = usual().method)]
    method: Method,
    /// Range of disparities, in px over the whole baseline, such as 420..434 or -60..0 [default: found from
    /// the data]
    #[arg(long, value_name = "MIN..MAX", value_parser = parse_range, allow_hyphen_values = true)]
    range: Option<DisparityRange>,
    /// The reference frame, whose pixels get a disparity: first, middle, last or an index from 0. Most points
    /// of the middle frame are seen by most frames; the paper takes the first
    #[arg(long, default_value = "middle", value_parser = parse_reference)]
    reference: ReferenceFrame,
    /// Step between disparity candidates, in px
    #[arg(long, value_name = "PX", default_value_t = usual().disparity_step_px)]
    disparity_step: f64,
    /// Side of the cost's window, odd, in px [default: 3 for variance and normalised, 7 for correlation]
    #[arg(long, value_name = "PX")]
    window: Option<usize>,
    /// How candidates are searched: by sums over groups of frames, or by every sample as in the paper (always
    /// so for correlation)
    #[arg(long, value_parser = choice::<Search>(), default_value_t = usual().search)]
    search: Search,
    /// Aggregate costs across rows (semi-global matching): for weak texture on surfaces that continue from
    /// row to row. The search takes about twice as long
    #[arg(long)]
    semi_global: bool,
    /// Interpolation of frames between pixels in the exhaustive search
    #[arg(long, value_parser = choice::<Interpolation>(), default_value_t = usual().interpolation)]
    interpolation: Interpolation,
    /// Whether points keep their order from the first frame to the last
    #[arg(long, value_parser = choice::<OrderingConstraint>(), default_value_t = usual().ordering_constraint)]
    ordering_constraint: OrderingConstraint,
    /// Whether points may be occluded in part of the sequence
    #[arg(long, value_parser = choice::<Occlusion>(), default_value_t = usual().occlusion)]
    occlusion: Occlusion,
    /// Share of the frames that must see a point, above 0 and at most 1
    #[arg(long, value_name = "SHARE", default_value_t = usual().min_visible)]
    min_visible: f64,
    /// Reject pixels whose sigma is larger, in px
    #[arg(long, value_name = "PX", default_value_t = usual().max_sigma_px)]
    max_sigma: f64,
    /// Reject pixels whose confidence is lower, 0 to 1 (only without the ordering constraint)
    #[arg(long, value_name = "SHARE", default_value_t = usual().min_confidence)]
    min_confidence: f64,
    /// Let the discs of the sub-pixel fit grow where they leave a larger sigma than this, in px: up
    /// to 115 px. `inf` keeps all at one small size
    #[arg(long, value_name = "PX", default_value_t = usual().wanted_sigma_px.unwrap_or(f64::INFINITY))]
    wanted_sigma: f64,
    /// Interpolate three costs by a parabola instead of the fit over all frames (always so for correlation)
    #[arg(long)]
    no_fit: bool,
    /// Match this many rows in one go, at most [default: as many as take 768 MiB, and 256 at least]
    #[arg(long, value_name = "ROWS")]
    block_rows: Option<usize>,
}

impl MatchArguments {
    /// Whether nothing else is chosen than what is usual.
    pub(super) fn are_usual(&self) -> bool {
        self.options() == usual()
    }

    pub(super) fn options(&self) -> MatchOptions {
        let defaults = MatchOptions::for_method(self.method);
        MatchOptions {
            method: self.method,
            search: self.search,
            quick: self.quick,
            interpolation: self.interpolation,
            range: self.range,
            disparity_step_px: self.disparity_step,
            window_px: self.window.unwrap_or(defaults.window_px),
            semi_global: self.semi_global,
            reference: self.reference,
            min_visible: self.min_visible,
            occlusion: self.occlusion,
            ordering_constraint: self.ordering_constraint,
            fit: defaults.fit && !self.no_fit,
            wanted_sigma_px: Some(self.wanted_sigma).filter(|sigma_px| *sigma_px != f64::INFINITY),
            max_sigma_px: self.max_sigma,
            min_confidence: self.min_confidence,
            block_rows: self.block_rows,
        }
    }
}

/// The defaults that help shows. A few depend on the method, and their help says so.
fn usual() -> MatchOptions {
    MatchOptions::default()
}

fn parse_range(text: &str) -> Result<DisparityRange, String> {
    let wrong = || {
        format!("\"{text}\" is not a range; write the smallest and the largest disparity, such as 420..434")
    };
    let (low, high) = text.split_once("..").ok_or_else(wrong)?;
    let number = |text: &str| text.trim().parse::<f64>().map_err(|_| wrong());
    Ok(DisparityRange { minimum_px: number(low)?, maximum_px: number(high)? })
}

fn parse_reference(text: &str) -> Result<ReferenceFrame, String> {
    match text {
        "first" => Ok(ReferenceFrame::First),
        "middle" => Ok(ReferenceFrame::Middle),
        "last" => Ok(ReferenceFrame::Last),
        _ => text
            .parse()
            .map(ReferenceFrame::Index)
            .map_err(|_| format!("\"{text}\" is not a frame; write first, middle, last or an index from 0")),
    }
}
