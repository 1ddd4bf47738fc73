//! Tells the page what a scan does.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use crate::capture::{Awaited, ScanWatcher};
use crate::panel::live_map::LiveMapMaker;
use crate::panel::shared::SharedState;
use crate::panel::state::{Presence, Retake, Stop};
use epirig_core::frame::Frame;
use epirig_core::statistics::upper_median;
use epirig_data::sequence::{FrameFacts, FrameKind};
use epirig_data::storage::free_bytes;

/// Stops whose times foretell those to come; before as many are known, the plan does.
const STOPS: usize = 10;
/// Stops after which their times are trusted.
const ENOUGH: usize = 5;

/// Watches one run of a scan.
pub(super) struct Watcher<'a> {
    shared: &'a Arc<SharedState>,
    map: &'a LiveMapMaker,
    positions_mm: &'a [f64],
    /// Time of the whole scan by the plan.
    planned: Option<Duration>,
    frame_bytes: u64,
    began: Instant,
    /// Attempts at the frame in hand.
    attempts: AtomicUsize,
    /// When each frame of this run was good.
    times: Mutex<Vec<Instant>>,
}

impl<'a> Watcher<'a> {
    pub(super) fn new(
        shared: &'a Arc<SharedState>,
        map: &'a LiveMapMaker,
        positions_mm: &'a [f64],
        planned: Option<Duration>,
        frame_bytes: u64,
    ) -> Self {
        let (began, attempts, times) = (Instant::now(), AtomicUsize::new(1), Mutex::default());
        Self { shared, map, positions_mm, planned, frame_bytes, began, attempts, times }
    }

    /// Time left with `left` frames to come, in s.
    fn seconds_left(&self, left: usize) -> Option<f64> {
        let mut times = self.times.lock().unwrap_or_else(PoisonError::into_inner);
        times.push(Instant::now());
        let mut steps: Vec<f64> = times
            .windows(2)
            .rev()
            .take(STOPS)
            .map(|pair| pair[1].duration_since(pair[0]).as_secs_f64())
            .collect();
        if steps.len() >= ENOUGH {
            return upper_median(&mut steps).map(|step_s| step_s * left as f64);
        }
        Some(self.planned?.as_secs_f64() - self.began.elapsed().as_secs_f64())
    }
}

impl ScanWatcher for Watcher<'_> {
    fn frame(&self, kind: FrameKind, index: usize, frame: &Frame, facts: &FrameFacts) {
        if kind != FrameKind::Scan {
            return;
        }
        self.map.add(index, frame);
        let (planned_mm, frames) = (self.positions_mm[index], self.positions_mm.len());
        let stop = Stop {
            index,
            attempts: self.attempts.swap(1, Ordering::SeqCst),
            planned_mm,
            reported_mm: facts.reported_mm.unwrap_or(planned_mm),
            saturated: facts.certificate.as_ref().map_or(0.0, |certificate| certificate.saturated_share),
            mean_dn: frame.samples().mean(),
            at_s: self.began.elapsed().as_secs_f64(),
        };
        let free = free_bytes(&self.shared.folder);
        let done = self.shared.look(|state| state.rig.scan.as_ref().map_or(0, |scan| scan.done)) + 1;
        let seconds_left = self.seconds_left(frames.saturating_sub(done));
        self.shared.change(|state| {
            (state.rig.stage.position_mm, state.rig.stage.homed) = (Some(stop.reported_mm), true);
            state.rig.free_bytes = free;
            let Some(scan) = &mut state.rig.scan else { return };
            scan.done = done;
            // A frame that is taken again, as after a loss of the position, has one entry.
            scan.stops.retain(|before| before.index != stop.index);
            scan.stops.push(stop);
            (scan.seconds_left, scan.free_bytes) = (seconds_left, free);
            scan.needs_bytes = Some(self.frame_bytes.saturating_mul(frames.saturating_sub(done) as u64));
        });
    }

    fn wants_pictures(&self) -> bool {
        self.shared.pictures.are_watched()
    }

    fn failed(&self, index: usize, attempt: usize, reason: &str) {
        self.attempts.store(attempt + 1, Ordering::SeqCst);
        self.shared.warn(format!("frame {index} is taken again: {reason}"));
        let retake = Retake { index, attempt, reason: reason.to_owned() };
        self.shared.change(|state| state.rig.scan.as_mut().map(|scan| scan.retakes.push(retake)));
    }

    fn waits_for(&self, part: Option<Awaited>) {
        self.shared.change(|state| {
            let holder = part.map(|part| match part {
                Awaited::Camera => "camera",
                Awaited::Stage => "stage",
            });
            if let Some(scan) = &mut state.rig.scan {
                scan.held_by = holder.into_iter().collect();
                if part.is_some() {
                    // Nobody knows when it comes back.
                    scan.seconds_left = None;
                }
            }
            match part {
                Some(Awaited::Camera) => state.rig.camera.state = Presence::Lost,
                Some(Awaited::Stage) => state.rig.stage.state = Presence::Lost,
                None => (state.rig.camera.state, state.rig.stage.state) = (Presence::Busy, Presence::Ready),
            }
        });
    }
}
