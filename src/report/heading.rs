//! Title and legend above a picture, where they cover nothing.

use plotters::coord::Shift;
use plotters::prelude::*;

use super::canvas::{Drawn, FONT, say};

/// Colours that are distinct for people with any colour vision (Wong 2011).
pub(super) const COLOURS: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(86, 180, 233),
    RGBColor(230, 159, 0),
    RGBColor(60, 60, 60),
];

const TITLE_HEIGHT: u32 = 36;
const LEGEND_HEIGHT: u32 = 24;
/// Distance from an entry's mark to its name, and from a name to the next entry, in px.
const BEFORE_NAME: i32 = 8;
const AFTER_NAME: i32 = 26;

/// The mark before a name in the legend.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Sample {
    /// A line of this length, in px.
    Line(i32),
    /// A dashed line of this length, in px.
    Dashed(i32),
    /// A line of this length in a band, in px.
    Band(i32),
    Dot,
    Ring,
    /// A dot with an error bar.
    DotWithBar,
}

#[derive(Debug, Clone, PartialEq)]
pub(super) struct Entry {
    pub(super) name: String,
    pub(super) sample: Sample,
    pub(super) colour: RGBColor,
}

/// Height of title and legend, in px.
pub(super) fn heading_height(legend: &[Entry]) -> u32 {
    TITLE_HEIGHT + if legend.is_empty() { 0 } else { LEGEND_HEIGHT }
}

/// Draws title and legend at the top of `area`; names begin at column `left`.
pub(super) fn draw_heading<B: DrawingBackend>(
    area: &DrawingArea<B, Shift>,
    title: &str,
    legend: &[Entry],
    left: i32,
) -> Drawn {
    let title_style = (FONT, 20).into_font().into_text_style(area);
    area.draw_text(title, &title_style, (12, 9)).map_err(say)?;
    let style = (FONT, 14).into_font().into_text_style(area);
    let middle = (TITLE_HEIGHT + LEGEND_HEIGHT / 2) as i32;
    let mut x = left;
    for Entry { name, sample, colour } in legend {
        let width = match sample {
            Sample::Line(length) | Sample::Dashed(length) | Sample::Band(length) => *length,
            Sample::Dot | Sample::Ring | Sample::DotWithBar => 8,
        };
        let centre = (x + width / 2, middle);
        let path = |points: Vec<(i32, i32)>| PathElement::new(points, colour.stroke_width(2));
        match sample {
            Sample::Line(_) => area.draw(&path(vec![(x, middle), (x + width, middle)])),
            Sample::Dashed(_) => {
                area.draw(&path(vec![(x, middle), (x + 2 * width / 5, middle)])).map_err(say)?;
                area.draw(&path(vec![(x + 3 * width / 5, middle), (x + width, middle)]))
            }
            Sample::Band(_) => {
                let corners = [(x, middle - 5), (x + width, middle + 5)];
                area.draw(&Rectangle::new(corners, colour.mix(0.25).filled())).map_err(say)?;
                area.draw(&path(vec![(x, middle), (x + width, middle)]))
            }
            Sample::Dot => area.draw(&Circle::new(centre, 3, colour.filled())),
            Sample::Ring => area.draw(&Circle::new(centre, 4, colour.stroke_width(1))),
            Sample::DotWithBar => {
                area.draw(&path(vec![(centre.0, middle - 8), (centre.0, middle + 8)])).map_err(say)?;
                area.draw(&Circle::new(centre, 3, colour.filled()))
            }
        }
        .map_err(say)?;
        area.draw_text(name, &style, (x + width + BEFORE_NAME, middle - 4)).map_err(say)?;
        let (name_width, _) = area.estimate_text_size(name, &style).map_err(say)?;
        x += width + BEFORE_NAME + name_width as i32 + AFTER_NAME;
    }
    Ok(())
}
