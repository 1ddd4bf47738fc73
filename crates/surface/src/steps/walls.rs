//! How wide the walls between the levels look.

use super::super::trend::Field;
use super::levels::Levels;
use super::nearest::Nearest;
use super::regions::{Level, clear_of_walls};
use epirig_core::grid::Grid;
use epirig_core::statistics::quantile;

/// Farthest from a wall that is looked at, in px.
const FARTHEST_PX: usize = 48;
/// Fewest heights at a distance from the walls: their median is then known to an eighth of their scatter.
const LEAST: usize = 100;
/// Share of the depth that heights may lack at the ends of a wall.
const LACKING: f64 = 0.1;

/// Width of the walls of a map in px, across them: from where heights lie a tenth of the depth above the lower level to
/// where a tenth is missing to the upper one. It is what the walls of the object, the blur, the windows of the matcher, and
/// the noise that hides where the walls are make together. No width is told to less than a pixel. `None` if heights do not
/// come as near to both levels as that within [`FARTHEST_PX`].
pub(super) fn wall_width_px(field: &Field<'_>, on: &Grid<Level>, levels: &Levels) -> Option<f64> {
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

    /// A hollow 70 px across, 0.2 mm deep, whose walls fall evenly over so many px; and its mirror, which is raised.
    fn with_walls(width_px: f64, is_disc: bool, sign: f64, sigma_mm: f64) -> f64 {
        let middle = 0.5 * SIDE as f64;
        let heights = field(sigma_mm, 7, |x_mm, y_mm, x, y| {
            let (x, y) = (x as f64 - middle, y as f64 - middle);
            // A groove at an angle of 30 degrees, or a disc.
            let beyond = if is_disc { x.hypot(y) } else { (0.5 * x + 0.75_f64.sqrt() * y).abs() } - 35.0;
            let rises = (0.5 + beyond / width_px.max(1e-9)).clamp(0.0, 1.0);
            tilted(x_mm, y_mm) + 0.2 * sign * rises
        });
        find_steps(&heights, None, &options(TrendKind::Plane)).unwrap().wall_width_px.unwrap()
    }

    #[test]
    fn walls_are_as_wide_as_they_are_and_never_less_than_a_pixel() {
        for (is_disc, sign) in [(false, 1.0), (false, -1.0), (true, 1.0), (true, -1.0)] {
            for (width_px, sigma_mm) in [(0.0, 1e-4), (4.0, 1e-4), (4.0, 0.01), (12.0, 1e-4), (12.0, 0.01)] {
                let found = with_walls(width_px, is_disc, sign, sigma_mm);
                // From a tenth to nine of an even slope. Distances are those of middles of pixels, which lie up to half a
                // pixel off a wall at an angle, on both sides of it.
                let truth = f64::max(0.8 * width_px, 0.8);
                assert!((found - truth).abs() < 1.0, "{width_px}, {is_disc}, {sign}, {sigma_mm}: {found}");
            }
        }
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
