//! `epirig surface` from images to numbers: a bowed tile before a dark background, whose truth the simulator knows.

use std::fs;
use std::path::Path;

use crate::support::{fails, import_scan, succeeds};
use epirig_simulator::{Scene, Simulator, SimulatorConfig};

const SIDE_PX: usize = 200;
const FRAMES: usize = 31;
const DEPTH_MM: f64 = 1.0;
const BOW_MM: f64 = 0.8;

/// A tile of 93 x 93 px (1.62 mm each) with hollows of 17 px in its middle and at both sides, and sensor noise. They are 56 % of it: from 60 % on they are the ground that the
/// rest stands on.
pub(crate) fn tile() -> Simulator {
    let mut config = SimulatorConfig::tile(SIDE_PX, FRAMES);
    config.scene = Scene::Tile {
        distance_mm: 900.0,
        side_mm: 150.0,
        hollow_depth_mm: DEPTH_MM,
        hollow_width_mm: 28.0,
        pitch_mm: 60.0,
        wall_mm: 3.0,
        bow_mm: BOW_MM,
        bands: None,
    };
    config.sensor.read_noise_dn = 1.0;
    Simulator::new(config).unwrap()
}

/// Writes the tile's images, imports and matches them as `seq`.
fn matched(folder: &Path) {
    import_scan(folder, &tile(), &[]);
    succeeds(folder, &["match", "seq"]);
}

fn number(value: &serde_json::Value, path: &str) -> f64 {
    value.pointer(path).and_then(serde_json::Value::as_f64).unwrap_or_else(|| panic!("{path} in {value}"))
}

#[test]
fn a_tile_before_a_background_is_measured_and_its_region_can_be_chosen() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    matched(folder);

    let text = succeeds(folder, &["surface", "seq", "--json"]);
    let found: serde_json::Value = serde_json::from_str(&text).unwrap();
    let depth = number(&found, "/levels/depth/depth_mm");
    let half_width = number(&found, "/levels/depth/half_width_95_mm");
    // Twice the interval is missed once in ten thousand times.
    assert!((depth - DEPTH_MM).abs() < 2.0 * half_width, "{depth} +- {half_width}");
    assert!(half_width < 0.1 * DEPTH_MM, "{half_width}");
    assert_eq!(found["levels"]["parts"].as_array().unwrap().len(), 3);
    // The bow is stated for the field that was used, whose corners are nearly those of the tile: as much at the middle of two sides together.
    let halves = [0, 1].map(|axis| number(&found, &format!("/trend/half_extent_mm/{axis}")) / 75.0);
    let bow = number(&found, "/bow_mm");
    // A rim of 11 px is left out, of what may reach 6 px beyond the tile.
    let rim = f64::from(2 * 11) / 93.0;
    assert!(halves.iter().all(|half| (1.0 - rim..=1.0).contains(half)), "{halves:?}");
    let expected = halves.map(|half| half * half * BOW_MM).iter().sum::<f64>();
    assert!((bow - expected).abs() < 0.1 * BOW_MM, "{bow}, not {expected}");
    let field = |name: &str| found["field"][name].as_u64().unwrap();
    let parts = ["used_px", "uncertain_px", "apart_px", "rim_px", "outlier_px"].map(field);
    assert_eq!(parts.iter().sum::<u64>(), field("answered_px"));
    assert!(parts[0] > 5000 && parts[3] > 200, "{parts:?}");

    // What the mask says was used is what was used.
    let mask = image::open(folder.join("seq/results/surface/used.png")).unwrap().into_luma8();
    assert_eq!(mask.dimensions(), (200, 200));
    let values = |wanted: &[u8]| mask.pixels().filter(|pixel| wanted.contains(&pixel.0[0])).count() as u64;
    assert_eq!(values(&[160, 255]), field("used_px"));
    assert_eq!(values(&[80, 160, 255]), field("answered_px"));
    assert_eq!(values(&[255]), number(&found, "/trend/pixels") as u64);

    fails(folder, &["surface", "seq"], 2, &["--overwrite"]);
    fails(folder, &["surface", "seq", "--region", "0,0,200,100", "--overwrite"], 2, &["--region", "199,199"]);
    // The upper half of the tile, given by any two corners.
    let text = succeeds(folder, &["surface", "seq", "--region", "199,100,0,0", "--overwrite", "--json"]);
    let half: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert!((number(&half, "/levels/depth/depth_mm") - DEPTH_MM).abs() < 0.1 * DEPTH_MM);
    let mask = image::open(folder.join("seq/results/surface/used.png")).unwrap().into_luma8();
    let last = mask.enumerate_pixels().filter(|(.., pixel)| pixel.0[0] > 80).map(|(_, y, _)| y).max();
    assert_eq!(last, Some(100));
    let text = succeeds(folder, &["surface", "seq", "--overwrite"]);
    assert!(text.contains("field ") && text.contains("used.png") && text.contains("95 %"), "{text}");
}

