//! `epirig compare` on simulated scans: the shift and the change are those of the simulator.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::support::{fails, succeeds, write_png};
use epirig_core::grid::Grid;
use epirig_data::formats::MapFormat;
use epirig_simulator::{Scene, Simulator, SimulatorConfig};

/// Takes, imports and matches a scan as `name`.
pub(crate) fn scanned(folder: &Path, name: &str, config: &SimulatorConfig, seed: u64) {
    let mut config = config.clone();
    config.sensor.read_noise_dn = 1.0;
    config.sensor.seed = seed;
    let simulator = Simulator::new(config).unwrap();
    let photos = folder.join(format!("{name}-photos"));
    fs::create_dir(&photos).unwrap();
    for (index, &position) in simulator.config().scan.positions_mm().iter().enumerate() {
        write_png(&photos.join(format!("{index:03}.png")), &simulator.expose(position, index as u32));
    }
    let focal_length = simulator.config().optics.focal_length_px.to_string();
    let step = simulator.config().scan.step_mm.to_string();
    let photos = format!("{name}-photos");
    let import = ["import", &photos, "--out", name, "--step-mm", &step, "--focal-length-px", &focal_length];
    succeeds(folder, &import);
    succeeds(folder, &["match", name, "--reference", "first"]);
}

/// A tile of 93 x 93 px with one hollow of 17 px in its middle.
pub(crate) fn tile(depth_mm: f64, shift_px: (f64, f64)) -> SimulatorConfig {
    let mut config = SimulatorConfig::tile(200, 31);
    config.scene = Scene::Tile {
        distance_mm: 900.0,
        side_mm: 150.0,
        hollow_depth_mm: depth_mm,
        hollow_width_mm: 28.0,
        pitch_mm: 100.0,
        wall_mm: 3.0,
        bow_mm: 0.3,
        bands: None,
    };
    // All that the camera sees moves with its principal point.
    config.optics.principal_point_x_px += shift_px.0;
    config.optics.principal_point_y_px += shift_px.1;
    config
}

fn json(text: &str) -> Value {
    serde_json::from_str(text).unwrap()
}

fn number(value: &Value, path: &str) -> f64 {
    value.pointer(path).and_then(Value::as_f64).unwrap_or_else(|| panic!("{path} in {value}"))
}

/// The median of a map in these columns and rows.
fn median(path: &Path, columns: std::ops::Range<usize>, rows: std::ops::Range<usize>) -> f64 {
    let map = MapFormat::Tiff.decode(&fs::read(path).unwrap()).unwrap();
    let mut values: Vec<f32> =
        map.cropped(columns, rows).values().iter().copied().filter(|value| value.is_finite()).collect();
    values.sort_by(f32::total_cmp);
    f64::from(values[values.len() / 2])
}

