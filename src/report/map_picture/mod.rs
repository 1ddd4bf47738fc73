//! A map as a picture for people: in perceptually uniform colours, as a relief if it is one, with axes, a colour
//! scale, a legend, and the photograph of the same place beside it.

mod axes;
mod classes;
mod layout;
mod range;
mod relief;
mod window;

use image::{Rgb, RgbImage};
use rayon::prelude::*;

use super::ReportError;
use crate::results::{Look, ResultMap};
pub use classes::class_picture;
use epirig_core::grid::Grid;
use epirig_core::statistics::quantile;
use layout::{Bar, Key, Layout, Panel};
pub use range::ValueRange;
use relief::{lit, relief};
use window::Zoom;
pub(in crate::report) use window::reduced;
pub use window::{Millimetres, Window};

/// Colour of pixels without an answer.
const UNKNOWN: [u8; 3] = [70, 70, 70];
/// Largest side of a map in a file of its own, in px.
const MOST_PX: usize = 1200;
/// The darkest and the brightest of a photograph that are shown as black and white, as a share of its pixels, so
/// that a few lights do not darken it.
const CLIPPED: f64 = 0.005;

/// A map, and how it is to be shown.
#[derive(Debug, Clone)]
pub struct MapPicture<'a> {
    map: &'a Grid<f32>,
    title: String,
    unit: &'a str,
    range: ValueRange,
    window: Window,
    millimetres: Option<Millimetres>,
    relief: bool,
    shade: fn(f64) -> [u8; 3],
    photograph: Option<&'a Grid<f32>>,
    most_px: usize,
}

impl<'a> MapPicture<'a> {
    /// `map` in colours over `range`, in the window of its known values.
    pub fn new(map: &'a Grid<f32>, title: impl Into<String>, unit: &'a str, range: ValueRange) -> Self {
        Self {
            map,
            title: title.into(),
            unit,
            range,
            window: Window::around(map),
            millimetres: None,
            relief: false,
            shade: viridis,
            photograph: None,
            most_px: MOST_PX,
        }
    }

    /// `values` of `map` in colours over the usual range, as such a map is shown.
    pub fn of(map: ResultMap, values: &'a Grid<f32>) -> Self {
        let row = map.row();
        let range = ValueRange::of(values, row.least_span);
        Self::over(map, values, if row.look == Look::Difference { range.around_zero() } else { range })
    }

    /// The same over `range`.
    pub fn over(map: ResultMap, values: &'a Grid<f32>, range: ValueRange) -> Self {
        let row = map.row();
        let picture = Self::new(values, row.title, row.unit(), range);
        match row.look {
            Look::Relief => picture.as_relief(),
            Look::Difference => picture.diverging(),
            _ => picture,
        }
    }

    /// The part that is shown.
    ///
    /// # Panics
    /// When it is drawn, if it reaches outside the map.
    #[must_use]
    pub fn within(self, window: Window) -> Self {
        Self { window, ..self }
    }

    /// With axes in mm, if it is known where pixels lie; else they are in px.
    #[must_use]
    pub fn in_mm(self, millimetres: Option<Millimetres>) -> Self {
        Self { millimetres, ..self }
    }

    /// With light from the upper left, as if the values were heights.
    #[must_use]
    pub fn as_relief(self) -> Self {
        Self { relief: true, ..self }
    }

    /// From blue over white to red, for values that differ to both sides of the middle of the range.
    #[must_use]
    pub fn diverging(self) -> Self {
        Self { shade: blue_to_red, ..self }
    }

    /// With a photograph beside it, if there is one of the same size; another is not shown.
    #[must_use]
    pub fn beside(self, photograph: Option<&'a Grid<f32>>) -> Self {
        let size = (self.map.rows(), self.map.columns());
        let photograph = photograph.filter(|photograph| (photograph.rows(), photograph.columns()) == size);
        Self { photograph, ..self }
    }

    /// Whether a photograph is shown beside it.
    pub fn has_photograph(&self) -> bool {
        self.photograph.is_some()
    }

    /// At most this wide and high, without axes and legend, in px; larger maps are reduced to means.
    #[must_use]
    pub fn at_most(self, most_px: usize) -> Self {
        Self { most_px, ..self }
    }

    /// Side of the square of map pixels whose mean is one pixel of the picture.
    pub fn reduced_by(&self) -> usize {
        self.zoom().reduced
    }

    fn zoom(&self) -> Zoom {
        Zoom::of(self.window.rows.len(), self.window.columns.len(), self.most_px)
    }

