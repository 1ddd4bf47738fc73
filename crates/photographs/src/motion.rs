//! Where the camera stands in each frame, and how it is turned.

use nalgebra::{Matrix3, Rotation3, Vector3};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::photographs::Photographs;
use super::random::Purpose;

/// How far the camera goes back in a step back, in mean steps.
const BACK: f64 = 0.7;

/// One frame: y = rotation (X - centre).
#[derive(Debug, Clone, PartialEq)]
pub struct View {
    /// From the common camera to that of the frame.
    pub rotation: Matrix3<f64>,
    /// Where the camera stands, in mm.
    pub centre: Vector3<f64>,
}

impl View {
    /// A point, in mm in the common camera's coordinates, in those of the frame's camera.
    pub fn sees(&self, point: &Vector3<f64>) -> Vector3<f64> {
        self.rotation * (point - self.centre)
    }
}

/// The motion over the photographs that are there, in their order.
#[derive(Debug, Clone, PartialEq)]
pub struct Motion {
    /// Unit direction m, in the common camera's coordinates.
    pub direction: Vector3<f64>,
    /// Numbers of the photographs; the first that was taken is 1.
    pub numbers: Vec<usize>,
    /// Positions s_t along the direction, in mm; 0 is the middle between the first and the last
    /// that were taken.
    pub positions_mm: Vec<f64>,
    /// Rotations w_t, in rad, as vectors: R(w) is the rotation by |w| about w.
    pub rotations: Vec<Vector3<f64>>,
    /// Offsets d_t across the direction, in mm.
    pub offsets_mm: Vec<Vector3<f64>>,
    /// The frames, as these numbers say.
    pub views: Vec<View>,
}

impl Motion {
    /// The motion that is asked for.
    pub(super) fn drawn(asked: &Photographs) -> Self {
        let (roll, pan) = (asked.roll_deg.to_radians(), asked.pan_deg.to_radians());
        let direction = Vector3::new(pan.cos() * roll.cos(), pan.cos() * roll.sin(), pan.sin());
        let all = positions(asked);
        let numbers: Vec<usize> =
            (1..=asked.frames).filter(|number| !asked.missing.contains(number)).collect();
        assert!(numbers.len() >= 2, "fewer than two photographs are left");
        let positions_mm: Vec<f64> = numbers.iter().map(|number| all[number - 1]).collect();
        let count = numbers.len();

        let mut random = asked.random(Purpose::Wobble);
        let wobble = asked.wobble_deg.to_radians();
        let [pitch, yaw, roll] = [(); 3].map(|()| scattered(count, wobble, None, &mut random));
        let rotations = (0..count).map(|t| Vector3::new(pitch[t], yaw[t], roll[t])).collect();

        let mut random = asked.random(Purpose::Offset);
        let offset_mm = asked.offset_px * asked.pixel_mm();
        let axes = rail_axes(&direction);
        let [down, deep] = [(); 2].map(|()| scattered(count, offset_mm, Some(&positions_mm), &mut random));
        let (row, away) = (axes.row(1).transpose(), axes.row(2).transpose());
        let offsets_mm = (0..count).map(|t| down[t] * row + deep[t] * away).collect();

        let turned = |w: &Vector3<f64>| Rotation3::from_scaled_axis(*w).into_inner();
        let mut motion = Self { direction, numbers, positions_mm, rotations, offsets_mm, views: Vec::new() };
        motion.views = motion.stood(turned);
        motion
    }

    /// The same positions, with all frames turned so that their rows lie along the motion, and no
    /// offsets.
    pub(super) fn straightened(&self) -> Self {
        let axes = self.rail_axes();
        let nothing = vec![Vector3::zeros(); self.numbers.len()];
        let mut motion =
            Self { rotations: nothing.clone(), offsets_mm: nothing, views: Vec::new(), ..self.clone() };
        motion.views = motion.stood(|_| axes);
        motion
    }

