//! Any `calibration.json`: what is read and contradicts nothing can be applied.
#![no_main]

use std::path::PathBuf;
use std::sync::LazyLock;

use epirig::calibrate::read_calibration_file;
use epirig_calibration::photometry::Maps;
use epirig_calibration::rectification::Rectifier;
use libfuzzer_sys::fuzz_target;

static FILE: LazyLock<PathBuf> = LazyLock::new(|| {
    let place = tempfile::tempdir_in("/dev/shm").or_else(|_| tempfile::tempdir());
    place.expect("a folder can be made").keep().join("calibration.json")
});

/// Larger frames are sound, but slow to fuzz.
const LARGEST: usize = 200;

fuzz_target!(|bytes: &[u8]| {
    std::fs::write(&*FILE, bytes).expect("it can be written");
    let Ok(calibration) = read_calibration_file(&FILE) else { return };
    let (rows, columns) = (calibration.mapping.raw_rows, calibration.mapping.raw_columns);
    let frames = calibration.positions.tau.len();
    let _ = calibration.hash();
    if calibration.contradiction(frames, rows, columns).is_some() || rows.max(columns) > LARGEST {
        return;
    }
    let maps = Maps { dark: None, flat_field: None };
    if let Ok(correction) = calibration.photometry.correction(&maps) {
        let _ = Rectifier::new(calibration.mapping, correction);
    }
});
