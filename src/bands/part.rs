//! The file of a part: the maps of one block of rows.
//!
//! Three pieces follow each other: the BLAKE3 of all that comes after it, as 64 hexadecimal digits, and a line feed;
//! the [head](Head) as one line of JSON; the maps, row by row, each pixel as four little-endian numbers of 32 bit
//! (disparity, sigma, cost, confidence) and the place of its [`Validity`] in [`Validity::ALL`] as a byte.

use std::ops::Range;

use serde::{Deserialize, Serialize};
use thiserror::Error;

use epirig_core::choice::Choice as _;
use epirig_core::grid::Grid;
use epirig_data::storage::{hash, parse_record};
use epirig_matcher::{DisparityMaps, Validity};

/// Bytes of a pixel.
const PIXEL: usize = 17;
/// Bytes of the hash with its line feed.
const HASH: usize = 65;

/// What a part is, and what the match of its block found besides the maps.
#[derive(Debug, Serialize, Deserialize)]
struct Head {
    /// Hash of the plan.
    plan: String,
    /// The rows of the picture.
    rows: Range<usize>,
    columns: usize,
    /// Seconds that the match of the block took.
    seconds: f64,
    found: DisparityMaps,
}

/// Why a part is not used.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum PartFault {
    /// There is none.
    #[error("not there")]
    Missing,
    /// It was cut, or changed.
    #[error("damaged")]
    Damaged,
    /// It is of another plan.
    #[error("of another plan")]
    OtherPlan,
    /// It is there and says that it found something else than was searched.
    #[error("of another match")]
    OtherMatch,
    /// It cannot be read.
    #[error("not to be read: {0}")]
    Unreadable(String),
}

/// The bytes of the part of a plan: `maps` of these rows, whose match took `seconds`.
pub(super) fn encode(plan: &str, rows: Range<usize>, maps: &DisparityMaps, seconds: f64) -> Vec<u8> {
    let pixels = rows.len() * maps.disparity.columns();
    let found = maps.without_pixels();
    let head = Head { plan: plan.to_owned(), rows, columns: maps.disparity.columns(), seconds, found };
    // Keys are words and values are finite numbers.
    let head = serde_json::to_string(&head).unwrap_or_default();
    let mut bytes = Vec::with_capacity(HASH + head.len() + 1 + pixels * PIXEL);
    bytes.resize(HASH, b'\n');
    bytes.extend(head.as_bytes());
    bytes.push(b'\n');
    let maps_of = [&maps.disparity, &maps.sigma, &maps.cost, &maps.confidence].map(Grid::values);
    for (pixel, &validity) in maps.validity.values().iter().enumerate() {
        maps_of.iter().for_each(|map| bytes.extend(map[pixel].to_le_bytes()));
        let place = Validity::ALL.iter().position(|&other| other == validity);
        bytes.push(place.unwrap_or_default() as u8);
    }
    let hash = hash(&bytes[HASH..]);
    bytes[..hash.len()].copy_from_slice(hash.as_bytes());
    bytes
}

