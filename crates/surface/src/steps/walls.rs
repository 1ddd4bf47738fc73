//! How wide the walls between the levels look.

use super::super::trend::Field;
use super::levels::Levels;
use super::nearest::Nearest;
use super::regions::{Level, clear_of_walls};
use epirig_core::grid::Grid;
use epirig_core::statistics::quantile;

/// Farthest from a wall that is looked at, in px.
const FARTHEST_PX: usize = 48;
/// Fewest heights at a distance from the walls.
const LEAST: usize = 100;
/// Largest scatter of the heights, as a share of the depth. The heights say where the walls are, and where noise says it, they
/// look narrower than they are: at this limit by a tenth.
const LARGEST_SCATTER: f64 = 0.05;
/// Share of the depth that heights may lack at the ends of a wall.
const LACKING: f64 = 0.1;

/// Width of the walls of a map in px, across them: from where heights lie a tenth of the depth above the lower level to
/// where a tenth is missing to the upper one. The walls of the object, the blur and the windows of the matcher make it. It is
/// told to about a pixel; a sharp wall looks 0.8 px wide, and walls at an angle up to a pixel narrower than they are, as
/// distances are those of middles of pixels. `None` if heights scatter about their levels by more than a twentieth of the
/// depth, or do not come near enough to both levels within [`FARTHEST_PX`].
pub(super) fn wall_width_px(
    field: &Field<'_>,
    on: &Grid<Level>,
    (levels, scatter_mm): (&Levels, f64),
) -> Option<f64> {
    if scatter_mm > LARGEST_SCATTER * levels.depth_mm {
        return None;
    }
    // What heights lack to the level that they are on, as a share of the depth, by whole pixels from the wall.
    let mut on_lower = vec![Vec::new(); FARTHEST_PX];
    let mut on_upper = on_lower.clone();
    let [to_lower, to_upper] =
        [Level::Lower, Level::Upper].map(|wanted| Nearest::new(&on.map(|level| level == wanted)));
    let far = clear_of_walls(on, FARTHEST_PX);
    for sample in field.samples_where(|x, y| far.at(x, y) == Level::Unknown) {
        let below_upper = (levels.upper_mm(&sample.row) - sample.height_mm) / levels.depth_mm;
        let (other, lacking, level) = match on.at(sample.x, sample.y) {
            Level::Lower => (&to_upper, 1.0 - below_upper, &mut on_lower),
            Level::Upper => (&to_lower, below_upper, &mut on_upper),
            Level::Unknown => continue,
        };
        let distance = other.of(sample.x, sample.y).map(|(distance_px, _)| distance_px as usize);
        if let Some(at_distance) = distance.and_then(|distance| level.get_mut(distance)) {
            at_distance.push(lacking as f32);
        }
    }
    let [lower, upper] = [on_lower, on_upper].map(medians);
    let beside = |level: &[f64]| level.first().map(|lacking| 1.0 - lacking);
    Some(reach_px(beside(&upper)?, &lower)? + reach_px(beside(&lower)?, &upper)?)
}

/// The medians up to the first distance with too few values.
fn medians(by_distance: Vec<Vec<f32>>) -> Vec<f64> {
    let enough = by_distance.into_iter().take_while(|values| values.len() >= LEAST);
    enough.filter_map(|mut values| quantile(&mut values, 0.5).map(f64::from)).collect()
}

/// How far from the wall heights lack no more than [`LACKING`], in px: by lines through what they lack at half a pixel,
/// one and a half, and so on, and `across`, half a pixel on the other side.
fn reach_px(across: f64, lacking: &[f64]) -> Option<f64> {
    let (mut before, mut before_px) = (across.max(0.5), -0.5);
    for (whole_px, &here) in lacking.iter().enumerate() {
        let here_px = whole_px as f64 + 0.5;
        if here <= LACKING {
            return Some(before_px + (before - LACKING) / (before - here) * (here_px - before_px));
        }
        (before, before_px) = (here, here_px);
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    use super::super::find_steps;
    use super::super::tests::{SIDE, field, options, tilted};
    use crate::trend::TrendKind;

    /// A hollow 70 px across, 0.2 mm deep, whose walls fall evenly over so many px; or its mirror, which is raised.
    fn looks(width_px: f64, shape: Shape, sign: f64, sigma_mm: f64) -> Option<f64> {
        let middle = 0.5 * (SIDE as f64 - 1.0);
        let heights = field(sigma_mm, 7, |x_mm, y_mm, x, y| {
            let (x, y) = (x as f64 - middle, y as f64 - middle);
            let from_middle = match shape {
                Shape::Upright => x.abs(),
                Shape::Slanted => (0.5 * x + 0.75_f64.sqrt() * y).abs(),
                Shape::Round => x.hypot(y),
            };
            let rises = (0.5 + (from_middle - 35.0) / width_px.max(1e-9)).clamp(0.0, 1.0);
            tilted(x_mm, y_mm) + 0.2 * sign * rises
        });
        find_steps(&heights, None, &options(TrendKind::Plane)).unwrap().wall_width_px
    }

    #[derive(Debug, Clone, Copy, PartialEq)]
    enum Shape {
        Upright,
        /// By 30 degrees.
        Slanted,
        Round,
    }

    #[test]
    fn walls_are_as_wide_as_they_look() {
        for (shape, sign) in [
            (Shape::Upright, 1.0),
            (Shape::Upright, -1.0),
            (Shape::Slanted, 1.0),
            (Shape::Slanted, -1.0),
            (Shape::Round, 1.0),
            (Shape::Round, -1.0),
        ] {
            for (width_px, sigma_mm) in [(0.0, 1e-4), (4.0, 1e-4), (4.0, 0.008), (12.0, 1e-4), (12.0, 0.008)]
            {
                let found = looks(width_px, shape, sign, sigma_mm).unwrap();
                // From a tenth to nine of an even slope; a sharp one jumps between the middles of two pixels.
                let truth = f64::max(0.8 * width_px, 0.8);
                // Lines between the middles of pixels cut the foot of a slope by a tenth of a pixel. Upright walls have
                // exact distances, and others are narrower by up to half a pixel on each side. Noise of 4 % of the depth
                // narrows them by up to a tenth.
                let exact = 0.25 + if sigma_mm > 0.001 { 0.1 * truth } else { 0.0 };
                let slanted = if shape == Shape::Upright { 0.0 } else { 1.0 };
                let is_right = (truth - exact - slanted..=truth + exact).contains(&found);
                assert!(is_right, "{width_px}, {shape:?}, {sign}, {sigma_mm}: {found}");
            }
        }
        // Noise of 8 % would say where the walls are.
        assert_eq!(looks(4.0, Shape::Upright, 1.0, 0.016), None);
    }

    #[test]
    fn a_wall_ends_where_a_tenth_is_lacking() {
        // A straight slope from -5 to 5 px: it lacks 0.5 at the wall, a tenth at 4 px.
        let slope: Vec<f64> = (0..8).map(|px| (0.5 - 0.1 * (f64::from(px) + 0.5)).max(0.0)).collect();
        assert!((reach_px(0.55, &slope).unwrap() - 4.0).abs() < 1e-12);
        // A sharp one jumps between two pixels.
        assert!((reach_px(1.0, &[0.0, 0.0]).unwrap() - 0.4).abs() < 1e-12);
        assert_eq!(reach_px(1.0, &[0.3, 0.2, 0.11]), None);
        assert_eq!(reach_px(1.0, &[]), None);
    }
}
