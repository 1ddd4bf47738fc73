//! A map in perceptually uniform colours with a scale bar.

use image::{Rgb, RgbImage};
use plotters::prelude::*;
use rayon::prelude::*;

use super::{FONT, ReportError, register_font};
use epirig_core::grid::Grid;

/// Colour of pixels without an answer.
const UNKNOWN: Rgb<u8> = Rgb([70, 70, 70]);
const TITLE_HEIGHT: u32 = 34;
const BAR_WIDTH: u32 = 20;
const BAR_SPACE: u32 = 150;
/// Narrower maps are enlarged by an integer factor.
const COMFORTABLE_WIDTH: usize = 400;

/// The values of the first and the last colour.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ValueRange {
    /// Value of the darkest colour.
    pub low: f32,
    /// Value of the brightest colour.
    pub high: f32,
}

impl ValueRange {
    /// From the 1st to the 99th percentile of the known values, at least `least_span` wide; 0 to 1 if no
    /// value is known.
    pub fn of(map: &Grid<f32>, least_span: f32) -> Self {
        let mut known = known(map);
        if known.is_empty() {
            return NOTHING_KNOWN;
        }
        let last = (known.len() - 1) as f64;
        let (low, high) = of_ranks(&mut known, [(last * 0.01) as usize, (last * 0.99) as usize]);
        let missing = (least_span - (high - low)).max(0.0);
        Self { low: low - 0.5 * missing, high: high + 0.5 * missing }
    }

    /// Three times the interquartile range of the known values around it, at least `least_span` wide, so that
    /// one near object does not take all colours. 0 to 1 if no value is known.
    pub fn of_most(map: &Grid<f32>, least_span: f32) -> Self {
        let mut known = known(map);
        if known.is_empty() {
            return NOTHING_KNOWN;
        }
        let count = known.len();
        let (lower, upper) = of_ranks(&mut known, [count / 4, count * 3 / 4]);
        let reach = (upper - lower).max(least_span / 3.0);
        Self { low: lower - reach, high: upper + reach }
    }
}

/// The range of a map without any value.
const NOTHING_KNOWN: ValueRange = ValueRange { low: 0.0, high: 1.0 };

fn known(map: &Grid<f32>) -> Vec<f32> {
    map.values().iter().copied().filter(|value| value.is_finite()).collect()
}

/// The values of these ranks among `values`, the first not larger than the second.
fn of_ranks(values: &mut [f32], [low, high]: [usize; 2]) -> (f32, f32) {
    let (below, &mut upper, _) = values.select_nth_unstable_by(high, f32::total_cmp);
    let lower = if low < high { *below.select_nth_unstable_by(low, f32::total_cmp).1 } else { upper };
    (lower, upper)
}

/// `map` in the colours of viridis over `range`, grey where unknown, with a title that has the unit, and a
/// scale bar.
///
/// # Errors
/// [`ReportError`] if the text cannot be drawn.
pub fn map_picture(
    map: &Grid<f32>,
    title: &str,
    unit: &str,
    range: ValueRange,
) -> Result<RgbImage, ReportError> {
    register_font();
    let factor = COMFORTABLE_WIDTH.div_ceil(map.columns().max(1)).max(1);
    let (width, height) = ((map.columns() * factor) as u32, (map.rows() * factor) as u32);
    let full = (width + BAR_SPACE, height.max(120) + TITLE_HEIGHT + 10);
    let mut picture = RgbImage::from_pixel(full.0, full.1, Rgb([255, 255, 255]));
    let row_bytes = 3 * full.0 as usize;
    let samples: &mut [u8] = &mut picture;
    let rows = samples.par_chunks_exact_mut(row_bytes).skip(TITLE_HEIGHT as usize).take(height as usize);
    rows.enumerate().for_each(|(y, row)| {
        let pixels = row.chunks_exact_mut(3 * factor).zip(map.row(y / factor));
        for (pixels, &value) in pixels {
            let Rgb(shade) = colour(value, range);
            pixels.chunks_exact_mut(3).for_each(|pixel| pixel.copy_from_slice(&shade));
        }
    });
    let bar_height = full.1 - TITLE_HEIGHT - 30;
    let bar_top = TITLE_HEIGHT + 10;
    for step in 0..bar_height {
        let share = 1.0 - step as f32 / (bar_height - 1).max(1) as f32;
        let shade = colour(range.low + share * (range.high - range.low), range);
        for x in 0..BAR_WIDTH {
            picture.put_pixel(width + 14 + x, bar_top + step, shade);
        }
    }
    let unknown = map.values().iter().any(|value| value.is_nan());
    let mut raw = picture.into_raw();
    let drawn = draw_text(
        &mut raw,
        full,
        (&format!("{title} ({unit})"), unknown),
        range,
        (width, bar_top, bar_height),
    );
    drawn.map_err(|reason| ReportError::new(title, reason))?;
    RgbImage::from_raw(full.0, full.1, raw).ok_or_else(|| ReportError::new(title, "its size is wrong"))
}

/// Pictures side by side, aligned at the top.
pub fn side_by_side(pictures: &[RgbImage]) -> RgbImage {
    let width = pictures.iter().map(RgbImage::width).sum();
    let height = pictures.iter().map(RgbImage::height).max().unwrap_or(0);
    let mut joined = RgbImage::from_pixel(width, height, Rgb([255, 255, 255]));
    let mut left = 0;
    for picture in pictures {
        image::imageops::replace(&mut joined, picture, left, 0);
        left += i64::from(picture.width());
    }
    joined
}

