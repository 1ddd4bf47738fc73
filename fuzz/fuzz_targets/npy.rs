//! Any bytes as a map in a NPY file.
#![no_main]

use epirig_data::formats::MapFormat;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    if let Ok(map) = MapFormat::Npy.decode(bytes) {
        assert_eq!(map.values().len(), map.rows() * map.columns());
        assert!(map.values().len() <= bytes.len());
        assert!(MapFormat::Npy.encode(&map).is_ok());
    }
});
