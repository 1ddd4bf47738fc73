//! The stations of the matcher in their order: range, costs, mapping, sub-pixel fit, validity of each pixel.

use std::ops::Range;

use tracing::{debug, debug_span};

use super::candidates::Candidates;
use super::candidates::DisparityRange;
use super::cost::CostTable;
use super::cost::changing_light::changes_much;
use super::cost::exhaustive::{Band, band_costs};
use super::cost::normalise::{NORMALISING_WINDOW_PX, locally_normalised};
use super::fit::{Fit, FitResult, Sizes, fit};
use super::lines::{EpiLines, SeenRule};
use super::locking::PixelLocking;
use super::maps::{DisparityMaps, OrderingUsed};
use super::options::{MatchError, MatchOptions, Method, Occlusion, OrderingConstraint, Search};
use super::quick::{Halved, TellingFrames};
use super::range::{Survey, survey};
use super::search::edge_refinement::refine_edges;
use super::search::{SearchResult, Task, search};
use super::stack::Stack;
use super::validity::Validity;
use super::validity::area::Area;
use super::validity::rule::ValidityRule;
use epirig_core::grid::Grid;
use epirig_core::progress::{Progress, Silent};
use epirig_core::volume::Volume;

/// Gauss-Newton steps: from half a disparity step two come within a thousandth of a pixel of the end; the
/// third confirms.
const FIT_STEPS: usize = 2;

/// Disparity of every pixel of the reference frame, as [`Matcher::matched`] finds it.
///
/// With [`Method::Normalised`] the frames are copied; a [`Matcher`] that is given the only volume normalises
/// them in their place.
///
/// # Errors
/// [`MatchError`] if the options do not suit the volume, or no range was given and none is to be found.
pub fn match_volume(
    volume: &Volume,
    options: &MatchOptions,
    progress: &dyn Progress,
) -> Result<DisparityMaps, MatchError> {
    Matcher::new(volume.clone(), options.clone())?.matched(progress)
}

/// Disparity of every pixel of the reference frame of `stack`, in px over the whole baseline, with its sigma.
///
/// # Errors
/// [`MatchError`] if the options do not suit the stack, or no range was given and none is to be found.
pub fn disparity(stack: &Stack, options: &MatchOptions) -> Result<DisparityMaps, MatchError> {
    disparity_with(stack, options, &Silent)
}

/// The same, which tells `progress` how far it is, and ends early if that [cancels](Progress::cancelled) it.
///
/// # Errors
/// As [`disparity`], or [`MatchError::Cancelled`].
pub fn disparity_with(
    stack: &Stack,
    options: &MatchOptions,
    progress: &dyn Progress,
) -> Result<DisparityMaps, MatchError> {
    match_volume(stack.volume(), options, progress)
}

/// A volume that is ready to be matched.
#[derive(Debug, Clone)]
pub struct Matcher {
    /// The samples that are compared along lines.
    volume: Volume,
    options: MatchOptions,
    /// The part of the picture that `volume` has the rows of; `None`: all of it.
    area: Option<Area>,
    /// The columns of each row of the picture that all frames show; `None`: all.
    shown: Option<Vec<Range<usize>>>,
}

impl Matcher {
    /// Prepares `volume` for a match with `options`. Samples are changed in their place unless they are
    /// shared with another volume.
    ///
    /// # Errors
    /// [`MatchError`] if the options do not suit the volume.
    pub fn new(volume: Volume, options: MatchOptions) -> Result<Self, MatchError> {
        options.check(volume.rows(), volume.columns(), volume.frames())?;
        let volume = match options.method {
            Method::Normalised => locally_normalised(volume, NORMALISING_WINDOW_PX),
            Method::Variance | Method::NccFirst | Method::NccMean => volume,
        };
        Ok(Self { volume, options, area: None, shown: None })
    }