/// Red, green and blue of a height in the colours of [`map_picture`] over `range`.
pub fn height_colour(height_mm: f32, range: ValueRange) -> [u8; 3] {
    colour(height_mm, range).0
}

fn colour(value: f32, range: ValueRange) -> Rgb<u8> {
    if value.is_nan() {
        return UNKNOWN;
    }
    let share = f64::from((value - range.low) / (range.high - range.low).max(f32::MIN_POSITIVE));
    let colour = colorous::VIRIDIS.eval_continuous(share.clamp(0.0, 1.0));
    Rgb([colour.r, colour.g, colour.b])
}

fn draw_text(
    raw: &mut [u8],
    size: (u32, u32),
    (title, unknown): (&str, bool),
    range: ValueRange,
    (width, bar_top, bar_height): (u32, u32, u32),
) -> Result<(), String> {
    let area = BitMapBackend::with_buffer(raw, size).into_drawing_area();
    let say = |error: DrawingAreaErrorKind<_>| error.to_string();
    area.draw_text(title, &(FONT, 19).into_font().into_text_style(&area), (8, 7)).map_err(say)?;
    let style = (FONT, 14).into_font().into_text_style(&area);
    let span = f64::from(range.high - range.low);
    let (step, decimals) = tick_step(span);
    let mut tick = (f64::from(range.low) / step).ceil() * step;
    while tick <= f64::from(range.high) + 1e-9 * span && step > 0.0 {
        let share = ((tick - f64::from(range.low)) / span).clamp(0.0, 1.0);
        let y = f64::from(bar_top) + (1.0 - share) * f64::from(bar_height - 1);
        let x = (width + 14 + BAR_WIDTH) as i32;
        let line = PathElement::new(vec![(x, y as i32), (x + 5, y as i32)], BLACK);
        area.draw(&line).map_err(say)?;
        // A tick that is zero except for rounding has no sign.
        let value = if tick.abs() < 1e-6 * step { 0.0 } else { tick };
        area.draw_text(&format!("{value:.decimals$}"), &style, (x + 9, y as i32 - 8)).map_err(say)?;
        tick += step;
    }
    if unknown {
        let (x, y) = ((width + 14) as i32, (bar_top + bar_height + 4) as i32);
        let grey = RGBColor(UNKNOWN.0[0], UNKNOWN.0[1], UNKNOWN.0[2]);
        area.draw(&Rectangle::new([(x, y), (x + 14, y + 12)], grey.filled())).map_err(say)?;
        area.draw_text("no answer", &style, (x + 20, y - 1)).map_err(say)?;
    }
    area.present().map_err(say)
}

/// A round distance between ticks, for about six ticks, and its number of decimals.
fn tick_step(span: f64) -> (f64, usize) {
    let raw = (span / 6.0).max(f64::MIN_POSITIVE);
    let decade = 10.0_f64.powf(raw.log10().floor());
    let step =
        [1.0, 2.0, 5.0, 10.0].into_iter().map(|factor| factor * decade).find(|&step| step >= raw * 0.999);
    let step = step.unwrap_or(10.0 * decade);
    (step, (-step.log10().floor()).clamp(0.0, 9.0) as usize)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unknown_pixels_are_grey_and_values_span_the_colours() {
        let mut map = Grid::filled(40, 400, 1.0);
        map.values_mut()[0] = f32::NAN;
        map.values_mut()[1] = 3.0;
        let picture = map_picture(&map, "test", "px", ValueRange { low: 1.0, high: 3.0 }).unwrap();
        assert_eq!(*picture.get_pixel(0, TITLE_HEIGHT), UNKNOWN);
        // The ends of viridis, from its definition.
        assert_eq!(*picture.get_pixel(1, TITLE_HEIGHT), Rgb([253, 231, 37]));
        assert_eq!(*picture.get_pixel(2, TITLE_HEIGHT), Rgb([68, 1, 84]));
        // The title is drawn: something is dark above the map.
        assert!((0..100).any(|x| (0..TITLE_HEIGHT).any(|y| picture.get_pixel(x, y).0[0] < 100)));
    }

    #[test]
    fn ranges_are_those_of_the_sorted_values() {
        let values: Vec<f32> = (0..1000).map(|index| ((index * 389) % 1000) as f32).collect();
        let map = Grid::from_values(10, 100, values).unwrap();
        assert_eq!(ValueRange::of(&map, 0.05), ValueRange { low: 9.0, high: 989.0 });
        assert_eq!(ValueRange::of_most(&map, 0.05), ValueRange { low: -250.0, high: 1250.0 });
        let one = Grid::from_values(1, 2, vec![3.0, f32::NAN]).unwrap();
        assert_eq!(ValueRange::of(&one, 1.0), ValueRange { low: 2.5, high: 3.5 });
        assert_eq!(ValueRange::of(&Grid::filled(1, 2, f32::NAN), 1.0), NOTHING_KNOWN);
    }

    #[test]
    fn ticks_are_round() {
        assert_eq!(tick_step(6.0), (1.0, 0));
        assert_eq!(tick_step(0.1).1, 2);
        assert!((tick_step(0.1).0 - 0.02).abs() < 1e-12);
    }
}
