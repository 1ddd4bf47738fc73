//! Volumes on disk as Zarr arrays, of which rows are read without the rest.
//!
//! An image file must be decoded whole for a few of its rows. A packed volume has the frames as they are matched in
//! a Zarr array (version 3) of frames x rows x columns: a shard, which is a file, for each frame; in it a chunk for
//! each [`CHUNK_ROWS`] rows. So frames are written one by one, each once and whole, and a band of rows of all frames
//! is a ranged read from each file. Chunks carry a checksum (CRC-32C) and are not compressed: other software reads
//! them, and nothing is decoded.
//!
//! [`PackWriter`] writes one, [`PackedVolume`] reads it, [`ForeignArray`] reads the frames of arrays that other
//! software wrote.

mod error;
mod foreign;
mod layout;
mod read;
#[cfg(test)]
mod tests;
mod write;

pub use error::PackedError;
pub use foreign::{ForeignArray, is_zarr};
pub use layout::{CHUNK_ROWS, PackedRecord};
pub use read::PackedVolume;
pub use write::PackWriter;
