//! A scan, new or resumed, with all that the page sees of it.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use super::assistant::Person;
use super::notes::Notes;
use super::plan::estimate;
use super::watcher::Watcher;
use crate::capture::{CaptureError, CapturePlan, Rig, capture, resume};
use crate::panel::live_map::{LiveMap, LiveMapMaker};
use crate::panel::shared::SharedState;
use crate::panel::state::{LiveMapState, LogKind, ScanPhase, ScanState};
use crate::profile::{Draft, Profile};
use crate::rig::capture_plan;
use epirig_core::statistics::upper_median;
use epirig_data::sequence::{Sequence, SequenceError};
use epirig_data::storage::{RealDisk, free_bytes};
use epirig_devices::camera::{Camera, ViewSwitch};
use epirig_devices::stage::StageSource;

/// One run of a scan.
pub(in crate::panel) struct ScanRun<'a> {
    pub(in crate::panel) shared: &'a Arc<SharedState>,
    /// Name of the folder in that of the panel.
    pub(in crate::panel) name: &'a str,
    /// Whether the scan was begun before.
    pub(in crate::panel) resumed: bool,
    /// Of a simulated camera.
    pub(in crate::panel) view: Option<ViewSwitch>,
}

/// Takes the frames, and says how it ended. Returns the maker of the live map, which may still be at work on
/// the last frames.
///
/// # Errors
/// In words, if nothing could begin.
pub(in crate::panel) fn run_scan(
    run: &ScanRun<'_>,
    profile: &Profile,
    stages: &mut dyn StageSource,
    camera: &mut dyn Camera,
) -> Result<LiveMapMaker, String> {
    let (shared, folder) = (run.shared, run.shared.folder.join(run.name));
    let (plan, before) = planned(run, profile, &folder).map_err(|error| error.to_string())?;
    let done = before.as_ref().map_or(0, |sequence| sequence.frames().len());
    let mut state = ScanState::begun(run.name, folder.display().to_string(), plan.positions_mm.len(), done);
    state.free_bytes = free_bytes(&shared.folder);
    shared.change(|known| {
        // What is known of the frames before a pause stays.
        known.live_map = None;
        known.coverage.clear();
        if let Some(before) = known.rig.scan.take().filter(|before| run.resumed && before.name == run.name) {
            (state.stops, state.retakes, state.course) = (before.stops, before.retakes, before.course);
            state.map = before.map;
        }
        known.rig.scan = Some(state);
    });
    let map = live_map(run, profile, &plan);
    if let Some(sequence) = &before {
        // What cannot be read is taken again, and comes with the scan then.
        for record in sequence.frames() {
            if let Ok(frame) = sequence.read(record) {
                map.add(record.index, &frame);
            }
        }
    }
    let (estimate, frame_bytes) = estimate(shared, &plan);
    let watcher = Watcher::new(shared, &map, &plan.positions_mm, estimate, frame_bytes);
    let pause = shared.look(|state| state.pause.clone());
    if shared.is_ending() {
        pause.press();
    }
    shared.hooks.scan_begins(&folder, run.resumed);
    let mut rig = Rig {
        stages,
        camera,
        assistant: &mut Person::new(shared, run.view.clone(), pause.clone()),
        pause,
        progress: &Notes(shared),
        watcher: &watcher,
    };
    let taken = if run.resumed {
        resume(&mut rig, &plan, &folder, Box::new(RealDisk))
    } else {
        capture(&mut rig, &plan, &folder, Box::new(RealDisk))
    };
    end(shared, run.name, taken.err());
    drop(rig);
    drop(watcher);
    Ok(map)
}

/// The plan, and the sequence so far of a scan that is resumed: its own rig counts, but for where its devices
/// are now.
fn planned(
    run: &ScanRun<'_>,
    profile: &Profile,
    folder: &Path,
) -> Result<(CapturePlan, Option<Sequence>), Box<dyn std::error::Error>> {
    if !run.resumed {
        return Ok((capture_plan(profile)?, None));
    }
    let sequence = Sequence::open(folder)?;
    let recorded = Profile::of_sequence(&sequence)?.ok_or("this sequence was not made by a scan")?;
    let now = |device: &Option<String>| device.clone().unwrap_or_default();
    let devices = BTreeMap::from([
        ("stage.port".to_owned(), now(&profile.stage.port)),
        ("camera.device".to_owned(), now(&profile.camera.device)),
    ]);
    let recorded = Draft::of(&recorded).changed(&devices).profile()?;
    Ok((capture_plan(&recorded)?, Some(sequence)))
}

/// Says that a scan has all its frames.
fn done(shared: &SharedState, kind: LogKind, words: &str) {
    shared.change(|state| {
        state.rig.log(kind, words);
        if let Some(scan) = &mut state.rig.scan {
            (scan.state, scan.seconds_left, scan.asked) = (ScanPhase::Done, None, None);
            scan.held_by.clear();
        }
    });
}

