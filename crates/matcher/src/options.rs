//! The options of a match, and the checks that they suit a volume.

use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::candidates::{Candidates, DisparityRange};
use super::cost::interpolation::Interpolation;
use super::stack::StackError;
use epirig_core::fault::{Blame, Fault};
use epirig_core::progress::Cancelled;
use epirig_core::rows::RowsError;
use epirig_core::tau::Tau;

epirig_core::choices! {
    /// The cost of a candidate: how badly the samples along its line agree.
    #[non_exhaustive]
    pub enum Method {
        /// Variance of the intensities along the line; needs equal illumination.
        ///
        /// Paper, section 4; averaged over the window.
        Variance = "variance",
        /// Variance of locally normalised frames: for light that varies between frames and over the image.
        ///
        /// Gains and offsets that change from frame to frame and slowly over the image do not count. Costs are
        /// in units of a 32nd of the local standard deviation, squared.
        Normalised = "normalised",
        /// Correlation of windows with the reference frame's window.
        ///
        /// One minus the normalised correlation, averaged over the frames. With the first frame as reference
        /// this is the paper's own choice of model.
        NccFirst = "ncc-first",
        /// Correlation of windows with their mean.
        ///
        /// The mean is that of all observations of the window.
        NccMean = "ncc-mean",
    }
}

impl Method {
    /// Whether the cost is a variance of intensities (or of normalised ones), as the fit presumes.
    pub fn compares_intensities(self) -> bool {
        matches!(self, Self::Variance | Self::Normalised)
    }

    /// A difference of costs that is not significant: the variance of quantisation in DN^2, or a correlation
    /// of 0.999.
    pub(super) fn resolution(self) -> f32 {
        match self {
            Self::Variance | Self::Normalised => 1.0 / 12.0,
            Self::NccFirst | Self::NccMean => 1e-3,
        }
    }
}

epirig_core::choices! {
    /// How the candidates of a pixel are searched.
    #[non_exhaustive]
    pub enum Search {
        /// Sums over groups of neighbouring frames serve many candidates: many times faster.
        ///
        /// Candidates lie at twice the disparity step asked for (at most 1 px), with linear interpolation.
        /// For methods that [compare intensities](Method::compares_intensities); others are searched
        /// exhaustively.
        Factorised = "factorised",
        /// The samples of all frames for each candidate, as in the paper.
        ///
        /// At the disparity step asked for. Right for any method and interpolation.
        Exhaustive = "exhaustive",
    }
}

/// The frame whose pixels are given a disparity. Records (serde) have `first`, `middle`, `last` or the index.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[non_exhaustive]
pub enum ReferenceFrame {
    /// The first frame: disparity belongs to (i, y), as in the paper.
    First,
    /// The frame nearest to the middle of the baseline: each point in it stays in view longest.
    Middle,
    /// The last frame.
    Last,
    /// Any frame, by its index from 0.
    #[serde(untagged)]
    Index(usize),
}

epirig_core::choices! {
    /// Whether the mapping from the first to the last frame must be strictly increasing.
    #[non_exhaustive]
    pub enum OrderingConstraint {
        /// Points keep their order: the paper's strictly increasing mapping.
        ///
        /// The paper's ordering and uniqueness constraints. Right for a surface seen without occlusions.
        On = "on",
        /// Each pixel by itself: for objects that occlude others.
        Off = "off",
        /// On, unless the sampled rows show depth edges that no strictly increasing mapping allows.
        Automatic = "auto",
    }
}

epirig_core::choices! {
    /// Whether points may be occluded in part of the sequence.
    #[non_exhaustive]
    pub enum Occlusion {
        /// Nothing is occluded: all frames that contain the candidate count.
        None = "none",
        /// A point may be occluded before or after the reference frame.
        ///
        /// The best of all frames, the frames up to the reference and the frames from it on counts (Kang,
        /// Szeliski and Chai 2001, "best half").
        OneSide = "one-side",
        /// One side without the ordering constraint, none with it.
        Automatic = "auto",
    }
}

/// Most candidates that are searched for a pixel: their indices and the tables of a band must fit.
const LARGEST_SEARCH: usize = 30_000;

/// The widest window of the costs, in px.
pub const LARGEST_WINDOW_PX: usize = 31;

/// Side of a square that sees as far as discs of one size do, in px. With larger ones a mean over
/// many pixels is known a tenth better, but they see step edges from a pixel farther.
pub const EQUAL_DISCS_PX: usize = 5;