    /// The picture.
    ///
    /// # Errors
    /// [`ReportError`] if the text cannot be drawn.
    pub fn picture(&self) -> Result<RgbImage, ReportError> {
        let zoom = self.zoom();
        let map = reduced(&self.window.of(self.map), zoom.reduced);
        let known = any(&map, f32::is_finite);
        let panel = |name: &str, pixels: Grid<[u8; 3]>| Panel {
            name: name.to_owned(),
            pixels: enlarged(&pixels, zoom.enlarged),
        };
        let mut panels = Vec::new();
        if let Some(photograph) = self.photograph {
            let grey = stretched(&reduced(&self.window.of(photograph), zoom.reduced));
            panels.push(panel("reference frame", grey));
        }
        let name = if panels.is_empty() { "" } else { "map" };
        panels.push(panel(name, self.coloured(&map)));
        let part = self.window.of(self.map);
        let beyond =
            [any(&part, |value| value < self.range.low), any(&part, |value| value > self.range.high)];
        let scale = Bar { low: self.range.low, high: self.range.high, colour: self.shade, beyond };
        let bar = known.then_some(scale);
        let size = panels.first().map_or((1, 1), |panel| panel.pixels.dimensions());
        let layout = Layout {
            title: match self.unit {
                "" => self.title.clone(),
                unit => format!("{} ({unit})", self.title),
            },
            panels: &panels,
            scales: zoom.scales(&self.window, size, self.millimetres),
            unit: if self.millimetres.is_some() { "mm" } else { "px" },
            bar,
            legend: &self.legend(&part, known),
        };
        layout.picture().map_err(|reason| ReportError::new(&self.title, reason))
    }

    fn coloured(&self, map: &Grid<f32>) -> Grid<[u8; 3]> {
        let mut colours = map.map(|value| colour(value, self.range, self.shade));
        if self.relief {
            let light = relief(map, self.range);
            let places = colours.values_mut().iter_mut().zip(light.values());
            places.for_each(|(colour, &light)| *colour = lit(*colour, light));
        }
        colours
    }

    fn legend(&self, part: &Grid<f32>, known: bool) -> Vec<Key> {
        let remark = |name: String| Key { colour: None, name };
        if !known {
            return vec![Key { colour: Some(UNKNOWN), name: "no pixel has an answer".to_owned() }];
        }
        let mut keys = Vec::new();
        if any(part, f32::is_nan) {
            keys.push(Key { colour: Some(UNKNOWN), name: "no answer".to_owned() });
        }
        if self.relief {
            keys.push(remark("shaded as if lit from the upper left".to_owned()));
        }
        if let Some(Millimetres { pixel_mm, .. }) = self.millimetres {
            keys.push(remark(format!("1 px is {pixel_mm:.4} mm")));
        }
        keys
    }
}

fn any(map: &Grid<f32>, is: impl Fn(f32) -> bool) -> bool {
    map.values().iter().any(|&value| is(value))
}

/// Each value as a square of this side.
fn enlarged(pixels: &Grid<[u8; 3]>, side: usize) -> RgbImage {
    let (width, height) = (pixels.columns() * side, pixels.rows() * side);
    let mut picture = RgbImage::new(width as u32, height as u32);
    let samples: &mut [u8] = &mut picture;
    samples.par_chunks_exact_mut((3 * width).max(1)).enumerate().for_each(|(y, row)| {
        let pixels = row.chunks_exact_mut(3 * side).zip(pixels.row(y / side));
        for (pixels, shade) in pixels {
            pixels.chunks_exact_mut(3).for_each(|pixel| pixel.copy_from_slice(shade));
        }
    });
    picture
}

/// A photograph from black to white.
fn stretched(photograph: &Grid<f32>) -> Grid<[u8; 3]> {
    let mut known: Vec<f64> =
        photograph.values().iter().filter(|value| value.is_finite()).map(|&value| f64::from(value)).collect();
    let low = quantile(&mut known, CLIPPED).unwrap_or(0.0) as f32;
    let high = quantile(&mut known, 1.0 - CLIPPED).unwrap_or(1.0) as f32;
    photograph.map(|value| {
        // What is even is grey, not black.
        let share = if high > low { (value - low) / (high - low) } else { 0.5 };
        // What a rectified frame does not show is NaN, which becomes black.
        [(255.0 * share.clamp(0.0, 1.0)) as u8; 3]
    })
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

/// Red, green and blue of a height in the colours of [`MapPicture`] over `range`.
pub fn height_colour(height_mm: f32, range: ValueRange) -> [u8; 3] {
    colour(height_mm, range, viridis)
}

fn colour(value: f32, range: ValueRange, shade: fn(f64) -> [u8; 3]) -> [u8; 3] {
    if value.is_nan() { UNKNOWN } else { shade(range.share(value)) }
}

/// A colour from blue over white to red (RdBu of ColorBrewer) at this share, from 0 to 1.
fn blue_to_red(share: f64) -> [u8; 3] {
    let colour = colorous::RED_BLUE.eval_continuous(1.0 - share.clamp(0.0, 1.0));
    [colour.r, colour.g, colour.b]
}

/// The colour of viridis at this share, from 0 to 1.
fn viridis(share: f64) -> [u8; 3] {
    let colour = colorous::VIRIDIS.eval_continuous(share.clamp(0.0, 1.0));
    [colour.r, colour.g, colour.b]
}

#[cfg(test)]
mod tests;
