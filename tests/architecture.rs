//! Data flows one way: a station knows those to its left only. The arrows are those of ARCHITECTURE.md.

#![allow(clippy::unwrap_used, reason = "a test stops at the first thing that does not work")]

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// Module and the modules that it may use.
const ARROWS: &[(&str, &[&str])] = &[
    ("plane", &[]),
    ("progress", &[]),
    ("memory", &[]),
    ("storage", &[]),
    ("tau", &[]),
    ("frame", &[]),
    ("adjust", &[]),
    ("lens", &["adjust"]),
    ("shift", &["frame", "plane"]),
    ("target", &["frame", "plane"]),
    ("volume", &["frame", "tau"]),
    ("photometry", &["frame", "plane", "shift", "volume"]),
    ("travel", &["adjust", "lens", "target"]),
    ("rectify", &["frame", "lens", "photometry", "plane", "tau", "volume"]),
    ("simulator", &["frame", "plane", "progress", "tau", "volume"]),
    ("link", &[]),
    ("stage", &["link"]),
    ("sequence", &["frame", "plane", "progress", "storage", "tau", "volume"]),
    ("camera", &["frame", "plane", "sequence", "stage", "simulator"]),
    ("profile", &["camera", "lens", "plane", "sequence", "storage"]),
    ("virtual_rig", &["camera", "frame", "link", "stage", "simulator"]),
    ("capture", &["camera", "frame", "progress", "sequence", "shift", "stage", "storage"]),
    ("doctor", &["camera", "capture", "frame", "plane", "progress", "shift", "stage"]),
    ("epi", &["plane", "progress", "tau", "volume"]),
    ("surface", &["plane"]),
    ("evaluate", &["epi", "plane", "progress", "tau", "volume"]),
    ("formats", &["plane"]),
    (
        "calibrate",
        &[
            "epi",
            "formats",
            "frame",
            "lens",
            "photometry",
            "plane",
            "progress",
            "rectify",
            "sequence",
            "storage",
            "target",
            "tau",
            "travel",
            "volume",
        ],
    ),
    ("report", &["calibrate", "epi", "lens", "photometry", "plane", "travel", "volume"]),
    ("results", &["epi", "formats", "plane", "storage"]),
    (
        "measure",
        &[
            "calibrate",
            "epi",
            "formats",
            "frame",
            "photometry",
            "plane",
            "progress",
            "report",
            "results",
            "sequence",
            "surface",
            "volume",
        ],
    ),
];

/// Where files may be touched, besides the command line.
const FILES: &[&str] = &[
    "src/link/",
    "src/calibrate/folder.rs",
    "src/memory.rs",
    "src/storage/",
    "src/sequence/",
    "src/results/",
    "src/camera/v4l2/discover.rs",
    "src/camera/v4l2/kernel/",
];

/// The only places with unsafe code.
const UNSAFE: [&str; 2] = ["src/camera/v4l2/kernel/", "src/cli/memory.rs"];

fn rust_files(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            rust_files(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(path);
        }
    }
}

/// The code of every module without its tests.
fn modules() -> BTreeMap<String, Vec<(PathBuf, String)>> {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    rust_files(&source, &mut files);
    let mut modules: BTreeMap<String, Vec<_>> = BTreeMap::new();
    for path in files {
        let inside = path.strip_prefix(&source).unwrap();
        let module = inside.components().next().unwrap().as_os_str().to_string_lossy().replace(".rs", "");
        let is_test = ["reference_tests.rs", "tests.rs"].iter().any(|name| inside.ends_with(name));
        if is_test || ["lib", "main"].contains(&module.as_str()) {
            continue;
        }
        let text = fs::read_to_string(&path).unwrap();
        let code = text.split("#[cfg(test)]\nmod tests").next().unwrap_or_default().to_owned();
        modules.entry(module).or_default().push((path, code));
    }
    modules
}