    /// The same of which only the pixels `inside` are asked for; rows x columns of the volume.
    ///
    /// The smallest rectangle that holds them is matched, with a rim that windows around them reach. The
    /// other rows are dropped, and the other columns are left out of the factorised search. Pixels that are
    /// not inside become [`Validity::Outside`]. Answers inside are those without a mask, up to the influence of
    /// what is estimated from all pixels: the range, gains of frames, noise, and pixel locking.
    ///
    /// # Errors
    /// [`MatchError::MaskSize`] if `inside` has another size; [`MatchError::EmptyMask`] if no pixel is inside.
    pub fn within(mut self, inside: &Grid<bool>) -> Result<Self, MatchError> {
        let area = Area::new(inside, self.volume.rows(), self.volume.columns(), &self.options)?;
        self.volume.keep_rows(area.rows.clone());
        Ok(Self { area: Some(area), ..self })
    }

    /// The same of frames that all show only some columns, a range for each row of the picture: beyond them
    /// there is nothing of the scene, as beyond the image. The interpolation along lines reads 3 px beyond.
    ///
    /// # Errors
    /// [`MatchError::ShownRows`] if there is not a range for each row, or one leads beyond the image.
    pub fn showing(self, shown: Vec<Range<usize>>) -> Result<Self, MatchError> {
        let rows = self.area.as_ref().map_or(self.volume.rows(), Area::whole_rows);
        let columns = self.volume.columns();
        if shown.len() != rows || shown.iter().any(|range| range.end > columns) {
            return Err(MatchError::ShownRows { ranges: shown.len(), rows, columns });
        }
        Ok(Self { shown: Some(shown), ..self })
    }

    /// The lines of frame `reference`, in the rows of the volume.
    fn lines(&self, reference: usize) -> EpiLines {
        let rows = self.area.as_ref().map_or(0..self.volume.rows(), |area| area.rows.clone());
        let shown = self.shown.as_ref().map(|shown| shown[rows].into());
        EpiLines::new(self.volume.tau(), reference, self.volume.columns()).showing(shown)
    }

    /// Disparity of every pixel of the reference frame.
    ///
    /// The result does not depend on the number of threads.
    ///
    /// # Errors
    /// [`MatchError`] if the options do not suit the volume, no range was given and none is to be found, or
    /// `progress` has cancelled the match.
    pub fn matched(&self, progress: &dyn Progress) -> Result<DisparityMaps, MatchError> {
        let lines = self.lines(self.options.reference_index(&self.volume)?);
        let maps = matched(&self.volume, lines, self.area.as_ref(), &self.options, progress)?;
        Ok(match &self.area {
            Some(area) => area.whole(maps),
            None => maps,
        })
    }

    /// The pixels that `maps` answers, by planes in discs of one size.
    ///
    /// Discs that grow with the noise see a step edge from as far as they reach, which differs from
    /// pixel to pixel. These see it from 2 px, so a mean over many pixels farther away is right,
    /// although each pixel has more noise.
    ///
    /// # Errors
    /// [`MatchError::Cancelled`] if `progress` has cancelled it.
    pub fn in_equal_discs(
        &self,
        maps: &DisparityMaps,
        progress: &dyn Progress,
    ) -> Result<EqualDiscs, MatchError> {
        let Self { volume, options, area, .. } = self;
        let lines = self.lines(maps.reference);
        let rows = area.as_ref().map_or(0..volume.rows(), |area| area.rows.clone());
        let answers = maps.disparity.cropped(0..volume.columns(), rows);
        let equal = Fit {
            sizes: Sizes::Equal,
            // Answers are near enough.
            steps: usize::from(options.fit),
            rule: seen_rule(volume, options, maps.ordering),
            deviation_share: None,
        };
        progress.begin("refining in equal discs", volume.rows() as u64);
        let found = fit(volume, &lines, answers, equal, progress)?;
        progress.end();
        let FitResult { disparity, sigma, locking_px: locking, .. } = found;
        let found = EqualDiscs { disparity, sigma, locking };
        Ok(match area {
            Some(area) => found.map(|map| area.spread(map, f32::NAN)),
            None => found,
        })
    }

    /// Costs of all candidates of row `y` as they were when `maps` were found, for pictures of the search:
    /// the row's own, whatever other rows added, and at the whole resolution, whatever a first look took.
    ///
    /// # Panics
    /// If `y` lies outside the volume, or outside the rows that a mask left of it.
    pub fn row_costs(&self, y: usize, maps: &DisparityMaps) -> (Candidates, CostTable) {
        self.costs_of_row(y, maps.reference, maps.range, maps.ordering)
    }

