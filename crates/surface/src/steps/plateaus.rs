//! The plateaus that ISO 5436-1 takes for the depth of a groove (or the height of a ridge) of type A1.
//!
//! Of a groove of width w the central third of the bottom counts, and of the upper level on both sides what
//! lies a third of w to w away from the edge. So rounded edges play no part. The standard looks at one profile
//! across one groove; here the distance from the edge decides, which is the same for a straight one, and the
//! plateaus of all grooves are fitted together.

use super::nearest::Nearest;
use super::regions::{Level, regions};
use epirig_core::grid::Grid;

/// Share of its width that is left out at both sides of an edge.
const LEFT_OUT: f64 = 1.0 / 3.0;

/// The plateaus of all parts that are wide enough.
pub(super) struct Plateaus {
    /// The levels on them, and unknown elsewhere.
    pub(super) clear: Grid<Level>,
    /// Width of each part, to about a pixel.
    pub(super) widths_px: Vec<f64>,
}

impl Plateaus {
    /// The plateaus of the parts that lie on the level `of_parts` and are so wide that a third of their width is
    /// at least `margin_px`.
    pub(super) fn of(levels: &Grid<Level>, of_parts: Level, margin_px: usize) -> Self {
        let (rows, columns) = (levels.rows(), levels.columns());
        let ground = of_parts.other();
        let to_ground = Nearest::new(&levels.map(|level| level == ground));
        let to_others = Nearest::new(&levels.map(|level| level != of_parts));
        // Half of the width that shows here: the field may end within the part.
        let half_width_px = |&(x, y): &(usize, usize)| {
            let to_border = [x, y, columns - 1 - x, rows - 1 - y].into_iter().min().unwrap_or(0) as f64 + 0.5;
            to_others.of(x, y).map_or(to_border, |(distance_px, _)| distance_px.min(to_border))
        };
        let mut clear = levels.map(|_| Level::Unknown);
        let mut width_at = levels.map(|_| 0.0);
        let mut widths_px = Vec::new();
        for part in regions(levels).into_iter().filter(|part| part.value == of_parts) {
            let width_px = 2.0 * part.pixels.iter().map(half_width_px).fold(0.0, f64::max);
            let left_out_px = LEFT_OUT * width_px;
            if left_out_px < margin_px as f64 {
                continue;
            }
            widths_px.push(width_px);
            for (x, y) in part.pixels {
                width_at.row_mut(y)[x] = width_px;
                if to_ground.of(x, y).is_some_and(|(distance_px, _)| distance_px >= left_out_px) {
                    clear.row_mut(y)[x] = of_parts;
                }
            }
        }
        let to_part = Nearest::new(&levels.map(|level| level == of_parts));
        let places = (0..rows).flat_map(|y| (0..columns).map(move |x| (x, y)));
        for (x, y) in places.filter(|&(x, y)| levels.at(x, y) == ground) {
            let Some((distance_px, (part_x, part_y))) = to_part.of(x, y) else { break };
            let width_px = width_at.at(part_x, part_y);
            if width_px > 0.0 && (LEFT_OUT * width_px..=width_px).contains(&distance_px) {
                clear.row_mut(y)[x] = ground;
            }
        }
        Self { clear, widths_px }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A map with the lower level where it is said, 80 x 90 px.
    fn levels(is_low: impl Fn(usize, usize) -> bool) -> Grid<Level> {
        let at = |index: usize| if is_low(index % 90, index / 90) { Level::Lower } else { Level::Upper };
        Grid::from_values(80, 90, (0..80 * 90).map(at).collect()).unwrap()
    }

    #[test]
    fn of_a_groove_the_central_third_counts_and_the_ground_beside_it() {
        // 15 px wide, from column 30 to 44: its edges lie at 29.5 and 44.5.
        let map = levels(|x, _| (30..45).contains(&x));
        let Plateaus { clear, widths_px } = Plateaus::of(&map, Level::Lower, 5);
        assert_eq!(widths_px, [15.0]);
        for (x, y) in (0..90).flat_map(|x| [0, 40, 79].map(|y| (x, y))) {
            let expected = match x {
                35..=39 => Level::Lower,
                // From 5 to 15 px beside the edges.
                15..=24 | 50..=59 => Level::Upper,
                _ => Level::Unknown,
            };
            assert_eq!(clear.at(x, y), expected, "({x}, {y})");
        }
        // A third is 5 px.
        assert!(Plateaus::of(&map, Level::Lower, 6).widths_px.is_empty());
        assert!(Plateaus::of(&levels(|_, _| false), Level::Lower, 1).widths_px.is_empty());
    }

    #[test]
    fn each_part_has_its_own_width_in_any_direction() {
        // A round pit of diameter 24, and a groove 12 px wide at 45 degrees.
        let from_pit = |x: usize, y: usize| (x as f64 - 60.0).hypot(y as f64 - 25.0);
        let from_groove = |x: usize, y: usize| ((x + y) as f64 - 45.0).abs() / 2.0_f64.sqrt();
        let map = levels(|x, y| from_pit(x, y) <= 12.0 || from_groove(x, y) <= 6.0);
        let Plateaus { clear, widths_px } = Plateaus::of(&map, Level::Lower, 3);
        assert_eq!(widths_px.len(), 2);
        for (width_px, expected) in widths_px.iter().zip([12.0, 24.0]) {
            // The inscribed disc is known to a pixel.
            assert!((width_px - expected).abs() <= 1.0, "{width_px} for {expected}");
        }
        for (x, y) in (0..90).flat_map(|x| (0..80).map(move |y| (x, y))) {
            let (pit, groove) = (from_pit(x, y) - 12.0, from_groove(x, y) - 6.0);
            match clear.at(x, y) {
                Level::Lower => assert!(pit < -7.0 || groove < -3.0, "({x}, {y})"),
                Level::Upper => {
                    let beside =
                        |distance: f64, width: f64| (width / 3.0 - 1.0..=width + 1.0).contains(&distance);
                    assert!(beside(pit, 24.0) || beside(groove, 12.0), "({x}, {y}): {pit}, {groove}");
                }
                Level::Unknown => {}
            }
        }
    }
}
