//! From the bytes of a chunk to its samples. Bytes are not trusted: no more room is taken than the samples need.

use std::io::Read;

use flate2::read::{GzDecoder, ZlibDecoder};
use ruzstd::decoding::StreamingDecoder;

/// A step of packing.
#[derive(Debug)]
pub(super) enum Codec {
    /// Dimensions in another order: that of the packed array.
    Transpose(Vec<usize>),
    /// Samples as bytes, with the high one first or last.
    Bytes {
        big: bool,
    },
    /// Chunks in a chunk, which is then called a shard.
    Sharding(Box<Sharding>),
    Gzip,
    Zlib,
    Zstd,
    /// A checksum behind the bytes.
    Crc32c,
}

/// How a shard holds its chunks.
#[derive(Debug)]
pub(super) struct Sharding {
    pub(super) chunk: Vec<usize>,
    pub(super) codecs: Vec<Codec>,
    /// Those of the index: place and length of each chunk.
    pub(super) index_codecs: Vec<Codec>,
    pub(super) index_first: bool,
}

/// What a chunk holds.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stored<'a> {
    pub(super) shape: &'a [usize],
    /// Bytes of a sample.
    pub(super) sample_bytes: usize,
    /// The sample where nothing is stored.
    pub(super) fill: u16,
}

impl Stored<'_> {
    fn bytes(self) -> usize {
        self.shape.iter().product::<usize>() * self.sample_bytes
    }

    /// Samples of the fill value, low byte first.
    pub(super) fn filled(self) -> Vec<u8> {
        self.fill.to_le_bytes()[..self.sample_bytes].repeat(self.bytes() / self.sample_bytes)
    }
}

/// Bytes of an entry of a shard's index.
const ENTRY: usize = 16;
/// An entry of a chunk that is not there.
const ABSENT: u64 = u64::MAX;
/// Bytes of a checksum.
const CHECKSUM: usize = 4;

/// The samples of a chunk, low byte first, in the order of `stored.shape`; or what is wrong with it.
pub(super) fn unpack(bytes: Vec<u8>, codecs: &[Codec], stored: Stored<'_>) -> Result<Vec<u8>, String> {
    let Some((last, before)) = codecs.split_last() else {
        return Err("it has no codec for bytes".to_owned());
    };
    // Packed chunks of a shard may be somewhat larger than their samples.
    let most = 2 * stored.bytes() + (1 << 16);
    match last {
        Codec::Gzip => unpack(read_all(GzDecoder::new(&*bytes), most)?, before, stored),
        Codec::Zlib => unpack(read_all(ZlibDecoder::new(&*bytes), most)?, before, stored),
        Codec::Zstd => {
            let decoder = StreamingDecoder::new(&*bytes).map_err(|error| error.to_string())?;
            unpack(read_all(decoder, most)?, before, stored)
        }
        Codec::Crc32c => unpack(checked(bytes)?, before, stored),
        Codec::Bytes { big } => {
            let (found, expected) = (bytes.len(), stored.bytes());
            if found != expected {
                return Err(format!("it has {found} bytes of samples, not {expected}"));
            }
            let mut bytes = bytes;
            if *big && stored.sample_bytes == 2 {
                bytes.chunks_exact_mut(2).for_each(|pair| pair.swap(0, 1));
            }
            transposed_back(bytes, before, stored)
        }
        Codec::Sharding(sharding) => {
            let samples = sharding.unpack(&bytes, stored)?;
            transposed_back(samples, before, stored)
        }
        Codec::Transpose(_) => Err("its codecs are in disorder".to_owned()),
    }
}

fn read_all(decoder: impl Read, most: usize) -> Result<Vec<u8>, String> {
    let mut bytes = Vec::new();
    decoder.take(most as u64 + 1).read_to_end(&mut bytes).map_err(|error| error.to_string())?;
    if bytes.len() > most { Err("it unpacks to more than its samples".to_owned()) } else { Ok(bytes) }
}

fn checked(mut bytes: Vec<u8>) -> Result<Vec<u8>, String> {
    let length = bytes.len().checked_sub(CHECKSUM).ok_or("it is cut")?;
    let checksum = bytes.split_off(length);
    if crc32c::crc32c(&bytes).to_le_bytes() == checksum[..] {
        Ok(bytes)
    } else {
        Err("its checksum is wrong".to_owned())
    }
}

