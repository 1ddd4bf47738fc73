//! `epirig match --mask`: what is white is matched as without a mask, and the rest is not asked for.

use std::fs;
use std::path::Path;

use crate::support::{fails, import_scan, succeeds};
use epirig_core::grid::Grid;
use epirig_simulator::{Simulator, SimulatorConfig};

const SIDE_PX: u32 = 200;
const FRAMES: usize = 31;

/// Writes images of a tile, and imports them as `seq`.
fn imported(folder: &Path) {
    let mut config = SimulatorConfig::tile(SIDE_PX as usize, FRAMES);
    config.sensor.read_noise_dn = 1.0;
    import_scan(folder, &Simulator::new(config).unwrap(), &[]);
}

/// A picture as large as the frames that is white where `inside` says.
fn mask(path: &Path, inside: impl Fn(u32, u32) -> bool) {
    let value = |x, y| image::Luma([if inside(x, y) { 255 } else { 0 }]);
    image::GrayImage::from_fn(SIDE_PX, SIDE_PX, value).save(path).unwrap();
}

fn map(path: &Path) -> Grid<f32> {
    epirig::results::read_map(path).unwrap()
}

fn json(text: &str) -> serde_json::Value {
    serde_json::from_str(text).unwrap()
}

#[test]
fn only_what_is_inside_the_mask_is_matched() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    imported(folder);
    // A slanted part of the tile, and beside it a corner of the background.
    let inside = |x: u32, y: u32| (70..110).contains(&y) && x >= 60 + y / 4 && x < 120 + y / 8;
    mask(&folder.join("part.png"), inside);
    let count = (0..SIDE_PX * SIDE_PX).filter(|index| inside(index % SIDE_PX, index / SIDE_PX)).count();
    let share = count as f64 / f64::from(SIDE_PX * SIDE_PX);
    for quick in [&[][..], &["--quick"]] {
        let matched = |out: &str, more: &[&str]| {
            let whole = ["match", "seq", "--out", out, "--json"];
            json(&succeeds(folder, &[&whole[..], quick, more].concat()))
        };
        let all = matched("all", &["--overwrite"]);
        let part = matched("part", &["--mask", "part.png", "--overwrite"]);
        assert_eq!((&all["mask"], &all["outside"]), (&serde_json::Value::Null, &0.0.into()));
        assert_eq!(part["mask"]["file"], "part.png");
        assert_eq!(part["mask"]["inside_px"], count);
        assert!((part["outside"].as_f64().unwrap() - (1.0 - share)).abs() < 1e-12, "{part}");
        // It is no failure: of the object, as much is answered as without the mask.
        let answered = |summary: &serde_json::Value| summary["object_answered"].as_f64().unwrap();
        assert!(answered(&part) >= 0.99 && answered(&all) >= 0.99, "{part} {all}");

        let (all, part) = (folder.join("all"), folder.join("part"));
        let (d, sigma, found) = (
            map(&all.join("disparity.tiff")),
            read_sigma(folder, "all", !quick.is_empty()),
            map(&part.join("disparity.tiff")),
        );
        let codes = image::open(part.join("mask.png")).unwrap().into_luma8();
        let (mut compared, mut apart) = (0, Vec::new());
        for (x, y, code) in codes.enumerate_pixels() {
            let place = (x as usize, y as usize);
            let value = found.at(place.0, place.1);
            if !inside(x, y) {
                assert!(code.0[0] == 200 && value.is_nan(), "({x}, {y}): {code:?}, {value}");
                continue;
            }
            assert_eq!(code.0[0] == 255, value.is_finite());
            assert_ne!(code.0[0], 200);
            assert_eq!(value.is_finite(), d.at(place.0, place.1).is_finite(), "({x}, {y})");
            if value.is_finite() {
                compared += 1;
                apart.push((value - d.at(place.0, place.1)).abs() / sigma.at(place.0, place.1));
            }
        }
        assert!(compared * 10 > count * 9, "{compared} of {count}");
        // Range, noise and pixel locking are estimated from other pixels. That may decide otherwise about which
        // window a few pixels take: then two answers differ by their noise, by less than 4.5 standard deviations
        // of a difference. The others are the same but for the rounding of sums.
        apart.sort_by(f32::total_cmp);
        assert!(apart[compared * 9 / 10] < 0.05, "{}", apart[compared * 9 / 10]);
        assert!(apart[compared - 1] < 4.5 * 2.0_f32.sqrt(), "{}", apart[compared - 1]);
    }
    // Other verbs go on from it: all that they use lies inside.
    let surface = ["surface", "seq", "--results", "part", "--trend", "plane", "--json"];
    assert!(json(&succeeds(folder, &surface))["field"]["used_px"].as_u64().unwrap() <= count as u64);
}

fn read_sigma(folder: &Path, results: &str, quick: bool) -> Grid<f32> {
    let out = format!("{results}-{}.pfm", if quick { "quick-sigma" } else { "sigma" });
    let export = ["export", "seq", "--results", results, "--map", "sigma", "--out", &out];
    succeeds(folder, &export);
    map(&folder.join(out))
}

#[test]
fn masks_that_cannot_be_used_are_refused_before_anything_is_matched() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    imported(folder);
    let refused = |name: &str, more: &[&str], code: i32, words: &[&str]| {
        fails(folder, &[&["match", "seq", "--mask", name], more].concat(), code, words);
        assert!(!folder.join("seq/results").exists());
    };
    image::GrayImage::new(200, 100).save(folder.join("small.png")).unwrap();
    refused("small.png", &[], 2, &["100 rows x 200 columns", "200 rows x 200 columns"]);
    mask(&folder.join("black.png"), |_, _| false);
    refused("black.png", &[], 2, &["black.png", "paint white"]);
    fs::write(folder.join("words.png"), "white").unwrap();
    refused("words.png", &[], 5, &["words.png", "white inside"]);
    mask(&folder.join("part.png"), |x, y| x < 100 && (50..120).contains(&y));
    refused("part.png", &["--figure-row", "20"], 2, &["row 20", "--figure-row"]);
    refused("part.png", &["--region", "150,0,199,199"], 2, &["no pixel of the region", "part.png"]);
}
