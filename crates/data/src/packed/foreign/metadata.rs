//! The record of an array: `zarr.json` of version 3, or `.zarray` of version 2.

use std::path::Path;

use serde_json::Value;

use super::codecs::{Codec, Sharding};
use crate::storage::read_text;

/// Records of arrays and groups, by the versions of the specification.
pub(super) const RECORDS: [&str; 3] = ["zarr.json", ".zarray", ".zgroup"];
/// More than any record of an array has.
const LARGEST_RECORD: u64 = 1 << 20;
/// More samples than a frame or a chunk may have.
pub(super) const MOST_SAMPLES: usize = 1 << 30;
/// More dimensions than an array of frames has.
const MOST_DIMENSIONS: usize = 8;

/// Why an array is not read.
pub(super) enum Unread {
    /// Its samples are of another kind.
    Kind(String),
    /// Its record is not understood.
    Record(String),
}

/// What is needed to read an array.
#[derive(Debug)]
pub(super) struct ArrayMetadata {
    pub(super) shape: Vec<usize>,
    /// Shape of a chunk, which is a file; of a shard, if it has chunks in it.
    pub(super) chunk: Vec<usize>,
    /// 1 or 2.
    pub(super) sample_bytes: usize,
    /// The samples of a chunk that is not there.
    pub(super) fill: u16,
    /// In the order in which they packed.
    pub(super) codecs: Vec<Codec>,
    prefix: &'static str,
    separator: char,
}

/// The record of the array `folder`; `None` if it is none.
pub(super) fn array_record(folder: &Path) -> Option<Value> {
    let read = |name: &str| -> Option<Value> {
        serde_json::from_str(&read_text(&folder.join(name), LARGEST_RECORD).ok()?).ok()
    };
    read(RECORDS[0]).filter(|record| record["node_type"] == "array").or_else(|| read(RECORDS[1]))
}

impl ArrayMetadata {
    /// The meaning of a record.
    pub(super) fn read(record: &Value) -> Result<Self, Unread> {
        let found = match record["zarr_format"].as_u64() {
            Some(3) => Self::third(record)?,
            Some(2) => Self::second(record)?,
            other => return Err(Unread::Record(format!("its version is {other:?}, not 2 or 3"))),
        };
        let samples = found.chunk.iter().try_fold(1_usize, |product, &count| product.checked_mul(count));
        let is_sound = found.shape.len() == found.chunk.len()
            && found.shape.len() <= MOST_DIMENSIONS
            && !found.chunk.contains(&0)
            && samples.is_some_and(|samples| samples <= MOST_SAMPLES);
        match is_sound {
            true => Ok(found),
            false => Err(Unread::Record(format!("a chunk has the shape {:?}", found.chunk))),
        }
    }

    fn third(record: &Value) -> Result<Self, Unread> {
        let sample_bytes = match &record["data_type"] {
            Value::String(name) if name == "uint8" => 1,
            Value::String(name) if name == "uint16" => 2,
            other => return Err(Unread::Kind(format!("samples of the kind {}", word(other)))),
        };
        let grid = &record["chunk_grid"];
        if grid["name"] != "regular" {
            return Err(Unread::Record(format!("its chunks are {}", word(&grid["name"]))));
        }
        let keys = &record["chunk_key_encoding"];
        let separator = keys["configuration"]["separator"].as_str().and_then(|text| text.chars().next());
        let (prefix, usual) = match keys["name"].as_str() {
            Some("default") => ("c", '/'),
            Some("v2") => ("", '.'),
            other => return Err(Unread::Record(format!("its chunks are named by {other:?}"))),
        };
        Ok(Self {
            shape: counts(&record["shape"])?,
            chunk: counts(&grid["configuration"]["chunk_shape"])?,
            sample_bytes,
            fill: fill(&record["fill_value"])?,
            codecs: codecs(&record["codecs"])?,
            prefix,
            separator: separator.unwrap_or(usual),
        })
    }

