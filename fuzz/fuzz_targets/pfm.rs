//! Any bytes as a map in a PFM file.
#![no_main]

use epirig_data::formats::MapFormat;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    if let Ok(map) = MapFormat::Pfm.decode(bytes) {
        assert_eq!(map.values().len(), map.rows() * map.columns());
        assert!(map.values().len() <= bytes.len());
        assert!(MapFormat::Pfm.encode(&map).is_ok());
    }
});
