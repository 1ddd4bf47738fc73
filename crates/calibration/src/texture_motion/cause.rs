//! Why there is no motion along a line: what two frames in the middle show instead where none is found, and what
//! contradicts one that is found.

use nalgebra::{Matrix4, RowVector4, Vector2, Vector4};

use super::TextureMotionError;
use super::cameras::Cameras;
use super::fit::Fit;
use super::frames::Frames;
use super::point::squares;
use super::start::{AGREE_ON_DIRECTION, CLEAR_PX, FEWEST, MOVES_PX, POINTS, SIDE, found_between};
use epirig_core::statistics::{median, quantile};

/// Fewest squares that tell what kind of motion it is: half of them may be wrong, and four unknowns are adjusted.
const TELLING: usize = 4 * FEWEST;
/// A square agrees with a motion of the picture as a whole within this and a tenth of its own, in px.
const AGREES_PX: f64 = 1.0;
/// Each side has at least this share of the squares that move if they move to both.
const EACH_SIDE: f64 = 0.2;
/// Share of the squares that stand still, and of those that move, if a part of the picture does either.
const EACH_PART: f64 = 0.1;
/// Of squares that move by anything up to some pixels, twice as many move by less than a clear motion as by less than any:
/// where there are so few between, still ones are apart from those that move.
const BETWEEN: f64 = 0.5;
const STEPS: usize = 30;
/// Share of the points that may lie behind the camera, and how far, as a share of that of near points: points that
/// are very far away may do so by chance. A camera that turned by 3 degrees round its object had 43 %, sets without
/// such a turn none.
const MAY_BE_BEHIND: f64 = 0.02;
const FAR: f64 = 0.1;

/// Why a motion that was found cannot be, in frames of `size` (rows, columns).
pub(super) fn contradiction(fit: &Fit, (rows, columns): (usize, usize)) -> Option<TextureMotionError> {
    let Cameras { direction, focal_length_px, centre_px, .. } = &fit.cameras;
    let along = |part: f64| focal_length_px * part / direction.z;
    let place = [centre_px[0] + along(direction.x), centre_px[1] + along(direction.y)];
    let is_inside = |place: f64, size: usize| (0.0..size as f64).contains(&place);
    if is_inside(place[0], columns) && is_inside(place[1], rows) {
        return Some(TextureMotionError::Towards { place });
    }
    let agrees = |weights: &Vec<Vector2<f64>>| weights.iter().any(|weight| weight.x > 0.0);
    let points = fit.points.iter().zip(&fit.weights).filter(|(_, weights)| agrees(weights));
    let mut inverse_depths: Vec<f64> = points.map(|(point, _)| point.rho).collect();
    // Most of the picture may stand still.
    let least = -FAR * quantile(&mut inverse_depths.iter().map(|rho| rho.abs()).collect::<Vec<_>>(), 0.9)?;
    let count = inverse_depths.len() as f64;
    inverse_depths.retain(|rho| *rho < least);
    let share = inverse_depths.len() as f64 / count;
    (share > MAY_BE_BEHIND).then_some(TextureMotionError::BothSides { share: share.min(1.0 - share) })
}

/// A square's place from the middle of the picture, and how far it has moved, in px.
type Shift = ([f64; 2], [f64; 2]);

/// What frames show in pictures that are reduced by `factor`; `None` if it is nothing of these.
pub(super) fn cause(frames: &dyn Frames, factor: usize) -> Option<TextureMotionError> {
    let middle = (frames.count() - 1) / 2;
    let from = frames.picture(middle, factor);
    let places = squares(&from, SIDE, POINTS, [1.0, 0.0]);
    if places.len() < FEWEST {
        return Some(TextureMotionError::NoTexture);
    }
    let half = [from.columns(), from.rows()].map(|size| 0.5 * (size as f64 - 1.0));
    let shown = |other: usize| -> Vec<Shift> {
        let found = found_between(&from, &frames.picture(other, factor), &places, None);
        let from_middle = |block: &crate::block::Block| {
            let middle = block.middle();
            [middle[0] - half[0], middle[1] - half[1]]
        };
        found.iter().map(|(block, shift)| (from_middle(block), *shift)).collect()
    };
    let distances = std::iter::successors(Some(1), |distance| Some(2 * distance));
    let others = distances.map(|distance| middle + distance).take_while(|&other| other < frames.count());
    let all: Vec<(usize, Vec<Shift>)> = others.map(|other| (other, shown(other))).collect();
    let told = || all.iter().filter(|(_, shifts)| shifts.len() >= TELLING);
    let radius = half[0].hypot(half[1]);
    let of_whole = told().find_map(|(other, shifts)| {
        of_whole_picture(shifts, radius, factor, half).map(|whole| whole.error((other - middle) as f64))
    });
    let sides = || told().find_map(|(_, shifts)| both_sides(shifts));
    let still = || {
        let stays = |(_, shifts): &&(usize, Vec<Shift>)| {
            let mut sizes: Vec<f64> = shifts.iter().map(|(_, [x, y])| x.hypot(*y)).collect();
            median(&mut sizes).is_some_and(|usual| usual < MOVES_PX)
        };
        (told().count() > 0 && told().all(|told| stays(&told))).then_some(TextureMotionError::Still)
    };
    told().find_map(|(_, shifts)| stands(shifts)).or(of_whole).or_else(sides).or_else(still)
}