/// The same of discs that grow: what noise hides from them they see from this far at most, where
/// surfaces have relief.
pub const GROWN_DISCS_PX: usize = 11;

/// Everything that a caller may choose of the matcher. Records (serde) hold it as it is.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MatchOptions {
    /// The cost of a candidate.
    pub method: Method,
    /// How candidates are searched.
    pub search: Search,
    /// Whether only a first look is wanted, in some 60 % of the time. Candidates are searched at half
    /// the resolution, with the costs and confidences of that resolution. The fit looks for edges in
    /// small discs only and, of a hundred frames or more, asks the half that tells most. Objects
    /// narrower than some 20 px may be missed. Frames too small to be halved are searched as they
    /// are.
    pub quick: bool,
    /// How frames are sampled between pixels during the exhaustive search.
    pub interpolation: Interpolation,
    /// Disparities searched; `None`: found from the data.
    pub range: Option<DisparityRange>,
    /// Step between the disparities of neighbouring candidates, in px over the whole baseline; (0, 1].
    pub disparity_step_px: f64,
    /// Side of the square window of the costs, in px, odd.
    pub window_px: usize,
    /// Whether costs are aggregated across rows, too (semi-global matching), for weak texture. Where a row
    /// shows no more than noise, the surface is then taken to continue from row to row.
    pub semi_global: bool,
    /// The frame whose pixels are answered.
    pub reference: ReferenceFrame,
    /// Share of the frames that a candidate must lie in to be answered; (0, 1].
    pub min_visible: f64,
    /// Whether points may be occluded in part of the sequence.
    pub occlusion: Occlusion,
    /// Whether the mapping must be strictly increasing.
    pub ordering_constraint: OrderingConstraint,
    /// Whether the fit over all frames refines the disparity between the candidates. Without it the vertex of
    /// the parabola through three costs does, as far as half the disparity step. The fit presumes equal
    /// intensities, as `Method::Variance` does and `Method::Normalised` brings about.
    pub fit: bool,
    /// The discs of the fit grow where they leave a larger sigma than this, in px; `None`: all have
    /// one small size. In a first look none grows.
    pub wanted_sigma_px: Option<f64>,
    /// A pixel whose sigma exceeds this has no answer, in px.
    pub max_sigma_px: f64,
    /// Without the ordering constraint, a pixel whose confidence is lower has no answer; [0, 1].
    pub min_confidence: f64,
    /// Most rows that are matched in one go, beside a rim, from 1; `None`: as many as take 768 MiB, and
    /// 256 at least. See [`Blocks`](super::Blocks).
    pub block_rows: Option<usize>,
}

impl Default for MatchOptions {
    fn default() -> Self {
        Self::for_method(Method::Variance)
    }
}

impl MatchOptions {
    /// The usual options for `method`, for an unknown scene.
    pub fn for_method(method: Method) -> Self {
        Self {
            method,
            search: Search::Factorised,
            quick: false,
            interpolation: Interpolation::BSpline,
            range: None,
            disparity_step_px: 0.25,
            window_px: if method.compares_intensities() { 3 } else { 7 },
            semi_global: false,
            reference: ReferenceFrame::Middle,
            min_visible: 0.5,
            occlusion: Occlusion::Automatic,
            ordering_constraint: OrderingConstraint::Automatic,
            fit: method.compares_intensities(),
            wanted_sigma_px: Some(0.003),
            max_sigma_px: 3.0,
            min_confidence: 0.03,
            block_rows: None,
        }
    }
}

