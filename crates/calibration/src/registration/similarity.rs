//! How the picture of an object moved between two scans: shifted, turned and scaled.
//!
//! The shift of the whole picture comes first. Then the shifts of parts of it show turn and scale.

use std::ops::Range;

use nalgebra::{Matrix4, Vector4};

use super::{ShiftError, shift_between};
use epirig_core::frame::{Frame, FrameError, Samples};
use epirig_core::statistics::median;

/// From a pixel of the first picture to its place in the second: p' = s R (p - c) + c + t.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Similarity {
    /// The point c that only shifts: column and row, in px.
    pub centre_px: (f64, f64),
    /// The shift t of that point, to higher columns and rows, in px.
    pub shift_px: (f64, f64),
    /// The turn R, from the axis of columns towards that of rows, in rad.
    pub turn_rad: f64,
    /// The scale s.
    pub scale: f64,
    /// Standard deviation of a place, in px.
    pub sigma_px: f64,
    /// Parts of the picture whose shifts were found; 0 if only the whole was registered, without turn and scale.
    pub parts: usize,
}

/// How far a part of the picture has moved.
#[derive(Debug, Clone, Copy, PartialEq)]
struct LocalShift {
    /// Middle of the part in the first picture: column and row, in px.
    at_px: (f64, f64),
    /// How far it has moved in the second, in px.
    by_px: (f64, f64),
    /// Standard deviation of either, in px.
    sigma_px: f64,
}

/// Side of a part, in px: wide enough for a shift, and narrow enough that a turn of 1 deg moves its edges by half a
/// pixel.
const PART_PX: usize = 48;
/// Most parts along a side.
const MOST_PARTS: usize = 8;
/// Fewest parts from which turn and scale are found: two would do, but not show a wrong one.
const LEAST_PARTS: usize = 4;
/// Rounds of reweighting, after which parts that changed have no weight.
const ROUNDS: usize = 10;
/// Residuals beyond this many standard deviations have no weight (Tukey's biweight at 95 % efficiency).
const OUTLIER: f64 = 4.685;
/// Median length of a vector in the plane whose coordinates have a standard deviation of 1: sqrt(2 ln 2).
const MEDIAN_LENGTH: f64 = 1.177_410_02;

/// The motion of `second` against `first`: by a turn of about a degree, a scale within a few percent, and a shift as
/// [`shift_between`] finds it.
///
/// # Errors
/// [`ShiftError`] if the whole pictures cannot be registered.
pub fn similarity_between(first: &Frame, second: &Frame) -> Result<Similarity, ShiftError> {
    let whole = shift_between(first, second)?;
    let parts = local_shifts(first, second, (whole.x_px, whole.y_px));
    Ok(Similarity::fitted(&parts).unwrap_or(Similarity {
        centre_px: (0.0, 0.0),
        shift_px: (whole.x_px, whole.y_px),
        turn_rad: 0.0,
        scale: 1.0,
        sigma_px: whole.sigma_px,
        parts: 0,
    }))
}

/// Shifts of parts of the first picture that both show; parts without texture are left out.
fn local_shifts(first: &Frame, second: &Frame, (x_px, y_px): (f64, f64)) -> Vec<LocalShift> {
    let across = ranges(first.columns(), x_px);
    let down = ranges(first.rows(), y_px);
    let mut found = Vec::new();
    for ((columns, moved_columns), (rows, moved_rows)) in
        across.iter().flat_map(|columns| down.iter().map(move |rows| (columns, rows)))
    {
        let parts = part(first, columns, rows).ok().zip(part(second, moved_columns, moved_rows).ok());
        let Some(Ok(shift)) = parts.map(|(first, second)| shift_between(&first, &second)) else { continue };
        let middle = |range: &Range<usize>| 0.5 * (range.start + range.end - 1) as f64;
        found.push(LocalShift {
            at_px: (middle(columns), middle(rows)),
            by_px: (x_px.round() + shift.x_px, y_px.round() + shift.y_px),
            sigma_px: shift.sigma_px,
        });
    }
    found
}

/// Ranges of a side of the first picture that stay in the second, each with where they are there.
fn ranges(size: usize, shift_px: f64) -> Vec<(Range<usize>, Range<usize>)> {
    let shift = shift_px.round() as i64;
    let first = (-shift).max(0) as usize;
    let last = (size as i64 - shift.max(0)).max(0) as usize;
    let common = last.saturating_sub(first);
    let count = (common / PART_PX).min(MOST_PARTS);
    (0..count)
        .map(|index| {
            let here = first + index * common / count..first + (index + 1) * common / count;
            let there = |place: usize| (place as i64 + shift) as usize;
            (here.clone(), there(here.start)..there(here.end))
        })
        .collect()
}

