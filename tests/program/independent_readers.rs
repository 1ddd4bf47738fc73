//! What we write is read by other programs: NumPy, OpenCV, Pillow, plyfile and gsffile see the same numbers in all
//! formats.

use std::process::Command;

use crate::support::{images, succeeds};

const SCRIPT: &str = r#"
import sys, numpy, cv2, gsffile, plyfile
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
surface = results + "/surface"
rest = cv2.imread(surface + "/height_mm.tiff", cv2.IMREAD_UNCHANGED)
field, metadata = gsffile.read_gsf(surface + "/height.gsf")
assert field.shape == (24, 64) and metadata["XYUnits"] == metadata["ZUnits"] == "m", metadata
assert numpy.allclose(1000 * field, rest, rtol=1e-6, atol=0, equal_nan=True)
used = cv2.imread(surface + "/used.png", cv2.IMREAD_UNCHANGED)
assert (numpy.isfinite(field) == (used >= 160)).all() and ((used > 0) == known).all()
assert 0.3 < (used >= 160).mean() < 1.0
# A pixel is Z / f = 240 mm / 128 px wide.
assert abs(metadata["XReal"] / 64 - 1.875e-3) < 5e-6 and abs(metadata["YReal"] / 24 - 1.875e-3) < 5e-6, metadata
ply = plyfile.PlyData.read(surface + "/surface.ply")
assert len(ply["vertex"]) == known.sum() and {"x", "y", "z", "sigma"} == {p.name for p in ply["vertex"].properties}
height = cv2.imread(results + "/height_mm.tiff", cv2.IMREAD_UNCHANGED)
assert (ply["vertex"]["z"] == height[known]).all()
faces = numpy.stack(ply["face"]["vertex_indices"])
assert faces.shape[1] == 3 and faces.max() < known.sum()
corners = [numpy.stack([ply["vertex"][axis][faces[:, corner]] for axis in "xy"], 1) for corner in range(3)]
first, second = corners[1] - corners[0], corners[2] - corners[0]
# Seen from the camera, which is where z points, corners go round against the clock.
assert (first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0] > 0).all()
profile = numpy.genfromtxt(surface + "/profile.csv", delimiter=",", names=True)
assert profile.dtype.names == ("x_px", "y_px", "distance_mm", "height_mm", "sigma_mm") and len(profile) > 40
row, columns = int(profile["y_px"][0]), profile["x_px"].astype(int)
assert (profile["y_px"] == row).all() and columns[0] == numpy.nonzero(used >= 160)[1].min()
assert numpy.allclose(profile["height_mm"], rest[row, columns], rtol=1e-6, atol=0, equal_nan=True)
frame = cv2.imread(sys.argv[2], cv2.IMREAD_UNCHANGED)
assert frame.shape == (24, 64) and frame.dtype == numpy.uint8
"#;

#[test]
fn other_programs_read_the_same_numbers() {
    let python = Command::new("python3").args(["-c", "import numpy, cv2, PIL, gsffile, plyfile"]).output();
    if !python.is_ok_and(|output| output.status.success()) {
        assert!(
            std::env::var_os("EPIRIG_REQUIRE_PYTHON").is_none(),
            "python3 with numpy, cv2, PIL, gsffile and plyfile is required"
        );
        eprintln!(
            "SKIPPED other_programs_read_the_same_numbers: python3 with numpy, cv2, PIL, gsffile and plyfile is not there"
        );
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    images(&folder.path().join("photos"), 9);
    let scale = ["--step-mm", "1.875", "--focal-length-px", "128"];
    succeeds(folder.path(), &[&["import", "photos", "--out", "seq"], &scale[..]].concat());
    succeeds(folder.path(), &["match", "seq"]);
    succeeds(folder.path(), &["surface", "seq"]);
    let output = Command::new("python3")
        .args(["-c", SCRIPT, "seq/results", "seq/frames/0003.png"])
        .current_dir(folder.path())
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}
