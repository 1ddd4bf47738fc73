//! The stations of a match in their order: range, costs, mapping, sub-pixel fit, validity of each pixel.

use serde::{Deserialize, Serialize};
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
use super::validity::Validity;
use super::validity::area::Area;
use super::validity::rule::ValidityRule;
use epirig_core::progress::Progress;
use epirig_core::volume::Volume;

/// Gauss-Newton steps: from half a disparity step two come within a thousandth of a pixel of the end; the
/// third confirms.
const FIT_STEPS: usize = 2;

/// What is found once for a whole picture, from some of its rows.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct Overview {
    /// The disparities that are searched.
    pub range: DisparityRange,
    /// Whether the ordering constraint is applied.
    pub ordering: OrderingUsed,
    /// Whether light changes so much that normalised frames are searched.
    pub light_changes: bool,
}

/// The frames in the forms in which they are searched.
struct Searched {
    /// Frames without the changes of light, for the search alone.
    normalised: Option<Volume>,
    /// Those that are searched at half the resolution.
    halved: Option<Halved>,
    /// Some of the frames, for a first look.
    telling: Option<TellingFrames>,
    /// The same of normalised ones.
    searched_telling: Option<TellingFrames>,
}

impl Searched {
    fn of(volume: &Volume, lines: &EpiLines, options: &MatchOptions, light_changes: bool) -> Self {
        // Light that changes much leads the variance astray. Normalised frames do not show it; they are
        // for the search alone.
        let normalised = light_changes.then(|| locally_normalised(volume.clone(), NORMALISING_WINDOW_PX));
        // Correlations have windows that are too wide for half the resolution.
        let may_be_halved = options.quick || options.search_used() == Search::Factorised;
        let searched_whole = normalised.as_ref().unwrap_or(volume);
        let halved = if may_be_halved { Halved::of(searched_whole, lines, options) } else { None };
        let minimum_frames = minimum_frames(volume, options);
        let telling_of = |volume: &Volume| TellingFrames::of(volume, lines.reference(), minimum_frames);
        let telling = halved.as_ref().filter(|_| options.quick).and_then(|_| telling_of(volume));
        let searched_telling = telling.as_ref().and(normalised.as_ref()).and_then(telling_of);
        Self { normalised, halved, telling, searched_telling }
    }

    /// The frames that are fitted, those that are searched at the whole resolution, and their lines. Volumes share their
    /// samples.
    fn used(&self, volume: &Volume, lines: EpiLines) -> (Volume, Volume, EpiLines) {
        let (fitted, lines) = match &self.telling {
            Some(some) => (&some.volume, lines.in_frames(some.volume.tau(), some.reference)),
            None => (volume, lines),
        };
        let searched = match (&self.searched_telling, &self.normalised) {
            (Some(some), _) => &some.volume,
            (None, Some(normalised)) => normalised,
            (None, None) => fitted,
        };
        (fitted.clone(), searched.clone(), lines)
    }

    fn overview(
        &self,
        (volume, lines): (&Volume, &EpiLines),
        options: &MatchOptions,
        progress: &dyn Progress,
    ) -> Result<Overview, MatchError> {
        // Half the resolution shows which disparities occur, but not whether narrow objects occlude others.
        let range = match (&self.halved, options.range) {
            (Some(halved), None) => halved.range(progress),
            (_, range) => range,
        };
        progress.unless_cancelled()?;
        let options = MatchOptions { range, ..options.clone() };
        let (_, searched, lines) = self.used(volume, lines.clone());
        let (range, ordering) = range_and_ordering(&searched, &lines, &options, progress)?;
        Ok(Overview { range, ordering, light_changes: self.normalised.is_some() })
    }
}

/// The samples that are compared along lines: those of `volume`, changed in their place unless they are shared
/// with another volume.
pub(crate) fn prepared(volume: Volume, options: &MatchOptions) -> Volume {
    match options.method {
        Method::Normalised => locally_normalised(volume, NORMALISING_WINDOW_PX),
        Method::Variance | Method::NccFirst | Method::NccMean => volume,
    }
}

/// Finds what holds for the whole picture from `volume`.
pub(crate) fn overview(
    volume: &Volume,
    lines: &EpiLines,
    options: &MatchOptions,
    progress: &dyn Progress,
) -> Result<Overview, MatchError> {
    let searched = Searched::of(volume, lines, options, light_changes(volume, options));
    searched.overview((volume, lines), options, progress)
}

fn light_changes(volume: &Volume, options: &MatchOptions) -> bool {
    options.method == Method::Variance && changes_much(volume)
}

/// The maps of `volume`, or of its part `area`. What holds for the whole picture is found unless it is `known`.
pub(crate) fn matched(
    volume: &Volume,
    lines: &EpiLines,
    area: Option<&Area>,
    options: &MatchOptions,
    known: Option<Overview>,
    progress: &dyn Progress,
) -> Result<DisparityMaps, MatchError> {
    let reference = lines.reference();
    let asked = area.map_or(0..volume.columns(), |area| area.columns.clone());
    let lines = lines.clone().asking(asked);
    let range_found = options.range.is_none();
    let quick = options.quick;
    let changes = known.map_or_else(|| light_changes(volume, options), |known| known.light_changes);
    let mut forms = Searched::of(volume, &lines, options, changes);
    let Overview { range, ordering, .. } = match known {
        Some(known) => known,
        None => forms.overview((volume, &lines), options, progress)?,
    };
    let options = &MatchOptions { range: Some(range), ..options.clone() };
    // Narrow objects that occlude others are not seen at half the resolution.
    let halved = forms.halved.take().filter(|_| quick || ordering == OrderingUsed::On);
    let minimum_frames = match &forms.telling {
        Some(some) => some.minimum_frames,
        None => minimum_frames(volume, options),
    };
    let (volume, searched_in, lines) = forms.used(volume, lines);
    let is_normalised = forms.normalised.is_some();
    drop(forms);
    let volume = &volume;
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
    let task = Task { volume: &searched_in, lines: &lines, range, ordering, rule, options, progress };
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
        (Some(_), true) if !is_normalised => FIT_STEPS - 1,
        (Some(_), true) => FIT_STEPS,
        (None, true) => FIT_STEPS,
    };
    drop((halved, searched_in));
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

/// Costs of all candidates of row `y` of a prepared `volume`, in a match of this reference frame, range and ordering.
pub(crate) fn costs_of_row(
    volume: &Volume,
    y: usize,
    options: &MatchOptions,
    (reference, range, ordering): (usize, DisparityRange, OrderingUsed),
) -> (Candidates, CostTable) {
    let lines = EpiLines::new(volume.tau(), reference, volume.columns());
    let candidates = Candidates::covering(range, options.disparity_step_px);
    let rule = seen_rule(volume, options, ordering);
    let band = Band::new(volume, y..y + 1, options);
    let costs = band_costs(&band, &lines, &candidates, rule, options).swap_remove(0);
    (candidates, costs)
}

pub(crate) fn seen_rule(volume: &Volume, options: &MatchOptions, ordering: OrderingUsed) -> SeenRule {
    let occlusion = match (options.occlusion, ordering) {
        (Occlusion::Automatic, OrderingUsed::Off) => Occlusion::OneSide,
        (Occlusion::Automatic, OrderingUsed::On) => Occlusion::None,
        (stated, _) => stated,
    };
    SeenRule::new(volume.frames(), options.min_visible, occlusion)
}

/// Frames that have to see a point.
fn minimum_frames(volume: &Volume, options: &MatchOptions) -> usize {
    seen_rule(volume, options, OrderingUsed::On).minimum_frames
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
