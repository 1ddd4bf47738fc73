//! The report that `surface` writes: what it says, that it stays inside its file, and that it can be replaced.

use std::fs;
use std::path::Path;

use crate::support::{fails, names, succeeds};

/// Elements that are not closed.
const VOID: [&str; 2] = ["meta", "img"];

/// Reads a page tag by tag: its text, and its tags with their attributes. Tags that are not closed in their order
/// are a failure.
fn parse(html: &str) -> (String, Vec<String>) {
    let body = html.strip_prefix("<!DOCTYPE html>").unwrap();
    let (mut text, mut tags, mut open) = (String::new(), Vec::new(), Vec::new());
    let mut rest = body;
    while let Some(start) = rest.find('<') {
        text.push_str(&rest[..start]);
        text.push(' ');
        let end = start + rest[start..].find('>').unwrap();
        let tag = &rest[start + 1..end];
        let name: String = tag.chars().take_while(|letter| letter.is_ascii_alphanumeric()).collect();
        match tag.strip_prefix('/') {
            Some(closed) => assert_eq!(open.pop().as_deref(), Some(closed), "after {text}"),
            None if VOID.contains(&&*name) => {}
            None => open.push(name),
        }
        // Values are escaped, so a tag has an even number of quotes and no other of its signs.
        assert_eq!(tag.matches('"').count() % 2, 0, "{tag}");
        tags.push(tag.to_owned());
        rest = &rest[end + 1..];
    }
    assert_eq!((open, rest.trim()), (Vec::<String>::new(), ""));
    (text.split_whitespace().collect::<Vec<_>>().join(" "), tags)
}

fn attribute<'a>(tag: &'a str, name: &str) -> Option<&'a str> {
    let start = tag.find(&format!(" {name}=\""))? + name.len() + 3;
    tag[start..].split('"').next()
}

/// A page that needs nothing from outside, and is for all readers.
fn check_page(html: &str) -> String {
    let (text, tags) = parse(html);
    let elements = |name: &str| {
        let wanted = format!("{name} ");
        tags.iter().filter(move |tag| tag.starts_with(&wanted)).cloned().collect::<Vec<_>>()
    };
    for tag in &tags {
        let is = |name: &str| tag == name || tag.starts_with(&format!("{name} "));
        assert!(!["script", "link", "iframe", "object", "embed"].into_iter().any(is), "{tag}");
        for place in ["src", "href"] {
            let leads = attribute(tag, place);
            assert!(leads.is_none_or(|to| to.starts_with("data:") || to.starts_with('#')), "{tag}");
        }
        assert!(!tag.contains("://"), "{tag}");
    }
    assert!(!html.contains("url(") && !html.contains("@import"));
    let pictures = elements("img");
    assert!(pictures.len() >= 6, "{} pictures", pictures.len());
    assert!(pictures.iter().all(|tag| attribute(tag, "alt").is_some_and(|alt| alt.len() > 20)));
    for heading in elements("th") {
        assert!(attribute(&heading, "scope").is_some(), "{heading}");
    }
    // Headings go down by one level at most, and each link leads to a section.
    let levels: Vec<u32> =
        tags.iter().filter_map(|tag| tag.strip_prefix('h')?.chars().next()?.to_digit(10)).collect();
    assert_eq!(levels.iter().filter(|level| **level == 1).count(), 1);
    assert!(levels.windows(2).all(|pair| pair[1] <= pair[0] + 1), "{levels:?}");
    for link in elements("a") {
        let to = attribute(&link, "href").and_then(|to| to.strip_prefix('#')).unwrap();
        assert!(elements("section").iter().any(|section| attribute(section, "id") == Some(to)), "{to}");
    }
    let words = || text.split(|letter: char| !letter.is_alphanumeric());
    assert!(!words().any(|word| ["NaN", "nan", "inf", "Infinity"].contains(&word)), "{text}");
    text
}

