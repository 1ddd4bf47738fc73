//! The sequences in the panel of a rig: what is told of them is what the command line tells.

use std::fs;
use std::path::Path;

use epirig_server::{Query, Refusal, RefusalKind, Reply};
use serde_json::{Value, json};

use crate::compare;
use crate::panel::{Rig, parsed};
use crate::support::{import_scan, succeeds};
use crate::surface;
use crate::trend::copied;
use crate::view;

fn get(rig: &Rig, path: &str) -> Result<Reply, Refusal> {
    epirig_server::Site::get(&rig.panel, &path.split('/').collect::<Vec<_>>(), &Query::default())
}

fn list(rig: &Rig) -> Vec<Value> {
    parsed(&get(rig, "sequences").unwrap()).as_array().unwrap().clone()
}

fn picture(rig: &Rig, entry: &Value) -> image::RgbaImage {
    let path = format!("sequences/{}", entry["picture"].as_str().unwrap());
    let reply = get(rig, &path).unwrap();
    assert!(reply.media_type == "image/png" && reply.is_lasting);
    image::load_from_memory_with_format(&reply.bytes, image::ImageFormat::Png).unwrap().into_rgba8()
}

/// A measured tile below the folder, and its records alone so many times, each with a depth of its own.
fn tiles(folder: &Path, depths_mm: &[f64]) {
    import_scan(folder, &surface::tile(), &["--set", "target.tolerance=0.9..1.1 mm"]);
    succeeds(folder, &["match", "seq"]);
    succeeds(folder, &["surface", "seq"]);
    let seq = folder.join("seq");
    for (number, depth_mm) in depths_mm.iter().enumerate() {
        let to = folder.join(format!("tiles/t{number:02}"));
        let begun = format!("2026-01-{:02}T10:00:00Z", 1 + number);
        copied(&seq, &to, "sequence.json", |record| record["created"] = begun.into());
        fs::copy(seq.join("journal.jsonl"), to.join("journal.jsonl")).unwrap();
        copied(&seq, &to, "results/surface/surface.json", |record| {
            record["levels"]["depth"]["depth_mm"] = (*depth_mm).into();
        });
        fs::copy(seq.join("results/match.json"), to.join("results/match.json")).unwrap();
    }
}

#[test]
fn the_list_has_what_epirig_list_tells_and_a_picture_of_each() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    tiles(folder, &[1.0, 1.001]);
    fs::create_dir(folder.join("broken")).unwrap();
    fs::write(folder.join("broken/sequence.json"), "{").unwrap();
    let rig = Rig::new(folder);
    let found = list(&rig);
    let arguments = ["list", folder.to_str().unwrap(), "--json"];
    let told: Value = serde_json::from_str(&succeeds(folder, &arguments)).unwrap();
    let told: Vec<&Value> = told["sequences"].as_array().unwrap().iter().rev().collect();
    assert_eq!(found.len(), told.len());
    for (found, told) in found.iter().zip(told) {
        for (name, value) in told.as_object().unwrap() {
            assert_eq!(&found[name], value, "{name} of {told}");
        }
    }
    let of = |name: &str| found.iter().find(|entry| entry["name"] == name).unwrap();
    assert_eq!((&of("seq")["state"], &of("seq")["verdict"]), (&"measured".into(), &"pass".into()));
    assert!(of("broken")["picture"].is_null() && of("broken")["problem"].is_string());

    // Its object is in the middle, and the background beside it was not measured.
    let heights = picture(&rig, of("seq"));
    assert!(heights.width() <= 128 && heights.height() <= 128, "{:?}", heights.dimensions());
    let middle = heights.get_pixel(heights.width() / 2, heights.height() / 2).0;
    assert!(middle[3] == 255 && middle[0] != middle[1], "{middle:?}");
    assert!(heights.pixels().any(|pixel| pixel.0[3] == 0));
    // Without results it is a frame, in grey. Other frames or results have another name.
    let former = of("seq")["picture"].clone();
    fs::remove_dir_all(folder.join("seq/results")).unwrap();
    let missing = get(&rig, "sequences/0123456789abcdef0123456789abcdef").expect_err("no such picture");
    assert_eq!(missing.kind, RefusalKind::NotFound);
    let found = list(&rig);
    let seq = found.iter().find(|entry| entry["name"] == "seq").unwrap();
    assert_ne!(seq["picture"], former);
    assert!(picture(&rig, seq).pixels().all(|pixel| pixel.0[0] == pixel.0[1] && pixel.0[3] == 255));
    let gone = get(&rig, &format!("sequences/{}", former.as_str().unwrap())).expect_err("a former list");
    assert_eq!(gone.kind, RefusalKind::NotFound);
    for outside in ["sequences/..", "sequences/../seq", "sequences/seq"] {
        assert_eq!(get(&rig, outside).expect_err(outside).kind, RefusalKind::NotFound, "{outside}");
    }
}

