//! Pixels that belong to classes, each in its colour, with a legend that counts them.

use image::RgbImage;

use super::layout::{Key, Layout, Panel};
use super::window::{Millimetres, Window, Zoom};
use super::{MOST_PX, ReportError, enlarged, register_font};
use epirig_core::grid::Grid;

/// A class of pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Class {
    /// The value of its pixels.
    pub value: u8,
    /// Its colour: red, green, blue.
    pub colour: [u8; 3],
    /// What it means.
    pub name: &'static str,
}

/// Uses of the pixels of a surface, as in `used.png`.
pub const USED_CLASSES: [Class; 4] = [
    Class { value: 255, colour: [0, 158, 115], name: "used" },
    Class { value: 160, colour: [230, 159, 0], name: "walls and outliers" },
    Class { value: 80, colour: [86, 180, 233], name: "left out" },
    Class { value: 0, colour: [60, 60, 60], name: "no height" },
];

/// Colour of a value that no class has.
const NO_CLASS: [u8; 3] = [255, 255, 255];

/// The values of a map in the colours of their classes, within `window`, with axes in mm if it is known where pixels
/// lie, else in px. The legend has the share of each class among the pixels of `window`.
///
/// # Errors
/// [`ReportError`] if the text cannot be drawn.
///
/// # Panics
/// If the window reaches outside the map.
pub fn class_picture(
    values: &Grid<u8>,
    title: &str,
    classes: &[Class],
    (window, millimetres): (&Window, Option<Millimetres>),
) -> Result<RgbImage, ReportError> {
    register_font();
    let part = window.of(values);
    let zoom = Zoom::of(part.rows(), part.columns(), MOST_PX);
    // Classes have no mean: of the pixels that become one, the first is taken.
    let (rows, columns) = (part.rows().div_ceil(zoom.reduced), part.columns().div_ceil(zoom.reduced));
    let mut pixels = Grid::filled(rows, columns, NO_CLASS);
    for y in 0..rows {
        for (x, pixel) in pixels.row_mut(y).iter_mut().enumerate() {
            let value = part.at(x * zoom.reduced, y * zoom.reduced);
            *pixel = classes.iter().find(|class| class.value == value).map_or(NO_CLASS, |class| class.colour);
        }
    }
    let all = part.values().len().max(1) as f64;
    let legend: Vec<Key> = classes
        .iter()
        .map(|class| {
            let count = part.values().iter().filter(|&&value| value == class.value).count();
            let name = format!("{} {:.1} %", class.name, 100.0 * count as f64 / all);
            Key { colour: Some(class.colour), name }
        })
        .collect();
    let panel = Panel { name: String::new(), pixels: enlarged(&pixels, zoom.enlarged) };
    let layout = Layout {
        title: title.to_owned(),
        edges: zoom.edges(window, panel.pixels.dimensions(), millimetres),
        panels: &[panel],
        unit: if millimetres.is_some() { "mm" } else { "px" },
        bar: None,
        legend: &legend,
    };
    layout.picture().map_err(|reason| ReportError::new(title, reason))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_class_has_its_colour_and_the_legend_its_share() {
        let values =
            Grid::from_values(40, 80, (0..3200).map(|index| u8::from(index % 80 < 20)).collect()).unwrap();
        let classes = [
            Class { value: 1, colour: [200, 0, 0], name: "left" },
            Class { value: 0, colour: [0, 0, 200], name: "right" },
        ];
        let picture = class_picture(&values, "t", &classes, (&Window::whole(40, 80), None)).unwrap();
        let count = |colour: [u8; 3]| picture.pixels().filter(|pixel| pixel.0 == colour).count();
        // 80 px become 800: squares of 10 x 10, and the samples of the legend.
        let samples = 15 * 15;
        assert!((80_000..80_000 + samples).contains(&count([200, 0, 0])), "{}", count([200, 0, 0]));
        assert!((240_000..240_000 + samples).contains(&count([0, 0, 200])), "{}", count([0, 0, 200]));
    }
}
