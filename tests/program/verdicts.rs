//! Limits, verdicts and their exit codes; and lists of sequences.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::support::{epirig, fails, import_scan, succeeds};
use crate::surface::tile;

/// A small simulated rig.
const RIG: [&str; 6] = ["--rig", "sim", "--set", "camera.size=96x64", "--set", "plan.frames=9"];

/// Runs the program, which must end with this code; its result as JSON.
fn ends(folder: &Path, arguments: &[&str], code: i32) -> Value {
    let output = epirig(folder, &[arguments, &["--json"]].concat());
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {stderr}");
    let failed = stderr.lines().any(|line| line.starts_with("error"));
    assert!(!failed, "a verdict is no failure: {stderr}");
    serde_json::from_slice(&output.stdout).unwrap_or_else(|error| panic!("{arguments:?}: {error}"))
}

#[test]
fn a_measurement_ends_with_its_verdict_and_every_verb_agrees() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    // Its hollows are 1 mm deep. The tolerance is recorded with the frames.
    import_scan(folder, &tile(), &["--set", "target.tolerance=0.9..1.1 mm"]);
    succeeds(folder, &["match", "seq"]);
    let found = ends(folder, &["surface", "seq"], 0);
    let conformity = &found["conformity"];
    assert_eq!((&conformity["rule"], &conformity["verdict"]), (&"guarded-risk".into(), &"pass".into()));
    let judged = &conformity["judgements"][0];
    let depth_mm = judged["value"]["value_mm"].as_f64().unwrap();
    assert_eq!(judged["limits"]["lower_mm"], 0.9);
    assert!(judged["conformance_probability"].as_f64().unwrap() > 0.95, "{judged}");
    // Options replace what is recorded.
    let surface = |more: &[&str], code| {
        let found = ends(folder, &[&["surface", "seq", "--overwrite"], more].concat(), code);
        found["conclusion"]["verdict"].as_str().unwrap_or("none").to_owned()
    };
    assert_eq!(surface(&[], 0), "pass");
    assert_eq!(surface(&["--tolerance", "1.5..1.6 mm"], 9), "fail");
    assert_eq!(surface(&["--tolerance", "1.5..1.6 mm", "--no-verdict"], 0), "fail");
    // A limit at the value itself: the value alone decides only by simple acceptance.
    let at_limit = format!("{depth_mm} mm..");
    assert_eq!(surface(&["--tolerance", &at_limit], 10), "undecided");
    assert_eq!(surface(&["--tolerance", &at_limit, "--decision-rule", "simple"], 0), "pass");
    assert_eq!(surface(&["--tolerance", "0.9..1.1 mm, sa ..0.1 um"], 9), "fail");
    assert_eq!(surface(&["--tolerance", "each-depth 0.5..1.5 mm", "--risk-percent", "1"], 0), "pass");

    let text = epirig(folder, &["surface", "seq", "--overwrite", "--tolerance", "1.5..1.6 mm"]);
    let text = String::from_utf8(text.stdout).unwrap();
    let last = text.lines().rev().nth(1).unwrap();
    assert!(last.starts_with("FAIL by guarded-risk, risk 5.0 %; depth: "), "{text}");
    // The report says it first.
    let report = fs::read_to_string(folder.join("seq/results/surface/report.html")).unwrap();
    assert!(report.contains("FAIL by guarded-risk"), "the report has no verdict");

    fails(
        folder,
        &["surface", "seq", "--overwrite", "--tolerance", "0.5"],
        2,
        &["--tolerance", "0.2 +- 0.01 mm"],
    );
    fails(folder, &["surface", "seq", "--overwrite", "--risk-percent", "70"], 2, &["--risk-percent", "50 %"]);
    let kept = fs::read_to_string(folder.join("seq/results/surface/report.html")).unwrap();
    assert_eq!(kept, report, "a wrong option costs nothing");

    states_what_people_know(folder);
    lists_what_was_measured(folder, depth_mm);
}

