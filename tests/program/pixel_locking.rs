//! Pixel locking: where frames lie at nearly repeating fractions of a pixel, the bias that interpolation and aliasing make is predicted, and the program says so.
//!
//! Frames and truth come from closed formulas (`support/painted`), so what is predicted is held against errors that nothing here computed.

use epirig::results::MatchSummary;
use epirig_core::progress::Silent;
use epirig_matcher::{MatchOptions, PixelLocking, ReferenceFrame, match_volume};

use crate::painted::{Aperture, Camera, Painting, Texture};
use crate::support::{epirig, write_png};

const FRAMES: usize = 40;

/// A plane whose disparity falls by `slope` px per px from `disparity_px` in the middle, behind a blur of `sigma_px`.
fn plane(disparity_px: f64, slope: f64, sigma_px: f64) -> Painting {
    let camera = Camera {
        rows: 64,
        columns: 260,
        frames: FRAMES,
        aperture: Aperture { sigma_px },
        noise_dn: 0.3,
        bit_depth: 8,
        seed: 3,
    };
    // Texture to 0.9 cycles per px: the sensor shows what is finer than half a cycle as something else.
    Painting::plane(
        camera,
        disparity_px,
        (-slope, 0.0),
        Texture::white(5, 400, (1.1, 20.0)).with_contrast(camera.aperture, 25.0),
    )
}

/// What is stated of a scene, and each answered pixel's true disparity and error.
fn matched(painting: &Painting) -> (PixelLocking, Vec<(f64, f64)>) {
    let options = MatchOptions { reference: ReferenceFrame::Middle, ..MatchOptions::default() };
    let maps = match_volume(&painting.volume(), &options, &Silent).unwrap();
    let truth = painting.truth(maps.reference);
    let seen = (0..truth.disparity.values().len())
        .filter(|&index| usize::from(truth.visible_frames.values()[index]) == FRAMES);
    let pairs = seen.map(|index| (truth.disparity.values()[index], maps.disparity.values()[index]));
    let errors = pairs.filter(|(_, found)| !found.is_nan());
    let errors = errors.map(|(truth, found)| (f64::from(truth), f64::from(found - truth))).collect();
    (maps.locking.unwrap(), errors)
}

#[test]
fn the_worst_bias_is_where_and_what_the_prediction_says() {
    // From 34.7 to 45.1 px, through N - 1 = 39.
    let (locking, errors) = matched(&plane(39.9, 0.04, 0.7));
    println!("{locking:?}");
    let at = locking.worst_disparity_px.expect("locking is found");
    assert!(locking.amplitudes.from_lines);
    // Half a turn of the fraction over the baseline has the largest slope; it lies half a pixel beside.
    assert!(((at - 39.0).abs() - 0.6).abs() < 0.4, "{at}");
    let near: Vec<f64> =
        errors.iter().filter(|(truth, _)| (truth - at).abs() < 0.15).map(|pair| pair.1).collect();
    let mean = near.iter().sum::<f64>() / near.len() as f64;
    println!(
        "predicted {:+.4} px at {at:.2} px, found {mean:+.4} px of {} pixels",
        locking.worst_bias_px,
        near.len()
    );
    // The formula is within a third or so ([`epirig_matcher::LockingAmplitudes`]), and the amplitude that it is made of is known to a tenth.
    let ratio = locking.worst_bias_px / mean;
    assert!((1.0 / 1.43..1.43).contains(&ratio), "{ratio}");
    let (low, high) = locking.locked_px.unwrap();
    assert!(low <= at && at <= high);
}

#[test]
fn the_program_says_where_a_flat_object_locks() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let painting = plane(39.6, 0.001, 0.5);
    std::fs::create_dir(path.join("frames")).unwrap();
    for t in 0..FRAMES {
        write_png(&path.join(format!("frames/{t:02}.png")), &painting.frame(t));
    }
    crate::support::succeeds(path, &["import", "frames", "--out", "seq"]);
    let output = epirig(path, &["match", "seq", "--reference", "middle", "--out", "found"]);
    let talk = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{talk}");
    let summary = std::fs::read(path.join("found/match.json")).unwrap();
    let summary: MatchSummary = serde_json::from_slice(&summary).unwrap();
    let locking = summary.pixel_locking.unwrap();
    println!("{talk}{locking:?}");
    assert!(locking.share_locked > 0.9, "{}", locking.share_locked);
    let hint = talk.lines().find(|line| line.starts_with("hint: ") && line.contains("show pixel locking"));
    let hint = hint.unwrap_or_else(|| panic!("{talk}"));
    let (low, high) = locking.locked_px.unwrap();
    assert!(low < 39.6 && high > 39.6, "{low} {high}");
    // Where, and what to do.
    let place = format!("{low:.2} .. {high:.2} px");
    assert!(hint.contains(&place) && hint.contains("another number of frames"), "{hint}");
    assert!(String::from_utf8(output.stdout).unwrap().contains("pixel locking      up to"));
}

#[test]
fn a_flat_object_elsewhere_does_not_lock() {
    // The golden section of N - 1: no small number of frames comes back to nearly the same fraction. What locks is only in the columns that some frames do not see, 12 on
    // either side.
    let (locking, errors) = matched(&plane(24.1, 0.001, 0.7));
    println!("{locking:?}");
    assert!(locking.share_locked < 2.0 * 12.5 / 260.0, "{}", locking.share_locked);
    let mean = errors.iter().map(|pair| pair.1).sum::<f64>() / errors.len() as f64;
    // A hundredth of a pixel is the promise for all; the average shows what all pixels have in common.
    assert!(mean.abs() < 0.001, "{mean}");
}
