//! What we write is read by other programs: NumPy, OpenCV and Pillow see the same numbers in all formats.

#![allow(clippy::unwrap_used, reason = "a test stops at the first thing that does not work")]

mod support;

use std::process::Command;

use support::{images, succeeds};

const SCRIPT: &str = r#"
import sys, numpy, cv2
from PIL import Image
results = sys.argv[1]
npy = numpy.load(results + "/disparity.npy")
pfm = cv2.imread(results + "/disparity.pfm", cv2.IMREAD_UNCHANGED)
tiff = cv2.imread(results + "/disparity.tiff", cv2.IMREAD_UNCHANGED)
pillow = numpy.asarray(Image.open(results + "/disparity.tiff"))
assert npy.dtype == numpy.float32 and npy.shape == (24, 64), (npy.dtype, npy.shape)
known = numpy.isfinite(npy)
assert 0.5 < known.mean() < 1.0, known.mean()
for name, other in [("pfm", pfm), ("tiff", tiff), ("pillow", pillow)]:
    assert other.shape == npy.shape, (name, other.shape)
    assert (numpy.isfinite(other) == known).all(), name
    assert (other[known] == npy[known]).all(), name
assert numpy.isinf(pfm[~known]).all() and numpy.isnan(tiff[~known]).all()
mask = cv2.imread(results + "/mask.png", cv2.IMREAD_UNCHANGED)
assert ((mask == 255) == known).all()
assert abs(numpy.median(npy[known]) - 8.0) < 0.01
frame = cv2.imread(sys.argv[2], cv2.IMREAD_UNCHANGED)
assert frame.shape == (24, 64) and frame.dtype == numpy.uint8
"#;

#[test]
fn other_programs_read_the_same_numbers() {
    let python = Command::new("python3").args(["-c", "import numpy, cv2, PIL"]).output();
    if !python.is_ok_and(|output| output.status.success()) {
        assert!(
            std::env::var_os("EPIRIG_REQUIRE_PYTHON").is_none(),
            "python3 with numpy, cv2 and PIL is required"
        );
        eprintln!(
            "SKIPPED other_programs_read_the_same_numbers: python3 with numpy, cv2 and PIL is not there"
        );
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    images(&folder.path().join("photos"), 9);
    succeeds(folder.path(), &["import", "photos", "--out", "seq"]);
    succeeds(folder.path(), &["match", "seq"]);
    let output = Command::new("python3")
        .args(["-c", SCRIPT, "seq/results", "seq/frames/0003.png"])
        .current_dir(folder.path())
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}
