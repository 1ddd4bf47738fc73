//! Where points are expected in pictures that have not been looked at yet.

use nalgebra::Vector3;

use super::cameras::{CameraPose, Cameras, View};
use super::fit::Fit;
use super::search::{Found, turned};
use super::track::Track;
use epirig_core::statistics::median;

/// What is known of the cameras so far.
pub(super) struct Expected {
    pub(super) cameras: Cameras,
    /// By how much all points of a frame are off the cameras' places: columns and rows, in px.
    off_px: Vec<[f64; 2]>,
    /// The least and the largest inverse depth of points that move.
    pub(super) rho: (f64, f64),
    /// Frames whose points are followed.
    pub(super) anchors: Vec<usize>,
}

impl Expected {
    /// From the first search, of frames with this size seen through this lens.
    pub(super) fn of_search(found: Found, focal_length_px: f64, centre_px: [f64; 2]) -> Self {
        let Found { position, across, direction, rho, anchors } = found;
        let (first, last) =
            position.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), &position| {
                (least.min(position), most.max(position))
            });
        // Positions grow from the first frame to the last. The scene moves against the camera.
        let path = if position[position.len() - 1] < position[0] { first - last } else { last - first };
        let pose =
            |position: &f64| CameraPose { position: (position - first) / path, ..CameraPose::default() };
        let turn = -path.signum();
        let cameras = Cameras {
            focal_length_px,
            centre_px,
            k1: 0.0,
            direction: Vector3::new(turn * direction[0], turn * direction[1], 0.0),
            frames: position.iter().map(pose).collect(),
        };
        let off_px = across.iter().map(|&across| turned(direction, 0.0, across)).collect();
        let unit = path.abs() / focal_length_px;
        Self { cameras, off_px, rho: (rho.0 * unit, rho.1 * unit), anchors }
    }

    /// From an adjustment to the tracks of smaller pictures.
    pub(super) fn of_fit(fit: &Fit, tracks: &[Track], anchors: Vec<usize>) -> Self {
        let views = fit.cameras.views();
        let mut off: Vec<[Vec<f64>; 2]> = vec![Default::default(); views.len()];
        let mut inverse_depths = Vec::new();
        for ((track, point), weights) in tracks.iter().zip(&fit.points).zip(&fit.weights) {
            let agreeing = || track.sights.iter().zip(weights).filter(|(_, weight)| weight.x > 0.0);
            for (sight, _) in agreeing() {
                let Some(place) = views[sight.frame].place(point) else { continue };
                let apart = &mut off[sight.frame];
                apart[0].push(sight.place[0] - place[0]);
                apart[1].push(sight.place[1] - place[1]);
            }
            if 2 * agreeing().count() > track.sights.len() {
                inverse_depths.push(point.rho);
            }
        }
        let middle = |values: &mut Vec<f64>| median(values).unwrap_or(0.0);
        inverse_depths.sort_by(f64::total_cmp);
        let share = |share: f64| {
            let last = inverse_depths.len().saturating_sub(1) as f64;
            inverse_depths.get((share * last).round() as usize).copied().unwrap_or(0.0)
        };
        Self {
            off_px: off.iter_mut().map(|[x, y]| [middle(x), middle(y)]).collect(),
            rho: (share(0.005), share(0.995)),
            cameras: fit.cameras.clone(),
            anchors,
        }
    }

    /// The usual direction in which the scene moves through the pictures, a unit vector.
    pub(super) fn direction(&self) -> [f64; 2] {
        let [x, y] = [-self.cameras.direction.x, -self.cameras.direction.y];
        let length = x.hypot(y).max(f64::MIN_POSITIVE);
        [x / length, y / length]
    }

    pub(super) fn views(&self) -> ExpectedViews<'_> {
        ExpectedViews { views: self.cameras.views(), off_px: &self.off_px }
    }
}

/// The cameras of all frames, as far as they are known.
pub(super) struct ExpectedViews<'a> {
    views: Vec<View<'a>>,
    off_px: &'a [[f64; 2]],
}

impl ExpectedViews<'_> {
    /// How far what is at `place` in the first of two frames, at inverse depth rho, has moved in the second: columns
    /// and rows, in px; `None` behind the camera.
    pub(super) fn moved(&self, [from, to]: [usize; 2], place: [f64; 2], rho: f64) -> Option<[f64; 2]> {
        let (off_from, off_to) = (self.off_px[from], self.off_px[to]);
        let point = self.views[from].point_at([0, 1].map(|axis| place[axis] - off_from[axis]), rho);
        let seen = self.views[to].place(&point)?;
        Some([0, 1].map(|axis| seen[axis] + off_to[axis] - place[axis]))
    }
}
