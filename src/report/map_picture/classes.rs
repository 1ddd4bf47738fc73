//! Pixels that belong to classes, each in its colour, with a legend that counts them.

use image::RgbImage;

use super::layout::{Key, Layout, Panel};
use super::window::{Millimetres, Window, Zoom};
use super::{MOST_PX, ReportError, enlarged};
use crate::results::ResultMap;
use epirig_core::grid::Grid;

/// Colour of a value that no class has.
const NO_CLASS: [u8; 3] = [255, 255, 255];

/// The grey values of a map of classes in the colours of these, within `window`, with axes in mm if it is known where pixels
/// lie, else in px. The legend has the share of each class among the pixels of `window`.
///
/// # Errors
/// [`ReportError`] if the text cannot be drawn.
///
/// # Panics
/// If the window reaches outside the map.
pub fn class_picture(
    map: ResultMap,
    values: &Grid<u8>,
    (window, millimetres): (&Window, Option<Millimetres>),
) -> Result<RgbImage, ReportError> {
    let (title, classes) = (map.row().title, map.row().classes());
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
        scales: zoom.scales(window, panel.pixels.dimensions(), millimetres),
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
    use crate::results::USED_CLASSES;

    #[test]
    fn each_class_has_its_colour_and_the_legend_its_share() {
        let values =
            Grid::from_values(40, 80, (0..3200).map(|index| if index % 80 < 20 { 255 } else { 0 }).collect())
                .unwrap();
        let [used, .., none] = USED_CLASSES;
        let picture = class_picture(ResultMap::Used, &values, (&Window::whole(40, 80), None)).unwrap();
        let count = |colour: [u8; 3]| picture.pixels().filter(|pixel| pixel.0 == colour).count();
        // 80 px become 800: squares of 10 x 10, and the samples of the legend.
        let samples = 15 * 15;
        assert!((80_000..80_000 + samples).contains(&count(used.colour)), "{}", count(used.colour));
        assert!((240_000..240_000 + samples).contains(&count(none.colour)), "{}", count(none.colour));
    }
}
