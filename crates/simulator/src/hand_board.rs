//! A chess-board that a person holds before the camera, in one pose after another.

use serde::{Deserialize, Serialize};

use super::chess::{Chess, SOFTNESS_PX, step};
use super::error::{SimulatorError, require, require_positive};
use super::optics::Optics;
use super::rays::Rays;
use super::render::{self, GROUND};
use super::sight::Sight;
use epirig_core::grid::Grid;

/// Least and largest tilt of the board against the image plane, in rad: 20 and 35 degrees.
const TILT_RAD: (f64, f64) = (0.349, 0.611);
/// Largest roll of the board either way, in rad: 30 degrees.
const MOST_ROLL_RAD: f64 = 0.524;
/// Share of the image, in width or height, that the squares fill if they are not tilted: farthest and
/// nearest.
const FILLED: (f64, f64) = (0.38, 0.58);
/// White paper around the squares, in squares.
const PAPER: f64 = 1.0;
/// Between the plate and the image's border there is this share of the image's shorter side ...
const MARGIN: f64 = 0.02;
/// ... and at least this, in px, so that the blurred edge of the plate is in view.
const LEAST_MARGIN_PX: f64 = 4.0;
/// Places along an edge of the plate that are looked at: a distorted edge is bent.
const ALONG_EDGE: usize = 8;
/// A board that does not fit is moved away by this factor, up to this number of times, since a board that has
/// moved looks a little different.
const AWAY: f64 = 1.06;
const MOVES: usize = 100;
/// The place is found when it changes by less than this, in px.
const PLACED_PX: f64 = 0.01;
/// Where the plate lies in the room that the image leaves it, from 0 at the left (top) to 1: the middle,
/// corners, edges.
const PLACES: [(f64, f64); 9] = [
    (0.5, 0.5),
    (0.0, 0.0),
    (1.0, 1.0),
    (1.0, 0.0),
    (0.0, 1.0),
    (0.5, 0.0),
    (0.5, 1.0),
    (0.0, 0.5),
    (1.0, 0.5),
];

/// A chess-board on a flat white plate that is one square larger on each side. Edges of squares are soft by
/// 0.45 px of the image; squares of less than 4 px alias.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct HandBoard {
    /// Side of a square, in mm.
    pub square_mm: f64,
    /// Squares along the board's u; at least 2.
    pub columns: usize,
    /// Squares along the board's v; at least 2.
    pub rows: usize,
}

/// Pose of a board in the camera's own frame: the point (u, v) of the board lies at centre + u axis_u + v
/// axis_v.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoardPose {
    /// The middle of the board, in mm.
    pub centre_mm: [f64; 3],
    /// Direction of the board's u, of length 1.
    pub axis_u: [f64; 3],
    /// Direction of the board's v, of length 1.
    pub axis_v: [f64; 3],
}

impl BoardPose {
    /// The ray (X / Z, Y / Z) to a point of the board.
    pub(super) fn ray(&self, u: f64, v: f64) -> (f64, f64) {
        let [x, y, z] =
            [0, 1, 2].map(|axis| self.centre_mm[axis] + u * self.axis_u[axis] + v * self.axis_v[axis]);
        (x / z, y / z)
    }

    /// The point of the board's plane that a ray meets.
    fn met_by(&self, (a, b): (f64, f64)) -> (f64, f64) {
        let normal = cross(self.axis_u, self.axis_v);
        let along = dot(normal, self.centre_mm) / dot(normal, [a, b, 1.0]);
        let from_centre =
            [a * along - self.centre_mm[0], b * along - self.centre_mm[1], along - self.centre_mm[2]];
        (dot(from_centre, self.axis_u), dot(from_centre, self.axis_v))
    }
}

impl HandBoard {
    pub(super) fn check(&self) -> Result<(), SimulatorError> {
        require_positive("squares of the board in mm", self.square_mm)?;
        let least = self.columns.min(self.rows);
        require(least >= 2, "number of squares of the board", least as f64, "at least 2 each way")
    }

