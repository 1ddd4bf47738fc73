//! The matcher's options on the command line, shared by the verbs that match.

use clap::{Args, ValueEnum};

use epirig_matcher::interpolation::Interpolation;
use epirig_matcher::{DisparityRange, HiddenPoints, MatchOptions, Method, Ordering, ReferenceFrame, Search};

#[derive(Debug, Clone, Copy, ValueEnum)]
enum SearchName {
    Factorised,
    Exhaustive,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum MethodName {
    /// Variance of the intensities along the line; needs equal illumination
    Variance,
    /// Variance of locally normalised frames: for light that varies from frame to frame and over the image
    Normalised,
    /// Correlation of windows with the reference frame's window
    NccFirst,
    /// Correlation of windows with their mean
    NccMean,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum InterpolationName {
    Linear,
    /// Cubic convolution (Keys)
    Cubic,
    /// Cubic B-spline, the most accurate
    BSpline,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum OrderingName {
    /// Points keep their order: the paper's strictly increasing mapping
    Strict,
    /// Each pixel by itself: for things in front of other things
    Free,
    /// Strict unless depth edges forbid it
    Auto,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum HiddenName {
    /// Nothing hides anything
    None,
    /// A point may be hidden before or after the reference frame
    OneSide,
    /// One side with free ordering, none with strict
    Auto,
}

/// How to match.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Matching")]
pub(super) struct MatchArguments {
    /// A first look: match in less than a third of the time, searching at half the resolution and fitting in windows of one size, by half of the frames if there are a hundred or more. Sigma
    /// says what that leaves, but for relief that is finer than the windows; things narrower than some 20 px may be passed over
    #[arg(long, conflicts_with = "wanted_sigma")]
    quick: bool,
    /// How the samples along a line are compared
    #[arg(long, value_enum, default_value = "variance")]
    method: MethodName,
    /// Disparities to search, in px over the whole baseline, such as 420..434 or -60..0 [default: found from the data]
    #[arg(long, value_name = "MIN..MAX", value_parser = parse_range, allow_hyphen_values = true)]
    range: Option<DisparityRange>,
    /// The frame whose pixels are answered: first, middle, last or an index from 0
    #[arg(long, default_value = "first", value_parser = parse_reference)]
    reference: ReferenceFrame,
    /// Step between the disparities tried, in px
    #[arg(long, value_name = "PX", default_value_t = 0.25)]
    raster: f64,
    /// Side of the cost's window, odd, in px [default: 3 for variance and normalised, 7 for correlation]
    #[arg(long, value_name = "PX")]
    window: Option<usize>,
    /// Whether candidates are searched by sums over groups of frames, or by every sample as in the paper (always so for correlation)
    #[arg(long, value_enum, default_value = "factorised")]
    search: SearchName,
    /// Let neighbouring rows help each other where texture is weak; for surfaces that go on from row to row (the search takes about twice as long)
    #[arg(long)]
    across_rows: bool,
    /// How the exhaustive search samples frames between pixels
    #[arg(long, value_enum, default_value = "b-spline")]
    interpolation: InterpolationName,
    /// Whether points keep their order from the first to the last frame
    #[arg(long, value_enum, default_value = "auto")]
    ordering: OrderingName,
    /// Whether points may be hidden in part of the sequence
    #[arg(long, value_enum, default_value = "auto")]
    hidden: HiddenName,
    /// Share of the frames that must see a point, from above 0 to 1
    #[arg(long, value_name = "SHARE", default_value_t = 0.5)]
    min_visible: f64,
    /// Leave a pixel without answer if its sigma is larger, in px
    #[arg(long, value_name = "PX", default_value_t = 3.0)]
    max_sigma: f64,
    /// Leave a pixel without answer if its confidence is lower (free ordering only), from 0 to 1
    #[arg(long, value_name = "SHARE", default_value_t = 0.03)]
    min_confidence: f64,
    /// Side of the smallest window of the sub-pixel fit, odd, from 1 to 21 px [default: 3, with --quick 5]
    #[arg(long, value_name = "PX")]
    fit_window: Option<usize>,
    /// Let the window of the fit grow, up to 11 px and up to 21 px on surfaces that show no relief, where it leaves a larger sigma than this, in px; `inf` keeps all windows the smallest
    #[arg(long, value_name = "PX", default_value_t = 0.005)]
    wanted_sigma: f64,
    /// Take the parabola through three costs instead of the fit over all frames (always so for correlation)
    #[arg(long)]
    no_fit: bool,
}

impl MatchArguments {
    pub(super) fn options(&self) -> MatchOptions {
        let method = match self.method {
            MethodName::Variance => Method::Variance,
            MethodName::Normalised => Method::Normalised,
            MethodName::NccFirst => Method::NccFirst,
            MethodName::NccMean => Method::NccMean,
        };
        let defaults = MatchOptions::for_method(method);
        let defaults = if self.quick { defaults.quick() } else { defaults };
        MatchOptions {
            method,
            search: match self.search {
                SearchName::Factorised => Search::Factorised,
                SearchName::Exhaustive => Search::Exhaustive,
            },
            effort: defaults.effort,
            interpolation: match self.interpolation {
                InterpolationName::Linear => Interpolation::Linear,
                InterpolationName::Cubic => Interpolation::Cubic,
                InterpolationName::BSpline => Interpolation::BSpline,
            },
            range: self.range,
            raster_px: self.raster,
            window_px: self.window.unwrap_or(defaults.window_px),
            across_rows: self.across_rows,
            reference: self.reference,
            minimum_visible: self.min_visible,
            hidden_points: match self.hidden {
                HiddenName::None => HiddenPoints::None,
                HiddenName::OneSide => HiddenPoints::OneSide,
                HiddenName::Auto => HiddenPoints::Automatic,
            },
            ordering: match self.ordering {
                OrderingName::Strict => Ordering::Strict,
                OrderingName::Free => Ordering::Free,
                OrderingName::Auto => Ordering::Automatic,
            },
            refine: defaults.refine && !self.no_fit,
            refine_window_px: self.fit_window.unwrap_or(defaults.refine_window_px),
            wanted_sigma_px: self.wanted_sigma,
            maximum_sigma_px: self.max_sigma,
            minimum_confidence: self.min_confidence,
        }
    }
}

fn parse_range(text: &str) -> Result<DisparityRange, String> {
    let wrong =
        || format!("\"{text}\" is no range; write the smallest and the largest disparity, such as 420..434");
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
            .map_err(|_| format!("\"{text}\" is no frame; write first, middle, last or an index from 0")),
    }
}