/// Whether some squares stand still while others move, with next to none between.
fn stands(shifts: &[Shift]) -> Option<TextureMotionError> {
    let count = |range: std::ops::Range<f64>| {
        shifts.iter().filter(|(_, [x, y])| range.contains(&x.hypot(*y))).count() as f64 / shifts.len() as f64
    };
    let (still, between) = (count(0.0..MOVES_PX), count(MOVES_PX..CLEAR_PX));
    let moving = 1.0 - still - between;
    (still.min(moving) >= EACH_PART && between < BETWEEN * still)
        .then_some(TextureMotionError::Stands { share: still })
}

/// A motion of the picture as a whole, beside a shift.
enum Whole {
    /// Everything moves away from a place (column, row of the frame), by this share of its distance.
    Apart([f64; 2], f64),
    /// Everything turns by so many degrees.
    Turns(f64),
}

impl Whole {
    fn error(self, steps: f64) -> TextureMotionError {
        match self {
            Self::Apart(place, share) => TextureMotionError::Grows { place, share: share / steps },
            Self::Turns(degrees) => TextureMotionError::Turns { degrees: degrees / steps },
        }
    }
}

/// Whether squares that have moved grow apart or turn, if most of them agree on it: a similarity of the picture,
/// x' = x + t + a x - b y, y' = y + u + b x + a y. Least squares with weights of Cauchy's distribution.
fn of_whole_picture(shifts: &[Shift], radius: f64, factor: usize, half: [f64; 2]) -> Option<Whole> {
    let off = |model: &Vector4<f64>, ([x, y], [right, down]): &Shift| {
        let [t, u, a, b] = [model[0], model[1], model[2], model[3]];
        (right - t - a * x + b * y).hypot(down - u - b * x - a * y)
    };
    let mut model = Vector4::zeros();
    for step in 0..STEPS {
        let (mut normal, mut right_side) = (Matrix4::zeros(), Vector4::zeros());
        for shift in shifts {
            let ([x, y], [right, down]) = *shift;
            let weight = if step == 0 { 1.0 } else { 1.0 / (1.0 + (off(&model, shift) / AGREES_PX).powi(2)) };
            for (row, moved) in
                [(RowVector4::new(1.0, 0.0, x, -y), right), (RowVector4::new(0.0, 1.0, y, x), down)]
            {
                normal += weight * row.transpose() * row;
                right_side += weight * moved * row.transpose();
            }
        }
        model = normal.cholesky()?.solve(&right_side);
    }
    let agrees = |shift: &&Shift| off(&model, shift) <= AGREES_PX + 0.1 * shift.1[0].hypot(shift.1[1]);
    let share = shifts.iter().filter(agrees).count() as f64 / shifts.len() as f64;
    let [t, u, a, b] = [model[0], model[1], model[2], model[3]];
    let (grows, turns) = (a.abs() * radius, b.abs() * radius);
    // The borders move by more than what cannot be told from nothing, and otherwise than the middle.
    if share < AGREE_ON_DIRECTION || grows.max(turns) < 2.0 * MOVES_PX.max(0.5 * t.hypot(u)) {
        return None;
    }
    if turns > grows {
        return Some(Whole::Turns(b.to_degrees()));
    }
    // Where a x - b y = -t and b x + a y = -u.
    let square = a * a + b * b;
    let still = [-(a * t + b * u) / square, -(a * u - b * t) / square];
    let place = [0, 1].map(|axis| factor as f64 * (still[axis] + half[axis]));
    Some(Whole::Apart(place, a))
}

/// Whether squares move to both sides along one direction.
fn both_sides(shifts: &[Shift]) -> Option<TextureMotionError> {
    let moving: Vec<[f64; 2]> =
        shifts.iter().map(|(_, shift)| *shift).filter(|[x, y]| x.hypot(*y) >= MOVES_PX).collect();
    // Twice the angle is the same for both sides.
    let (sum_x, sum_y) = moving.iter().fold((0.0, 0.0), |(sum_x, sum_y), [x, y]| {
        (sum_x + (x * x - y * y) / x.hypot(*y), sum_y + 2.0 * x * y / x.hypot(*y))
    });
    let (sin, cos) = (0.5 * f64::atan2(sum_y, sum_x)).sin_cos();
    let along: Vec<f64> = moving
        .iter()
        .map(|[x, y]| (x * cos + y * sin, y * cos - x * sin))
        .filter(|(along, across)| across.abs() <= AGREES_PX + 0.1 * along.abs())
        .map(|parts| parts.0)
        .collect();
    let share = |count: usize| count as f64 / moving.len() as f64;
    let forward = share(along.iter().filter(|along| **along > 0.0).count());
    let back = share(along.len()) - forward;
    (moving.len() >= TELLING && share(along.len()) >= AGREE_ON_DIRECTION && forward.min(back) >= EACH_SIDE)
        .then_some(TextureMotionError::BothSides { share: forward.min(back) })
}