    /// Pose number `pose`. They never end, and no two are alike: all parts of the image in turn, with tilts
    /// in all directions, rolls and distances from sequences that fill their ranges evenly (van der Corput,
    /// in bases 2, 3, 5 and 7).
    pub(super) fn pose(&self, optics: &Optics, pose: usize) -> BoardPose {
        let between = |(least, most): (f64, f64), share: f64| least + (most - least) * share;
        let tilt_rad = between(TILT_RAD, van_der_corput(pose, 2));
        let direction_rad = std::f64::consts::TAU * van_der_corput(pose, 3);
        let roll_rad = between((-MOST_ROLL_RAD, MOST_ROLL_RAD), van_der_corput(pose, 5));
        let filled = between(FILLED, van_der_corput(pose, 7));
        let [axis_u, axis_v] = axes(tilt_rad, direction_rad, roll_rad);

        let sight = optics.sight();
        let (right, bottom) = (optics.columns as f64 - 1.0, optics.rows as f64 - 1.0);
        let margin = (MARGIN * right.min(bottom)).max(LEAST_MARGIN_PX);
        let (share_x, share_y) = PLACES[pose % PLACES.len()];
        let size_mm = |squares: usize| squares as f64 * self.square_mm;
        let mut distance_mm = optics.focal_length_px / filled
            * (size_mm(self.columns) / optics.columns as f64).max(size_mm(self.rows) / optics.rows as f64);
        let (mut x, mut y) = (0.5 * right, 0.5 * bottom);
        let mut held = BoardPose { centre_mm: [0.0, 0.0, distance_mm], axis_u, axis_v };
        for _ in 0..MOVES {
            let (a, b) = sight.raw_ray(x, y);
            held.centre_mm = [a * distance_mm, b * distance_mm, distance_mm];
            let (from, to) = self.bounds(&held, &sight);
            let free = (right - 2.0 * margin - (to.0 - from.0), bottom - 2.0 * margin - (to.1 - from.1));
            if free.0 < 0.0 || free.1 < 0.0 {
                distance_mm *= AWAY;
                continue;
            }
            let (dx, dy) = (margin + share_x * free.0 - from.0, margin + share_y * free.1 - from.1);
            if dx.abs().max(dy.abs()) < PLACED_PX {
                break;
            }
            (x, y) = (x + dx, y + dy);
        }
        held
    }

    /// The part of the image that the plate fills: its least and its largest x and y.
    fn bounds(&self, pose: &BoardPose, sight: &Sight) -> ((f64, f64), (f64, f64)) {
        let (half_u, half_v) = self.half_plate_mm();
        let along = (0..=ALONG_EDGE).map(|step| 2.0 * step as f64 / ALONG_EDGE as f64 - 1.0);
        let edges = along.flat_map(|share| [(share, -1.0), (share, 1.0), (-1.0, share), (1.0, share)]);
        let infinite = (f64::INFINITY, f64::INFINITY);
        edges
            .map(|(u, v)| sight.raw_pixel(pose.ray(u * half_u, v * half_v)))
            .fold((infinite, (-infinite.0, -infinite.1)), |(from, to), (x, y)| {
                ((from.0.min(x), from.1.min(y)), (to.0.max(x), to.1.max(y)))
            })
    }

    fn half_plate_mm(&self) -> (f64, f64) {
        let half = |squares: usize| (0.5 * squares as f64 + PAPER) * self.square_mm;
        (half(self.columns), half(self.rows))
    }

    pub(super) fn chess(&self, softness_mm: f64) -> Chess {
        Chess::new(self.square_mm, self.columns, self.rows, softness_mm)
    }

    /// The light on the sensor with the board in a pose, as a share of full scale at reflectance 1.
    pub(super) fn irradiance(&self, optics: &Optics, pose: BoardPose) -> Grid<f32> {
        let sight = optics.sight();
        let softness_mm = SOFTNESS_PX * pose.centre_mm[2] / optics.focal_length_px;
        let chess = self.chess(softness_mm);
        let (half_u, half_v) = self.half_plate_mm();
        render::irradiance(optics, &Rays::new(optics, |x, y| sight.raw_ray(x, y)), |ray| {
            let (u, v) = pose.met_by(ray);
            let plate = step(half_u - u.abs(), softness_mm) * step(half_v - v.abs(), softness_mm);
            let ground = f64::from(GROUND);
            (ground + plate * (chess.reflectance(u, v) - ground)) as f32
        })
    }
}

