//! What repeated scans tell of a rig.

use std::fs;
use std::path::Path;

use epirig_data::formats::MapFormat;
use serde_json::Value;

use crate::support::{epirig, fails, succeeds};

/// Root mean square of the known values of a map, and of these over those of another.
fn errors(map: &Path, sigmas: &Path) -> [f64; 2] {
    let read = |path: &Path| MapFormat::Tiff.decode(&fs::read(path).unwrap()).unwrap();
    let (map, sigmas) = (read(map), read(sigmas));
    let both = map.values().iter().zip(sigmas.values());
    let known: Vec<(f64, f64)> = both
        .filter(|(value, sigma)| value.is_finite() && sigma.is_finite())
        .map(|(&value, &sigma)| (f64::from(value), f64::from(sigma)))
        .collect();
    let mean = |square: fn(&(f64, f64)) -> f64| known.iter().map(square).sum::<f64>() / known.len() as f64;
    [mean(|(value, _)| value.powi(2)).sqrt(), mean(|(value, sigma)| (value / sigma).powi(2)).sqrt()]
}

/// Two series of the same scans, of which one has other records.
fn compares_with_earlier_scans(folder: &Path) {
    let twice = ["characterise", "repeats", "--earlier", "repeats"];
    fails(folder, &twice, 2, &["belongs to the earlier scans"]);
    let both = ["characterise", "repeats", "--earlier", "other", "--standard", "0.2 mm"];
    fails(folder, &both, 2, &["--standard", "--earlier"]);
    for number in 1..=4 {
        let (from, to) = (folder.join(format!("repeats/00{number}")), folder.join(format!("other/{number}")));
        fs::create_dir_all(to.join("results/surface")).unwrap();
        // No map, and no frame.
        for file in ["sequence.json", "journal.jsonl", "results/match.json", "results/surface/surface.json"] {
            fs::copy(from.join(file), to.join(file)).unwrap();
        }
    }
    let compared = ["characterise", "repeats", "--earlier", "other"];
    assert!(succeeds(folder, &compared).contains("nothing that so few scans could show"));
    let found: Value =
        serde_json::from_str(&succeeds(folder, &[&compared[..], &["--json"]].concat())).unwrap();
    let changes = found["changes"].as_array().unwrap();
    // The same values: chance makes them differ as much, always.
    for change in changes {
        for by_chance in ["mean_by_chance", "deviation_by_chance"] {
            assert!((change[by_chance].as_f64().unwrap() - 1.0).abs() < 1e-9, "{change}");
        }
    }
    assert!(changes.iter().any(|change| change["measure"] == "bow"), "{changes:?}");
    // Bows that were a mm less before.
    for number in 1..=4 {
        let path = folder.join(format!("other/{number}/results/surface/surface.json"));
        let mut record: Value = serde_json::from_slice(&fs::read(&path).unwrap()).unwrap();
        record["bow_mm"] = (record["bow_mm"].as_f64().unwrap() - 1.0).into();
        fs::write(&path, record.to_string()).unwrap();
    }
    let text = succeeds(folder, &compared);
    let line = text.lines().find(|line| line.starts_with("changed ")).unwrap();
    assert!(line.contains("bow: mean -") && line.contains(" mm before, "), "{line}");
}

#[test]
fn noise_of_repeated_scans_is_that_about_the_true_plane() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let small = ["--size=160x120", "--frames=21", "--step-mm=7.5"];
    let rig = ["--rig=sim", "--anyway", "--set=sim.scene=plane", "--set=sim.noise=2 DN"];
    // Each scan ends once; one that is resumed has no fault.
    let faults = ["--set=sim.faults=camera-gone@13", "--set=limits.wait=1 s"];
    let repeat = |count: &'static str, rest: &[&'static str]| {
        [&["repeat", count, "--out", "repeats"], rest, &small, &rig, &faults].concat()
    };
    for number in 1..=4 {
        let output = epirig(folder, &repeat("4", &[]));
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(7), "{said}");
        assert!(said.contains("the same command goes on"), "{said}");
        assert!((1..number).all(|done| said.contains(&format!("scan {done} of 4: "))), "{said}");
        assert!(folder.join(format!("repeats/00{number}/sequence.json")).exists());
    }
    fails(
        folder,
        &repeat("4", &["--set=plan.average=2"]),
        2,
        &["001", "another plan.average", "a new folder"],
    );
    let found: Value = serde_json::from_str(&succeeds(folder, &repeat("4", &["--json"]))).unwrap();
    let again = succeeds(folder, &["characterise", "repeats", "--json"]);
    assert_eq!(found, serde_json::from_str::<Value>(&again).unwrap());
    assert_eq!(found["sequences"].as_array().unwrap().len(), 4);
    let number = |name: &str| found["noise"][name].as_f64().unwrap();
    // The object is a plane: what is left without the form is error. Noise is the part of it that does not repeat; as
    // nothing but noise differs from a perfect rig, that is most of it.
    let results = |n: usize| folder.join(format!("repeats/{n:03}/results"));
    let of_scan =
        |n| errors(&results(n).join("surface/height_mm.tiff"), &results(n).join("height_sigma_mm.tiff"));
    let scans: Vec<[f64; 2]> = (1..=4).map(of_scan).collect();
    let together = |which: usize| (scans.iter().map(|scan| scan[which].powi(2)).sum::<f64>() / 4.0).sqrt();
    let share = number("noise_mm") / together(0);
    assert!((0.6..1.1).contains(&share), "{share}: {found}, {scans:?}");
    let share = number("over_claimed") / together(1);
    assert!((0.6..1.1).contains(&share), "{share}: {found}, {scans:?}");
    assert_eq!(number("pairs"), 3.0);
    let quantities = found["quantities"].as_array().unwrap();
    let of = |measure: &str| quantities.iter().find(|quantity| quantity["measure"] == measure).unwrap();
    let distance = &of("distance")["repeatability"];
    // The plane of the simulated rig is 900 mm away.
    assert!((distance["mean"].as_f64().unwrap() - 900.0).abs() < 1.0, "{distance}");
    assert!(distance["lower"].as_f64() < distance["deviation"].as_f64(), "{distance}");

    let text = succeeds(folder, &["characterise", "repeats"]);
    assert!(text.contains("N_M ") && text.contains("s_r ") && text.contains("claimed "), "{text}");
    assert!(text.lines().all(|line| line.chars().count() <= 100), "{text}");
    fails(folder, &["characterise", "repeats/001"], 2, &["1 of 1 sequences", "two at least"]);
    compares_with_earlier_scans(folder);
    // A plane has no depth.
    let standard = |text| ["characterise", "repeats", "--standard", text];
    fails(folder, &standard("0.2 mm"), 2, &["no depth was measured", "--standard", "`epirig list`"]);
    fails(folder, &standard("0.2"), 2, &["0.2 +- 0.001 mm"]);
    let twice = [&standard("0.2 mm")[..], &["--standard", "./=0.3 mm"]].concat();
    fails(folder, &twice, 2, &["given twice", "of 0.3 mm"]);
}
