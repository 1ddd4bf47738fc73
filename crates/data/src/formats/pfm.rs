//! Portable float map: `Pf`, width and height, a scale whose sign tells the byte order, then rows from the
//! bottom up.

use super::codec::Codec;
use super::error::{FormatError, malformed};
use epirig_core::grid::{Grid, area};

pub(super) const CODEC: Codec = Codec {
    name: "PFM",
    extensions: &["pfm"],
    encode: |map, _| Ok(encode(map)),
    holds_facts: false,
    lengths_only: false,
    decode: Some(decode),
};

fn encode(map: &Grid<f32>) -> Vec<u8> {
    let mut bytes = format!("Pf\n{} {}\n-1.0\n", map.columns(), map.rows()).into_bytes();
    for y in (0..map.rows()).rev() {
        for &value in map.row(y) {
            let value = if value.is_nan() { f32::INFINITY } else { value };
            bytes.extend(value.to_le_bytes());
        }
    }
    bytes
}

fn decode(bytes: &[u8]) -> Result<Grid<f32>, FormatError> {
    let bad = |reason: &str| malformed("PFM", reason);
    let mut rest = bytes;
    let mut token = || {
        let start = rest
            .iter()
            .position(|byte| !byte.is_ascii_whitespace())
            .ok_or_else(|| bad("the header is cut short"))?;
        let length = rest[start..]
            .iter()
            .position(u8::is_ascii_whitespace)
            .ok_or_else(|| bad("the header is cut short"))?;
        let token =
            std::str::from_utf8(&rest[start..start + length]).map_err(|_| bad("the header is no text"))?;
        rest = &rest[start + length + 1..];
        Ok::<_, FormatError>(token)
    };
    if token()? != "Pf" {
        return Err(bad("it does not begin with Pf, the mark of one grey channel"));
    }
    let size = |text: &str| text.parse::<usize>().map_err(|_| bad("the size is no number"));
    let (columns, rows) = (size(token()?)?, size(token()?)?);
    let scale: f64 = token()?.parse().map_err(|_| bad("the scale is no number"))?;
    if scale == 0.0 || !scale.is_finite() {
        return Err(bad("its scale, whose sign tells the order of bytes, is 0 or not finite"));
    }
    let count = area(rows, columns).filter(|count| 4 * count == rest.len());
    if count.is_none() {
        return Err(bad("the number of samples is not the size in the header"));
    }
    let value = |sample: &[u8]| {
        let sample: [u8; 4] = sample.try_into().unwrap_or_default();
        let value = if scale < 0.0 { f32::from_le_bytes(sample) } else { f32::from_be_bytes(sample) };
        if value.is_infinite() { f32::NAN } else { value }
    };
    let values =
        rest.chunks_exact(4 * columns).rev().flat_map(|row| row.chunks_exact(4).map(value)).collect();
    Grid::from_values(rows, columns, values)
        .ok_or_else(|| bad("the number of samples is not the size in the header"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_that_cannot_be_are_refused() {
        for head in
            ["Pf\n4611686018427387904 0\n-1.0\n", "Pf\n0 4611686018427387904\n-1.0\n", "Pf\n0 0\n-1.0\n"]
        {
            assert!(decode(head.as_bytes()).is_err(), "{head}");
        }
        let too_wide = format!("Pf\n{} 4\n-1.0\n", 1_u64 << 62);
        assert!(decode(too_wide.as_bytes()).is_err());
    }
}
