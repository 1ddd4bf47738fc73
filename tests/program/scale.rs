//! How well the scale is known is part of the interval of a depth, and terminal, files and report tell the same.

use std::fs;
use std::path::Path;

use crate::support::{import_scan, succeeds};
use epirig_simulator::{Scene, Simulator, SimulatorConfig};

const DEPTH_MM: f64 = 1.0;

/// A tile of 93 x 93 px with hollows of 17 px, without noise.
fn tile() -> Simulator {
    let mut config = SimulatorConfig::tile(200, 31);
    config.scene = Scene::Tile {
        distance_mm: 900.0,
        side_mm: 150.0,
        hollow_depth_mm: DEPTH_MM,
        hollow_width_mm: 28.0,
        pitch_mm: 60.0,
        wall_mm: 3.0,
        bow_mm: 0.0,
        bands: None,
    };
    Simulator::new(config).unwrap()
}

/// What `surface` says when the records state this uncertainty of the focal length.
struct Measured {
    json: serde_json::Value,
    said: String,
    report: String,
}

impl Measured {
    fn with(folder: &Path, focal_length_sigma: &str) -> Self {
        let record = folder.join("seq/sequence.json");
        let mut text: serde_json::Value = serde_json::from_slice(&fs::read(&record).unwrap()).unwrap();
        let percent = 100.0 * focal_length_sigma.parse::<f64>().unwrap();
        text["origin"]["rig"]["optics"]["focal_length_sigma"] = format!("{percent} %").into();
        fs::write(&record, serde_json::to_vec_pretty(&text).unwrap()).unwrap();
        let json = succeeds(folder, &["surface", "seq", "--overwrite", "--json"]);
        let said = succeeds(folder, &["surface", "seq", "--overwrite"]);
        let report = fs::read_to_string(folder.join("seq/results/surface/report.html")).unwrap();
        let file = fs::read(folder.join("seq/results/surface/surface.json")).unwrap();
        let json: serde_json::Value = serde_json::from_str(&json).unwrap();
        let mut recorded: serde_json::Value = serde_json::from_slice(&file).unwrap();
        // The file alone knows the hashes of those beside it.
        recorded.as_object_mut().unwrap().remove("files");
        assert_eq!(recorded, json);
        Self { json, said, report }
    }

    fn number(&self, path: &str) -> f64 {
        let found = self.json.pointer(path).and_then(serde_json::Value::as_f64);
        found.unwrap_or_else(|| panic!("{path} in {}", self.json))
    }

    /// Standard uncertainty of the depth by a contribution of the budget.
    fn contribution(&self, name: &str) -> Option<f64> {
        let all = self.json["levels"]["budget"]["contributions"].as_array().unwrap();
        all.iter().find(|part| part["name"] == name).unwrap()["sigma_mm"].as_f64()
    }
}

/// `size` with two significant digits.
fn two_digits(size: f64) -> String {
    let decimals = (1.0 - size.log10().floor()).max(0.0) as usize;
    format!("{size:.decimals$}")
}

#[test]
fn the_interval_holds_the_uncertainty_of_the_focal_length() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    import_scan(folder, &tile(), &[]);
    succeeds(folder, &["match", "seq"]);
    let record: serde_json::Value =
        serde_json::from_slice(&fs::read(folder.join("seq/sequence.json")).unwrap()).unwrap();
    assert_eq!(record["origin"]["rig"]["optics"]["focal_length_sigma"], "2 %", "that of a data sheet");

    let exact = Measured::with(folder, "0.0");
    let depth_mm = exact.number("/levels/depth/depth_mm");
    let rest_mm = exact.number("/levels/budget/combined/sigma_mm");
    assert!(rest_mm < 0.5 * 0.02 * DEPTH_MM, "{rest_mm} hides what is tested");
    assert_eq!(exact.contribution("scale: focal length"), Some(0.0));
    assert!(
        exact.said.contains("(95 % coverage, focal length and baseline taken as exact)"),
        "{}",
        exact.said
    );
    for relative in [0.02, 0.05] {
        let found = Measured::with(folder, &relative.to_string());
        // A height is a difference of distances f b / |d|, so it is wrong by the share by which f is.
        let by_scale_mm = relative * depth_mm;
        let said_mm = found.contribution("scale: focal length").unwrap();
        assert!((said_mm - by_scale_mm).abs() < 1e-12, "{said_mm}, not {by_scale_mm}");
        // No record tells how long the stage's mm is.
        assert_eq!(found.contribution("scale: length of the baseline"), None);
        let sigma_mm = found.number("/levels/budget/combined/sigma_mm");
        assert!((sigma_mm / by_scale_mm.hypot(rest_mm) - 1.0).abs() < 1e-9, "{sigma_mm}");
        // By tables, Student's t is between 1.980 (120 degrees of freedom) and 1.960 (the normal distribution).
        let half_width_mm = found.number("/levels/budget/combined/half_width_95_mm");
        assert!((1.9599..1.980).contains(&(half_width_mm / sigma_mm)), "{half_width_mm}, {sigma_mm}");
        assert!((depth_mm - DEPTH_MM).abs() < half_width_mm, "{depth_mm}");
        // The noise of single heights stays what it was.
        for path in ["/roughness/sq_noise_mm", "/levels/depth/sigma_mm", "/levels/depth/half_width_95_mm"] {
            assert_eq!(found.number(path), exact.number(path), "{path}");
        }

        let half_width = two_digits(half_width_mm);
        let sentence = found.json["conclusion"]["sentence"].as_str().unwrap();
        let wanted = format!(" mm +- {half_width} mm deep (95 % coverage, baseline taken as exact)");
        assert!(sentence.starts_with("hollows ") && sentence.contains(&wanted), "{sentence}, not {wanted}");
        assert!(found.said.lines().any(|line| line == sentence), "{sentence} in {}", found.said);
        let printed = sentence.replacen("hollows", "Hollows", 1).replace("+-", "\u{b1}");
        assert!(found.report.contains(&printed), "{printed}");
        assert!(
            found.report.contains(&format!(" mm \u{b1} {half_width} mm</data> (95 % coverage, k = 1.96)"))
        );
        assert_eq!(found.report.contains("known to 2.0 % (standard uncertainty)"), relative == 0.02);
    }
}
