//! The person at the page, who arranges what is before the camera.

use std::sync::Arc;
use std::time::{Duration, Instant};

use super::target::find_target;
use crate::capture::{Arrangement, Assistant, PauseSwitch};
use crate::panel::shared::SharedState;
use crate::panel::state::Asked;
use epirig_core::statistics::upper_median;
use epirig_devices::camera::{Camera, ViewSwitch};

/// Longest wait for a picture.
const PATIENCE: Duration = Duration::from_millis(100);
/// Time between two looks for the board: a hand that moves is seen to move in it.
const BETWEEN: Duration = Duration::from_millis(400);
/// A board is still if its corners move by less than this from one look to the next, in px. A hand that is
/// supported trembles by less; the camera itself refuses a picture that is not steady.
const STILL_PX: f64 = 1.0;
/// A pose is a new one if the place or the size of the board differs by this from every other, as a share of
/// the picture's width.
const NEW_POSE: f64 = 0.03;
/// Share of the corners that must be found. The lens is calibrated with parts of boards, too; with fewer the
/// board is not yet held as it was asked for.
const ENOUGH: f64 = 0.75;

/// Asks the person at the page. With a simulated camera it changes the view itself.
pub(super) struct Person<'a> {
    shared: &'a Arc<SharedState>,
    view: Option<ViewSwitch>,
    pause: PauseSwitch,
    /// The poses that were taken.
    taken: Vec<Pose>,
}

impl<'a> Person<'a> {
    pub(super) fn new(shared: &'a Arc<SharedState>, view: Option<ViewSwitch>, pause: PauseSwitch) -> Self {
        Self { shared, view, pause, taken: Vec::new() }
    }

    fn ask(&self, arrangement: Arrangement) {
        let (kind, pose) = match arrangement {
            Arrangement::Object => ("object", None),
            Arrangement::Dark => ("dark", None),
            Arrangement::Flat => ("flat", None),
            Arrangement::Board { pose, poses } => ("board", Some((pose + 1, poses))),
        };
        let asked = Asked {
            kind,
            words: arrangement.words(),
            pose: pose.map(|(pose, _)| pose),
            poses: pose.map(|(_, poses)| poses),
            by_itself: kind == "board",
            waiting_for: None,
        };
        self.shared.change(|state| state.rig.scan.as_mut().map(|scan| scan.asked = Some(asked)));
    }

    /// Waits until a person has confirmed, or the board is seen, still, and in a new pose.
    fn wait(&mut self, arrangement: Arrangement, camera: &mut dyn Camera) -> bool {
        let is_board = matches!(arrangement, Arrangement::Board { .. });
        let mut looked: Option<(Instant, Vec<[f64; 2]>)> = None;
        loop {
            if self.pause.pressed() {
                return false;
            }
            if let Some(done) = self.shared.change(|state| state.answer.take()) {
                return done;
            }
            let frame = match camera.look(PATIENCE) {
                Ok(Some(frame)) => frame,
                Ok(None) => continue,
                // A lost picture confirms nothing: only a person or the board does. The start of the camera
                // that follows says what is wrong with it, or mends it.
                Err(_) => {
                    std::thread::sleep(PATIENCE);
                    continue;
                }
            };
            let is_time = looked.as_ref().is_none_or(|(at, _)| at.elapsed() >= BETWEEN);
            if is_board && is_time {
                let target = find_target(self.shared, &frame, false);
                let corners = target.as_ref().map(|target| target.corners.clone()).unwrap_or_default();
                let wanted = target.as_ref().map_or(0, |target| target.wanted);
                let before = looked.replace((Instant::now(), corners.clone())).map(|(_, corners)| corners);
                let width_px = frame.columns() as f64;
                let waiting_for = self.waits_for(&corners, before.as_deref(), wanted, width_px);
                let ready = waiting_for.is_none();
                if ready {
                    self.taken.push(Pose::of(&corners));
                }
                self.shared.change(|state| {
                    if ready {
                        state.coverage.add(&corners, frame.columns(), frame.rows());
                    }
                    state.rig.target = target;
                    if let Some(asked) = state.rig.scan.as_mut().and_then(|scan| scan.asked.as_mut()) {
                        asked.waiting_for = waiting_for;
                    }
                });
                if ready {
                    return true;
                }
            }
            if self.shared.pictures.are_watched() {
                self.shared.pictures.put(frame);
            }
        }
    }