/// Samples in the order before packing. Only one change of the order is known.
fn transposed_back(samples: Vec<u8>, before: &[Codec], stored: Stored<'_>) -> Result<Vec<u8>, String> {
    let order = match before {
        [] => return Ok(samples),
        [Codec::Transpose(order)] => order,
        _ => return Err("its codecs are in disorder".to_owned()),
    };
    let mut sorted = order.clone();
    sorted.sort_unstable();
    if !sorted.into_iter().eq(0..stored.shape.len()) {
        return Err(format!("{order:?} is no order of its dimensions"));
    }
    // Dimension i of the packed array is dimension order[i] of the chunk.
    let packed: Vec<usize> = order.iter().map(|&dimension| stored.shape[dimension]).collect();
    let strides = strides(stored.shape);
    let mut out = vec![0; samples.len()];
    for (number, sample) in samples.chunks_exact(stored.sample_bytes).enumerate() {
        let index = index_of(number, &packed);
        let to: usize = order.iter().zip(index).map(|(&dimension, place)| strides[dimension] * place).sum();
        out[to * stored.sample_bytes..(to + 1) * stored.sample_bytes].copy_from_slice(sample);
    }
    Ok(out)
}

/// Samples from one to the next along each dimension.
pub(super) fn strides(shape: &[usize]) -> Vec<usize> {
    (0..shape.len()).map(|dimension| shape[dimension + 1..].iter().product()).collect()
}

fn index_of(number: usize, shape: &[usize]) -> Vec<usize> {
    strides(shape).iter().zip(shape).map(|(stride, count)| number / stride % count).collect()
}

impl Sharding {
    /// The samples of a shard of `stored.shape`.
    fn unpack(&self, bytes: &[u8], stored: Stored<'_>) -> Result<Vec<u8>, String> {
        let fits = self.chunk.len() == stored.shape.len()
            && self.chunk.iter().zip(stored.shape).all(|(&inner, &outer)| inner > 0 && outer % inner == 0);
        if !fits {
            return Err(format!("chunks of {:?} do not fill a shard of {:?}", self.chunk, stored.shape));
        }
        let counts: Vec<usize> =
            stored.shape.iter().zip(&self.chunk).map(|(outer, inner)| outer / inner).collect();
        let index = self.index(bytes, counts.iter().product())?;
        let inner = Stored { shape: &self.chunk, ..stored };
        let (strides, sample) = (strides(stored.shape), stored.sample_bytes);
        let mut out = stored.filled();
        let row = self.chunk[self.chunk.len() - 1] * sample;
        for (number, [offset, length]) in index.into_iter().enumerate() {
            if (offset, length) == (ABSENT, ABSENT) {
                continue;
            }
            let end = offset.checked_add(length).filter(|&end| end <= bytes.len() as u64);
            let end = end.ok_or_else(|| format!("chunk {number} of its index lies beyond its end"))?;
            let chunk = unpack(bytes[offset as usize..end as usize].to_vec(), &self.codecs, inner)?;
            let first = index_of(number, &counts);
            // Row by row of the last dimension.
            for (line, from) in chunk.chunks_exact(row).enumerate() {
                let place = index_of(line * self.chunk[self.chunk.len() - 1], &self.chunk);
                let at = first.iter().zip(&self.chunk).zip(place).zip(&strides);
                let to: usize =
                    at.map(|(((first, size), place), stride)| (first * size + place) * stride).sum();
                out[to * sample..to * sample + row].copy_from_slice(from);
            }
        }
        Ok(out)
    }

    /// Place and length of each chunk.
    fn index(&self, bytes: &[u8], chunks: usize) -> Result<Vec<[u64; 2]>, String> {
        let (big, is_checked) = match self.index_codecs[..] {
            [Codec::Bytes { big }] => (big, false),
            [Codec::Bytes { big }, Codec::Crc32c] => (big, true),
            _ => return Err("its index is packed in an unknown way".to_owned()),
        };
        let size = ENTRY * chunks + if is_checked { CHECKSUM } else { 0 };
        let start = bytes.len().checked_sub(size).ok_or("it is cut")?;
        let place = if self.index_first { 0..size } else { start..bytes.len() };
        let index = bytes[place].to_vec();
        let index = if is_checked { checked(index)? } else { index };
        let number = |bytes: &[u8]| {
            let bytes = <[u8; 8]>::try_from(bytes).unwrap_or_default();
            if big { u64::from_be_bytes(bytes) } else { u64::from_le_bytes(bytes) }
        };
        Ok(index.chunks_exact(ENTRY).map(|entry| [number(&entry[..8]), number(&entry[8..])]).collect())
    }
}
