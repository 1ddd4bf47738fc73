//! A sequence as a small picture, to be told from others in a list.

use std::path::Path;

use image::RgbaImage;

use crate::pipeline::PipelineError;
use crate::report::{ValueRange, Window, height_colour};
use crate::results::{ResultFiles, ResultMap, ResultsError};
use epirig_core::grid::Grid;
use epirig_core::image::{reduced_frame, reduced_known};
use epirig_data::sequence::Sequence;

/// Largest side of the picture, in px: that of a row of a list, on a screen with two pixels for one.
const MOST_PX: usize = 128;

/// A small picture of the sequence in `folder`: its heights in colours, or else its disparities; what has no answer is
/// transparent. Without results it is the middle one of its frames in grey; `None` if it has no frames.
///
/// # Errors
/// [`PipelineError`] if a file cannot be read.
pub fn thumbnail(folder: &Path) -> Result<Option<RgbaImage>, PipelineError> {
    let sequence = Sequence::open(folder)?;
    if let Some((map, row)) = map_of(&sequence)? {
        // A small object fills the picture.
        let map = Window::around(&map).of(&map);
        let map = reduced_known(&map, step_of(map.rows(), map.columns()), 0.5);
        let range = ValueRange::of(&map, row.row().least_span);
        return Ok(Some(painted(&map, |value| height_colour(value, range))));
    }
    let frames = sequence.frames();
    let Some(middle) = frames.get(frames.len() / 2) else { return Ok(None) };
    let frame = sequence.read(middle)?;
    let small = reduced_frame(&frame, step_of(frame.rows(), frame.columns()));
    // A span of one grey level keeps the noise of a dark frame dark.
    let range = ValueRange::of(&small, f32::from(frame.full_scale()) / 256.0);
    let grey = |value: f32| {
        let share = ((value - range.low) / (range.high - range.low)).clamp(0.0, 1.0);
        [(share * 255.0).round() as u8; 3]
    };
    Ok(Some(painted(&small, grey)))
}

/// The map that tells most of what was measured; `None` if there are no results of this sequence.
fn map_of(sequence: &Sequence) -> Result<Option<(Grid<f32>, ResultMap)>, ResultsError> {
    let (files, matched) = match ResultFiles::open_match(&sequence.folder().join("results")) {
        Err(error) if error.is_missing() => return Ok(None),
        opened => opened?,
    };
    if matched.sequence_uid != sequence.record().uid {
        return Ok(None);
    }
    // A surface of other results is not that of these.
    let without_form = files.surface().ok().flatten();
    if let Some(map) =
        without_form.map(|surface| surface.map(ResultMap::HeightWithoutForm)).transpose()?.flatten()
    {
        return Ok(Some((map, ResultMap::HeightWithoutForm)));
    }
    for map in [ResultMap::Height, ResultMap::Disparity] {
        if let Some(found) = files.map(map)? {
            return Ok(Some((found, map)));
        }
    }
    Ok(None)
}

/// How many pixels become one along a side.
fn step_of(rows: usize, columns: usize) -> usize {
    rows.max(columns).div_ceil(MOST_PX).max(1)
}

fn painted(map: &Grid<f32>, colour: impl Fn(f32) -> [u8; 3]) -> RgbaImage {
    RgbaImage::from_fn(map.columns() as u32, map.rows() as u32, |x, y| {
        let value = map.at(x as usize, y as usize);
        let [red, green, blue] = colour(value);
        image::Rgba([red, green, blue, if value.is_nan() { 0 } else { 255 }])
    })
}
