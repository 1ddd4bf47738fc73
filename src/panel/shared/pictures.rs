//! The latest picture of the camera.

use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use epirig_core::frame::Frame;
use epirig_server::Bell;

/// A picture.
#[derive(Debug, Clone)]
pub(in crate::panel) struct Picture {
    pub(in crate::panel) number: u64,
    pub(in crate::panel) frame: Arc<Frame>,
    pub(in crate::panel) at: Instant,
}

/// The latest picture.
#[derive(Debug, Default)]
pub(in crate::panel) struct Pictures {
    latest: Mutex<Latest>,
    arrived: Condvar,
    /// Rings when a picture has come.
    pub(in crate::panel) bell: Bell,
}

#[derive(Debug, Default)]
struct Latest {
    picture: Option<Picture>,
    /// When the pictures of the last second came.
    times: Vec<Instant>,
}

impl Pictures {
    fn held(&self) -> MutexGuard<'_, Latest> {
        self.latest.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(in crate::panel) fn put(&self, frame: Frame) {
        let now = Instant::now();
        let mut latest = self.held();
        let number = latest.picture.as_ref().map_or(1, |picture| picture.number + 1);
        latest.picture = Some(Picture { number, frame: Arc::new(frame), at: now });
        latest.times.retain(|time| now.duration_since(*time) < Duration::from_secs(1));
        latest.times.push(now);
        drop(latest);
        self.arrived.notify_all();
        self.bell.ring();
    }

    pub(in crate::panel) fn latest(&self) -> Option<Picture> {
        self.held().picture.clone()
    }

    /// Pictures that came in the last second.
    pub(in crate::panel) fn rate_hz(&self) -> f64 {
        let now = Instant::now();
        self.held().times.iter().filter(|time| now.duration_since(**time) < Duration::from_secs(1)).count()
            as f64
    }

    /// A picture after that with `number`, if one comes within `patience`.
    pub(in crate::panel) fn after(&self, number: u64, patience: Duration) -> Option<Picture> {
        let is_old =
            |latest: &mut Latest| latest.picture.as_ref().is_none_or(|picture| picture.number <= number);
        let waited = self.arrived.wait_timeout_while(self.held(), patience, is_old);
        let (mut latest, _) = waited.unwrap_or_else(PoisonError::into_inner);
        if is_old(&mut latest) { None } else { latest.picture.clone() }
    }

    /// Whether any page looks at the pictures.
    pub(in crate::panel) fn are_watched(&self) -> bool {
        self.bell.listeners() > 0
    }
}
