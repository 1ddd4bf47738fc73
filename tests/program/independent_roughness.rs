//! X3P files are read, and roughness is computed, by another program: surfalize. It has the parameters of ISO
//! 25178-2 and the Gaussian filter (of SciPy), and shares no code with ours.

use std::fs;
use std::path::Path;
use std::process::Command;

use crate::support::{fails, images, succeeds};
use epirig_core::grid::Grid;
use epirig_data::formats::{MapFacts, MapFormat, Quantity};
use epirig_surface::{Filters, Roughness};

/// Reads an X3P, compares it with the same map as TIFF or NPY, and our parameters with those of surfalize.
/// surfalize has no filter for surfaces with holes. So it filters the heights with zeros in the holes, and the
/// pattern of the known pixels; the quotient is the normalised convolution.
const SCRIPT: &str = r#"
import json, sys, zipfile, hashlib, numpy
from surfalize import Surface
from surfalize.filter import GaussianFilter
x3p, told = sys.argv[1], json.load(open(sys.argv[2]))
surface = Surface.load(x3p)
# surfalize has um.
assert abs(surface.step_x / (1000 * told["pixel_mm"]) - 1) < 1e-9, (surface.step_x, told["pixel_mm"])
assert surface.step_y == surface.step_x
with zipfile.ZipFile(x3p) as archive:
    assert archive.testzip() is None
    assert hashlib.md5(archive.read("main.xml")).hexdigest() == archive.read("md5checksum.hex").split()[0].decode()
    assert hashlib.md5(archive.read("bindata/data.bin")).hexdigest() in archive.read("main.xml").decode()
npy = numpy.load(sys.argv[3])
assert surface.data.shape == npy.shape, surface.data.shape
known = numpy.isfinite(npy)
assert (numpy.isfinite(surface.data) == known).all() and not known.all() and known.any()
assert numpy.allclose(surface.data, 1000 * npy, rtol=1e-6, atol=0, equal_nan=True)

def smoothed(values, cutoff_mm):
    chosen = numpy.isfinite(values)
    low = GaussianFilter(1000 * cutoff_mm, "lowpass", endeffect_mode="constant")
    of = lambda data: low(Surface(data, surface.step_x, surface.step_y)).data
    with numpy.errstate(invalid="ignore", divide="ignore"):
        mean = of(numpy.where(chosen, values, 0.0)) / of(chosen.astype(float))
    return numpy.where(chosen, mean, numpy.nan)

for case in told["cases"]:
    values = surface.data
    if case["s_filter_mm"] is not None: values = smoothed(values, case["s_filter_mm"])
    if case["l_filter_mm"] is not None: values = values - smoothed(values, case["l_filter_mm"])
    # The parameters do not depend on where heights lie; surfalize wants a surface without holes.
    theirs = Surface(values[known].reshape(1, -1), surface.step_x, surface.step_y)
    ours = case["roughness"]
    pairs = [("Sa", 1000 * ours["sa_mm"], theirs.Sa()), ("Sq", 1000 * ours["sq_mm"], theirs.Sq()),
             ("Sz", 1000 * ours["sz_mm"], theirs.Sz()), ("Ssk", ours["ssk"], theirs.Ssk()), ("Sku", ours["sku"], theirs.Sku())]
    for name, one, other in pairs:
        print(case["s_filter_mm"], case["l_filter_mm"], name, one, other)
        # A skewness near 0 has no relative error.
        assert abs(one - other) <= 1e-3 * (max(abs(other), 0.1) if name == "Ssk" else abs(other)), (case, name, one, other)
"#;

/// Whether surfalize is there; tells of the skip if not.
fn there(test: &str) -> bool {
    let python = Command::new("python3").args(["-c", "import numpy, surfalize"]).output();
    let there = python.is_ok_and(|output| output.status.success());
    assert!(
        there || std::env::var_os("EPIRIG_REQUIRE_PYTHON").is_none(),
        "python3 with numpy and surfalize is required"
    );
    if !there {
        eprintln!("SKIPPED {test}: python3 with numpy and surfalize is not there");
    }
    there
}

fn compare(folder: &Path, files: [&str; 3]) {
    let output =
        Command::new("python3").args(["-c", SCRIPT]).args(files).current_dir(folder).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    println!("{}", String::from_utf8_lossy(&output.stdout));
}

fn case(filters: Filters, roughness: &Roughness) -> serde_json::Value {
    serde_json::json!({
        "s_filter_mm": filters.s_filter_mm, "l_filter_mm": filters.l_filter_mm, "roughness": roughness
    })
}

