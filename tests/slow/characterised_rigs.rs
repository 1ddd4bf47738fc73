//! What `epirig characterise` tells of simulated rigs whose faults are known.

use std::ops::Range;
use std::path::Path;

use serde_json::Value;

use crate::support::{succeeds, write_png};
use epirig_simulator::{Optics, Scene, SimulatedScan, Simulator, SimulatorConfig, StepError, Texture};

/// Depths of the standards, in mm: 0.1 to 0.45 px.
const DEPTHS_MM: [f64; 3] = [0.5, 1.0, 2.0];

#[derive(Clone, Copy)]
struct Rig {
    noise_dn: f64,
    flicker: f64,
    step_error_um: f64,
    point_spread_px: f64,
    /// The focal length that the program is told, over the true one.
    scale: f64,
}

const IDEAL: Rig = Rig { noise_dn: 0.3, flicker: 0.0, step_error_um: 0.0, point_spread_px: 0.5, scale: 1.0 };
/// 45 dB below full scale.
const REAL: Rig = Rig { noise_dn: 1.434, flicker: 0.003, step_error_um: 5.0, scale: 1.03, ..IDEAL };
const NOISY: Rig = Rig { noise_dn: 4.0, scale: 0.98, ..REAL };

/// A tile of 140 x 140 px, 0.4 mm each, with hollows of 30 px and steep walls.
fn simulator(rig: Rig, depth_mm: f64, scan: u32) -> Simulator {
    let distance_mm = 400.0;
    let scene = Scene::Tile {
        distance_mm,
        side_mm: 56.0,
        hollow_depth_mm: depth_mm,
        hollow_width_mm: 12.0,
        pitch_mm: 24.0,
        wall_mm: 0.4,
        bow_mm: 0.0,
        bands: None,
    };
    let mut config = SimulatorConfig {
        scene,
        texture: Texture { grain_mm: 0.8, coarse_share: 0.35, seed: 1 },
        optics: Optics {
            rows: 168,
            principal_point_y_px: 83.5,
            point_spread_sigma_px: rig.point_spread_px,
            ..Optics::square(256, 1000.0)
        },
        scan: SimulatedScan { start_mm: 0.0, step_mm: 2.0, frames: 19 },
        flicker: rig.flicker,
        step_error: StepError { sigma_um: rig.step_error_um, seed: u64::from(scan) + 1 },
        first_exposure: 1000 * scan,
        ..SimulatorConfig::tile(256, 19)
    };
    config.sensor.read_noise_dn = rig.noise_dn;
    Simulator::new(config).unwrap()
}

/// Scans and measures a standard in `folder`, many times.
fn measure(folder: &Path, rig: Rig, depth_mm: f64, scans: Range<u32>) {
    for scan in scans {
        let folder = folder.join(format!("{scan}"));
        std::fs::create_dir_all(folder.join("photos")).unwrap();
        let simulator = simulator(rig, depth_mm, scan);
        for (index, &position) in simulator.config().scan.positions_mm().iter().enumerate() {
            write_png(
                &folder.join(format!("photos/{index:03}.png")),
                &simulator.expose(position, index as u32),
            );
        }
        let focal_length = (rig.scale * simulator.config().optics.focal_length_px).to_string();
        let scale = ["--step-mm=2", "--focal-length-px", &focal_length];
        succeeds(&folder, &[&["import", "photos", "--out", "seq"], &scale[..]].concat());
        succeeds(&folder, &["match", "seq"]);
        succeeds(&folder, &["surface", "seq"]);
        std::fs::remove_dir_all(folder.join("photos")).unwrap();
    }
}

fn characterised(folder: &Path, arguments: &[&str]) -> Value {
    println!("{}", succeeds(folder, &[&["characterise"], arguments].concat()));
    serde_json::from_str(&succeeds(folder, &[&["characterise", "--json"], arguments].concat())).unwrap()
}

#[test]
#[ignore = "takes minutes"]
fn standards_tell_amplification_and_linearity_of_three_rigs() {
    for rig in [IDEAL, REAL, NOISY] {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path();
        for depth_mm in DEPTHS_MM {
            measure(&folder.join(format!("d{depth_mm}")), rig, depth_mm, 0..3);
        }
        let standards: Vec<String> = DEPTHS_MM.iter().map(|mm| format!("--standard=d{mm}={mm} mm")).collect();
        let standards: Vec<&str> = standards.iter().map(String::as_str).collect();
        let found = characterised(folder, &standards);
        let response = &found["response"];
        let number = |value: &Value| value.as_f64().unwrap();
        // Heights are as much too large as the focal length that they are computed with.
        let (slope, half_width) = (number(&response["amplification"]), number(&response["half_width_95"]));
        assert!((slope - rig.scale).abs() <= half_width, "{response}");
        assert!(half_width < 0.05, "{response}");
        // A mean is off the line by chance, as its own interval says, and by what the slope is off.
        let steps = response["steps"].as_array().unwrap();
        let widest = steps.iter().map(|step| number(&step["half_width_95_mm"])).fold(0.0, f64::max);
        assert!(number(&response["linearity_mm"]) <= widest, "{response}");
        // The walls fall over a pixel of 0.4 mm. Blur and windows widen them, to less than a grown window (11 px). With
        // much noise nothing is told of them.
        let found = characterised(folder, &["d2"]);
        let quantities = found["quantities"].as_array().unwrap();
        let walls = quantities.iter().find(|quantity| quantity["measure"] == "wall-width");
        assert!(walls.is_some() || rig.noise_dn > REAL.noise_dn, "{found}");
        if let Some(walls) = walls {
            let width_mm = number(&walls["repeatability"]["mean"]);
            assert!((0.4..4.4).contains(&width_mm), "{walls}");
        }
    }
}

#[test]
#[ignore = "takes minutes"]
fn a_lost_focus_is_told_by_earlier_scans_and_other_noise_is_not() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    measure(&folder.join("earlier"), REAL, 1.0, 0..4);
    let changed = |name: &str, rig: Rig| {
        measure(&folder.join(name), rig, 1.0, 4..8);
        let arguments = [name, "--earlier", "earlier"];
        let text = succeeds(folder, &[&["characterise"], &arguments[..]].concat());
        let lines = text.lines().filter_map(|line| line.strip_prefix("changed "));
        lines.map(|line| line.trim().to_owned()).collect::<Vec<_>>()
    };
    assert_eq!(changed("same", REAL), ["nothing that so few scans could show"]);
    let lost = changed("lost", Rig { point_spread_px: 2.0, ..REAL });
    assert!(lost.iter().any(|line| line.starts_with("noise: mean ")), "{lost:?}");
}
