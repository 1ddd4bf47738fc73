//! A first look: disparities found at half the resolution, where that takes an eighth of the work, and carried to the whole one.
//!
//! Averages of 2 x 2 pixels ([`Volume::halved`]) are searched as any frames are, and a step of the fit brings their disparities to some hundredths of a pixel
//! (coarse to fine; Bergen and others 1992). What half the resolution blurs is where surfaces meet, which the pixels themselves settle ([`doubling`]).

mod doubling;
#[cfg(test)]
mod tests;

use super::lines::{Lines, SeenRule};
use super::options::{DisparityRange, MatchError, MatchOptions};
use super::range::survey;
use super::refine::stepped;
use super::search::{Searched, Task, search};
use crate::progress::Progress;
use crate::tau::Tau;
use crate::volume::Volume;
use doubling::settled;

/// Windows are wider by this much, in px of the halved frames: a raster of whole pixels needs steadier costs.
const WIDER_PX: usize = 2;

/// Frames that the fit of a first look asks.
const FRAMES: usize = 50;
/// They are all of those at both ends, which tell a line's slope best, up to this share of the sequence ...
const END_SHARE: f64 = 1.0 / 6.0;
/// ... and as many again, spread over the rest, for points that are not seen at the ends, as this share of all says.
const FRAMES_AT_END: f64 = 1.0 / 3.0;

/// The frames of which a fit knows nearly as much as of all, where there are many: half of a hundred leave 1.14 times their sigma. With them comes the place of the
/// reference frame, which is one of them. `None` if all are needed.
pub(super) fn telling_frames(volume: &Volume, reference: usize) -> Option<(Volume, usize)> {
    if volume.frames() < 2 * FRAMES {
        return None;
    }
    let last = (volume.frames() - 1) as f64;
    let place = |index: usize| {
        let share = index as f64 / (FRAMES - 1) as f64;
        let from_end = share.min(1.0 - share);
        let inner = (0.5 - END_SHARE) / (0.5 - FRAMES_AT_END);
        let place = if from_end < FRAMES_AT_END {
            from_end * END_SHARE / FRAMES_AT_END
        } else {
            END_SHARE + (from_end - FRAMES_AT_END) * inner
        };
        (last * if share < 0.5 { place } else { 1.0 - place }).round() as usize
    };
    let mut frames: Vec<usize> = (0..FRAMES).map(place).collect();
    frames.push(reference);
    frames.sort_unstable();
    frames.dedup();
    let positions: Vec<f64> = frames.iter().map(|&t| volume.tau().values()[t]).collect();
    let tau = Tau::from_positions(&positions).ok()?;
    let rows: Vec<usize> = (0..volume.rows()).collect();
    let reference = frames.iter().position(|&t| t == reference)?;
    Some((volume.selected(&rows, &frames, tau), reference))
}

/// Frames at half the resolution, with their lines and options.
pub(super) struct Halved {
    volume: Volume,
    lines: Lines,
    options: MatchOptions,
}

impl Halved {
    /// `volume` halved; `None` if it is too small for that.
    pub(super) fn of(volume: &Volume, lines: &Lines, options: &MatchOptions) -> Option<Self> {
        let halved = volume.halved();
        let options = MatchOptions {
            window_px: options.window_px + WIDER_PX,
            range: options.range.map(|range| scaled(range, 0.5)),
            ..options.clone()
        };
        options.check(halved.rows(), halved.columns(), halved.frames()).ok()?;
        let lines = Lines::new(halved.tau(), lines.reference(), halved.columns());
        Some(Self { volume: halved, lines, options })
    }

    /// The range of disparities in px of the whole frames; `None` if none stands out.
    pub(super) fn range(&self, progress: &dyn Progress) -> Option<DisparityRange> {
        progress.begin("looking for the range", 1);
        let found = survey(&self.volume, &self.lines, &self.options);
        progress.end();
        Some(scaled(found?.range, 2.0))
    }

    /// What `task` asks for, searched in these frames and settled in its own. `progress` is told each row of these.
    ///
    /// # Errors
    /// As [`search`].
    pub(super) fn searched(&self, task: Task<'_>, progress: &dyn Progress) -> Result<Searched, MatchError> {
        let Self { volume, lines, options } = self;
        let rule = SeenRule::new(volume.frames(), options.minimum_visible, task.rule.hidden_points);
        let mut found =
            search(Task { volume, lines, range: scaled(task.range, 0.5), rule, options, ..task }, progress)?;
        if options.refine {
            found.guess = stepped(volume, lines, found.guess, rule, || ());
        }
        Ok(settled(task, &found, options.window_px / 2))
    }

    /// Rows that are searched.
    pub(super) fn rows(&self) -> usize {
        self.volume.rows()
    }
}

fn scaled(range: DisparityRange, by: f64) -> DisparityRange {
    DisparityRange { minimum_px: by * range.minimum_px, maximum_px: by * range.maximum_px }
}
