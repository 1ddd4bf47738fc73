//! Step height: two levels of a surface, and the depth of its hollows.
//!
//! The surface is a trend, and lies a depth lower in the hollows (the tile of the paper, section 5.2). The
//! heights tell where the hollows are. Then depth and trend are fitted together, to the pixels clear of the
//! walls.

mod budget;
mod depth;
mod divide;
mod levels;
mod nearest;
mod options;
mod plateaus;
mod regions;
#[cfg(test)]
mod tests;
mod walls;

use serde::Serialize;

use super::SurfaceError;
use super::blocks::Correlation;
use super::height::{HalfHeights, Heights};
use super::trend::{Field, Trend};
use budget::Choices;
pub use budget::{Budget, Combined, Contribution, Evaluation};
pub use depth::{Depth, Part};
use depth::{Side, fit, parts};
use divide::{Divided, ROOM, divided};
use epirig_core::grid::Grid;
use epirig_core::statistics::quantile;
pub use options::StepsOptions;
use regions::{Level, count};
use walls::wall_width_px;

/// The lower level is the ground, and the upper one stands on it, if it is this share of the field.
const GROUND: f64 = 0.6;
/// Number of pixels that are left out at the walls beyond those asked for, to see whether the depth still
/// changes.
const MORE_MARGIN: usize = 2;
/// Share of the pixels that a larger margin has to leave of those of the smallest one. Errors of neighbours are alike,
/// so half of the pixels know the depth nearly as well as all.
const ROOMY: f64 = 0.5;

/// The depth by pixels at least this far from the walls.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct DepthAtMargin {
    /// Distance from the walls that is left out, in px.
    pub margin_px: usize,
    /// How far the lower level lies below the upper one, in mm.
    pub depth_mm: f64,
    /// Standard deviation from the scatter between independent parts of the field, in mm; `None` if too few
    /// are left.
    pub sigma_mm: Option<f64>,
    /// Half the width of the interval that holds it with 95 % coverage, in mm, by that scatter.
    pub half_width_95_mm: Option<f64>,
    /// Pixels that are left.
    pub used_px: usize,
}

/// The depth on the plateaus of ISO 5436-1: the central third of each hollow, and the ground from a third of its
/// width to its width beside it (or the same of raised parts).
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct DepthOnPlateaus {
    /// With the interval by its scatter.
    pub depth: Depth,
    /// Median width of the parts that are wide enough for these plateaus, in px, to about a pixel.
    pub width_px: f64,
    /// Pixels on the plateaus.
    pub used_px: usize,
}

/// The two levels of a field.
#[derive(Debug, Clone, PartialEq)]
pub struct Steps {
    /// Over all hollows.
    pub depth: Depth,
    /// Its uncertainty, by contributions.
    pub budget: Budget,
    /// Whether parts stand on a ground that lies deeper, instead of being sunk into it.
    pub raised: bool,
    /// Each hollow (or raised part), from top to bottom.
    pub parts: Vec<Part>,
    /// Depths for other distances from the walls. Windows that reach over a wall make hollows shallower, so
    /// the depth grows with the distance until they no longer do.
    pub by_margin: Vec<DepthAtMargin>,
    /// Depth on the plateaus of ISO 5436-1; `None` if no part is so wide that a third of it is at least the smallest
    /// margin.
    pub on_plateaus: Option<DepthOnPlateaus>,
    /// How wide the walls look in the map, from 10 % to 90 % of the depth, in px, to about a pixel: blur and the windows of
    /// the match are part of that. `None` if heights scatter by more than a twentieth of the depth, or do not reach both
    /// levels beside the walls.
    pub wall_width_px: Option<f64>,
    /// The trend of the upper level.
    pub trend: Trend,
    /// True on the lower level; meaningful where there is a height.
    pub lower: Grid<bool>,
    /// Pixels of the map that the trend was fitted to: clear of the walls, and no outliers.
    pub used: Grid<bool>,
    /// The correlation of the errors of these pixels.
    pub correlation: Correlation,
    /// Distance from the walls that was left out, in px.
    pub margin_px: usize,
    /// Scatter of the heights of the pixels used about their level, as a standard deviation in mm.
    pub scatter_mm: f64,
}