    /// The same for a match of which only the reference frame, the range and the ordering are known.
    ///
    /// # Panics
    /// If `y` or `reference` lies outside the volume, or `y` outside the rows that a mask left of it.
    pub fn costs_of_row(
        &self,
        y: usize,
        reference: usize,
        range: DisparityRange,
        ordering: OrderingUsed,
    ) -> (Candidates, CostTable) {
        let Self { volume, options, area, .. } = self;
        let y = y - area.as_ref().map_or(0, |area| area.rows.start);
        let lines = EpiLines::new(volume.tau(), reference, volume.columns());
        let candidates = Candidates::covering(range, options.disparity_step_px);
        let rule = seen_rule(volume, options, ordering);
        let band = Band::new(volume, y..y + 1, options);
        let costs = band_costs(&band, &lines, &candidates, rule, options).swap_remove(0);
        (candidates, costs)
    }
}

/// Maps by discs of one size, in px over the whole baseline; rows x columns.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct EqualDiscs {
    /// Disparity; NaN without an answer.
    pub disparity: Grid<f32>,
    /// Its standard deviation.
    pub sigma: Grid<f32>,
    /// Its bias by pixel locking, as predicted; `None` if it is not significant.
    pub locking: Option<Grid<f32>>,
}

impl EqualDiscs {
    /// The maps that `change` makes of these.
    #[must_use]
    pub fn map(&self, change: impl Fn(&Grid<f32>) -> Grid<f32>) -> Self {
        Self {
            disparity: change(&self.disparity),
            sigma: change(&self.sigma),
            locking: self.locking.as_ref().map(change),
        }
    }
}

