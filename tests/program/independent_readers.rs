//! What we write is read by other programs: NumPy, OpenCV, Pillow, plyfile, gsffile, surfalize and trimesh see the same
//! numbers in all formats.

use std::process::Command;

use crate::support::{images, succeeds};

const SCRIPT: &str = r#"
import sys, numpy, cv2, gsffile, plyfile, xml.etree.ElementTree, zipfile
from PIL import Image
results = sys.argv[1]
npy = numpy.load("new/disparity.npy")
pfm = cv2.imread("new/disparity.pfm", cv2.IMREAD_UNCHANGED)
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
field, metadata = gsffile.read_gsf("new/height.gsf")
assert field.shape == (24, 64) and metadata["XYUnits"] == metadata["ZUnits"] == "m", metadata
assert numpy.allclose(1000 * field, rest, rtol=1e-6, atol=0, equal_nan=True)
used = cv2.imread(surface + "/used.png", cv2.IMREAD_UNCHANGED)
assert (numpy.isfinite(field) == (used >= 160)).all() and ((used > 0) == known).all()
assert 0.3 < (used >= 160).mean() < 1.0
# A pixel is Z / f = 240 mm / 128 px wide.
assert abs(metadata["XReal"] / 64 - 1.875e-3) < 5e-6 and abs(metadata["YReal"] / 24 - 1.875e-3) < 5e-6, metadata
# 1.875 mm are 5.333 px per cm; 3 is cm.
for path in [results + "/height_mm.tiff", results + "/disparity.tiff", surface + "/height_mm.tiff"]:
    tags = Image.open(path).tag_v2
    assert tags[296] == 3 and all(abs(float(tags[tag]) - 10 / 1.875) < 0.02 for tag in (282, 283)), dict(tags)
with zipfile.ZipFile("new/height.x3p") as archive:
    root = xml.etree.ElementTree.fromstring(archive.read("main.xml"))
    heights = numpy.frombuffer(archive.read("bindata/data.bin"), "<f4").reshape(24, 64)
assert numpy.allclose(1000 * heights, rest, rtol=1e-6, atol=0, equal_nan=True)
assert abs(float(root.find("Record1/Axes/CX/Increment").text) - 1.875e-3) < 5e-6
assert root.find("Record2/Date").text > "2020"
region = numpy.isfinite(rest)
def vertices(path):
    ply = plyfile.PlyData.read(path)
    names = {p.name for p in ply["vertex"].properties}
    assert names == {"x", "y", "z", "sigma", "red", "green", "blue"}, names
    return ply
height = cv2.imread(results + "/height_mm.tiff", cv2.IMREAD_UNCHANGED)
exported = vertices("new/folder/as-measured.ply")
assert (exported["vertex"]["z"] == height[known]).all()
ply = vertices("new/surface.ply")
assert (ply["vertex"]["z"] == rest[region]).all()
# Viridis has the more green the higher a value is.
green = ply["vertex"]["green"][numpy.argsort(ply["vertex"]["z"])].astype(int)
assert (numpy.diff(green) >= 0).all() and green[-1] > green[0]
kept = vertices("new/used.ply")
assert (kept["vertex"]["z"] == height[region]).all() and (kept["vertex"]["x"] == ply["vertex"]["x"]).all()
faces = numpy.stack(ply["face"]["vertex_indices"])
assert faces.shape[1] == 3 and faces.max() < region.sum()
corners = [numpy.stack([ply["vertex"][axis][faces[:, corner]] for axis in "xy"], 1) for corner in range(3)]
first, second = corners[1] - corners[0], corners[2] - corners[0]
# Seen from the camera, which is where z points, corners go round against the clock.
assert (first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0] > 0).all()
import surfalize, trimesh
for path in ("new/height.sdf", "new/height.sur"):
    read = surfalize.Surface.load(path)
    assert read.data.shape == (24, 64) and (numpy.isfinite(read.data) == region).all(), path
    # In um. SUR counts in 32-bit whole numbers.
    assert numpy.allclose(read.data, 1000 * rest.astype(float), rtol=1e-6, atol=2e-6, equal_nan=True), path
    assert abs(read.step_x - 1875) < 5 and abs(read.step_y - 1875) < 5, (path, read.step_x)
