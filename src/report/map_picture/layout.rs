//! Pictures of one place side by side, with axes, a colour scale and a legend. Nothing is cut off: the sheet is as
//! wide as its longest text.

use image::{Rgb, RgbImage};
use plotters::style::text_anchor::{HPos, VPos};

use super::super::canvas::{Canvas, Drawn, drawn_over, use_own_font};
use super::axes::{
    LABEL_PX, Place, Scale, filled, line, polygon, text, ticks_below, ticks_left, ticks_right, upright_width,
    width_of,
};

const TITLE_PX: u32 = 19;
/// Room above the panels: for the title, and for their names.
const ABOVE: u32 = 60;
/// Room below, for labels and the name of the axis.
const BELOW: u32 = 46;
/// Least room to the left, for the name of the axis.
const LEAST_LEFT: u32 = 48;
/// Where the name of a panel begins, so that it stays apart from that of the axis.
const NAME: i32 = 16;
/// Room between panels, and around all.
const GAP: u32 = 40;
const MARGIN: u32 = 12;
/// Colour scale: width, and height of its ends.
const BAR: u32 = 20;
const END: u32 = 12;
/// Least height of the body, so that a colour scale can be read beside a flat map.
const LEAST_BODY: u32 = 170;
/// Legend: height of a line, and side of a sample.
const LINE: u32 = 22;
const SAMPLE: u32 = 14;

/// One picture in the sheet.
pub(super) struct Panel {
    pub(super) name: String,
    pub(super) pixels: RgbImage,
}

pub(super) struct Bar {
    pub(super) low: f32,
    pub(super) high: f32,
    /// Colour of a share of the scale, from 0 to 1.
    pub(super) colour: fn(f64) -> [u8; 3],
    /// Whether there are values below and above it.
    pub(super) beyond: [bool; 2],
}

/// What a colour means.
pub(super) struct Key {
    /// The colour; `None` for a remark without a sample.
    pub(super) colour: Option<[u8; 3]>,
    pub(super) name: String,
}

/// A sheet of panels of equal size that show the same place.
pub(super) struct Layout<'a> {
    pub(super) title: String,
    pub(super) panels: &'a [Panel],
    /// Scales of each panel, along x and y.
    pub(super) scales: [Scale; 2],
    pub(super) unit: &'a str,
    pub(super) bar: Option<Bar>,
    pub(super) legend: &'a [Key],
}