    fn second(record: &Value) -> Result<Self, Unread> {
        let (sample_bytes, big) = match record["dtype"].as_str() {
            Some("|u1" | "<u1" | ">u1") => (1, false),
            Some("<u2") => (2, false),
            Some(">u2") => (2, true),
            _ => return Err(Unread::Kind(format!("samples of the kind {}", word(&record["dtype"])))),
        };
        let unknown = |what: &Value| Unread::Record(format!("its chunks are packed by {}", word(what)));
        if record["filters"].as_array().is_some_and(|filters| !filters.is_empty()) {
            return Err(unknown(&record["filters"]));
        }
        let shape = counts(&record["shape"])?;
        let mut found = Vec::new();
        if record["order"] == "F" {
            found.push(Codec::Transpose((0..shape.len()).rev().collect()));
        }
        found.push(Codec::Bytes { big });
        if !record["compressor"].is_null() {
            let id = &record["compressor"]["id"];
            found.push(id.as_str().and_then(compressor).ok_or_else(|| unknown(id))?);
        }
        Ok(Self {
            shape,
            chunk: counts(&record["chunks"])?,
            sample_bytes,
            fill: fill(&record["fill_value"])?,
            codecs: found,
            prefix: "",
            separator: record["dimension_separator"]
                .as_str()
                .and_then(|text| text.chars().next())
                .unwrap_or('.'),
        })
    }

    /// The name of a chunk's file in the folder of the array.
    pub(super) fn chunk_name(&self, index: &[usize]) -> String {
        let numbers = index.iter().map(usize::to_string);
        let parts: Vec<String> = Some(self.prefix.to_owned())
            .filter(|prefix| !prefix.is_empty())
            .into_iter()
            .chain(numbers)
            .collect();
        parts.join(&self.separator.to_string())
    }
}

fn word(value: &Value) -> String {
    value.as_str().map_or_else(|| value.to_string(), str::to_owned)
}

fn counts(value: &Value) -> Result<Vec<usize>, Unread> {
    let numbers = value.as_array().map(|all| {
        all.iter().map(|count| count.as_u64().and_then(|count| usize::try_from(count).ok())).collect()
    });
    numbers.flatten().ok_or_else(|| Unread::Record(format!("{value} is no shape")))
}

fn fill(value: &Value) -> Result<u16, Unread> {
    match value {
        Value::Null => Ok(0),
        value => value
            .as_u64()
            .and_then(|fill| u16::try_from(fill).ok())
            .ok_or_else(|| Unread::Record(format!("its fill value is {value}"))),
    }
}

fn compressor(name: &str) -> Option<Codec> {
    match name {
        "gzip" => Some(Codec::Gzip),
        "zlib" => Some(Codec::Zlib),
        "zstd" => Some(Codec::Zstd),
        "crc32c" => Some(Codec::Crc32c),
        _ => None,
    }
}

/// The codecs of version 3.
fn codecs(value: &Value) -> Result<Vec<Codec>, Unread> {
    let all = value.as_array().ok_or_else(|| Unread::Record(format!("{value} are no codecs")))?;
    all.iter().map(codec).collect()
}

fn codec(value: &Value) -> Result<Codec, Unread> {
    let (name, configuration) = (value["name"].as_str().unwrap_or_default(), &value["configuration"]);
    Ok(match name {
        "bytes" => Codec::Bytes { big: configuration["endian"] == "big" },
        "transpose" => Codec::Transpose(counts(&configuration["order"])?),
        "sharding_indexed" => Codec::Sharding(Box::new(Sharding {
            chunk: counts(&configuration["chunk_shape"])?,
            codecs: codecs(&configuration["codecs"])?,
            index_codecs: codecs(&configuration["index_codecs"])?,
            index_first: configuration["index_location"] == "start",
        })),
        other => compressor(other)
            .ok_or_else(|| Unread::Record(format!("its chunks are packed by {}", word(&value["name"]))))?,
    })
}
