//! Photographs and their truth in a folder.

use std::fs;
use std::io::Cursor;
use std::path::Path;

use epirig_core::grid::Grid;
use image::codecs::jpeg::JpegEncoder;
use image::{ExtendedColorType, ImageBuffer, ImageFormat, Luma};
use rayon::prelude::*;
use serde_json::json;

use super::exif::{Orientation, segment};
use super::{Region, Series};

/// The JPEG image of an upright picture, stored as `orientation` says.
pub fn jpeg(
    upright: &Grid<u8>,
    quality: u8,
    orientation: Orientation,
    focal_length_px: Option<f64>,
) -> Vec<u8> {
    let stored = orientation.stored(upright);
    let (width, height) = (stored.columns() as u32, stored.rows() as u32);
    let mut bytes = Vec::new();
    let mut encoder = JpegEncoder::new_with_quality(&mut bytes, quality);
    encoder.encode(stored.values(), width, height, ExtendedColorType::L8).unwrap();
    // The tags come right after the mark of the start.
    bytes.splice(2..2, segment(orientation, focal_length_px));
    bytes
}

/// What is left of a picture that was stored as JPEG.
pub fn jpeg_decoded(upright: &Grid<u8>, quality: u8, orientation: Orientation) -> Grid<u8> {
    let bytes = jpeg(upright, quality, orientation, None);
    let stored = image::load_from_memory_with_format(&bytes, ImageFormat::Jpeg).unwrap().into_luma8();
    let (columns, rows) = (stored.width() as usize, stored.height() as usize);
    orientation.upright(&Grid::from_values(rows, columns, stored.into_raw()).unwrap())
}

impl Series {
    /// The name of a frame's file.
    pub fn file_name(&self, frame: usize) -> String {
        let number = if self.taken.renumbered { frame + 1 } else { self.motion.numbers[frame] };
        let extension = if self.taken.jpeg_quality.is_some() { "jpg" } else { "png" };
        format!("IMG_{number:04}.{extension}")
    }

    /// Writes the photographs into a folder, which is made.
    pub fn write_photographs(&self, folder: &Path) {
        fs::create_dir_all(folder).unwrap();
        let focal_length = self.taken.exif_focal_length.then_some(self.camera.focal_length_px);
        (0..self.count()).into_par_iter().for_each(|frame| {
            let path = folder.join(self.file_name(frame));
            let exposed = self.exposed(frame);
            match self.taken.jpeg_quality {
                Some(quality) => {
                    fs::write(path, jpeg(&exposed, quality, self.taken.orientation, focal_length)).unwrap();
                }
                None => write_png(&path, &exposed, |grey| grey),
            }
        });
    }

    /// Writes the truth into a folder, which is made: `truth.json`, see [`Self::truth_record`], and
    /// `parallax.npy`, see [`Self::parallax`], of the frame in the middle.
    pub fn write_truth(&self, folder: &Path) {
        fs::create_dir_all(folder).unwrap();
        let record = serde_json::to_string_pretty(&self.truth_record()).unwrap();
        fs::write(folder.join("truth.json"), record).unwrap();
        write_npy(&folder.join("parallax.npy"), &self.parallax(self.motion.middle()));
    }

    /// Writes the series that [`Self::straightened`] gives: its photographs to `photographs`, and its
    /// true disparity in the frame in the middle to `disparity.npy`.
    pub fn write_straightened(&self, folder: &Path) {
        let ideal = self.straightened();
        ideal.write_photographs(&folder.join("photographs"));
        let disparity = ideal.straight_disparity(ideal.motion.middle());
        write_npy(&folder.join("disparity.npy"), &disparity);
    }

