//! The thread that makes live maps.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};

use rayon::ThreadPool;
use tracing::debug;

use super::binned::{Binned, bin_for};
use super::making::make;
use super::map::LiveMap;
use crate::panel::background::background;
use epirig_core::frame::Frame;
use epirig_core::tau::{Tau, TauError};

/// Makes live maps of a scan, in a thread of its own.
///
/// The scan never waits for a map. When a map is ready, the next one is made of all frames that have come. So
/// a map is at most one stop behind, if a stop takes longer than a map.
///
/// Dropping it ends the thread. A map that is being made is finished and thrown away; the drop does not wait
/// for it. Only a call of `made` that has begun may end after the drop.
#[derive(Debug)]
pub struct LiveMapMaker {
    frames: Sender<(usize, Binned)>,
    planned: usize,
    ended: Arc<AtomicBool>,
    /// One thread: the matcher computes in it, too. `None` if it does not run: then there are no maps.
    thread: Option<ThreadPool>,
}

impl LiveMapMaker {
    /// For a scan whose frames are to be taken at `positions_mm`, which rise or fall. `made` is called with
    /// each new map, in the thread that made it.
    ///
    /// There are no maps if the positions are no baseline, or the system allows no thread; a live map is
    /// never a reason to end a scan.
    pub fn new(positions_mm: &[f64], made: impl Fn(LiveMap) + Send + 'static) -> Self {
        let (frames, coming) = channel();
        let ended = Arc::new(AtomicBool::new(false));
        let thread = match (plan(positions_mm), background("live-map", 1)) {
            (Ok(plan), Some(pool)) => {
                let ended = Arc::clone(&ended);
                pool.spawn(move || make_maps(&plan, &coming, &ended, made));
                Some(pool)
            }
            (Err(error), _) => {
                debug!(%error, "no live maps");
                None
            }
            (_, None) => None,
        };
        Self { frames, planned: positions_mm.len(), ended, thread }
    }

    /// Frame `index` of the scan, from 0. Returns at once: `frame` is copied in a smaller size.
    ///
    /// Frames may come in any order, and again, when they are retaken: the last one counts. Maps begin with
    /// five frames, one of them frame 0. A frame beyond the plan, or unlike the others in size or bit depth,
    /// is left out.
    pub fn add(&self, index: usize, frame: &Frame) {
        if self.thread.is_none() || index >= self.planned {
            return;
        }
        let bin = bin_for(frame.rows(), frame.columns(), self.planned);
        if let Some(binned) = Binned::of(frame, bin)
            && self.frames.send((index, binned)).is_err()
        {
            debug!("the thread of the live map has ended");
        }
    }
}

impl Drop for LiveMapMaker {
    fn drop(&mut self) {
        // The thread ends when the sender is gone; it is not to make a map of what the sender still holds.
        self.ended.store(true, Ordering::Relaxed);
    }
}

/// tau of all frames of the plan.
fn plan(positions_mm: &[f64]) -> Result<Tau, TauError> {
    let ends = positions_mm.first().zip(positions_mm.last());
    let direction = ends.map_or(1.0, |(first, last)| (last - first).signum());
    Tau::from_positions(&positions_mm.iter().map(|position| direction * position).collect::<Vec<_>>())
}

/// Makes a map whenever frames have come, until no more can come.
fn make_maps(plan: &Tau, coming: &Receiver<(usize, Binned)>, ended: &AtomicBool, made: impl Fn(LiveMap)) {
    let mut frames: BTreeMap<usize, Binned> = BTreeMap::new();
    while let Ok(next) = coming.recv() {
        for (index, frame) in std::iter::once(next).chain(coming.try_iter()) {
            if frames.values().next().is_none_or(|other| other.is_like(&frame)) {
                frames.insert(index, frame);
            } else {
                debug!(index, "a frame unlike the others is left out of the live map");
            }
        }
        let over = || ended.load(Ordering::Relaxed);
        if over() {
            return;
        }
        if let Some(map) = make(plan, &frames)
            && !over()
        {
            made(map);
        }
    }
}