/// The name of a sequence in the folder of the panel; `None` if it is elsewhere.
fn name_of(shared: &SharedState, sequence: &Path) -> Option<String> {
    let is_here = shared.folder.canonicalize().is_ok_and(|here| sequence.parent() == Some(&here));
    is_here.then(|| sequence.file_name()?.to_str().map(str::to_owned)).flatten()
}

fn end(shared: &SharedState, name: &str, error: Option<CaptureError>) {
    let Some(error) = error else { return done(shared, LogKind::Note, "the scan is complete") };
    let folder = shared.folder.join(name);
    // Another program may have renamed it.
    let name = match &error {
        CaptureError::Interrupted { folder: now, .. }
        | CaptureError::Sequence(SequenceError::Renamed { now, .. })
            if *now != folder =>
        {
            name_of(shared, now)
        }
        _ => Some(name.to_owned()),
    };
    if let Some(name) = &name {
        shared.change(|state| {
            let Some(scan) = &mut state.rig.scan else { return };
            (scan.name, scan.folder) = (name.clone(), shared.folder.join(name).display().to_string());
        });
    }
    if let CaptureError::Sequence(SequenceError::Renamed { .. }) = &error {
        return done(shared, LogKind::Warning, &format!("the scan is complete; {error}"));
    }
    let begun = matches!(error, CaptureError::Interrupted { .. });
    let can_be_resumed = begun && name.is_some();
    // Who cancels what is asked for wants the scan to wait.
    let wanted = error.is_wanted() || matches!(error.cause(), CaptureError::NotArranged { .. });
    let words = match (wanted, begun) {
        (true, false) => "stopped before the first frame".to_owned(),
        (true, true) if can_be_resumed => "the scan is paused".to_owned(),
        // Elsewhere, it can be resumed by the command that this names.
        _ => error.to_string(),
    };
    let holder = match error.cause() {
        _ if wanted => "operator",
        CaptureError::Camera(_) => "camera",
        CaptureError::Stage(_)
        | CaptureError::SettingsChanged { .. }
        | CaptureError::CannotHome { .. }
        | CaptureError::StageReconnectTimeout { .. } => "stage",
        CaptureError::Sequence(SequenceError::Io { .. }) => "disk",
        _ => "operator",
    };
    shared.change(|state| {
        let kind = if wanted { LogKind::Note } else { LogKind::Error };
        state.rig.log(kind, words.clone());
        let Some(scan) = &mut state.rig.scan else { return };
        let reason = (!(wanted && can_be_resumed)).then_some(words);
        (scan.seconds_left, scan.asked, scan.reason) = (None, None, reason);
        (scan.state, scan.held_by) =
            if can_be_resumed { (ScanPhase::Paused, vec![holder]) } else { (ScanPhase::Failed, Vec::new()) };
    });
}

/// Makes the live map of a scan, in a thread of its own.
fn live_map(run: &ScanRun<'_>, profile: &Profile, plan: &CapturePlan) -> LiveMapMaker {
    let baseline_mm = match (plan.positions_mm.first(), plan.positions_mm.last()) {
        (Some(first_mm), Some(last_mm)) => (last_mm - first_mm).abs(),
        _ => 0.0,
    };
    let (shared, optics, name) = (Arc::clone(run.shared), profile.optics.clone(), run.name.to_owned());
    LiveMapMaker::new(&plan.positions_mm, move |map| {
        let columns = map.disparity.columns() * map.bin;
        let focal_length_px = optics.focal_length_px(columns);
        let sigma_mm = focal_length_px.and_then(|length_px| height_sigma_mm(&map, length_px * baseline_mm));
        let (frames, sigma_px) = (map.frames, map.median_sigma_px);
        shared.change(|state| {
            state.live_map = Some(Arc::new(map));
            // The last map of a scan may come when another one has begun.
            let Some(scan) = state.rig.scan.as_mut().filter(|scan| scan.name == name) else { return };
            let number = scan.map.as_ref().map_or(1, |map| map.number + 1);
            scan.map = Some(LiveMapState { number, frames, sigma_px, sigma_mm });
            scan.has_sigma(frames, sigma_px);
        });
    })
}

/// Median sigma as a height: z = f b / d, so sigma(z) = z sigma(d) / d. `scale` is f b, in px mm.
fn height_sigma_mm(map: &LiveMap, scale: f64) -> Option<f64> {
    let known = map.disparity.values().iter().filter(|value| value.is_finite());
    let mut disparities: Vec<f64> = known.map(|value| f64::from(value.abs())).collect();
    let disparity_px = upper_median(&mut disparities).filter(|disparity_px| *disparity_px > 0.0)?;
    Some(scale / (disparity_px * disparity_px) * map.median_sigma_px)
}
