//! Comma-separated values: one line for each row of the map, `nan` for unknown.

use super::codec::Codec;
use epirig_core::grid::Grid;

pub(super) const CODEC: Codec = Codec {
    name: "CSV",
    extensions: &["csv"],
    encode: |map, _| Ok(encode(map)),
    holds_facts: false,
    lengths_only: false,
    decode: None,
};

fn encode(map: &Grid<f32>) -> Vec<u8> {
    let mut text = String::new();
    for y in 0..map.rows() {
        for (x, value) in map.row(y).iter().enumerate() {
            if x > 0 {
                text.push(',');
            }
            text.push_str(&if value.is_nan() { "nan".to_owned() } else { value.to_string() });
        }
        text.push('\n');
    }
    text.into_bytes()
}
