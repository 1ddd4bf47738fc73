//! NumPy's own format.

use npyz::{NpyFile, Order, WriterBuilder};

use super::codec::Codec;
use super::error::{FormatError, malformed};
use epirig_core::grid::{Grid, area};

pub(super) const CODEC: Codec = Codec {
    name: "NPY",
    extensions: &["npy"],
    encode: |map, _| encode(map),
    holds_facts: false,
    lengths_only: false,
    decode: Some(decode),
};

fn encode(map: &Grid<f32>) -> Result<Vec<u8>, FormatError> {
    let bad = |error: std::io::Error| malformed("NPY", error);
    let mut bytes = Vec::new();
    let shape = [map.rows() as u64, map.columns() as u64];
    let options = npyz::WriteOptions::new().default_dtype().shape(&shape).writer(&mut bytes);
    let mut writer = options.begin_nd().map_err(bad)?;
    writer.extend(map.values().iter().copied()).map_err(bad)?;
    writer.finish().map_err(bad)?;
    Ok(bytes)
}

fn decode(bytes: &[u8]) -> Result<Grid<f32>, FormatError> {
    check_header(bytes)?;
    let file = NpyFile::new(bytes).map_err(|error| malformed("NPY", error))?;
    let &[rows, columns] = file.shape() else {
        return Err(malformed("NPY", format!("its shape is {:?}, not (rows, columns)", file.shape())));
    };
    if file.order() != Order::C {
        return Err(malformed("NPY", "it is in Fortran order; save it with numpy.ascontiguousarray"));
    }
    // The shape counts only as far as there are bytes for it.
    let count = usize::try_from(rows).ok().zip(usize::try_from(columns).ok());
    let count = count.and_then(|(rows, columns)| area(rows, columns));
    if count.is_none_or(|count| count > bytes.len()) {
        return Err(malformed("NPY", "the number of samples is not the shape in the header"));
    }
    let wide = matches!(file.dtype().descr().as_str(), "'<f8'" | "'>f8'");
    let values: Vec<f32> = if wide {
        let values: Vec<f64> = file.into_vec().map_err(|error| malformed("NPY", error))?;
        values.into_iter().map(|value| value as f32).collect()
    } else {
        file.into_vec().map_err(|error| malformed("NPY", error))?
    };
    Grid::from_values(rows as usize, columns as usize, values)
        .ok_or_else(|| malformed("NPY", "the number of samples is not the shape in the header"))
}

/// Refuses headers that no map has, before they are read as the Python expression that they are: theirs is a
/// dictionary of three entries with a pair of decimal numbers in it, whose product fits 64 bits.
fn check_header(bytes: &[u8]) -> Result<(), FormatError> {
    const LONGEST: usize = 1024;
    const DEEPEST: usize = 2;
    // Numbers with so many digits in all have a product below 10^18, which is below 2^64.
    const MOST_DIGITS: usize = 18;
    let wrong = || malformed("NPY", "its header is not that of a map of rows x columns");
    // Magic, version, and the length of the header, in two bytes or, from version 2 on, in four.
    let (length, start) = match bytes {
        [_, _, _, _, _, _, 1, _, a, b, ..] => (usize::from(u16::from_le_bytes([*a, *b])), 10),
        [_, _, _, _, _, _, 2 | 3, _, a, b, c, d, ..] => {
            let length = u32::from_le_bytes([*a, *b, *c, *d]);
            (usize::try_from(length).map_err(|_| wrong())?, 12)
        }
        _ => return Err(wrong()),
    };
    let header = bytes[start..].get(..length).filter(|header| header.len() <= LONGEST).ok_or_else(wrong)?;
    let mut depth = 0_usize;
    for byte in header {
        match byte {
            b'(' | b'[' | b'{' => depth += 1,
            b')' | b']' | b'}' => depth = depth.saturating_sub(1),
            _ => {}
        }
        if depth > DEEPEST {
            return Err(wrong());
        }
    }
    let digits = header.iter().filter(|byte| byte.is_ascii_digit()).count();
    let decimal = header.windows(2).all(|pair| !(pair[0].is_ascii_digit() && pair[1].is_ascii_alphabetic()));
    if digits > MOST_DIGITS || !decimal {
        return Err(wrong());
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A file with this header and a sample or two.
    fn file(version: u8, header: &str) -> Vec<u8> {
        let mut bytes = b"\x93NUMPY".to_vec();
        bytes.extend([version, 0]);
        match version {
            1 => bytes.extend((header.len() as u16).to_le_bytes()),
            _ => bytes.extend((header.len() as u32).to_le_bytes()),
        }
        bytes.extend(header.bytes());
        bytes.extend([0; 8]);
        bytes
    }

    #[test]
    fn headers_of_other_things_are_refused_at_once() {
        let shape = |shape: &str| format!("{{'descr': '<f4', 'fortran_order': False, 'shape': {shape}, }}");
        for version in 1..=3 {
            assert!(decode(&file(version, &shape("(1, 2)"))).is_ok());
            assert!(decode(&file(version, &shape(&"(".repeat(40)))).is_err());
            assert!(decode(&file(version, &shape("(4611686018427387904, 0)"))).is_err());
            assert!(decode(&file(version, &shape("(4611686018427387904, 4)"))).is_err());
            assert!(decode(&file(version, &shape("(9545387870156487302, 3)"))).is_err());
            assert!(decode(&file(version, &shape("(0xffffffffffffffff, 0xff)"))).is_err());
            assert!(decode(&file(version, &shape("(99999, 99999, 99999, 99999)"))).is_err());
        }
        let mut long = file(2, &shape("(1, 2)"));
        long[8..12].fill(0xff);
        assert!(decode(&long).is_err());
    }
}
