//! From a sequence to its results, as `epirig run` does after the scan.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::notes::Notes;
use crate::memory::available;
use crate::panel::error::PanelError;
use crate::panel::shared::SharedState;
use crate::panel::state::TaskKind;
use crate::pipeline::{
    Frames, Held, MeasuredSurface, SurfaceQuestions, View, calibrate_sequence, calibration_held,
    half_heights, halves_need, held, inspect_surface, match_need, measure as match_sequence, open_results,
    pack_if_large,
};
use crate::profile::Profile;
use crate::results::{Region, ResultsFolder, ResultsKind};
use crate::rig::{calibration_plan, can_be_calibrated};
use epirig_data::sequence::Sequence;
use epirig_matcher::MatchOptions;

/// Begins to measure the sequence `name` in `folder`, in a thread of its own. STOP ends it.
///
/// # Errors
/// [`PanelError::Busy`] if the rig is doing something else; [`PanelError::Threads`].
pub(in crate::panel) fn begin_measurement(
    shared: &Arc<SharedState>,
    name: &str,
    folder: PathBuf,
) -> Result<(), PanelError> {
    shared
        .begin(TaskKind::Measuring, format!("measuring with {name}"), None)
        .map_err(|_| PanelError::Busy("the rig is busy; measure afterwards".to_owned()))?;
    let (shared, name) = (Arc::clone(shared), name.to_owned());
    let ended = Arc::clone(&shared);
    let work = move || {
        // What unwinds leaves scratch files to be removed, and the former results where they are.
        let measured = catch_unwind(AssertUnwindSafe(|| measure(&shared, &folder)));
        let stopped = shared.look(|state| state.rig.task.as_ref().is_some_and(|task| task.stops));
        shared.end_task();
        match measured {
            Ok(Ok(())) => {
                shared.note(format!("{name} is measured"));
                shared.change(|state| {
                    let scan = state.rig.scan.as_mut().filter(|scan| scan.name == name);
                    scan.map(|scan| scan.measured = true)
                });
            }
            Ok(Err(error)) => shared.fail(error.to_string()),
            Err(_) if stopped => shared.note(format!("the measurement of {name} was stopped")),
            Err(_) => shared.fail(format!("the measurement of {name} broke off; this is a fault of epirig")),
        }
    };
    if let Err(error) = std::thread::Builder::new().spawn(work) {
        ended.end_task();
        return Err(PanelError::Threads(error));
    }
    Ok(())
}

/// Calibrates the sequence in `folder` if its rig gives anything to calibrate with, matches it, and analyses its
/// surface. Results that were there are replaced.
fn measure(shared: &Arc<SharedState>, folder: &Path) -> Result<(), PanelError> {
    let (sequence, notes) = (Sequence::open(folder)?, Notes(shared));
    sequence.check_closed()?;
    sequence.check_records()?;
    let record = sequence.record();
    let rig = Profile::of_sequence(&sequence)?.filter(can_be_calibrated);
    let options = MatchOptions::default();
    let frames = Frames {
        count: sequence.frames().len(),
        rows: record.rows,
        columns: record.columns,
        sample_bytes: if rig.is_some() || record.bit_depth > 8 { 2 } else { 1 },
    };
    options.check(frames.rows, frames.columns, frames.count)?;
    let place = held(|held| match_need(frames, &options, held), None);
    let needed = match_need(frames, &options, place);
    if let Some(available) = available().filter(|available| needed > available.bytes) {
        let (work, available, bound) = ("matching", available.bytes, available.bound);
        return Err(PanelError::Memory { work, needed, available, bound });
    }
    let calibration = match &rig {
        None => None,
        Some(rig) => {
            let mut plan = calibration_plan(rig, record.columns, record.rows);
            plan.frames_on_disk = calibration_held(&sequence, &plan, None).0 == Held::Packed;
            let (found, unfinished) = calibrate_sequence(&sequence, &plan, true, &notes)?;
            if let Some(error) = unfinished {
                shared.warn(format!("the calibration is in place, but {error}"));
            }
            Some((found.calibration, found.maps))
        }
    };
    pack_if_large(&sequence, calibration.as_ref(), &options, (match_need, None), &notes)?;
    let results = folder.join("results");
    let place = ResultsFolder::create(&results, ResultsKind::Match, true)?;
    let view = View { figure_row: None, truth: None };
    match_sequence(&sequence, calibration.as_ref(), (&options, &Region::default()), view, &place, &notes)?;
    place.commit()?;
    // Results without a surface are results: a lens may be unknown.
    if let Err(error) = analyse(&sequence, &results, &notes) {
        shared.warn(format!("the surface was not measured: {error}"));
    }
    Ok(())
}

fn analyse(sequence: &Sequence, results: &Path, notes: &Notes<'_>) -> Result<(), PanelError> {
    let opened = open_results(sequence, results)?;
    let heights = opened.heights.as_ref().ok_or_else(|| {
        PanelError::Wrong("no heights: the focal length is unknown, or no pixel has a disparity".to_owned())
    })?;
    let questions = SurfaceQuestions::usual(&opened);
    let place = ResultsFolder::create(&results.join("surface"), ResultsKind::Surface, true)?;
    let (options, calibration) = (opened.matched.options(), opened.calibration.as_ref());
    pack_if_large(sequence, calibration, &options, (halves_need, None), notes)?;
    let halves = half_heights(sequence, &opened, notes).unwrap_or_else(|error| {
        notes.0.warn(format!("depths are measured without halves of the frames: {error}"));
        None
    });
    let measured = MeasuredSurface { sequence, opened: &opened, heights, halves: halves.as_ref() };
    inspect_surface(measured, &questions, &place)?;
    Ok(place.commit()?)
}