fn matched(
    volume: &Volume,
    lines: EpiLines,
    area: Option<&Area>,
    options: &MatchOptions,
    progress: &dyn Progress,
) -> Result<DisparityMaps, MatchError> {
    let reference = lines.reference();
    let asked = area.map_or(0..volume.columns(), |area| area.columns.clone());
    let lines = lines.asking(asked);
    let range_found = options.range.is_none();
    let quick = options.quick;
    // Light that changes much leads the variance astray. Normalised frames do not show it; they are
    // for the search alone.
    let normalised = (options.method == Method::Variance && changes_much(volume))
        .then(|| locally_normalised(volume.clone(), NORMALISING_WINDOW_PX));
    let searched_whole = normalised.as_ref().unwrap_or(volume);
    // Correlations have windows that are too wide for half the resolution.
    let may_be_halved = quick || options.search_used() == Search::Factorised;
    let halved = if may_be_halved { Halved::of(searched_whole, &lines, options) } else { None };
    let minimum_frames = seen_rule(volume, options, OrderingUsed::On).minimum_frames;
    let telling_of = |volume: &Volume| TellingFrames::of(volume, reference, minimum_frames);
    let telling = halved.as_ref().filter(|_| quick).and_then(|_| telling_of(volume));
    let searched_telling = telling.as_ref().and(normalised.as_ref()).and_then(telling_of);
    let (volume, lines, minimum_frames) = match &telling {
        Some(some) => {
            let lines = lines.in_frames(some.volume.tau(), some.reference);
            (&some.volume, lines, some.minimum_frames)
        }
        None => (volume, lines, minimum_frames),
    };
    let searched_in = match (&searched_telling, &normalised) {
        (Some(some), _) => &some.volume,
        (None, Some(normalised)) => normalised,
        (None, None) => volume,
    };
    // Half the resolution shows which disparities occur, but not whether narrow objects occlude others.
    let options = &match (&halved, options.range) {
        (Some(halved), None) => MatchOptions { range: halved.range(progress), ..options.clone() },
        _ => options.clone(),
    };
    progress.unless_cancelled()?;
    let (range, ordering) = range_and_ordering(searched_in, &lines, options, progress)?;
    // Narrow objects that occlude others are not seen at half the resolution.
    let halved = halved.filter(|_| quick || ordering == OrderingUsed::On);
    let candidates = Candidates::covering(range, options.disparity_step_px);
    options.check_search(&candidates)?;
    let rule = SeenRule { minimum_frames, ..seen_rule(volume, options, ordering) };

    let rows = volume.rows();
    debug!(
        minimum_px = range.minimum_px,
        maximum_px = range.maximum_px,
        range_found,
        candidates = candidates.count(),
        %ordering,
        minimum_frames,
        quick,
        "range and ordering"
    );
    let pass = debug_span!("search").entered();
    progress.begin("matching", halved.as_ref().map_or(rows, Halved::rows) as u64);
    let task = Task { volume: searched_in, lines: &lines, range, ordering, rule, options, progress };
    let SearchResult { mut guess, cost, confidence, validity: searched, deviation_share } = {
        let searched = match &halved {
            None => search(task),
            Some(halved) => halved.searched(task),
        };
        progress.end();
        searched?
    };
    progress.unless_cancelled()?;

    if halved.is_none() && ordering == OrderingUsed::On {
        // A free search has windows that lie to one side of a pixel.
        refine_edges(task, &mut guess, 1 + options.window_px / 2);
    }
    progress.unless_cancelled()?;
    if let Some(area) = area {
        area.forget_beside(&mut guess);
    }
    lines.forget_unshown(&mut guess);
    debug!(deviation_share, "searched");
    drop(pass);
    let steps = match (&halved, options.fit) {
        (_, false) => 0,
        // One was taken at half the resolution, of the same frames.
        (Some(_), true) if normalised.is_none() => FIT_STEPS - 1,
        (Some(_), true) => FIT_STEPS,
        (None, true) => FIT_STEPS,
    };
    drop(halved);
    let fit_options = Fit { sizes: Sizes::of(options), steps, rule, deviation_share };
    let pass = debug_span!("fit").entered();
    progress.begin("refining", (rows * steps.max(1)) as u64);
    let found = fit(volume, &lines, guess, fit_options, progress)?;
    let FitResult { disparity, sigma, outliers, locking_px, locking, light } = found;
    progress.end();
    debug!(steps, pixel_locking = locking_px.is_some(), "fitted");
    drop(pass);

    let mut maps = DisparityMaps {
        disparity,
        sigma,
        cost,
        confidence,
        validity: searched,
        reference,
        range,
        range_found,
        ordering,
        locking: None,
        light,
    };
    ValidityRule { range, ordering, options }.pass(&mut maps, outliers.as_ref());
    if let Some(area) = area {
        area.forget_outside(&mut maps);
    }
    // Without a significant bias, none is the worst.
    let answered = locking_px.iter().flat_map(|locking_px| {
        let pixels = maps.disparity.values().iter().zip(locking_px.values());
        let pixels = pixels.zip(maps.validity.values()).filter(|(_, validity)| **validity == Validity::Found);
        pixels.map(|((disparity, bias), _)| [*disparity, *bias])
    });
    maps.locking = locking.map(|amplitudes| PixelLocking::of(amplitudes, answered));
    Ok(maps)
}

fn seen_rule(volume: &Volume, options: &MatchOptions, ordering: OrderingUsed) -> SeenRule {
    let occlusion = match (options.occlusion, ordering) {
        (Occlusion::Automatic, OrderingUsed::Off) => Occlusion::OneSide,
        (Occlusion::Automatic, OrderingUsed::On) => Occlusion::None,
        (stated, _) => stated,
    };
    SeenRule::new(volume.frames(), options.min_visible, occlusion)
}

fn range_and_ordering(
    volume: &Volume,
    lines: &EpiLines,
    options: &MatchOptions,
    progress: &dyn Progress,
) -> Result<(DisparityRange, OrderingUsed), MatchError> {
    let surveyed = if options.range.is_none() || options.ordering_constraint == OrderingConstraint::Automatic
    {
        progress.begin("looking at a few rows", 1);
        let found = survey(volume, lines, options, progress);
        progress.end();
        progress.unless_cancelled()?;
        found
    } else {
        None
    };
    let range = options.range.or(surveyed.map(|survey| survey.range)).ok_or(MatchError::NoRange)?;
    let ordered = surveyed.is_none_or(|Survey { ordered, .. }| ordered);
    let ordering = match options.ordering_constraint {
        OrderingConstraint::On => OrderingUsed::On,
        OrderingConstraint::Off => OrderingUsed::Off,
        OrderingConstraint::Automatic if ordered => OrderingUsed::On,
        OrderingConstraint::Automatic => OrderingUsed::Off,
    };
    Ok((range, ordering))
}
