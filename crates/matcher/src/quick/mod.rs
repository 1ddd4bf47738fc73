//! A first look: disparities are searched at half the resolution, at an eighth of the work, and carried to
//! the whole one.
//!
//! Averages of 2 x 2 pixels ([`Volume::halved`]) are searched like any frames, and a step of the fit brings
//! their disparities to some hundredths of a pixel (coarse to fine; Bergen and others 1992). Half the
//! resolution blurs the edges between surfaces; edge refinement at the whole resolution decides these
//! ([`doubling`]).

mod doubling;
#[cfg(test)]
mod tests;

use std::ops::Range;

use super::candidates::DisparityRange;
use super::fit::gauss_newton_step;
use super::lines::{EpiLines, SeenRule};
use super::options::{LARGEST_WINDOW_PX, MatchError, MatchOptions};
use super::range::survey;
use super::search::{SearchResult, Task, search};
use doubling::refined;
use epirig_core::progress::{Progress, Uncounted};
use epirig_core::tau::Tau;
use epirig_core::volume::Volume;

/// Windows are wider by this much, in px of the halved frames: a disparity step of whole pixels needs
/// steadier costs.
const WIDER_PX: usize = 2;

/// Sequences of fewer frames are used as a whole; of longer ones half of the frames are.
const MANY_FRAMES: usize = 100;
/// Those are all of the ends, up to this share of the sequence, which tell a line's slope best, ...
const END_SHARE: f64 = 1.0 / 6.0;
/// ... two thirds of the half. The others are spread over the frames between, for points that the ends do not
/// see.
const HALF_AT_END: f64 = 1.0 / 3.0;

/// The frames that a first look's fit asks.
pub(super) struct TellingFrames {
    /// Their samples, shared with all frames.
    pub(super) volume: Volume,
    /// Place of the reference frame among them.
    pub(super) reference: usize,
    /// As many of them as any run of frames holds that is long enough to see a point.
    pub(super) minimum_frames: usize,
}

impl TellingFrames {
    /// The half of the frames of `volume` that tells most: it leaves 1.14 times the sigma of all. `None` if
    /// all are needed. `minimum_frames` of all have to see a point.
    pub(super) fn of(volume: &Volume, reference: usize, minimum_frames: usize) -> Option<Self> {
        let count = volume.frames();
        if count < MANY_FRAMES {
            return None;
        }
        let frames = places(count, reference);
        let positions: Vec<f64> = frames.iter().map(|&t| volume.tau().values()[t]).collect();
        let tau = Tau::from_positions(&positions).ok()?;
        let among = |run: Range<usize>| frames.iter().filter(|t| run.contains(t)).count();
        let runs = (0..=count - minimum_frames.min(count)).map(|first| among(first..first + minimum_frames));
        Some(Self {
            volume: volume.showing(&frames, tau),
            reference: frames.iter().position(|&t| t == reference)?,
            // Two points always lie on a line.
            minimum_frames: runs.min()?.max(3),
        })
    }
}

/// Half of `count` frames and the `reference`, in their order.
fn places(count: usize, reference: usize) -> Vec<usize> {
    let (last, half) = ((count - 1) as f64, count / 2);
    let place = |index: usize| {
        let share = index as f64 / (half - 1) as f64;
        let from_end = share.min(1.0 - share);
        let inner = (0.5 - END_SHARE) / (0.5 - HALF_AT_END);
        let place = if from_end < HALF_AT_END {
            from_end * END_SHARE / HALF_AT_END
        } else {
            END_SHARE + (from_end - HALF_AT_END) * inner
        };
        (last * if share < 0.5 { place } else { 1.0 - place }).round() as usize
    };
    let mut frames: Vec<usize> = (0..half).map(place).collect();
    frames.push(reference);
    frames.sort_unstable();
    frames.dedup();
    frames
}

/// Frames at half the resolution, with their lines and options.
pub(super) struct Halved {
    volume: Volume,
    lines: EpiLines,
    options: MatchOptions,
}

impl Halved {
    /// `volume` halved; `None` if it is too small for that.
    pub(super) fn of(volume: &Volume, lines: &EpiLines, options: &MatchOptions) -> Option<Self> {
        let halved = volume.halved();
        let limit_px = options.largest_disparity_px(halved.columns().max(1));
        // Half of an odd number of columns is less than half of them.
        let range = options.range.map(|range| range.scaled(0.5)).map(|range| DisparityRange {
            minimum_px: range.minimum_px.clamp(-limit_px, limit_px),
            maximum_px: range.maximum_px.clamp(-limit_px, limit_px),
        });
        let window_px = (options.window_px + WIDER_PX).min(LARGEST_WINDOW_PX);
        let options = MatchOptions { window_px, range, ..options.clone() };
        // Options that suit the whole frames do not suit these only if these are too small.
        options.check(halved.rows(), halved.columns(), halved.frames()).ok()?;
        let lines = lines.halved(halved.tau(), halved.columns());
        Some(Self { volume: halved, lines, options })
    }

    /// The range of disparities in px of the whole frames; `None` if none is significant.
    pub(super) fn range(&self, progress: &dyn Progress) -> Option<DisparityRange> {
        progress.begin("looking for the range", 1);
        let found = survey(&self.volume, &self.lines, &self.options, progress);
        progress.end();
        Some(found?.range.scaled(2.0))
    }

    /// The result of `task`, searched in these frames and refined in its own. The task's progress counts
    /// each row of these.
    ///
    /// # Errors
    /// As [`search`].
    pub(super) fn searched(&self, task: Task<'_>) -> Result<SearchResult, MatchError> {
        let Self { volume, lines, options } = self;
        let rule = SeenRule::new(volume.frames(), options.min_visible, task.rule.occlusion);
        let mut found = search(Task { volume, lines, range: task.range.scaled(0.5), rule, options, ..task })?;
        lines.forget_unshown(&mut found.guess);
        if options.fit {
            found.guess = gauss_newton_step(volume, lines, found.guess, rule, &Uncounted(task.progress))?;
        }
        Ok(refined(task, &found, options.window_px / 2))
    }

    /// Rows that are searched.
    pub(super) fn rows(&self) -> usize {
        self.volume.rows()
    }
}