    /// Why the shot is not taken yet.
    fn waits_for(
        &self,
        corners: &[[f64; 2]],
        before: Option<&[[f64; 2]]>,
        wanted: usize,
        width_px: f64,
    ) -> Option<String> {
        let seen = corners.len();
        if seen == 0 {
            return Some("no board is seen".to_owned());
        }
        if (seen as f64) < ENOUGH * wanted as f64 {
            return Some(format!("{seen} of {wanted} corners are seen; all squares must be in view"));
        }
        let pose = Pose::of(corners);
        if self.taken.iter().any(|taken| taken.difference_px(&pose) < NEW_POSE * width_px) {
            return Some("this pose was taken; move the board".to_owned());
        }
        let still = before.is_some_and(|before| moved_px(before, corners) < STILL_PX);
        if still { None } else { Some("the board moves; hold it still".to_owned()) }
    }
}

/// Median distance from a corner of `now` to the nearest one of `before`, in px; infinite without corners. A
/// corner that is found in one look only does not matter.
fn moved_px(before: &[[f64; 2]], now: &[[f64; 2]]) -> f64 {
    let distance = |a: &[f64; 2], b: &[f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]);
    let nearest = |a| before.iter().map(|b| distance(a, b)).fold(f64::INFINITY, f64::min);
    let mut distances: Vec<f64> = now.iter().map(nearest).collect();
    upper_median(&mut distances).unwrap_or(f64::INFINITY)
}

/// Where a board is in the picture: least and largest x and y of its corners, in px.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Pose([f64; 4]);

impl Pose {
    fn of(corners: &[[f64; 2]]) -> Self {
        let start = [f64::INFINITY, f64::NEG_INFINITY, f64::INFINITY, f64::NEG_INFINITY];
        let wider = |[left, right, top, bottom]: [f64; 4], &[x, y]: &[f64; 2]| {
            [left.min(x), right.max(x), top.min(y), bottom.max(y)]
        };
        Self(corners.iter().fold(start, wider))
    }

    fn difference_px(&self, other: &Self) -> f64 {
        self.0.iter().zip(other.0).map(|(one, other)| (one - other).abs()).fold(0.0, f64::max)
    }
}

impl Assistant for Person<'_> {
    fn is_there(&self) -> bool {
        true
    }

    fn arrange(&mut self, arrangement: Arrangement, camera: &mut dyn Camera) -> bool {
        // An answer to an earlier request is none to this one.
        self.shared.change(|state| state.answer = None);
        self.ask(arrangement);
        let done = match &self.view {
            Some(view) => {
                view.put(arrangement.simulated());
                // The simulated board is waited for like a real one.
                !matches!(arrangement, Arrangement::Board { .. }) || self.wait(arrangement, camera)
            }
            None => self.wait(arrangement, camera),
        };
        self.shared.change(|state| state.rig.scan.as_mut().map(|scan| scan.asked = None));
        done
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_board_that_moves_is_told_from_one_of_which_a_corner_was_missed() {
        let board: Vec<[f64; 2]> =
            (0..12).map(|index| [f64::from(index % 4) * 20.0, f64::from(index / 4) * 20.0]).collect();
        let shifted =
            |x: f64| -> Vec<[f64; 2]> { board.iter().map(|corner| [corner[0] + x, corner[1]]).collect() };
        assert_eq!(moved_px(&board, &board[1..]), 0.0);
        assert_eq!(moved_px(&board[1..], &board), 0.0);
        assert!((moved_px(&board, &shifted(3.0)) - 3.0).abs() < 1e-12);
        assert_eq!(moved_px(&[], &board), f64::INFINITY);
        // A shift by a whole square looks the same to the nearest corners, but is another pose.
        assert_eq!(Pose::of(&board).difference_px(&Pose::of(&shifted(20.0))), 20.0);
    }
}