/// What the profile and the options say beside the results stands in the report.
fn states_what_people_know(folder: &Path) {
    let surface = ["surface", "seq", "--overwrite", "--no-verdict", "--tolerance", "1.5..1.6 mm"];
    let of = |more: &[&'static str]| [&surface[..], more].concat();
    succeeds(folder, &of(&["--report", "customer=A & B", "--report", "serial_number=T-0042"]));
    let report = fs::read_to_string(folder.join("seq/results/surface/report.html")).unwrap();
    for wanted in ["As stated", "customer", "A &amp; B", "serial number", "T-0042"] {
        assert!(report.contains(wanted), "{wanted} is not in the report");
    }
    fails(folder, &of(&["--report", "color=red"]), 2, &["report.color"]);
    fails(folder, &of(&["--report", "customer"]), 2, &["--report"]);
    let own = Path::new("seq/results/surface/height.png");
    fs::copy(folder.join(own), folder.join("logo.png")).unwrap();
    for (logo, wanted) in [
        ("logo=logo.png", "<img class=\"logo\" src=\"data:image/png;base64,"),
        ("logo=gone.png", "There is no logo: cannot read gone.png"),
        ("logo=seq/sequence.json", "There is no logo: it is neither PNG nor JPEG."),
        ("logo=/dev/zero", "There is no logo: /dev/zero is a device, not a file"),
    ] {
        succeeds(folder, &of(&["--report", logo]));
        let report = fs::read_to_string(folder.join("seq/results/surface/report.html")).unwrap();
        assert!(report.contains(wanted), "{wanted} is not in the report");
    }
}

#[test]
fn a_scan_whose_surface_cannot_be_measured_is_undecided() {
    let folder = tempfile::tempdir().unwrap();
    // Hollows of 0.2 mm are far too shallow for so few pixels.
    let run = |out: &'static str, more: &[&'static str]| {
        [&["run", "--out", out, "--anyway", "--tolerance", "0.1..0.3 mm"], more, &RIG].concat()
    };
    let found = ends(folder.path(), &run("a", &["--step-mm", "15"]), 10);
    assert!(found["summary"]["answered"].as_f64().unwrap() > 0.1, "the results are there: {found}");
    ends(folder.path(), &run("b", &["--step-mm", "15", "--no-verdict"]), 0);
}

/// The list of a folder with a measured tile, of which other states are made.
fn lists_what_was_measured(folder: &Path, depth_mm: f64) {
    let scan = [&["capture", "--out", "monday/scan", "--step-mm", "15"][..], &RIG].concat();
    fs::create_dir(folder.join("monday")).unwrap();
    succeeds(folder, &scan);
    succeeds(folder, &["match", "monday/scan"]);
    fs::create_dir_all(folder.join("broken")).unwrap();
    fs::write(folder.join("broken/sequence.json"), "{").unwrap();
    let listed = ends(folder, &["list"], 0);
    let of = |name: &str| {
        let entries = listed["sequences"].as_array().unwrap();
        entries
            .iter()
            .find(|entry| entry["name"] == name)
            .unwrap_or_else(|| panic!("{name}: {listed}"))
            .clone()
    };
    assert_eq!((&of("monday/scan")["state"], &of("seq")["state"]), (&"matched".into(), &"measured".into()));
    assert_eq!((&of("seq")["verdict"], &of("seq")["depth_mm"]), (&"fail".into(), &depth_mm.into()));
    assert_eq!(of("broken")["state"], "unreadable");
    assert!(of("broken")["problem"].as_str().unwrap().contains("sequence.json"), "{listed}");

    let text = succeeds(folder, &["list", "--sort", "depth"]);
    let last = text.lines().last().unwrap();
    assert!(last.starts_with("seq ") && last.ends_with("fail") && last.chars().count() < 80, "{text}");
    let only = ends(folder, &["list", "--state", "matched"], 0);
    assert_eq!(only["sequences"].as_array().unwrap().len(), 1);
    let csv = succeeds(folder, &["list", "monday", "--csv"]);
    let mut lines = csv.lines();
    assert!(lines.next().unwrap().starts_with("name,created,state,ended,frames,planned,depth_mm"), "{csv}");
    assert!(lines.next().unwrap().starts_with("scan,2"), "{csv}");
    fails(folder, &["list", "nowhere"], 1, &["nowhere"]);

    // Results that were matched again are not those of the surface.
    succeeds(folder, &["match", "seq", "--overwrite", "--quick"]);
    let again = ends(folder, &["list", "--sort", "name"], 0);
    let seq = again["sequences"].as_array().unwrap().iter().find(|entry| entry["name"] == "seq").unwrap();
    assert_eq!(seq["state"], "matched", "the surface is that of a former match: {seq}");
    assert!(seq["depth_mm"].is_null(), "{seq}");
}