/// The maps in the bytes of a part of this plan, which has these rows and `columns`; and the seconds that
/// they took.
pub(super) fn decode(
    bytes: &[u8],
    plan: &str,
    rows: &Range<usize>,
    columns: usize,
) -> Result<(DisparityMaps, f64), PartFault> {
    let (told, content) = bytes.split_at_checked(HASH).ok_or(PartFault::Damaged)?;
    if told != format!("{}\n", hash(content)).as_bytes() {
        return Err(PartFault::Damaged);
    }
    let end = content.iter().position(|&byte| byte == b'\n').ok_or(PartFault::Damaged)?;
    let head = std::str::from_utf8(&content[..end]).ok().and_then(|head| parse_record::<Head>(head).ok());
    let head = head.ok_or(PartFault::Damaged)?;
    let pixels = &content[end + 1..];
    if head.plan != plan || head.rows != *rows || head.columns != columns {
        return Err(PartFault::OtherPlan);
    }
    if Some(pixels.len()) != rows.len().checked_mul(columns).and_then(|count| count.checked_mul(PIXEL)) {
        return Err(PartFault::Damaged);
    }
    let mut maps = head.found;
    let map = |place: usize| {
        let value = |pixel: &[u8]| f32::from_le_bytes(std::array::from_fn(|byte| pixel[4 * place + byte]));
        Grid::from_values(rows.len(), columns, pixels.chunks_exact(PIXEL).map(value).collect())
    };
    let validity = |pixel: &[u8]| Validity::ALL.get(usize::from(pixel[PIXEL - 1])).copied();
    let validity: Option<Vec<Validity>> = pixels.chunks_exact(PIXEL).map(validity).collect();
    let validity = validity.and_then(|values| Grid::from_values(rows.len(), columns, values));
    let (Some(disparity), Some(sigma), Some(cost), Some(confidence), Some(validity)) =
        (map(0), map(1), map(2), map(3), validity)
    else {
        return Err(PartFault::Damaged);
    };
    (maps.disparity, maps.sigma, maps.cost, maps.confidence) = (disparity, sigma, cost, confidence);
    maps.validity = validity;
    Ok((maps, head.seconds))
}

#[cfg(test)]
mod tests {
    use super::*;
    use epirig_core::frame::{Frame, Samples};
    use epirig_core::tau::Tau;
    use epirig_core::volume::Volume;
    use epirig_matcher::{MatchOptions, Silent, match_volume};

    /// Maps of a match with answers, pixels without one, and numbers of all kinds in the head.
    fn maps() -> DisparityMaps {
        let mut volume = Volume::new(24, 64, 8, Tau::equidistant(9).unwrap());
        for t in 0..9 {
            let texture = |i: usize| {
                let (x, y) = ((i % 64 + t) as f64, (i / 64) as f64);
                (128.0 + 60.0 * (x * 1.9 + y).sin() + 40.0 * (x * 0.7 + 2.0 * y).sin()) as u8
            };
            let samples = Samples::U8((0..24 * 64).map(texture).collect());
            volume.insert(t, &Frame::new(24, 64, 8, samples).unwrap()).unwrap();
        }
        match_volume(&volume, &MatchOptions::default(), &Silent).unwrap()
    }

    fn bits(maps: &DisparityMaps) -> Vec<u32> {
        let all = [&maps.disparity, &maps.sigma, &maps.cost, &maps.confidence];
        all.iter().flat_map(|map| map.values().iter().map(|value| value.to_bits())).collect()
    }

    #[test]
    fn maps_come_back_to_the_last_bit() {
        let maps = maps();
        let (read, seconds) = decode(&encode("a", 8..32, &maps, 0.1), "a", &(8..32), 64).unwrap();
        assert_eq!(bits(&read), bits(&maps));
        assert_eq!((read.validity.values(), seconds), (maps.validity.values(), 0.1));
        assert_eq!(
            (read.range, read.range_found, read.ordering),
            (maps.range, maps.range_found, maps.ordering)
        );
        assert_eq!((read.locking, read.light, read.reference), (maps.locking, maps.light, maps.reference));
        assert!(read.light.is_some());
    }

    #[test]
    fn what_was_cut_or_changed_or_is_of_another_plan_is_not_used() {
        let bytes = encode("a", 8..32, &maps(), 0.1);
        for end in (0..bytes.len()).step_by(997).chain([64, 65, bytes.len() - 1]) {
            assert_eq!(decode(&bytes[..end], "a", &(8..32), 64), Err(PartFault::Damaged), "{end}");
        }
        for place in (0..bytes.len()).step_by(499) {
            let mut changed = bytes.clone();
            changed[place] ^= 4;
            assert_eq!(decode(&changed, "a", &(8..32), 64), Err(PartFault::Damaged), "{place}");
        }
        for (plan, rows, columns) in [("b", 8..32, 64), ("a", 0..24, 64), ("a", 8..32, 96)] {
            assert_eq!(decode(&bytes, plan, &rows, columns), Err(PartFault::OtherPlan));
        }
    }
}