    /// The axes of an ideal rectified camera, as rows in the common camera's coordinates.
    pub fn rail_axes(&self) -> Matrix3<f64> {
        rail_axes(&self.direction)
    }

    /// s_last - s_first, in mm.
    pub fn baseline_mm(&self) -> f64 {
        self.positions_mm[self.positions_mm.len() - 1] - self.positions_mm[0]
    }

    /// The frame nearest to the middle of the path; of two that are as near, the first.
    pub fn middle(&self) -> usize {
        let places = &self.positions_mm;
        let extremes = places.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), place| {
            (low.min(*place), high.max(*place))
        });
        let middle = 0.5 * (extremes.0 + extremes.1);
        // Rounding must not choose.
        let far = |frame: usize| ((places[frame] - middle).abs() / self.baseline_mm() * 1e9).round();
        (0..places.len()).min_by(|a, b| far(*a).total_cmp(&far(*b))).unwrap()
    }

    fn stood(&self, turned: impl Fn(&Vector3<f64>) -> Matrix3<f64>) -> Vec<View> {
        let view = |t: usize| View {
            rotation: turned(&self.rotations[t]),
            centre: self.positions_mm[t] * self.direction + self.offsets_mm[t],
        };
        (0..self.numbers.len()).map(view).collect()
    }
}

/// Rows along the motion, forwards or backwards, whichever is the smaller turn; view as near as can
/// be to that of the common camera.
fn rail_axes(direction: &Vector3<f64>) -> Matrix3<f64> {
    // A motion up or down is turned by 90 degrees one way, whatever the rounding of cos 90.
    let is_forwards = direction.x > 0.0 || direction.x.abs() < 1e-9;
    let along = if is_forwards { *direction } else { -direction };
    let away = (Vector3::z() - along * along.z).normalize();
    let down = away.cross(&along);
    Matrix3::from_rows(&[along.transpose(), down.transpose(), away.transpose()])
}

/// Positions of all photographs that are taken, in mm, in the order of their numbers.
fn positions(asked: &Photographs) -> Vec<f64> {
    let mut random = asked.random(Purpose::Steps);
    let mut steps: Vec<f64> =
        (1..asked.frames).map(|_| 1.0 + asked.uneven_steps * random.random_range(-1.0..=1.0)).collect();
    // The step before photograph n, which cannot be the first.
    let mut set = |number: Option<usize>, value: f64| {
        if let Some(number) = number {
            steps[number - 2] = value;
        }
    };
    set(asked.repeated, 0.0);
    set(asked.step_back, -BACK);
    let path_mm = asked.baseline_px * asked.pixel_mm();
    let scale = path_mm / steps.iter().sum::<f64>();
    let mut positions = vec![-0.5 * path_mm];
    for step in steps {
        positions.push(positions[positions.len() - 1] + scale * step);
    }
    positions
}

/// Random numbers whose mean is zero and whose root mean square is `rms`; without drift along
/// `places`, if there are any.
fn scattered(count: usize, rms: f64, places: Option<&[f64]>, random: &mut ChaCha8Rng) -> Vec<f64> {
    let mut values: Vec<f64> = (0..count).map(|_| StandardNormal.sample(random)).collect();
    let mean = |values: &[f64]| values.iter().sum::<f64>() / count as f64;
    let middle = mean(&values);
    values.iter_mut().for_each(|value| *value -= middle);
    if let Some(places) = places {
        let middle = mean(places);
        let product: f64 = values.iter().zip(places).map(|(value, place)| value * (place - middle)).sum();
        let square: f64 = places.iter().map(|place| (place - middle).powi(2)).sum();
        values
            .iter_mut()
            .zip(places)
            .for_each(|(value, place)| *value -= product / square * (place - middle));
    }
    let square = values.iter().map(|value| value * value).sum::<f64>() / count as f64;
    // Two frames have no scatter about a drift.
    let scale = if square > 1e-12 { rms / square.sqrt() } else { 0.0 };
    values.iter().map(|value| scale * value).collect()
}