fn part(frame: &Frame, columns: &Range<usize>, rows: &Range<usize>) -> Result<Frame, FrameError> {
    let place = |y: usize| y * frame.columns() + columns.start..y * frame.columns() + columns.end;
    let samples = match frame.samples() {
        Samples::U8(values) => {
            Samples::U8(rows.clone().flat_map(|y| values[place(y)].iter().copied()).collect())
        }
        Samples::U16(values) => {
            Samples::U16(rows.clone().flat_map(|y| values[place(y)].iter().copied()).collect())
        }
    };
    Frame::new(rows.len(), columns.len(), frame.bit_depth(), samples)
}

impl Similarity {
    /// Where the pixel at column `x` and row `y` of the first picture is in the second.
    pub fn place(&self, x: f64, y: f64) -> (f64, f64) {
        let (sin, cos) = self.turn_rad.sin_cos();
        let (u, v) = (x - self.centre_px.0, y - self.centre_px.1);
        (
            self.scale * (cos * u - sin * v) + self.centre_px.0 + self.shift_px.0,
            self.scale * (sin * u + cos * v) + self.centre_px.1 + self.shift_px.1,
        )
    }

    /// The motion that fits the shifts of the parts best, whatever a few of them do; `None` with fewer than four of
    /// them, or if they lie in one place.
    ///
    /// Linear least squares in a = s cos, b = s sin and t, reweighted by Tukey's biweight.
    fn fitted(parts: &[LocalShift]) -> Option<Self> {
        if parts.len() < LEAST_PARTS {
            return None;
        }
        let count = parts.len() as f64;
        let middle = |of: fn(&LocalShift) -> f64| parts.iter().map(of).sum::<f64>() / count;
        let centre_px = (middle(|part| part.at_px.0), middle(|part| part.at_px.1));
        let own = |part: &LocalShift| part.sigma_px.powi(-2);
        let stated_px = parts.iter().map(own).sum::<f64>().sqrt().recip();
        // Four parameters; two coordinates for each part.
        let free = 1.0 - 4.0 / (2.0 * count);
        let mut weights: Vec<f64> = parts.iter().map(own).collect();
        let mut found = None;
        for _ in 0..ROUNDS {
            let [a, b, x, y] = solve(parts, centre_px, &weights)?;
            let (turn_rad, scale, shift_px) = (b.atan2(a), a.hypot(b), (x, y));
            let motion =
                Self { centre_px, shift_px, turn_rad, scale, sigma_px: stated_px, parts: parts.len() };
            let distances: Vec<f64> = parts.iter().map(|part| motion.distance(part)).collect();
            let spread_px = median(&mut distances.clone())? / MEDIAN_LENGTH / free.sqrt();
            for ((weight, part), distance) in weights.iter_mut().zip(parts).zip(&distances) {
                let limit = OUTLIER * spread_px.max(part.sigma_px);
                let share = (1.0 - (distance / limit).powi(2)).max(0.0);
                *weight = share * share * own(part);
            }
            found = Some(Self { sigma_px: stated_px.max(spread_px / count.sqrt()), ..motion });
        }
        found
    }

    /// How far a part lies from where this motion has it, in px.
    fn distance(&self, part: &LocalShift) -> f64 {
        let (x, y) = self.place(part.at_px.0, part.at_px.1);
        (part.at_px.0 + part.by_px.0 - x).hypot(part.at_px.1 + part.by_px.1 - y)
    }
}

fn solve(parts: &[LocalShift], centre: (f64, f64), weights: &[f64]) -> Option<[f64; 4]> {
    let (mut normal, mut right) = (Matrix4::<f64>::zeros(), Vector4::<f64>::zeros());
    for (part, &weight) in parts.iter().zip(weights) {
        let (u, v) = (part.at_px.0 - centre.0, part.at_px.1 - centre.1);
        let rows = [
            (Vector4::new(u, -v, 1.0, 0.0), u + part.by_px.0),
            (Vector4::new(v, u, 0.0, 1.0), v + part.by_px.1),
        ];
        for (row, value) in rows {
            normal += row * row.transpose() * weight;
            right += row * (weight * value);
        }
    }
    let solved = normal.cholesky()?.solve(&right);
    solved.iter().all(|value| value.is_finite()).then(|| [solved[0], solved[1], solved[2], solved[3]])
}

#[cfg(test)]
mod tests {
    use super::*;
    use epirig_simulator::{Simulator, SimulatorConfig};