fn report(folder: &Path, sequence: &str) -> String {
    fs::read_to_string(folder.join(sequence).join("results/surface/report.html")).unwrap()
}

#[test]
fn the_report_tells_the_depth_and_needs_nothing_from_outside() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    succeeds(folder, &["-q", "demo", "--size", "512", "--frames", "21", "--out", "demo"]);
    let text = succeeds(folder, &["surface", "demo", "--json", "--overwrite"]);
    let found: serde_json::Value = serde_json::from_str(&text).unwrap();
    let html = report(folder, "demo");
    let text = check_page(&html);
    // The numbers of --json, to their last digit and as a person reads them.
    let number = |path: &str| found.pointer(path).and_then(serde_json::Value::as_f64);
    match number("/levels/depth/depth_mm") {
        Some(depth_mm) => {
            assert!(html.contains(&format!("<data value=\"{depth_mm}\">")), "{depth_mm}");
            assert!(text.contains("Depth of the hollows ") && text.contains("Uncertainty budget"), "{text}");
            assert!(text.contains("(95 % coverage, k = "), "{text}");
        }
        None => {
            let reason = found["no_levels"].as_str().unwrap();
            assert!(text.contains(&format!("No step height (planned: 0.2 mm): {reason}")), "{text}");
        }
    }
    // The lens of the demo is exactly as stated.
    assert_eq!(found["scale_sigma"]["focal_length"], 0.0);
    assert!(text.contains("Scale: focal length and baseline taken as exact."), "{text}");
    let uid = found["sequence_uid"].as_str().unwrap();
    let hash = blake3::hash(&fs::read(folder.join("demo/results/disparity.tiff")).unwrap());
    assert!(text.contains(uid) && text.contains(&*hash.to_hex()));
    assert!(
        text.contains("The scan is complete: all 21 planned frames are there.")
            && text.contains("No frame was taken again.")
    );
    assert!(html.len() < 5_000_000, "{}", html.len());

    fails(folder, &["surface", "demo"], 2, &["--overwrite"]);
    let said = succeeds(folder, &["surface", "demo", "--trend", "plane", "--overwrite"]);
    assert!(said.contains("report.html"), "{said}");
    assert!(check_page(&report(folder, "demo")).contains("form plane"));
    succeeds(folder, &["-q", "match", "demo", "--overwrite"]);
    assert!(!names(&folder.join("demo/results")).contains(&"surface".to_owned()));
}

/// Letters that mean something in HTML, in the name of a folder.
#[cfg(unix)]
#[test]
fn a_hostile_name_stays_text() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let name = "<img src=x onerror=alert(1)>&\"'";
    succeeds(folder, &["-q", "demo", "--size", "256", "--frames", "9", "--out", "demo"]);
    fs::rename(folder.join("demo"), folder.join(name)).unwrap();
    succeeds(folder, &["-q", "surface", name, "--overwrite"]);
    let html = report(folder, name);
    assert!(check_page(&html).contains("&lt;img src=x onerror=alert(1)&gt;&amp;&quot;'"));
}

#[test]
fn a_run_ends_with_a_report() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let small = ["--rig", "sim", "--set", "camera.size=256x256", "--set", "plan.frames=9", "--anyway"];
    let text = succeeds(folder, &[&["run", "--out", "tile", "--json"][..], &small].concat());
    let found: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert!(found["surface"]["roughness"]["sq_mm"].as_f64().is_some(), "{text}");
    // The profile of the simulated rig states no uncertainty of its lens, so it is that of a data sheet.
    let scale = serde_json::json!({"focal_length": 0.02, "baseline": null});
    assert_eq!(found["surface"]["scale_sigma"], scale);
    check_page(&report(folder, "tile"));
    // They are the results of `surface`.
    fails(folder, &["surface", "tile"], 2, &["--overwrite"]);
    succeeds(folder, &["-q", "surface", "tile", "--overwrite"]);
}