impl Layout<'_> {
    pub(super) fn picture(&self) -> Result<RgbImage, String> {
        use_own_font();
        let (width, height) = self.panels.first().map_or((1, 1), |panel| panel.pixels.dimensions());
        let panels = self.panels.len() as u32;
        let body = height.max(if self.bar.is_some() { LEAST_BODY } else { 0 });
        let left_of_panels = MARGIN + upright_width(&self.scales[1])?.max(LEAST_LEFT);
        let left = |index: u32| left_of_panels + index * (width + GAP);
        let right_of_panels = left_of_panels + panels * width + panels.saturating_sub(1) * GAP;
        let mut needed = right_of_panels + MARGIN + GAP / 2;
        if let Some(bar) = &self.bar {
            needed = right_of_panels + GAP / 2 + BAR + upright_width(&bar.scale(body - 2 * END))? + MARGIN;
        }
        needed = needed.max(width_of(&self.title, TITLE_PX)? + 2 * MARGIN);
        for key in self.legend {
            needed = needed.max(key.width()? + 2 * MARGIN);
        }
        for (index, panel) in (0..).zip(self.panels) {
            needed = needed.max(left(index) + NAME as u32 + width_of(&panel.name, LABEL_PX)? + MARGIN);
        }
        let lines = self.legend_lines(needed - 2 * MARGIN)?;
        let legend = if lines.is_empty() { 0 } else { lines.len() as u32 * LINE + MARGIN / 2 };
        let full_height = ABOVE + body + BELOW + legend;
        let mut sheet = RgbImage::from_pixel(needed, full_height, Rgb([255, 255, 255]));
        for (index, panel) in (0..).zip(self.panels) {
            image::imageops::replace(&mut sheet, &panel.pixels, i64::from(left(index)), i64::from(ABOVE));
        }
        let bar_left = right_of_panels + GAP / 2;
        if let Some(bar) = &self.bar {
            bar.fill(&mut sheet, bar_left, ABOVE + END, body - 2 * END);
        }
        drawn_over(sheet, |canvas| {
            text(canvas, &self.title, TITLE_PX, (MARGIN as i32, 8), (HPos::Left, VPos::Top))?;
            for (index, panel) in (0..).zip(self.panels) {
                self.axes(canvas, panel, left(index), index == 0)?;
            }
            if let Some(bar) = &self.bar {
                bar.draw(canvas, bar_left as i32, (ABOVE + END) as i32, (body - 2 * END) as i32)?;
            }
            for (line, keys) in (0..).zip(&lines) {
                let mut x = MARGIN as i32;
                let middle = (ABOVE + body + BELOW + line * LINE + LINE / 2) as i32;
                for key in keys {
                    key.draw(canvas, (x, middle))?;
                    x += (key.width()? + GAP / 2) as i32;
                }
            }
            Ok(())
        })
    }

    /// Border, ticks and names of a panel whose left edge is at column `left`.
    fn axes(&self, canvas: &Canvas<'_>, panel: &Panel, left: u32, first: bool) -> Drawn {
        let (width, height) = panel.pixels.dimensions();
        let (x, y) = (left as i32, ABOVE as i32);
        let (right, bottom) = (x + width as i32, y + height as i32);
        for (from, to) in [
            ((x - 1, y - 1), (right, y - 1)),
            ((x - 1, bottom), (right, bottom)),
            ((x - 1, y - 1), (x - 1, bottom)),
            ((right, y - 1), (right, bottom)),
        ] {
            line(canvas, from, to)?;
        }
        ticks_below(canvas, &self.scales[0], (x, bottom))?;
        ticks_left(canvas, &self.scales[1], (x - 1, y), first)?;
        if first {
            let name = format!("y ({})", self.unit);
            text(canvas, &name, LABEL_PX, (MARGIN as i32, y - 8), (HPos::Left, VPos::Bottom))?;
        }
        let name = format!("x ({})", self.unit);
        text(canvas, &name, LABEL_PX, (x, bottom + 24), (HPos::Left, VPos::Top))?;
        text(canvas, &panel.name, LABEL_PX, (x + NAME, y - 8), (HPos::Left, VPos::Bottom))
    }

    /// The entries in lines of at most this width.
    fn legend_lines(&self, width: u32) -> Result<Vec<Vec<&Key>>, String> {
        let mut lines: Vec<(u32, Vec<&Key>)> = Vec::new();
        for key in self.legend {
            let needs = key.width()? + GAP / 2;
            match lines.last_mut().filter(|(used, _)| used + needs - GAP / 2 <= width) {
                Some((used, keys)) => {
                    *used += needs;
                    keys.push(key);
                }
                None => lines.push((needs, vec![key])),
            }
        }
        Ok(lines.into_iter().map(|(_, keys)| keys).collect())
    }
}

impl Key {
    fn sample(&self) -> u32 {
        if self.colour.is_some() { SAMPLE + 6 } else { 0 }
    }

    fn width(&self) -> Result<u32, String> {
        Ok(self.sample() + width_of(&self.name, LABEL_PX)?)
    }

    fn draw(&self, canvas: &Canvas<'_>, (x, middle): Place) -> Drawn {
        if let Some(colour) = self.colour {
            let half = SAMPLE as i32 / 2;
            filled(canvas, [(x, middle - half), (x + SAMPLE as i32, middle + half)], colour)?;
        }
        text(canvas, &self.name, LABEL_PX, (x + self.sample() as i32, middle), (HPos::Left, VPos::Center))
    }
}

impl Bar {
    fn scale(&self, length_px: u32) -> Scale {
        Scale { first: self.low.into(), last: self.high.into(), length_px }
    }

    fn fill(&self, sheet: &mut RgbImage, left: u32, top: u32, height: u32) {
        for step in 0..height {
            let share = 1.0 - f64::from(step) / f64::from((height - 1).max(1));
            (0..BAR).for_each(|x| sheet.put_pixel(left + x, top + step, Rgb((self.colour)(share))));
        }
    }

    /// Border, ticks, and a triangle at each end that values lie beyond.
    fn draw(&self, canvas: &Canvas<'_>, left: i32, top: i32, height: i32) -> Drawn {
        let (right, bottom) = (left + BAR as i32, top + height);
        let middle = left + BAR as i32 / 2;
        for x in [left - 1, right] {
            line(canvas, (x, top), (x, bottom))?;
        }
        let ends = [(bottom, bottom + END as i32 - 1, 0.0), (top - 1, top - END as i32, 1.0)];
        for ((base, tip, share), beyond) in ends.into_iter().zip(self.beyond) {
            if beyond {
                polygon(canvas, &[(left - 1, base), (right, base), (middle, tip)], (self.colour)(share))?;
            } else {
                line(canvas, (left - 1, base), (right, base))?;
            }
        }
        ticks_right(canvas, &self.scale(height as u32), (right + 1, bottom - 1))
    }
}