/// Names after `crate::` in code, also in `use crate::{a, b}`; comments do not count.
fn used(code: &str) -> BTreeSet<String> {
    let code: String = code.lines().filter(|line| !line.trim_start().starts_with("//")).collect();
    let word = |text: &str| text.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect::<String>();
    let mut names = BTreeSet::new();
    for rest in code.split("crate::").skip(1) {
        match rest.strip_prefix('{') {
            Some(group) => {
                let (mut depth, mut start) = (0, true);
                for (index, character) in group.char_indices() {
                    match character {
                        '{' => depth += 1,
                        '}' if depth == 0 => break,
                        '}' => depth -= 1,
                        ',' if depth == 0 => start = true,
                        c if start && !c.is_whitespace() => {
                            names.insert(word(&group[index..]));
                            start = false;
                        }
                        _ => {}
                    }
                }
            }
            None => {
                names.insert(word(rest));
            }
        }
    }
    names
}

#[test]
fn code_keeps_to_the_arrows() {
    let modules = modules();
    let allowed: BTreeMap<&str, &[&str]> = ARROWS.iter().copied().collect();
    let mut wrong = Vec::new();
    let mut arrows = 0;
    for (module, files) in modules.iter().filter(|(module, _)| *module != "cli") {
        let targets =
            allowed.get(module.as_str()).unwrap_or_else(|| panic!("{module} is not in the list of arrows"));
        for (path, code) in files {
            for name in used(code).iter().filter(|name| *name != module) {
                arrows += 1;
                if !targets.contains(&name.as_str()) {
                    wrong.push(format!("{}: uses {name}", path.display()));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "arrows that ARCHITECTURE.md does not allow:\n{}", wrong.join("\n"));
    assert!(arrows > 30, "the scan has gone blind: {arrows} arrows");
}

#[test]
fn the_list_of_arrows_has_no_cycle_and_nothing_unknown() {
    let modules = modules();
    let mut placed = BTreeSet::new();
    for (module, targets) in ARROWS {
        assert!(modules.contains_key(*module), "{module} is no module");
        for target in *targets {
            assert!(placed.contains(target), "{module} -> {target} does not point to the left");
        }
        placed.insert(*module);
    }
}

#[test]
fn domain_code_knows_no_files_no_terminal_and_no_command_line() {
    for (_, files) in modules().iter().filter(|(module, _)| *module != "cli") {
        for (path, code) in files {
            for word in
                ["println!", "eprintln!", "clap::", "indicatif::", "process::exit", "process::Command"]
            {
                assert!(!code.contains(word), "{}: {word}", path.display());
            }
            let place = path.strip_prefix(env!("CARGO_MANIFEST_DIR")).unwrap().to_str().unwrap();
            if !FILES.iter().any(|allowed| place.starts_with(allowed)) {
                assert!(
                    !code.contains("std::fs") && !code.contains("File::open"),
                    "{}: files",
                    path.display()
                );
            }
        }
    }
}

#[test]
fn unsafe_code_is_in_two_places_and_says_why_it_is_sound() {
    let modules = modules();
    let mut found = 0;
    for (path, code) in modules.values().flatten() {
        let place = path.strip_prefix(env!("CARGO_MANIFEST_DIR")).unwrap().to_str().unwrap();
        let lines = code.lines().filter(|line| !line.trim_start().starts_with("//"));
        let blocks = lines.filter(|line| line.contains("unsafe {") || line.contains("unsafe impl")).count();
        assert!(
            blocks == 0 || UNSAFE.iter().any(|unsafe_place| place.starts_with(unsafe_place)),
            "{place}: unsafe code"
        );
        assert!(
            code.matches("SAFETY:").count() >= blocks,
            "{place}: an unsafe block that does not say why it is sound"
        );
        found += blocks;
    }
    assert!(found >= 10, "the scan has gone blind: {found} blocks");
}

#[test]
fn the_picture_in_architecture_md_names_every_module() {
    let text = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("ARCHITECTURE.md")).unwrap();
    for (module, targets) in ARROWS {
        let row = text.lines().find(|line| line.starts_with(&format!("| `{module}` |")));
        let row = row.unwrap_or_else(|| panic!("ARCHITECTURE.md has no row for {module}"));
        for target in *targets {
            assert!(
                row.contains(&format!("`{target}`")),
                "the row of {module} does not name {target}: {row}"
            );
        }
    }
}