#[test]
fn surfalize_finds_the_same_roughness_of_a_surface_with_holes() {
    if !there("surfalize_finds_the_same_roughness_of_a_surface_with_holes") {
        return;
    }
    const PIXEL_MM: f64 = 0.05;
    // Waves of 40, 9 and 3.1 px, skewed by squaring one of them; holes of several sizes, one at the rim.
    let height = |x: f64, y: f64| {
        let wave = |length: f64, angle: f64| {
            (std::f64::consts::TAU * (x * angle.cos() + y * angle.sin()) / length).sin()
        };
        0.05 * wave(40.0, 0.3) + 0.02 * wave(9.0, 1.1).powi(2) + 0.01 * wave(3.1, 2.0) * wave(5.3, 0.7)
    };
    let hole = |x: usize, y: usize| {
        (x < 12 && y < 20)
            || ((x as i64 - 90).pow(2) + (y as i64 - 50).pow(2) < 150)
            || (x * 7 + y * 13).is_multiple_of(61)
    };
    let values = (0..100 * 140).map(|index| match (index % 140, index / 140) {
        (x, y) if hole(x, y) => f32::NAN,
        (x, y) => height(x as f64, y as f64) as f32,
    });
    let map = Grid::from_values(100, 140, values.collect()).unwrap();
    let sigma = Grid::filled(100, 140, 0.001);
    let cut_offs = [(None, None), (Some(0.2), None), (None, Some(0.8)), (Some(0.25), Some(2.0))];
    let cases: Vec<serde_json::Value> = cut_offs
        .into_iter()
        .map(|(s_filter_mm, l_filter_mm)| {
            let filters = Filters { s_filter_mm, l_filter_mm };
            case(filters, &filters.roughness(&map, &sigma, PIXEL_MM, |_, _| true).unwrap())
        })
        .collect();
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, bytes: Vec<u8>| fs::write(folder.path().join(name), bytes).unwrap();
    let title = "waves & <holes>".to_owned();
    let facts = MapFacts { quantity: Quantity::LengthMm, pixel_mm: Some(PIXEL_MM), title, taken: None };
    write("map.x3p", MapFormat::X3p.encode_with(&map, &facts).unwrap());
    write("map.npy", MapFormat::Npy.encode(&map).unwrap());
    let told = serde_json::json!({"pixel_mm": PIXEL_MM, "cases": cases});
    write("told.json", serde_json::to_vec(&told).unwrap());
    compare(folder.path(), ["map.x3p", "told.json", "map.npy"]);
}

#[test]
fn surfalize_reads_what_the_program_writes_and_finds_the_same_roughness() {
    if !there("surfalize_reads_what_the_program_writes_and_finds_the_same_roughness") {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    images(&path.join("photos"), 9);
    let scale = ["--step-mm", "1.875", "--focal-length-px", "128"];
    succeeds(path, &[&["import", "photos", "--out", "seq"], &scale[..]].concat());
    // What leaves the image after the first frame has no answer.
    succeeds(path, &["match", "seq", "--reference", "first"]);
    // A pixel is 240 mm / 128 px = 1.875 mm wide.
    for filters in [
        Filters::default(),
        Filters { s_filter_mm: Some(6.0), l_filter_mm: None },
        Filters { s_filter_mm: Some(6.0), l_filter_mm: Some(40.0) },
    ] {
        let mut arguments =
            vec!["surface".to_owned(), "seq".to_owned(), "--json".to_owned(), "--overwrite".to_owned()];
        let options = [("--s-filter-mm", filters.s_filter_mm), ("--l-filter-mm", filters.l_filter_mm)];
        for (name, cut_off_mm) in options {
            arguments.extend(cut_off_mm.iter().flat_map(|mm| [name.to_owned(), mm.to_string()]));
        }
        let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
        let found: serde_json::Value = serde_json::from_str(&succeeds(path, &arguments)).unwrap();
        let told = serde_json::json!({
            "pixel_mm": found["pixel_mm"],
            "cases": [{"s_filter_mm": filters.s_filter_mm, "l_filter_mm": filters.l_filter_mm, "roughness": found["roughness"]}],
        });
        fs::write(path.join("told.json"), serde_json::to_vec(&told).unwrap()).unwrap();
        for name in ["map.npy", "map.x3p"] {
            let _ = fs::remove_file(path.join(name));
            succeeds(path, &["export", "seq", "--map", "height-without-form", "--out", name]);
        }
        compare(path, ["map.x3p", "told.json", "map.npy"]);
        let _ = fs::remove_file(path.join("filtered.x3p"));
        let filtered = ["export", "seq", "--map", "height-filtered", "--out", "filtered.x3p"];
        match filters.any() {
            true => drop(succeeds(path, &filtered)),
            false => fails(path, &filtered, 2, &["--s-filter-mm"]),
        }
    }
}
