//! What a packed volume looks like on disk: `zarr.json` of the group, with our record and OME-NGFF metadata, and the
//! array `0`.

use std::path::Path;
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use zarrs::array::codec::array_to_bytes::sharding::ShardingCodecBuilder;
use zarrs::array::codec::bytes_to_bytes::crc32c::Crc32cCodec;
use zarrs::array::{Array, ArrayBuilder, ChunkShape, DataType};

use super::PackedError;
use epirig_core::tau::Tau;
use epirig_core::volume::VolumeShape;

/// Rows of a chunk. With 64 of 1000 px a ranged read has 64 KB or more, as disks and networks like them.
pub const CHUNK_ROWS: usize = 64;
/// Version of the record.
pub(super) const FORMAT_VERSION: u32 = 1;
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
            bit_depth: shape.bit_depth,
            fine: shape.fine,
            tau: shape.tau.values().to_vec(),
            frame_gains: shape.frame_gains.clone(),
        }
    }

    /// The shape of the volume, whose frames have so many rows and columns.
    pub(super) fn shape(
        &self,
        rows: usize,
        columns: usize,
        folder: &Path,
    ) -> Result<VolumeShape, PackedError> {
        let tau = Tau::from_positions(&self.tau)?;
        let (bit_depth, frame_gains) = (self.bit_depth, self.frame_gains.clone());
        if !(1..=16).contains(&bit_depth) || frame_gains.len() != tau.frames() {
            return Err(PackedError::contradiction(folder, "its record contradicts itself"));
        }
        Ok(VolumeShape { rows, columns, bit_depth, fine: self.fine, tau, frame_gains })
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

/// The array of a volume of this shape in `store`. Nothing is written.
pub(super) fn array<S>(store: Arc<S>, shape: &VolumeShape, folder: &Path) -> Result<Array<S>, PackedError> {
    let fault = |reason: &dyn ToString| PackedError::contradiction(folder, reason.to_string());
    let (frames, rows, columns) = (shape.tau.frames() as u64, shape.rows as u64, shape.columns as u64);
    let chunk_rows = CHUNK_ROWS as u64;
    let chunk = ChunkShape::try_from([1, chunk_rows, columns].as_slice()).map_err(|error| fault(&error))?;
    let mut shards = ShardingCodecBuilder::new(chunk);
    shards.bytes_to_bytes_codecs(vec![Arc::new(Crc32cCodec::new())]);
    // A shard has whole chunks, so the last one may reach beyond the image.
    let shard = vec![1, rows.next_multiple_of(chunk_rows), columns];
    let (kind, zero): (DataType, Value) = match shape.stored_bit_depth() {
        ..=8 => (DataType::UInt8, json!(0)),
        _ => (DataType::UInt16, json!(0)),
    };
    let fill = zarrs::array::FillValueMetadataV3::from(zero.as_u64().unwrap_or(0));
    let mut array = ArrayBuilder::new(vec![frames, rows, columns], shard, kind, fill);
    array.array_to_bytes_codec(shards.build_arc()).dimension_names(["t", "y", "x"].into());
    array.build(store, &format!("/{ARRAY}")).map_err(|error| fault(&error))
}
