//! Light and shade of a map that is seen as a relief (hillshading).

use epirig_core::grid::Grid;

use super::ValueRange;

/// A slope that crosses all colours within this many pixels is drawn as one of 45 deg. So noise, which takes few
/// colours, stays faint, and a step shows.
const STEEP_PX: f64 = 6.0;
/// Gradients are fitted over this many pixels to both sides, so that noise averages out.
const REACH: usize = 2;
/// Darkest shade and brightest light, as a factor of the colour of a level place.
const DARKEST: f32 = 0.5;
const BRIGHTEST: f32 = 1.4;

/// Brightness of each pixel over that of a level place, for light from the upper left, 45 deg above the picture
/// (Lambert's law); an unknown slope counts as none.
pub(super) fn relief(map: &Grid<f32>, range: ValueRange) -> Grid<f32> {
    let mut light = Grid::filled(map.rows(), map.columns(), 1.0);
    // Heights that differ by less than their numbers resolve are level.
    let Some(width) = range.width() else { return light };
    let per_slope = STEEP_PX / width;
    for y in 0..map.rows() {
        for (x, light) in light.row_mut(y).iter_mut().enumerate() {
            let along_x = gradient(x, map.columns(), |x| map.at(x, y));
            let along_y = gradient(y, map.rows(), |y| map.at(x, y));
            // At a border, the slope along it is all that is known.
            let slope = |along: Option<f64>| along.unwrap_or(0.0) * per_slope;
            if map.at(x, y).is_finite() {
                *light = brightness(slope(along_x), slope(along_y));
            }
        }
    }
    light
}

/// Of a place whose values rise by these slopes to the right and down: the cosine between the light and its
/// normal, over that of a level place.
fn brightness(right: f64, down: f64) -> f32 {
    // The normal is (-right, -down, 1) and the light comes from (-1, -1, sqrt 2) / 2.
    let root = std::f64::consts::SQRT_2;
    let cosine = (right + down + root) / (2.0 * (1.0 + right * right + down * down).sqrt());
    ((cosine / (0.5 * root)) as f32).clamp(DARKEST, BRIGHTEST)
}

/// Slope of a straight line through the known pairs around `place`; `None` without any.
fn gradient(place: usize, size: usize, value: impl Fn(usize) -> f32) -> Option<f64> {
    let (mut sum, mut weight) = (0.0, 0.0);
    for step in 1..=REACH.min(place).min(size - 1 - place) {
        let difference = f64::from(value(place + step)) - f64::from(value(place - step));
        if difference.is_finite() {
            sum += step as f64 * difference;
            weight += (2 * step * step) as f64;
        }
    }
    (weight > 0.0).then(|| sum / weight)
}

/// `colour` in this light: darker below 1, nearer to white above.
pub(super) fn lit([red, green, blue]: [u8; 3], light: f32) -> [u8; 3] {
    [red, green, blue].map(|value| {
        let value = f32::from(value);
        let lit = if light < 1.0 { value * light } else { value + (255.0 - value) * (light - 1.0) };
        lit.round().clamp(0.0, 255.0) as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slopes_that_face_the_upper_left_are_bright() {
        let range = ValueRange { low: 0.0, high: 6.0 };
        let plane = |right: f32, down: f32| {
            let values = (0..81).map(|index| right * (index % 9) as f32 + down * (index / 9) as f32);
            let map = Grid::from_values(9, 9, values.collect()).unwrap();
            relief(&map, range).at(4, 4)
        };
        assert_eq!(plane(0.0, 0.0), 1.0);
        // A slope of 1 in 6 colours is one of 45 deg. Towards the light from one side: (1 + sqrt 2) / 2 over sqrt 2,
        // by the cosine of a level place: 1.207.
        assert!((plane(1.0, 0.0) - 1.2071).abs() < 1e-3 && (plane(0.0, 1.0) - 1.2071).abs() < 1e-3);
        assert!((plane(-2.0, 0.0) - 0.5).abs() < 1e-3, "{}", plane(-2.0, 0.0));
        assert!(plane(-0.3, -0.3) < 0.7 && plane(1.0, -1.0) < 1.0);
        assert_eq!(lit([100, 200, 0], 0.5), [50, 100, 0]);
        assert_eq!(lit([100, 200, 0], 1.5), [178, 228, 128]);
    }

    #[test]
    fn a_place_without_neighbours_is_as_a_level_one() {
        let range = ValueRange { low: 0.0, high: 1.0 };
        let mut map = Grid::filled(5, 5, f32::NAN);
        map.row_mut(2)[2] = 3.0;
        assert!(relief(&map, range).values().iter().all(|&light| light == 1.0));
        assert_eq!(relief(&Grid::filled(1, 1, 0.0), range).values(), [1.0]);
        // Heights far from zero, whose colours cannot be told apart.
        let even = Grid::filled(9, 9, 1e9);
        assert!(relief(&even, ValueRange::of(&even, 0.01)).values().iter().all(|&light| light == 1.0));
    }
}