for path in ("new/surface.stl", "new/surface.obj"):
    mesh = trimesh.load(path, process=False)
    assert len(mesh.faces) == len(faces), path
    # STL has three corners of its own for each triangle.
    same = mesh.vertices.astype("f4")[mesh.faces] == numpy.stack([ply["vertex"][axis] for axis in "xyz"], 1)[faces]
    assert same.all(), path
    assert (mesh.face_normals[:, 2] > 0).all(), path
profile = numpy.genfromtxt(surface + "/profile.csv", delimiter=",", names=True)
assert profile.dtype.names == ("x_px", "y_px", "distance_mm", "height_mm", "sigma_mm") and len(profile) > 40
row, columns = int(profile["y_px"][0]), profile["x_px"].astype(int)
assert (profile["y_px"] == row).all() and columns[0] == numpy.nonzero(used >= 160)[1].min()
assert numpy.allclose(profile["height_mm"], rest[row, columns], rtol=1e-6, atol=0, equal_nan=True)
picture = cv2.imread("new/picture.png", cv2.IMREAD_UNCHANGED)
assert picture.ndim == 3 and picture.shape[1] > 400
field, metadata = gsffile.read_gsf("new/disparity.gsf")
assert metadata["ZUnits"] == "px" and numpy.allclose(field, npy, equal_nan=True) and abs(metadata["XReal"] / 64 - 1.875e-3) < 5e-6
for name in ["sigma", "cost", "confidence"]:
    exported, kept = numpy.load("new/" + name + ".npy"), numpy.asarray(Image.open(results + "/" + name + ".tiff"))
    assert numpy.array_equal(exported, kept, equal_nan=True) and numpy.isfinite(exported).any(), name
assert (numpy.load("new/mask.npy") == mask).all() and cv2.imread("new/mask.png").shape[1] > 400
sigma = numpy.asarray(Image.open(results + "/height_sigma_mm.tiff"))
assert numpy.array_equal(numpy.load("new/height-sigma.npy"), sigma, equal_nan=True)
frame = cv2.imread(sys.argv[2], cv2.IMREAD_UNCHANGED)
assert frame.shape == (24, 64) and frame.dtype == numpy.uint8
"#;

#[test]
fn other_programs_read_the_same_numbers() {
    let python = Command::new("python3")
        .args(["-c", "import numpy, cv2, PIL, gsffile, plyfile, surfalize, trimesh"])
        .output();
    if !python.is_ok_and(|output| output.status.success()) {
        assert!(
            std::env::var_os("EPIRIG_REQUIRE_PYTHON").is_none(),
            "python3 with numpy, cv2, PIL, gsffile, plyfile, surfalize and trimesh is required"
        );
        eprintln!(
            "SKIPPED other_programs_read_the_same_numbers: python3 with numpy, cv2, PIL, gsffile, plyfile, surfalize and trimesh is not there"
        );
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    images(&folder.path().join("photos"), 9);
    let scale = ["--step-mm", "1.875", "--focal-length-px", "128"];
    succeeds(folder.path(), &[&["import", "photos", "--out", "seq"], &scale[..]].concat());
    // What leaves the image after the first frame has no answer.
    succeeds(folder.path(), &["match", "seq", "--reference", "first"]);
    succeeds(folder.path(), &["surface", "seq"]);
    for (map, out) in [
        ("height", "new/folder/as-measured.ply"),
        ("height-used", "new/used.ply"),
        ("height-without-form", "new/picture.png"),
        ("height-without-form", "new/surface.ply"),
        ("height-without-form", "new/height.gsf"),
        ("height-without-form", "new/height.x3p"),
        ("height-without-form", "new/height.sdf"),
        ("height-without-form", "new/height.sur"),
        ("height-without-form", "new/surface.stl"),
        ("height-without-form", "new/surface.obj"),
        ("height-sigma", "new/height-sigma.npy"),
        ("disparity", "new/disparity.gsf"),
        ("disparity", "new/disparity.npy"),
        ("disparity", "new/disparity.pfm"),
        ("sigma", "new/sigma.npy"),
        ("cost", "new/cost.npy"),
        ("confidence", "new/confidence.npy"),
        ("mask", "new/mask.npy"),
        ("mask", "new/mask.png"),
    ] {
        succeeds(folder.path(), &["export", "seq", "--map", map, "--out", out]);
    }
    let output = Command::new("python3")
        .args(["-c", SCRIPT, "seq/results", "seq/frames/0003.png"])
        .current_dir(folder.path())
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}
