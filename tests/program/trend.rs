//! Trends of many sequences.

use std::fs;
use std::path::Path;

use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, StandardNormal};
use serde_json::Value;

use crate::support::{fails, import_scan, succeeds};
use crate::surface::tile;

/// Sequences, and the first one after the change.
const COUNT: usize = 200;
const CHANGED: usize = 100;

fn read(path: &Path) -> Value {
    serde_json::from_slice(&fs::read(path).unwrap()).unwrap()
}

/// What `edit` makes of a record of the sequence `from`, in the sequence `to`.
pub(crate) fn copied(from: &Path, to: &Path, file: &str, edit: impl FnOnce(&mut Value)) {
    let mut record = read(&from.join(file));
    edit(&mut record);
    let path = to.join(file);
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    fs::write(path, serde_json::to_vec_pretty(&record).unwrap()).unwrap();
}

#[test]
fn a_drift_of_one_sigma_in_two_hundred_sequences_is_told_with_its_place() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    import_scan(folder, &tile(), &["--set", "target.tolerance=0.9..1.1 mm"]);
    succeeds(folder, &["match", "seq"]);
    succeeds(folder, &["surface", "seq"]);
    let seq = folder.join("seq");
    let mut random = ChaCha8Rng::seed_from_u64(7);
    for number in 0..COUNT {
        let to = folder.join(format!("tiles/t{number:03}"));
        // Records alone make the list; no frame is looked at.
        let begun = format!("2026-01-{:02}T{:02}:00:00Z", 1 + number / 24, number % 24);
        copied(&seq, &to, "sequence.json", |record| record["created"] = begun.into());
        fs::copy(seq.join("journal.jsonl"), to.join("journal.jsonl")).unwrap();
        let noise: f64 = StandardNormal.sample(&mut random);
        let drift = if number < CHANGED { 0.0 } else { 0.001 };
        copied(&seq, &to, "results/surface/surface.json", |record| {
            record["levels"]["depth"]["depth_mm"] = (1.0 + 0.001 * noise + drift).into();
        });
        // Byte for byte: the surface is bound to it by its hash.
        fs::copy(seq.join("results/match.json"), to.join("results/match.json")).unwrap();
    }
    let told: Value = serde_json::from_str(&succeeds(folder, &["trend", "tiles", "--json"])).unwrap();
    let trends = told["trends"].as_array().unwrap();
    let of = |measure: &str| trends.iter().find(|trend| trend["measure"] == measure).unwrap();
    let depth = of("depth");
    assert_eq!((&depth["lower_limit"], &depth["upper_limit"]), (&0.9.into(), &1.1.into()));
    assert_eq!(depth["values"].as_array().unwrap().len(), COUNT);
    let chart = &depth["chart"];
    // Differences of neighbours do not know the drift: 200 of them give the scatter to 6 % (standard deviation).
    let scatter = chart["sigma"].as_f64().unwrap();
    assert!((0.0008..0.0012).contains(&scatter), "{scatter}");
    let change = &chart["change"];
    let place = |name: &str| change[name].as_u64().unwrap() as usize;
    assert!((place("earliest")..=place("latest")).contains(&CHANGED), "{change}");
    assert!(place("latest") - place("earliest") < 30, "{change}");
    assert!(of("noise")["chart"]["change"].is_null(), "the noise is that of one match");

    let text = succeeds(folder, &["trend", "tiles", "--picture", "depth.png"]);
    let line = text.lines().find(|line| line.starts_with("depth ")).unwrap();
    assert!(line.contains("+0.0") && line.contains(" at t"), "{text}");
    assert!(text.lines().all(|line| line.chars().count() <= 100), "{text}");
    let picture = image::open(folder.join("depth.png")).unwrap();
    assert!(picture.width() > 900 && picture.height() > 900);
    fails(folder, &["trend", "tiles", "--picture", "depth.png"], 2, &["depth.png exists already"]);

    let csv = succeeds(folder, &["trend", "tiles", "--csv"]);
    let mut lines = csv.lines();
    assert_eq!(lines.next(), Some("measure,unit,sequence,begun,value,sigma,moving_range,patterns"));
    assert!(lines.next().unwrap().starts_with("depth,mm,t000,2026-01-01T00:00:00Z,"), "{csv}");
    // Limits of control from the first half: the second half is on their other side.
    let told = succeeds(folder, &["trend", "tiles", "--baseline", "100", "--json"]);
    let told: Value = serde_json::from_str(&told).unwrap();
    let points = told["trends"][0]["chart"]["points"].as_array().unwrap();
    let marked =
        |points: &[Value]| points.iter().filter(|point| point["patterns"] != Value::Array(vec![])).count();
    assert!(marked(&points[CHANGED..]) > 3 * marked(&points[..CHANGED]), "{}", told["trends"][0]);

    // A record that cannot be read is told, and the others count.
    fs::write(folder.join("tiles/t003/calibration.json"), "{").unwrap();
    let told: Value = serde_json::from_str(&succeeds(folder, &["trend", "tiles", "--json"])).unwrap();
    let problems = told["problems"].as_array().unwrap();
    assert!(problems.len() == 1 && problems[0].as_str().unwrap().starts_with("t003: "), "{problems:?}");
    assert_eq!(told["trends"][0]["values"].as_array().unwrap().len(), COUNT);

    fails(folder, &["trend", "tiles", "--baseline", "1"], 2, &["--baseline"]);
    fails(folder, &["trend", "seq", "--picture", "new.png"], 2, &["fewer than two sequences"]);
    assert!(succeeds(folder, &["trend", "seq"]).contains("too few for a trend"));
}