/// Why a volume cannot be matched as asked.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum MatchError {
    /// Too few rows, columns or frames for lines to be seen in.
    #[error(
        "a volume of {columns} x {rows} pixels and {frames} frame(s) shows no lines; at least 3 frames and 8 columns are \
         needed"
    )]
    TooSmall {
        /// Rows of the volume.
        rows: usize,
        /// Columns of the volume.
        columns: usize,
        /// Frames of the volume.
        frames: usize,
    },
    /// The range is empty or not finite.
    #[error("the disparity range {minimum_px}..{maximum_px} px is empty; give the smaller number first")]
    EmptyRange {
        /// Smallest disparity asked for, in px.
        minimum_px: f64,
        /// Largest disparity asked for, in px.
        maximum_px: f64,
    },
    /// The range spans more than the image does, or no point of it can stay in view.
    #[error(
        "the disparity range {minimum_px}..{maximum_px} px does not fit images {columns} px wide; a point must be in view \
         in {min_visible} of the frames, so disparities lie within +-{limit_px:.0} px and span less than {columns} px"
    )]
    RangeTooWide {
        /// Smallest disparity asked for, in px.
        minimum_px: f64,
        /// Largest disparity asked for, in px.
        maximum_px: f64,
        /// Image width, in px.
        columns: usize,
        /// Share of the frames that must see a point.
        min_visible: f64,
        /// Largest magnitude that keeps a point in view for that share, in px.
        limit_px: f64,
    },
    /// The reference frame does not exist.
    #[error("there is no frame {index} to refer to; the sequence has frames 0 to {last}")]
    NoSuchReference {
        /// Index asked for.
        index: usize,
        /// Index of the last frame.
        last: usize,
    },
    /// An option outside its values.
    #[error("{option} is {value}, but must be {expected}")]
    BadOption {
        /// The option's name.
        option: &'static str,
        /// The value given.
        value: f64,
        /// The values allowed.
        expected: &'static str,
    },
    /// The costs of all candidates take too much memory to be aggregated across rows.
    #[error(
        "aggregation across rows holds the costs of all candidates; {candidates} for each pixel would take more memory \
         than half of the frames' own, at most {limit} fit: give a narrower range or a larger disparity step, or leave --semi-global out"
    )]
    TooManyToAggregate {
        /// Candidates of a pixel.
        candidates: usize,
        /// Largest number that fits.
        limit: usize,
    },
    /// A mask that is not as large as the images.
    #[error(
        "the mask has {mask_rows} rows x {mask_columns} columns, but the images have {rows} rows x {columns} columns; draw it over one of the images"
    )]
    MaskSize {
        /// Rows of the mask.
        mask_rows: usize,
        /// Columns of the mask.
        mask_columns: usize,
        /// Rows of the images.
        rows: usize,
        /// Columns of the images.
        columns: usize,
    },
    /// There is not a range of shown columns for each row, or one leads beyond the images.
    #[error(
        "{ranges} ranges of shown columns are given for images of {rows} rows x {columns} columns; give one for each row, within the columns"
    )]
    ShownRows {
        /// Number of ranges.
        ranges: usize,
        /// Rows of the images.
        rows: usize,
        /// Columns of the images.
        columns: usize,
    },
    /// A mask without a pixel inside.
    #[error("no pixel is inside the mask, so there is nothing to match; make white what is to be matched")]
    EmptyMask,
    /// No range was given and none could be found.
    #[error(
        "no range of disparities is significant in the data: too little texture, or the frames do not show one moving scene; \
         look at the frames, or give the range"
    )]
    NoRange,
    /// The frames cannot be read.
    #[error(transparent)]
    Unread(RowsError),
    /// The frames make no stack.
    #[error(transparent)]
    Stack(#[from] StackError),
    /// The caller has cancelled the match.
    #[error("the match was interrupted")]
    Cancelled,
}

impl From<RowsError> for MatchError {
    fn from(error: RowsError) -> Self {
        match error {
            RowsError::Cancelled(_) => Self::Cancelled,
            error => Self::Unread(error),
        }
    }
}

impl From<Cancelled> for MatchError {
    fn from(_: Cancelled) -> Self {
        Self::Cancelled
    }
}

impl Fault for MatchError {
    fn blame(&self) -> Blame {
        match self {
            Self::NoRange => Blame::NoAnswer,
            Self::Unread(error) => error.blame(),
            Self::Cancelled => Blame::Interruption,
            Self::TooSmall { .. } | Self::Stack(_) => Blame::Data,
            Self::EmptyRange { .. }
            | Self::RangeTooWide { .. }
            | Self::NoSuchReference { .. }
            | Self::BadOption { .. }
            | Self::TooManyToAggregate { .. }
            | Self::MaskSize { .. }
            | Self::ShownRows { .. }
            | Self::EmptyMask => Blame::Request,
        }
    }
}

impl MatchOptions {
    /// The same for a first look.
    pub fn quick(self) -> Self {
        Self { quick: true, ..self }
    }