#[cfg(test)]
mod tests {
    use rand::{RngExt as _, SeedableRng as _};
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::texture_motion::{MotionOptions, texture_motion};
    use epirig_core::grid::Grid;
    use epirig_core::image::reduced;

    const ROWS: usize = 160;
    const COLUMNS: usize = 240;
    const FRAMES: usize = 9;

    /// Pictures of a texture that is moved by a formula.
    struct Moved(Vec<Grid<f32>>);

    impl Frames for Moved {
        fn count(&self) -> usize {
            self.0.len()
        }

        fn size(&self) -> (usize, usize) {
            (ROWS, COLUMNS)
        }

        fn picture(&self, index: usize, factor: usize) -> Grid<f32> {
            reduced(&self.0[index], factor)
        }
    }

    /// Frames in which the pixel at `place` from the middle shows the texture at `shown(t, place)`, t from -1 to 1; waves
    /// of 6 to 30 px.
    fn moved(contrast_dn: f64, shown: impl Fn(f64, [f64; 2]) -> [f64; 2]) -> Moved {
        let mut random = ChaCha8Rng::seed_from_u64(4);
        let waves: Vec<[f64; 3]> = (0..60)
            .map(|_| {
                let k = std::f64::consts::TAU / random.random_range(6.0..30.0_f64);
                let angle = random.random_range(0.0..3.2_f64);
                [k * angle.cos(), k * angle.sin(), random.random_range(0.0..6.3)]
            })
            .collect();
        let frame = |index: usize| {
            let t = 2.0 * index as f64 / (FRAMES - 1) as f64 - 1.0;
            let value = |pixel: usize| {
                let place = [(pixel % COLUMNS) as f64 - 119.5, (pixel / COLUMNS) as f64 - 79.5];
                let [x, y] = shown(t, place);
                let sum: f64 = waves.iter().map(|[a, b, phase]| (a * x + b * y + phase).cos()).sum();
                (128.0 + contrast_dn * sum / 30.0_f64.sqrt()).round() as f32
            };
            Grid::from_values(ROWS, COLUMNS, (0..ROWS * COLUMNS).map(value).collect()).unwrap()
        };
        Moved((0..FRAMES).map(frame).collect())
    }

    fn refusal(frames: &Moved) -> TextureMotionError {
        texture_motion(frames, &MotionOptions::of_positions(20_000)).unwrap_err()
    }

    #[test]
    fn a_zoom_is_named_with_its_place() {
        // The scale changes by 3 % from frame to frame about a place 30 px right of the middle.
        let zoomed = moved(30.0, |t, [x, y]| {
            let scale = 1.0 + 0.12 * t;
            [30.0 + (x - 30.0) / scale, y / scale]
        });
        let TextureMotionError::Grows { place, share, .. } = refusal(&zoomed) else {
            panic!("{:?}", refusal(&zoomed))
        };
        assert!((place[0] - 149.5).abs() < 1.0 && (place[1] - 79.5).abs() < 1.0, "{place:?}");
        assert!((share - 0.03).abs() < 0.001, "{share}");
    }

    #[test]
    fn a_turn_about_the_view_is_named_with_its_angle() {
        let turned = moved(30.0, |t, [x, y]| {
            let (sin, cos) = (8.0 * t).to_radians().sin_cos();
            [cos * x + sin * y, cos * y - sin * x]
        });
        let TextureMotionError::Turns { degrees, .. } = refusal(&turned) else {
            panic!("{:?}", refusal(&turned))
        };
        assert!((degrees.abs() - 2.0).abs() < 0.02, "{degrees}");
    }

    #[test]
    fn points_on_both_sides_of_the_axis_of_a_turn_are_named() {
        // Near points are in the left half, far ones in the right one, and the object turns about what lies between.
        let turned = moved(30.0, |t, [x, y]| [x - 12.0 * t * (x / 30.0).clamp(-1.0, 1.0), y]);
        let TextureMotionError::BothSides { share, .. } = refusal(&turned) else {
            panic!("{:?}", refusal(&turned))
        };
        assert!(share > 0.3, "{share}");
    }

    #[test]
    fn what_stands_still_before_what_moves_is_told_by_its_share() {
        // 46 % of the columns stand still, and the others go round a curve.
        let still =
            moved(30.0, |t, [x, y]| if x < -10.0 { [x, y] } else { [x + 30.0 * t, y + 30.0 * t * t] });
        let TextureMotionError::Stands { share } = refusal(&still) else { panic!("{:?}", refusal(&still)) };
        assert!((0.3..0.6).contains(&share), "{share}");
    }

    #[test]
    fn a_still_camera_and_a_bare_wall_are_named() {
        assert!(matches!(refusal(&moved(30.0, |_, place| place)), TextureMotionError::Still));
        assert!(matches!(refusal(&moved(0.2, |t, [x, y]| [x + 20.0 * t, y])), TextureMotionError::NoTexture));
    }
}