#[test]
fn a_hollow_that_grew_is_found_in_an_object_that_moved() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    scanned(folder, "before", &tile(1.0, (0.0, 0.0)), 1);
    scanned(folder, "after", &tile(2.2, (3.4, -2.3)), 2);
    let found = json(&succeeds(folder, &["compare", "before", "after", "--out", "change", "--json"]));
    // The second hollow lies 1.2 mm deeper, so it is seen 0.06 px off: 555 px * 75 mm * 1.2 mm / (900 mm)^2. It is a
    // fifth of the tile.
    let shift = [0, 1].map(|axis| number(&found, &format!("/motion/shift_px/{axis}")));
    assert!((shift[0] - 3.4).abs() < 0.02 && (shift[1] + 2.3).abs() < 0.02, "{found}");
    // The hollow lies around column 99.5 - 75 mm * 555.6 px / 900 mm = 53, and the tile in rows 53 to 146.
    let difference = folder.join("change/difference_mm.tiff");
    let hollow = median(&difference, 49..58, 70..130);
    let level = [median(&difference, 15..35, 70..130), median(&difference, 72..92, 70..130)];
    // Windows of up to 11 px leave six independent heights along the hollow at least.
    let tolerance_mm = 3.0 * number(&found, "/difference/median_sigma_mm") / 6.0_f64.sqrt();
    assert!(tolerance_mm < 0.2, "{tolerance_mm}");
    assert!((hollow + 1.2).abs() < tolerance_mm, "{hollow} +- {tolerance_mm}");
    assert!(level.iter().all(|level| level.abs() < tolerance_mm), "{level:?} +- {tolerance_mm}");
    let place = &found["places"][0];
    let centre = [0, 1].map(|axis| number(place, &format!("/centre_px/{axis}")));
    // The middle of a stripe of 93 rows is known less well along it: noise chooses the pixels that count.
    assert!((centre[0] - 53.0).abs() < 4.0 && (centre[1] - 99.5).abs() < 20.0, "{place}");
    // Beside its walls, windows see both levels.
    assert!(
        (-1.3..-0.9).contains(&number(place, "/mean_mm")) && number(place, "/volume_mm3") < 0.0,
        "{place}"
    );

    // Without --json the numbers are there in words, and every file is in the folder.
    fails(folder, &["compare", "before", "after", "--out", "change"], 2, &["--overwrite"]);
    let again =
        ["compare", "before/results", "after", "--out", "change", "--overwrite", "--trend", "constant"];
    let text = succeeds(folder, &again);
    for words in ["moved  ", "constant: offset", "within 2 sigma", "scale  ", "place(s)", "difference.png"] {
        assert!(text.contains(words), "{words}: {text}");
    }
    let names = crate::support::names(&folder.join("change"));
    let expected = [
        "compare.json",
        "difference.png",
        "difference_mm.tiff",
        "difference_sigma_mm.tiff",
        "places.csv",
        "significance.png",
    ];
    assert_eq!(names, expected);
    let export = |map: &str, out: &str| succeeds(folder, &["export", "change", "--map", map, "--out", out]);
    for (map, name) in [("difference", "difference_mm"), ("difference-sigma", "difference_sigma_mm")] {
        export(map, &format!("for-others/{name}.npy"));
        let exported = fs::read(folder.join(format!("for-others/{name}.npy"))).unwrap();
        let written = fs::read(folder.join(format!("change/{name}.tiff"))).unwrap();
        let exported = MapFormat::Npy.decode(&exported).unwrap();
        let written = MapFormat::Tiff.decode(&written).unwrap();
        let bits = |map: &Grid<f32>| map.values().iter().map(|value| value.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&exported), bits(&written));
    }
    export("difference", "for-others/difference.gsf");
    let other = ["export", "after", "--map", "difference", "--out", "other.npy"];
    fails(folder, &other, 2, &["compare.json", "epirig compare"]);
    let csv = fs::read_to_string(folder.join("change/places.csv")).unwrap();
    assert!(csv.starts_with("centre_x_px,") && csv.lines().count() > 1, "{csv}");

    // Left of the hollow nothing changed.
    image::GrayImage::from_fn(200, 200, |x, _| image::Luma([if x < 38 { 255 } else { 0 }]))
        .save(folder.join("left.png"))
        .unwrap();
    let left = ["compare", "before", "after", "--out", "left", "--mask", "left.png", "--json"];
    let left = json(&succeeds(folder, &[&left[..], &["--region", "12,60,199,140"]].concat()));
    assert!(number(&left, "/difference/pixels") <= 26.0 * 81.0);
    assert!(number(&left, "/difference/scatter_mm") < 1.2 * 0.5, "{left}");

    // What cannot be compared is refused with advice, and nothing is left.
    let compare = |second: &str, more: &[&str], code: i32, words: &[&str]| {
        fails(folder, &[&["compare", "before", second, "--out", "none"], more].concat(), code, words);
        assert!(!folder.join("none").exists());
    };
    compare("after", &["--region", "150,0,199,40"], 5, &["pixels have a height", "mask.png"]);
    let mut other = SimulatorConfig::textured_plane(200, 200, 9);
    other.texture.seed = 77;
    scanned(folder, "other", &other, 3);
    compare("other", &[], 5, &["cannot be registered", "Place the object"]);
    scanned(folder, "small", &SimulatorConfig::textured_plane(64, 48, 9), 4);
    compare("small", &[], 2, &["200 rows x 200 columns", "48 x 64", "same camera"]);
    succeeds(folder, &["import", "after-photos", "--out", "unscaled"]);
    succeeds(folder, &["match", "unscaled"]);
    compare("unscaled", &[], 2, &["no heights", "--focal-length-px"]);
    compare("nothing", &[], 2, &["nothing"]);
}

#[test]
fn a_scan_repeated_with_other_noise_differs_by_as_much_as_sigma_says() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let mut config = SimulatorConfig::textured_plane(160, 120, 31);
    scanned(folder, "first", &config, 5);
    scanned(folder, "second", &config, 6);
    config.optics.principal_point_x_px -= 1.6;
    config.optics.principal_point_y_px += 4.25;
    scanned(folder, "moved", &config, 7);
    for (second, expected) in [("second", [0.0, 0.0]), ("moved", [-1.6, 4.25])] {
        let arguments = ["compare", "first", second, "--out", &format!("to-{second}"), "--json"];
        let found = json(&succeeds(folder, &arguments));
        for (axis, expected) in expected.into_iter().enumerate() {
            let shift = number(&found, &format!("/motion/shift_px/{axis}"));
            // Interpolation errs by some 0.001 px, and noise of 1 DN by less in so many pixels.
            assert!((shift - expected).abs() < 0.01, "{found}");
        }
        let share = |name: &str| number(&found, &format!("/difference/{name}"));
        assert!(share("pixels") > 12_000.0, "{found}");
        // Windows of up to 11 px leave some 100 independent pixels: the shares scatter by 0.047 and 0.022. Three
        // times that is missed once in 400.
        assert!((share("within_1_sigma") - 0.68).abs() < 0.14, "{found}");
        assert!((share("within_2_sigma") - 0.95).abs() < 0.066, "{found}");
        assert!(share("median_mm").abs() < 0.5 * share("scatter_mm"), "{found}");
    }
}