/// Directions of u and v of a board that is rolled in its plane, then tilted about the direction (cos, sin,
/// 0) in the image plane.
fn axes(tilt_rad: f64, direction_rad: f64, roll_rad: f64) -> [[f64; 3]; 2] {
    let (sine, cosine) = tilt_rad.sin_cos();
    let axis = [direction_rad.cos(), direction_rad.sin(), 0.0];
    // Rodrigues' formula.
    let tilted = |direction: [f64; 3]| {
        let (across, along) = (cross(axis, direction), dot(axis, direction));
        [0, 1, 2].map(|i| cosine * direction[i] + sine * across[i] + (1.0 - cosine) * along * axis[i])
    };
    let (roll_sine, roll_cosine) = roll_rad.sin_cos();
    [tilted([roll_cosine, roll_sine, 0.0]), tilted([-roll_sine, roll_cosine, 0.0])]
}

/// The digits of `index`, mirrored at the point: 0, 1/2, 1/4, 3/4, ... for base 2.
fn van_der_corput(index: usize, base: usize) -> f64 {
    let (mut rest, mut value, mut digit) = (index, 0.0, 1.0);
    while rest > 0 {
        digit /= base as f64;
        value += digit * (rest % base) as f64;
        rest /= base;
    }
    value
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[cfg(test)]
mod tests {
    use super::super::distortion::Distortion;
    use super::*;

    fn wide_and_bent() -> Optics {
        Optics {
            rows: 480,
            columns: 640,
            principal_point_x_px: 325.0,
            principal_point_y_px: 236.0,
            roll_rad: 0.1,
            distortion: Distortion { k1: -0.2, k2: 0.05, ..Distortion::default() },
            ..Optics::square(640, 500.0)
        }
    }

    #[test]
    fn thirty_poses_are_tilted_and_wholly_in_view_with_a_margin() {
        let board = HandBoard { square_mm: 16.0, columns: 10, rows: 7 };
        for optics in [Optics::square(1024, 2844.4), Optics::square(256, 711.0), wide_and_bent()] {
            let (right, bottom) = (optics.columns as f64 - 1.0, optics.rows as f64 - 1.0);
            let mut reached = [false; 9];
            for number in 0..30 {
                let pose = board.pose(&optics, number);
                let facing = cross(pose.axis_u, pose.axis_v)[2];
                // 20 to 35 degrees.
                assert!((0.819..=0.9398).contains(&facing), "pose {number}: {facing}");
                assert!(dot(pose.axis_u, pose.axis_v).abs() < 1e-12);
                for (u, v) in [(-96.0, -72.0), (96.0, -72.0), (96.0, 72.0), (-96.0, 72.0)] {
                    let (x, y) = optics.sight().raw_pixel(pose.ray(u, v));
                    assert!(
                        x > 3.0 && x < right - 3.0 && y > 3.0 && y < bottom - 3.0,
                        "pose {number}: ({x}, {y})"
                    );
                }
                let corners: Vec<_> = board.chess(1.0).corners().collect();
                assert_eq!(corners.len(), 54);
                for (_, _, u, v) in corners {
                    let (x, y) = optics.sight().raw_pixel(pose.ray(u, v));
                    reached[(x / right * 3.0) as usize + 3 * (y / bottom * 3.0) as usize] = true;
                }
            }
            assert_eq!(reached, [true; 9]);
        }
    }

    #[test]
    fn a_ray_meets_the_point_that_it_was_aimed_at() {
        let board = HandBoard { square_mm: 16.0, columns: 10, rows: 7 };
        let pose = board.pose(&wide_and_bent(), 5);
        let (u, v) = pose.met_by(pose.ray(31.0, -17.0));
        assert!((u - 31.0).abs() < 1e-9 && (v + 17.0).abs() < 1e-9, "({u}, {v})");
    }

    #[test]
    fn mirrored_digits() {
        assert_eq!([0, 1, 2, 3, 6].map(|index| van_der_corput(index, 2)), [0.0, 0.5, 0.25, 0.75, 0.375]);
    }
}