/// Finds the hollows of a field and their depth.
///
/// Heights that say where the hollows are must not say how deep they are: beside the walls noise has put what is
/// low on the lower level, and what is high on the upper one. So each of the `halves`, the heights by the even and by
/// the odd frames, whose noise is independent, is measured on the levels that the other one shows (cross-fitting).
/// Without them the depth is too large.
///
/// What is measured has windows of one size. The margin beside the walls is as wide as the hollows have room for, between
/// the two of the `options`. Without halves it is that of windows that grow.
///
/// The interval holds as often as it says down to hollows three times as deep as heights scatter (tried on
/// stripes and on pits).
///
/// # Errors
/// [`SurfaceError`] if there is one level only, in the heights or in those of a half, or nothing of one is clear
/// of the walls.
pub fn find_steps(
    heights: &Heights,
    halves: Option<&[HalfHeights; 2]>,
    options: &StepsOptions,
) -> Result<Steps, SurfaceError> {
    let field = Field::new(heights, options.trend)?;
    let Some([one, other]) = halves else {
        let whole = divided(&[&field], options)?;
        let on = vec![(&field, &whole)];
        let measured = Measured { on, margin_px: whole.margin_px, locking_mm: Vec::new() };
        return steps(&field, &whole, &measured, options);
    };
    let mean = one.measured.mean_with(&other.measured);
    let whole = divided(&[&field, &field.with_heights(&mean)?], options)?;
    let by = |half: &HalfHeights| {
        divided(&[&field.with_heights(&half.dividing)?, &field.with_heights(&half.measured)?], options)
    };
    let (by_one, by_other) = rayon::join(|| by(one), || by(other));
    let (by_one, by_other) = (by_one?, by_other?);
    let locking_mm = vec![one.locking_mm.as_ref(), other.locking_mm.as_ref()];
    let heights = [one.measured.with_sigma_of(&other.measured), other.measured.with_sigma_of(&one.measured)];
    let [one, other] = &heights;
    let (one, other) = (field.with_heights(one)?, field.with_heights(other)?);
    let measured = Measured::new(vec![(&one, &by_other), (&other, &by_one)], locking_mm, options);
    steps(&field, &whole, &measured, options)
}

/// Heights to be measured, each with the division that they are measured on.
struct Measured<'a> {
    on: Vec<(&'a Field<'a>, &'a Divided)>,
    /// Distance from the walls that is left out, in px.
    margin_px: usize,
    /// Errors of each half's heights by pixel locking, as predicted, in mm; empty without halves.
    locking_mm: Vec<Option<&'a Grid<f32>>>,
}

impl<'a> Measured<'a> {
    /// With the largest margin that leaves the share [`ROOMY`] of what the smallest one leaves on both levels.
    fn new(
        on: Vec<(&'a Field<'a>, &'a Divided)>,
        locking_mm: Vec<Option<&'a Grid<f32>>>,
        options: &StepsOptions,
    ) -> Self {
        let left = |margin_px: usize| {
            let counts = on.iter().map(|(_, divided)| divided.counts(margin_px));
            counts.fold([0, 0], |sum, counts| [sum[0] + counts[0], sum[1] + counts[1]])
        };
        let least = left(options.margin_px);
        let is_roomy = |&margin_px: &usize| {
            let levels = left(margin_px).into_iter().zip(least);
            levels.into_iter().all(|(left, least)| left as f64 >= ROOMY * least as f64)
        };
        let farther = (options.margin_px + 1..=options.grown_margin_px).take_while(is_roomy);
        Self { margin_px: farther.last().unwrap_or(options.margin_px), on, locking_mm }
    }

    fn sides(&self, margin_px: usize) -> Vec<Side<'_>> {
        self.on.iter().map(|(field, divided)| Side { field, clear: divided.clear_by(margin_px) }).collect()
    }

    /// The depth on the plateaus of ISO 5436-1 of the parts on a level that are wide enough for this margin.
    fn on_plateaus(&self, of_parts: Level, margin_px: usize, scale_sigma: f64) -> Option<DepthOnPlateaus> {
        let mut widths_px = Vec::new();
        let sides: Vec<Side<'_>> = self
            .on
            .iter()
            .map(|(field, divided)| {
                let plateaus = divided.plateaus(of_parts, margin_px);
                widths_px.extend(plateaus.widths_px);
                Side { field, clear: plateaus.clear }
            })
            .collect();
        let fitted = fit(&sides)?;
        let depth = fitted.depth(&fitted.certainty(&sides), scale_sigma);
        Some(DepthOnPlateaus { depth, width_px: quantile(&mut widths_px, 0.5)?, used_px: fitted.pixels })
    }