    /// The truth about camera and motion. Rotations are in rad, lengths in mm unless a name says
    /// something else.
    pub fn truth_record(&self) -> serde_json::Value {
        let motion = &self.motion;
        let list = |values: &[nalgebra::Vector3<f64>]| -> Vec<[f64; 3]> {
            values.iter().map(|value| (*value).into()).collect()
        };
        let axes = motion.rail_axes();
        let row = |row: usize| [axes[(row, 0)], axes[(row, 1)], axes[(row, 2)]];
        json!({
            "rows": self.camera.rows,
            "columns": self.camera.columns,
            "focal_length_px": self.camera.focal_length_px,
            "centre_px": self.camera.centre(),
            "k1": self.camera.k1,
            "distance_mm": self.surface.distance_mm,
            "depth_mm": self.surface.depth_mm,
            "direction": <[f64; 3]>::from(motion.direction),
            "rail_axes": [row(0), row(1), row(2)],
            "files": (0..self.count()).map(|frame| self.file_name(frame)).collect::<Vec<_>>(),
            "numbers": motion.numbers,
            "positions_mm": motion.positions_mm,
            "rotations": list(&motion.rotations),
            "offsets_mm": list(&motion.offsets_mm),
            "gains": (0..self.count()).map(|frame| self.gain(frame)).collect::<Vec<_>>(),
            "middle_frame": motion.middle(),
            "taken": format!("{:?}", self.taken),
        })
    }

    /// Writes the photographs rectified with the true motion, in the order of their positions, as
    /// PNG with 256 levels for each grey value; `positions.csv`, in mean steps; `region.json`; and
    /// `disparity.npy`, the true one of the frame in the middle.
    pub fn write_rectified(&self, folder: &Path) {
        fs::create_dir_all(folder).unwrap();
        let region = self.region();
        let positions = &self.motion.positions_mm;
        let mut order: Vec<usize> = (0..self.count()).collect();
        order.sort_by(|a, b| positions[*a].total_cmp(&positions[*b]));
        order.par_iter().enumerate().for_each(|(place, &frame)| {
            let rectified = self.rectified_by_truth(frame, &self.frame(frame), &region);
            let path = folder.join(format!("{place:04}.png"));
            write_png(&path, &rectified, |grey| (256.0 * grey).round().clamp(0.0, 65535.0) as u16);
        });
        let (first, last) = (positions[order[0]], positions[order[order.len() - 1]]);
        let steps = (order.len() - 1) as f64;
        let place = |frame: &usize| format!("{}\n", (positions[*frame] - first) / (last - first) * steps);
        fs::write(folder.join("positions.csv"), order.iter().map(place).collect::<String>()).unwrap();
        let reference = self.motion.middle();
        let record = json!({
            "left": region.left,
            "top": region.top,
            "rows": region.rows,
            "columns": region.columns,
            "order": order,
            "reference_file": order.iter().position(|frame| *frame == reference),
        });
        fs::write(folder.join("region.json"), record.to_string()).unwrap();
        write_npy(&folder.join("disparity.npy"), &self.rectified_disparity(reference, &region));
    }

    /// The true disparity in a rectified frame, from the first photograph to the last.
    pub fn rectified_disparity(&self, frame: usize, region: &Region) -> Grid<f64> {
        let raw = |x, y| self.rectified_pixel(frame, region, x, y);
        let axis = self.motion.rail_axes().row(2).transpose();
        self.true_disparity(frame, (region.rows, region.columns), raw, &axis, self.camera.focal_length_px)
    }
}

/// Writes a picture as PNG, each value converted.
fn write_png<T, P>(path: &Path, picture: &Grid<T>, convert: impl FnMut(T) -> P)
where
    T: Copy,
    P: Copy + image::Primitive,
    Luma<P>: image::PixelWithColorType<Subpixel = P>,
    [P]: image::EncodableLayout,
{
    let (columns, rows) = (picture.columns() as u32, picture.rows() as u32);
    let values = picture.map(convert).values().to_vec();
    let image: ImageBuffer<Luma<P>, Vec<P>> = ImageBuffer::from_raw(columns, rows, values).unwrap();
    let mut bytes = Cursor::new(Vec::new());
    image.write_to(&mut bytes, ImageFormat::Png).unwrap();
    fs::write(path, bytes.into_inner()).unwrap();
}

/// Writes a NumPy file of 32-bit floats.
pub fn write_npy(path: &Path, values: &Grid<f64>) {
    /// Bytes before the values.
    const HEADER: usize = 128;
    let (rows, columns) = (values.rows(), values.columns());
    let shape = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': ({rows}, {columns}), }}");
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend(((HEADER - bytes.len() - 2) as u16).to_le_bytes());
    bytes.extend(shape.bytes());
    bytes.resize(HEADER - 1, b' ');
    bytes.push(b'\n');
    bytes.extend(values.values().iter().flat_map(|value| (*value as f32).to_le_bytes()));
    fs::write(path, bytes).unwrap();
}
