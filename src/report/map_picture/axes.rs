//! Axes of a picture: round ticks and their labels.

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::super::axis::round_ticks;
use super::super::canvas::{Canvas, Drawn, FONT, say};

/// Height of the letters of labels, in px.
pub(super) const LABEL_PX: u32 = 14;
/// Length of ticks, in px.
const TICK_PX: i32 = 5;
/// Least distance between the ticks of an upright axis, in px.
const UPRIGHT_PX: u32 = 32;

/// A column and a row.
pub(super) type Place = (i32, i32);

/// A straight axis of `length_px` from the value at its first pixel to that at its last.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Scale {
    pub(super) first: f64,
    pub(super) last: f64,
    pub(super) length_px: u32,
}

impl Scale {
    /// Round values at least `apart_px` from each other, each with its place from the start in px and its label.
    pub(super) fn ticks(&self, apart_px: u32) -> Vec<(f64, String)> {
        let span = self.last - self.first;
        let apart = span * f64::from(apart_px) / f64::from(self.length_px.max(1));
        let (values, decimals) = round_ticks(self.first, self.last, apart);
        let place = |value: f64| (value - self.first) / span * f64::from(self.length_px.saturating_sub(1));
        values.into_iter().map(|value| (place(value), format!("{value:.decimals$}"))).collect()
    }
}

/// Width of the widest label of an upright axis, with its tick, in px.
pub(super) fn upright_width(scale: &Scale) -> Result<u32, String> {
    let mut widest = 0;
    for (_, label) in scale.ticks(UPRIGHT_PX) {
        widest = widest.max(width_of(&label, LABEL_PX)?);
    }
    Ok(widest + TICK_PX as u32 + 3)
}

/// Width of `text` in letters of this height, in px.
pub(super) fn width_of(text: &str, size_px: u32) -> Result<u32, String> {
    let font = (FONT, size_px).into_font();
    Ok(font.box_size(text).map_err(say)?.0)
}

pub(super) fn text(canvas: &Canvas<'_>, text: &str, size_px: u32, place: Place, side: (HPos, VPos)) -> Drawn {
    let style = TextStyle::from((FONT, size_px)).color(&BLACK).pos(Pos::new(side.0, side.1));
    canvas.draw_text(text, &style, place).map_err(say)
}

pub(super) fn line(canvas: &Canvas<'_>, from: Place, to: Place) -> Drawn {
    canvas.draw(&PathElement::new(vec![from, to], BLACK)).map_err(say)
}

/// A triangle, or any other polygon, with a thin border.
pub(super) fn polygon(canvas: &Canvas<'_>, corners: &[Place], [red, green, blue]: [u8; 3]) -> Drawn {
    canvas.draw(&Polygon::new(corners.to_vec(), RGBColor(red, green, blue).filled())).map_err(say)?;
    let around = corners.iter().chain(corners.first()).copied().collect::<Vec<_>>();
    canvas.draw(&PathElement::new(around, BLACK)).map_err(say)
}

pub(super) fn filled(canvas: &Canvas<'_>, corners: [Place; 2], [red, green, blue]: [u8; 3]) -> Drawn {
    canvas.draw(&Rectangle::new(corners, RGBColor(red, green, blue).filled())).map_err(say)?;
    canvas.draw(&Rectangle::new(corners, BLACK)).map_err(say)
}

/// Ticks and labels below row `y`, from column `x`.
pub(super) fn ticks_below(canvas: &Canvas<'_>, scale: &Scale, (x, y): Place) -> Drawn {
    let widest = [scale.first, scale.last].map(|value| format!("{value:.0}").len()).into_iter().max();
    // Letters are about 9 px wide; two more for decimals.
    for (place, label) in scale.ticks(9 * (widest.unwrap_or(1) as u32 + 2) + 16) {
        let at = x + place.round() as i32;
        line(canvas, (at, y), (at, y + TICK_PX))?;
        text(canvas, &label, LABEL_PX, (at, y + TICK_PX + 2), (HPos::Center, VPos::Top))?;
    }
    Ok(())
}

/// Ticks to the left of column `x`, from row `y` down; with labels if wanted.
pub(super) fn ticks_left(canvas: &Canvas<'_>, scale: &Scale, (x, y): Place, labels: bool) -> Drawn {
    for (place, label) in scale.ticks(UPRIGHT_PX) {
        let at = y + place.round() as i32;
        line(canvas, (x - TICK_PX, at), (x, at))?;
        if labels {
            text(canvas, &label, LABEL_PX, (x - TICK_PX - 3, at), (HPos::Right, VPos::Center))?;
        }
    }
    Ok(())
}

/// Ticks and labels to the right of column `x`, from row `y` up.
pub(super) fn ticks_right(canvas: &Canvas<'_>, scale: &Scale, (x, y): Place) -> Drawn {
    for (place, label) in scale.ticks(UPRIGHT_PX) {
        let at = y - place.round() as i32;
        line(canvas, (x, at), (x + TICK_PX, at))?;
        text(canvas, &label, LABEL_PX, (x + TICK_PX + 3, at), (HPos::Left, VPos::Center))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_apart() {
        let ticks = |first, last, length_px| Scale { first, last, length_px }.ticks(30);
        let labels: Vec<String> = ticks(-0.1, 0.1, 101).into_iter().map(|(_, label)| label).collect();
        assert_eq!(labels, ["-0.1", "0.0", "0.1"]);
        assert_eq!(ticks(0.0, 100.0, 101)[1], (50.0, "50".to_owned()));
        assert!(ticks(1.0, 1.0, 50).is_empty() && ticks(0.0, f64::NAN, 50).is_empty());
    }
}