    /// Depth and its sigma by each half alone, in mm; `None` without halves, or if one of them does not do.
    fn by_halves(&self) -> Option<[(f64, Option<f64>); 2]> {
        let sides: [Side<'_>; 2] = self.sides(self.margin_px).try_into().ok()?;
        let [one, other] = sides.map(|side| {
            let alone = [side];
            fit(&alone).map(|fitted| fitted.depth(&fitted.certainty(&alone), 0.0))
        });
        Some([one?, other?].map(|depth| (depth.depth_mm, depth.sigma_mm)))
    }

    /// The depth and its sigma, in mm, with a form of one more degree; `None` if there is none, or too few
    /// pixels for it.
    fn with_richer_form(&self, scale_sigma: f64) -> Option<(f64, Option<f64>)> {
        let fields: Vec<Field<'_>> =
            self.on.iter().map(|(field, _)| field.richer()).collect::<Option<_>>()?;
        let sides: Vec<Side<'_>> = fields
            .iter()
            .zip(&self.on)
            .map(|(field, (_, divided))| Side { field, clear: divided.clear_by(self.margin_px) })
            .collect();
        let fitted = fit(&sides)?;
        let depth = fitted.depth(&fitted.certainty(&sides), scale_sigma);
        Some((depth.depth_mm, depth.sigma_mm))
    }
}

/// The depth as it is measured. All else, such as the trend of the map and where its parts are, is that of the `field`
/// on the levels of the `whole`.
fn steps(
    field: &Field<'_>,
    whole: &Divided,
    measured: &Measured<'_>,
    options: &StepsOptions,
) -> Result<Steps, SurfaceError> {
    let (margin_px, scale) = (measured.margin_px, field.heights.geometry.scale);
    let scale_sigma = scale.together();
    let narrow = SurfaceError::TooNarrow { margin_px, depth_mm: whole.levels_found.depth_mm };
    let plateaus = measured.sides(margin_px);
    let fitted = fit(&plateaus).ok_or(narrow.clone())?;
    let certainty = fitted.certainty(&plateaus);
    let map = [Side { field, clear: whole.clear.clone() }];
    let of_map = fit(&map).ok_or(narrow)?;
    let certainty_of_map = of_map.certainty(&map);
    let lower_share = {
        let [lower, upper] = [Level::Lower, Level::Upper].map(|level| count(&whole.levels, level) as f64);
        lower / (lower + upper)
    };
    let raised = lower_share > GROUND;
    let mut farther_from_walls = None;
    let by_margin = (0..=margin_px + MORE_MARGIN).map_while(|at_margin_px| {
        let sides = measured.sides(at_margin_px);
        let other = fit(&sides)?;
        let depth = other.depth(&other.certainty(&sides), scale_sigma);
        // With few pixels the depth is that of a corner of the field.
        let is_farther = at_margin_px > margin_px
            && [Level::Upper, Level::Lower]
                .iter()
                .all(|&level| other.count(level) as f64 >= ROOM * fitted.count(level) as f64);
        if is_farther {
            farther_from_walls = Some((depth.depth_mm, depth.sigma_mm));
        }
        Some(DepthAtMargin {
            margin_px: at_margin_px,
            depth_mm: depth.depth_mm,
            sigma_mm: depth.sigma_mm,
            half_width_95_mm: depth.half_width_95_mm,
            used_px: other.pixels,
        })
    });
    let by_margin: Vec<DepthAtMargin> = by_margin.collect();
    let depth = fitted.depth(&certainty, scale_sigma);
    let nearer = margin_px.checked_sub(1).and_then(|nearer_px| by_margin.get(nearer_px));
    let nearer_to_walls = nearer.map(|nearer| (nearer.depth_mm, nearer.sigma_mm));
    let of_parts = if raised { Level::Upper } else { Level::Lower };
    let on_plateaus = measured.on_plateaus(of_parts, options.margin_px, scale_sigma);
    let is_known = !measured.locking_mm.is_empty();
    let choices = Choices {
        farther_from_walls,
        nearer_to_walls,
        richer_form: measured.with_richer_form(scale_sigma),
        on_plateaus: on_plateaus.map(|on| (on.depth.depth_mm, on.depth.sigma_mm)),
        by_halves: measured.by_halves(),
        locking_mm: is_known.then(|| fitted.error_of_depth(&plateaus, &measured.locking_mm)).flatten(),
    };
    let budget = Budget::of(&depth, choices, scale);
    Ok(Steps {
        depth,
        budget,
        raised,
        on_plateaus,
        wall_width_px: wall_width_px(field, &whole.levels, (&of_map.levels, certainty_of_map.scatter_mm)),
        parts: parts(&plateaus, &whole.levels, &fitted, &certainty, raised, options),
        by_margin,
        trend: of_map.trend(field, &certainty_of_map),
        lower: whole.levels.map(|level| level == Level::Lower),
        used: of_map.used[0].map(|level| level != Level::Unknown),
        scatter_mm: certainty_of_map.scatter_mm,
        correlation: certainty_of_map.correlation,
        margin_px,
    })
}