    #[test]
    fn turn_and_scale_are_found_from_parts_though_one_changed() {
        let truth = Similarity {
            centre_px: (100.0, 50.0),
            shift_px: (4.0, -3.0),
            turn_rad: 0.01,
            scale: 1.002,
            sigma_px: 0.0,
            parts: 0,
        };
        let mut parts: Vec<LocalShift> = (0..25)
            .map(|index| {
                let at = ((index % 5 * 40) as f64, (index / 5 * 30) as f64);
                let to = truth.place(at.0, at.1);
                LocalShift { at_px: at, by_px: (to.0 - at.0, to.1 - at.1), sigma_px: 0.01 }
            })
            .collect();
        parts[7].by_px.0 += 5.0;
        let found = Similarity::fitted(&parts).unwrap();
        // The other parts are exact.
        assert!((found.turn_rad - 0.01).abs() < 1e-6 && (found.scale - 1.002).abs() < 1e-6, "{found:?}");
        for (x, y) in [(0.0, 0.0), (200.0, 120.0)] {
            let (place, expected) = (found.place(x, y), truth.place(x, y));
            assert!((place.0 - expected.0).hypot(place.1 - expected.1) < 1e-4);
        }
        // The mean of 25 parts of 0.01 px.
        assert!((found.sigma_px - 0.002).abs() < 1e-4, "{found:?}");
        assert_eq!(Similarity::fitted(&parts[..3]), None);
        assert_eq!(Similarity::fitted(&[parts[0]; 5]), None);
    }

    #[test]
    fn a_camera_that_rolled_and_moved_shows_its_turn_and_shift() {
        // A plane that fills the view; the second camera is rolled by 0.5 deg and moved along x.
        let view = |roll_rad: f64, position_mm: f64, seed: u64| {
            let mut config = SimulatorConfig::textured_plane(320, 240, 9);
            config.optics.roll_rad = roll_rad;
            config.sensor.read_noise_dn = 1.0;
            config.sensor.seed = seed;
            let middle = (config.optics.principal_point_x_px, config.optics.principal_point_y_px);
            let px_per_mm = config.optics.focal_length_px / 500.0;
            let simulator = Simulator::new(config).unwrap();
            let offset_px = simulator.scene_offset_mm(position_mm) * px_per_mm;
            (simulator.expose(position_mm, 0), middle, offset_px)
        };
        let roll = 0.5_f64.to_radians();
        let ((first, middle, from), (second, _, to)) = (view(0.0, 12.0, 1), view(roll, 20.0, 2));
        let found = similarity_between(&first, &second).unwrap();
        assert!(found.parts >= 20, "{found:?}");
        // A point at m + q of the first frame lies at m + T (q + shift) of the second, where T turns by the roll.
        // The sign of the roll is the simulator's; the shift tells the two senses apart.
        let moved = to - from;
        let turned = |sign: f64, (x, y): (f64, f64)| {
            let (sin, cos) = (sign * roll).sin_cos();
            let (u, v) = (x - middle.0 + moved, y - middle.1);
            (middle.0 + cos * u - sin * v, middle.1 + sin * u + cos * v)
        };
        let sign = found.turn_rad.signum();
        // The shift of a part is that of the middle of its texture: 24 x 24 grains leave it 48 px / sqrt 12 / sqrt 576 =
        // 0.6 px from the part's own along each axis, twice that where grains differ. A turn of 0.0087 rad makes
        // 0.011 px of it. Over 30 parts, 115 px (root mean square) from the middle, that is 1.7e-5; four times that.
        assert!((found.turn_rad.abs() - roll).abs() < 7e-5 && (found.scale - 1.0).abs() < 7e-5, "{found:?}");
        for corner in [(20.0, 20.0), (300.0, 220.0), (160.0, 120.0)] {
            let (place, expected) = (found.place(corner.0, corner.1), turned(sign, corner));
            let off = (place.0 - expected.0).hypot(place.1 - expected.1);
            assert!(off < 0.02, "{corner:?}: {place:?}, not {expected:?}");
        }
    }

    #[test]
    fn small_pictures_are_shifted_only_and_others_are_refused() {
        let view = |position_mm: f64| {
            let simulator = Simulator::new(SimulatorConfig::textured_plane(80, 60, 9)).unwrap();
            simulator.expose(position_mm, 0)
        };
        let found = similarity_between(&view(12.0), &view(14.0)).unwrap();
        assert_eq!((found.parts, found.turn_rad, found.scale), (0, 0.0, 1.0));
        // 160 px of focal length, 500 mm away: 2 mm are 0.64 px.
        assert!((found.shift_px.0 - 0.64).abs() < 0.01, "{found:?}");
        let even = Frame::new(60, 80, 8, Samples::U8(vec![100; 4800])).unwrap();
        let blank = similarity_between(&even, &even);
        assert!(matches!(blank, Err(ShiftError::TooLittleTexture { .. })), "{blank:?}");
    }
}