/// A picture of `SIDE_PX` x `SIDE_PX` that is white where `inside` says.
fn mask(path: &Path, inside: impl Fn(u32, u32) -> bool) {
    let side = SIDE_PX as u32;
    let picture =
        image::GrayImage::from_fn(side, side, |x, y| image::Luma([if inside(x, y) { 255 } else { 0 }]));
    picture.save(path).unwrap();
}

#[test]
fn a_mask_chooses_the_pixels_of_surface_and_evaluate() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    matched(folder);
    // Left of a slanted line, and with --region only above row 100, too.
    let left = |x: u32, y: u32| x < 90 + y / 8;
    mask(&folder.join("left.png"), left);
    let surface = ["surface", "seq", "--trend", "plane", "--json", "--overwrite"];
    let with = |more: &[&str]| -> serde_json::Value {
        serde_json::from_str(&succeeds(folder, &[&surface[..], more].concat())).unwrap()
    };
    let used = || {
        let used = image::open(folder.join("seq/results/surface/used.png")).unwrap().into_luma8();
        let chosen = used.enumerate_pixels().filter(|(.., pixel)| pixel.0[0] > 80);
        chosen.map(|(x, y, _)| (x, y)).collect::<Vec<_>>()
    };
    let found = with(&["--mask", "left.png"]);
    assert!(!used().is_empty() && used().iter().all(|&(x, y)| left(x, y)));
    assert_eq!(found["field"]["mask"]["file"], "left.png");
    let inside = (0..40_000).filter(|index| left(index % 200, index / 200)).count();
    assert_eq!(number(&found, "/field/mask/inside_px") as usize, inside);
    let report = fs::read_to_string(folder.join("seq/results/surface/report.html")).unwrap();
    assert!(
        report.contains("left.png") && report.contains(found["field"]["mask"]["blake3"].as_str().unwrap())
    );
    let both = with(&["--mask", "left.png", "--region", "0,0,199,99"]);
    assert!(used().iter().all(|&(x, y)| left(x, y) && y < 100));
    assert!(number(&both, "/field/answered_px") < number(&found, "/field/answered_px"));

    // What is wrong with a mask, and what to do, is said; the results stay.
    let refused = |name: &str, code: i32, words: &[&str]| {
        let arguments = ["surface", "seq", "--overwrite", "--mask", name];
        fails(folder, &arguments, code, words);
        let truth = ["evaluate", "seq", "--truth", "truth.pfm", "--mask", name];
        fails(folder, &truth, code, words);
    };
    succeeds(folder, &["export", "seq", "--map", "disparity", "--out", "truth.pfm"]);
    image::GrayImage::new(200, 100).save(folder.join("small.png")).unwrap();
    refused("small.png", 2, &["100 rows x 200 columns", "200 rows x 200 columns", "scale"]);
    mask(&folder.join("black.png"), |_, _| false);
    refused("black.png", 2, &["black.png", "paint white"]);
    fs::write(folder.join("words.png"), "white").unwrap();
    refused("words.png", 5, &["words.png", "white inside"]);
    refused("none.png", 1, &["none.png"]);
    mask(&folder.join("corner.png"), |x, y| x + y < 9);
    let apart = ["surface", "seq", "--overwrite", "--mask", "corner.png", "--region", "100,100,150,150"];
    fails(folder, &apart, 2, &["no pixel of the region", "corner.png"]);
    assert!(folder.join("seq/results/surface/surface.json").exists());

    // The map is its own truth, except where it is spoiled: outside the mask.
    let mut truth =
        epirig_data::formats::MapFormat::Pfm.decode(&fs::read(folder.join("truth.pfm")).unwrap()).unwrap();
    let known = |inside: bool, map: &epirig_core::grid::Grid<f32>| {
        let places = (0..40_000_u32).zip(map.values());
        places.filter(|(index, v)| v.is_finite() && left(index % 200, index / 200) == inside).count()
    };
    let expected = known(true, &truth);
    assert!(expected > 1000 && known(false, &truth) > 1000);
    for (index, value) in truth.values_mut().iter_mut().enumerate() {
        *value += if left(index as u32 % 200, index as u32 / 200) { 0.0 } else { 5.0 };
    }
    let spoiled = epirig_data::formats::MapFormat::Pfm.encode(&truth).unwrap();
    fs::write(folder.join("truth.pfm"), spoiled).unwrap();
    let evaluate = ["evaluate", "seq", "--truth", "truth.pfm", "--json"];
    let errors = |more: &[&str]| -> serde_json::Value {
        serde_json::from_str(&succeeds(folder, &[&evaluate[..], more].concat())).unwrap()
    };
    let masked = errors(&["--mask", "left.png"]);
    assert_eq!(number(&masked, "/truth/all/pixels") as usize, expected);
    assert_eq!(number(&masked, "/truth/all/maximum_px"), 0.0);
    assert!(number(&errors(&[]), "/truth/all/maximum_px") > 4.9);
    assert_eq!(number(&errors(&["--region", "0,0,89,199"]), "/truth/all/maximum_px"), 0.0);
    fails(folder, &["evaluate", "seq", "--split-half", "--mask", "left.png"], 2, &["--split-half"]);
}
