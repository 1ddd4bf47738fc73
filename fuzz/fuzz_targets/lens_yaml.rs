//! Any text as a lens of OpenCV or ROS; what is read comes back as it is written.
#![no_main]

use epirig_calibration::lens::opencv_yaml;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    if let Ok(found) = opencv_yaml::read_lens(text) {
        let (rows, columns) = (found.rows.unwrap_or(1), found.columns.unwrap_or(1));
        let again = opencv_yaml::read_lens(&opencv_yaml::write(rows, columns, &found.lens));
        assert_eq!(again.map(|again| again.lens), Ok(found.lens));
    }
});
