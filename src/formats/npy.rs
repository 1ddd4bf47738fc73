//! NumPy's own format.

use npyz::{NpyFile, Order, WriterBuilder};

use super::{FormatError, malformed};
use crate::plane::Plane;

pub(super) fn encode(map: &Plane<f32>) -> Result<Vec<u8>, FormatError> {
    let bad = |error: std::io::Error| malformed("NPY", error);
    let mut bytes = Vec::new();
    let shape = [map.rows() as u64, map.columns() as u64];
    let options = npyz::WriteOptions::new().default_dtype().shape(&shape).writer(&mut bytes);
    let mut writer = options.begin_nd().map_err(bad)?;
    writer.extend(map.values().iter().copied()).map_err(bad)?;
    writer.finish().map_err(bad)?;
    Ok(bytes)
}

pub(super) fn decode(bytes: &[u8]) -> Result<Plane<f32>, FormatError> {
    let file = NpyFile::new(bytes).map_err(|error| malformed("NPY", error))?;
    let &[rows, columns] = file.shape() else {
        return Err(malformed("NPY", format!("its shape is {:?}, not (rows, columns)", file.shape())));
    };
    if file.order() != Order::C {
        return Err(malformed("NPY", "it is in Fortran order; save it with numpy.ascontiguousarray"));
    }
    // The shape is believed only as far as there are bytes for it.
    if rows.checked_mul(columns).is_none_or(|count| count > bytes.len() as u64) {
        return Err(malformed("NPY", "the number of samples is not the shape in the header"));
    }
    let wide = matches!(file.dtype().descr().as_str(), "'<f8'" | "'>f8'");
    let values: Vec<f32> = if wide {
        let values: Vec<f64> = file.into_vec().map_err(|error| malformed("NPY", error))?;
        values.into_iter().map(|value| value as f32).collect()
    } else {
        file.into_vec().map_err(|error| malformed("NPY", error))?
    };
    Plane::from_values(rows as usize, columns as usize, values)
        .ok_or_else(|| malformed("NPY", "the number of samples is not the shape in the header"))
}
