//! What a packed volume looks like on disk: `zarr.json` of the group, with our record and OME-NGFF metadata, and the
//! array `0`.

use std::ops::Range;
use std::path::Path;

use serde::{Deserialize, Serialize};
use serde_json::json;

use super::PackedError;
use epirig_core::tau::Tau;
use epirig_core::volume::VolumeShape;

/// Rows of a chunk. A few rows are read without many others; most reads take many chunks, which lie side by side.
pub const CHUNK_ROWS: usize = 16;
/// Version of the record.
pub(super) const FORMAT_VERSION: u32 = 2;
/// The record of a group or array, by the Zarr specification.
pub(super) const METADATA: &str = "zarr.json";
/// The array of frames, as OME-NGFF calls the whole resolution.
pub(super) const ARRAY: &str = "0";

/// What a packed volume is made of, in the attributes of its group.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PackedRecord {
    /// Version of the format.
    pub format: u32,
    /// Name of the sequence that it was made of.
    pub sequence_uid: String,
    /// BLAKE3 over the frames of that sequence, in the order of the scan.
    pub frames_blake3: String,
    /// Hash of the calibration by which frames were rectified; `None` for frames as captured.
    pub calibration: Option<String>,
    /// Rows of a frame.
    pub rows: usize,
    /// Columns of a frame.
    pub columns: usize,
    /// Bits of the camera's samples.
    pub bit_depth: u8,
    /// Whether a sample of 16 bit is a fraction of a level: (full scale + 1) / 32768 DN.
    pub fine: bool,
    /// Positions of the frames on the baseline, 0 to 1.
    pub tau: Vec<f64>,
    /// Factor of the samples of each frame.
    pub frame_gains: Vec<f32>,
}

impl PackedRecord {
    /// The record of a volume of this shape.
    pub fn new(
        sequence_uid: String,
        frames_blake3: String,
        calibration: Option<String>,
        shape: &VolumeShape,
    ) -> Self {
        Self {
            format: FORMAT_VERSION,
            sequence_uid,
            frames_blake3,
            calibration,
            rows: shape.rows,
            columns: shape.columns,
            bit_depth: shape.bit_depth,
            fine: shape.fine,
            tau: shape.tau.values().to_vec(),
            frame_gains: shape.frame_gains.clone(),
        }
    }

    /// The shape of the volume.
    pub(super) fn shape(&self, folder: &Path) -> Result<VolumeShape, PackedError> {
        let Self { rows, columns, bit_depth, fine, .. } = *self;
        let (tau, frame_gains) = (Tau::from_positions(&self.tau)?, self.frame_gains.clone());
        let samples = rows.checked_mul(columns).and_then(|pixels| pixels.checked_mul(2 * tau.frames()));
        let is_sound = (1..=16).contains(&bit_depth)
            && frame_gains.len() == tau.frames()
            && rows > 0
            && samples.is_some_and(|samples| samples > 0);
        match is_sound {
            true => Ok(VolumeShape { rows, columns, bit_depth, fine, tau, frame_gains }),
            false => Err(PackedError::contradiction(folder, "its record contradicts itself")),
        }
    }
}

/// `zarr.json` of the group.
#[derive(Debug, Deserialize)]
pub(super) struct Group {
    pub(super) attributes: Attributes,
}

#[derive(Debug, Deserialize)]
pub(super) struct Attributes {
    pub(super) epirig: PackedRecord,
}

/// The text of `zarr.json` of the group.
pub(super) fn group_text(record: &PackedRecord) -> String {
    let axis = |name: &str, kind: &str| json!({ "name": name, "type": kind });
    // One resolution, in pixels: what a pixel is on the object depends on its distance.
    let multiscales = json!([{
        "axes": [axis("t", "time"), axis("y", "space"), axis("x", "space")],
        "datasets": [{ "path": ARRAY, "coordinateTransformations": [{ "type": "scale", "scale": [1.0, 1.0, 1.0] }] }],
    }]);
    let group = json!({
        "zarr_format": 3,
        "node_type": "group",
        "attributes": { "ome": { "version": "0.5", "multiscales": multiscales }, "epirig": record },
    });
    format!("{group:#}\n")
}

/// The text of `zarr.json` of the array.
pub(super) fn array_text(shape: &VolumeShape) -> String {
    let bytes = json!({ "name": "bytes", "configuration": { "endian": "little" } });
    let checked = json!([bytes, { "name": "crc32c" }]);
    let sharding = json!({
        "name": "sharding_indexed",
        "configuration": {
            "chunk_shape": [1, CHUNK_ROWS, shape.columns],
            "codecs": checked,
            "index_codecs": checked,
            "index_location": "end",
        },
    });
    let array = json!({
        "zarr_format": 3,
        "node_type": "array",
        "shape": [shape.tau.frames(), shape.rows, shape.columns],
        "data_type": if shape.stored_bit_depth() <= 8 { "uint8" } else { "uint16" },
        // A shard has whole chunks, so the last one may reach beyond the image.
        "chunk_grid": {
            "name": "regular",
            "configuration": { "chunk_shape": [1, shape.rows.next_multiple_of(CHUNK_ROWS), shape.columns] },
        },
        "chunk_key_encoding": { "name": "default", "configuration": { "separator": "/" } },
        "fill_value": 0,
        "codecs": [sharding],
        "dimension_names": ["t", "y", "x"],
    });
    format!("{array:#}\n")
}

/// Name of the file of frame `t` in the folder of the volume.
pub(super) fn shard_name(t: usize) -> String {
    format!("{ARRAY}/c/{t}/0/0")
}

/// Where the chunks of a shard lie, which all have one size: data and checksum.
#[derive(Debug, Clone, Copy)]
pub(super) struct Shard {
    pub(super) chunks: usize,
    /// Bytes of the data of a chunk.
    pub(super) data: usize,
}

/// Bytes of a checksum.
pub(super) const CHECKSUM: usize = 4;

impl Shard {
    pub(super) fn of(shape: &VolumeShape) -> Self {
        let sample = usize::from(shape.stored_bit_depth().div_ceil(8));
        Self { chunks: shape.rows.div_ceil(CHUNK_ROWS), data: CHUNK_ROWS * shape.columns * sample }
    }

    /// The bytes of a chunk in the file.
    pub(super) fn place(self, chunk: usize) -> Range<u64> {
        let size = (self.data + CHECKSUM) as u64;
        chunk as u64 * size..(chunk as u64 + 1) * size
    }

    /// The index at the end of the file: offset and length of each chunk, and its checksum.
    pub(super) fn index(self) -> Vec<u8> {
        let of_chunk = |chunk: usize| {
            let place = self.place(chunk);
            [place.start, place.end - place.start].into_iter().flat_map(u64::to_le_bytes)
        };
        let mut index: Vec<u8> = (0..self.chunks).flat_map(of_chunk).collect();
        index.extend(crc32c::crc32c(&index).to_le_bytes());
        index
    }
}