    /// Index of the reference frame of frames at `tau`.
    ///
    /// # Errors
    /// [`MatchError::NoSuchReference`] if there is no such frame.
    pub fn reference_index(&self, tau: &Tau) -> Result<usize, MatchError> {
        let last = tau.frames() - 1;
        match self.reference {
            ReferenceFrame::First => Ok(0),
            ReferenceFrame::Middle => Ok(tau.middle_frame()),
            ReferenceFrame::Last => Ok(last),
            ReferenceFrame::Index(index) if index <= last => Ok(index),
            ReferenceFrame::Index(index) => Err(MatchError::NoSuchReference { index, last }),
        }
    }

    /// The search that is used: the exhaustive one for methods that do not compare intensities.
    pub fn search_used(&self) -> Search {
        if self.method.compares_intensities() { self.search } else { Search::Exhaustive }
    }

    /// Whether these options can be used on `frames` frames of `rows` x `columns` pixels.
    ///
    /// # Errors
    /// [`MatchError`] naming the first option that cannot.
    pub fn check(&self, rows: usize, columns: usize, frames: usize) -> Result<(), MatchError> {
        if rows == 0 || columns < 8 || frames < 3 {
            return Err(MatchError::TooSmall { rows, columns, frames });
        }
        if let ReferenceFrame::Index(index) = self.reference
            && index >= frames
        {
            return Err(MatchError::NoSuchReference { index, last: frames - 1 });
        }
        let odd = "odd, from 1 to 31";
        let share = "greater than 0 and at most 1";
        let allowed = |side: usize| side % 2 == 1 && side <= LARGEST_WINDOW_PX;
        let bad = |option, value, expected| Err(MatchError::BadOption { option, value, expected });
        if !allowed(self.window_px) {
            return bad("the window", self.window_px as f64, odd);
        }
        if columns < self.window_px + 4 {
            return bad("the window", self.window_px as f64, "narrower than the images by 4 px");
        }
        if !(self.disparity_step_px >= 0.01 && self.disparity_step_px <= 1.0) {
            return bad("the disparity step", self.disparity_step_px, "from 0.01 to 1 px");
        }
        if !(self.min_visible > 0.0 && self.min_visible <= 1.0) {
            return bad("the share of frames that must see a point", self.min_visible, share);
        }
        let sigmas =
            [("the wanted sigma", self.wanted_sigma_px), ("the largest sigma", Some(self.max_sigma_px))];
        for (name, sigma_px) in sigmas {
            if let Some(sigma_px) = sigma_px.filter(|sigma_px| !(*sigma_px > 0.0 && sigma_px.is_finite())) {
                return bad(name, sigma_px, "a finite number of px greater than 0");
            }
        }
        if !(0.0..=1.0).contains(&self.min_confidence) {
            return bad("the least confidence", self.min_confidence, "from 0 to 1");
        }
        if self.block_rows == Some(0) {
            return bad("the number of rows of a block", 0.0, "at least 1");
        }
        self.range.map_or(Ok(()), |range| self.check_range(range, columns))
    }

    fn check_range(&self, range: DisparityRange, columns: usize) -> Result<(), MatchError> {
        let DisparityRange { minimum_px, maximum_px } = range;
        if !(minimum_px.is_finite() && maximum_px.is_finite() && minimum_px <= maximum_px) {
            return Err(MatchError::EmptyRange { minimum_px, maximum_px });
        }
        let limit_px = self.largest_disparity_px(columns);
        let span = maximum_px - minimum_px;
        if span >= columns as f64 || minimum_px.abs().max(maximum_px.abs()) > limit_px {
            return Err(MatchError::RangeTooWide {
                minimum_px,
                maximum_px,
                columns,
                min_visible: self.min_visible,
                limit_px,
            });
        }
        self.check_search(&Candidates::covering(range, self.disparity_step_px))
    }

    /// Whether this number of candidates can be searched.
    pub(super) fn check_search(&self, candidates: &Candidates) -> Result<(), MatchError> {
        if candidates.count() > LARGEST_SEARCH {
            return Err(MatchError::BadOption {
                option: "the disparity step",
                value: self.disparity_step_px,
                expected: "coarser for so wide a range: at most 30000 candidates fit",
            });
        }
        Ok(())
    }

    /// Largest magnitude of a disparity whose point can be in view in the share of the frames asked for, in
    /// px.
    pub(crate) fn largest_disparity_px(&self, columns: usize) -> f64 {
        (columns - 1) as f64 / self.min_visible
    }
}