#[test]
fn the_chart_is_that_of_epirig_trend_for_the_sequences_that_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    // The last value stands far beside the others.
    let depths_mm = [1.0, 1.001, 0.999, 1.0, 1.001, 1.0, 0.999, 1.0, 1.05];
    tiles(folder, &depths_mm);
    fs::rename(folder.join("seq"), folder.join("elsewhere")).unwrap();
    let rig = Rig::new(folder);
    let ask = |measure: &str, count: usize| {
        let names: Vec<String> = (0..count).map(|number| format!("tiles/t{number:02}")).collect();
        rig.post("sequences/trend", json!({ "measure": measure, "sequences": names })).map(|it| parsed(&it))
    };
    let found = ask("depth", depths_mm.len()).unwrap();
    let told: Value = serde_json::from_str(&succeeds(folder, &["trend", "tiles", "--json"])).unwrap();
    let told = &told["trends"][0];
    let chart = &found["chart"];
    for (page, verb) in [("mean", "centre"), ("lower", "lower"), ("upper", "upper"), ("scatter", "sigma")] {
        assert_eq!(chart[page], told["chart"][verb], "{page}");
    }
    assert_eq!((&chart["lower_limit"], &chart["unit"]), (&json!(0.9), &json!("mm")));
    let points = chart["points"].as_array().unwrap();
    let values: Vec<f64> = points.iter().map(|point| point["value"].as_f64().unwrap()).collect();
    assert_eq!(values, depths_mm);
    assert_eq!(points[8]["sequence"], "tiles/t08");
    assert!(points[8]["sigma"].as_f64().unwrap() > 0.0);
    let rules = points[8]["rules"].as_array().unwrap();
    assert!(rules.contains(&json!("too far from the one before")), "{rules:?}");
    assert_eq!(points[3]["rules"], json!([]));
    let offered = found["offered"].as_array().unwrap();
    assert_eq!(offered[0]["measure"], "depth");
    assert!(offered.iter().any(|one| one["measure"] == "noise" && one["meaning"].is_string()));

    // Of fewer sequences it is another chart; of one there is none.
    assert_eq!(ask("depth", 8).unwrap()["chart"]["points"].as_array().unwrap().len(), 8);
    let alone = ask("depth", 1).unwrap();
    assert!(alone["chart"].is_null() && alone["offered"] == json!([]), "{alone}");
    assert!(ask("blur", 9).unwrap()["chart"].is_null());
    assert_eq!(ask("colour", 9).expect_err("no such quantity").kind, RefusalKind::Wrong);
    // Whoever looks may ask.
    for open in [&["sequences", "trend"], &["sequences", "compare"]] {
        assert!(epirig_server::Site::rules(&rig.panel, open).open_to_all, "{open:?}");
    }
}

#[test]
fn any_two_are_compared_as_by_epirig_compare() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    fs::create_dir(folder.join("scans")).unwrap();
    let scans = folder.join("scans");
    compare::scanned(&scans, "before", &compare::tile(1.0, (0.0, 0.0)), 1);
    compare::scanned(&scans, "after", &compare::tile(2.2, (3.4, -2.3)), 2);
    view::matched(folder);
    let rig = Rig::new(folder);
    let ask = |sequence: &str| rig.post("sequences/compare", json!({ "sequence": sequence }));
    assert_eq!(ask("scans/after").expect_err("nothing is open").kind, RefusalKind::NotFound);
    // A sequence at any depth can be opened; the page knows it by its name in the list.
    for unknown in ["before", "scans", "../scans/before", "scans/before/results", ""] {
        let refusal = rig.post("results/open", json!({ "name": unknown })).expect_err(unknown);
        assert_eq!(refusal.kind, RefusalKind::NotFound, "{unknown}: {refusal:?}");
    }
    rig.post("results/open", json!({ "name": "scans/before" })).unwrap();
    let about = parsed(&get(&rig, "about").unwrap());
    assert_eq!(about["sequence"], "scans/before");

    let reply = ask("scans/after").unwrap();
    let length = u32::from_le_bytes(reply.bytes[..4].try_into().unwrap()) as usize;
    let found: Value = serde_json::from_slice(&reply.bytes[4..4 + length]).unwrap();
    let arguments = ["compare", "scans/before", "scans/after", "--out", "change", "--json"];
    let told: Value = serde_json::from_str(&succeeds(folder, &arguments)).unwrap();
    let number = |value: &Value, path: &str| value.pointer(path).and_then(Value::as_f64).unwrap();
    assert_eq!(found["count"], told["difference"]["pixels"]);
    // The page tells this less the other one, and the command the second less the first.
    let (page, command) = (number(&found, "/mean"), number(&told, "/difference/mean_mm"));
    assert!((page + command).abs() < 1e-6, "{page} {command}");
    assert_eq!(number(&found, "/in_sigma/one"), number(&told, "/difference/within_1_sigma"));
    assert_eq!(found["scan"]["shift_px"], told["motion"]["shift_px"]);
    assert_eq!(found["scan"]["places"], told["places"].as_array().unwrap().len());
    // The hollow of the other is 1.2 mm deeper, so this one is higher there.
    let columns = found["columns"].as_u64().unwrap() as usize;
    let at = |x: usize, y: usize| {
        let place = 4 + length + 4 * (y * columns + x);
        f32::from_le_bytes(reply.bytes[place..place + 4].try_into().unwrap())
    };
    assert_eq!(found["step"], 1);
    assert!((at(53, 99) - 1.2).abs() < 0.1, "{}", at(53, 99));

    let of = json!({ "sequence": "scans/after", "of": "0123456789abcdef" });
    assert_eq!(rig.post("sequences/compare", of).expect_err("other results").kind, RefusalKind::Outdated);
    let Err(size) = ask("seq") else { panic!("frames of another size were compared") };
    assert!(size.kind == RefusalKind::Wrong && size.message.contains("rows x"), "{size:?}");
    assert_eq!(ask("../scans/after").expect_err("outside").kind, RefusalKind::NotFound);
}
