//! The manual pages, against `--help` and as groff reads them.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use std::process::Command;

use crate::support::{fails, names, succeeds};

/// The verbs that the help of a command lists.
fn listed(folder: &Path, command: &[&str]) -> Vec<String> {
    let help = succeeds(folder, &[command, &["--help"]].concat());
    let list = help.lines().skip_while(|line| *line != "Commands:").skip(1);
    let names = list.take_while(|line| !line.is_empty()).filter(|line| !line.starts_with("   "));
    names
        .filter_map(|line| line.split_whitespace().next())
        .filter(|name| *name != "help")
        .map(Into::into)
        .collect()
}

/// All commands, as words behind `epirig`.
fn commands(folder: &Path, command: &[&str]) -> Vec<Vec<String>> {
    let own = command.iter().map(ToString::to_string).collect();
    let below = listed(folder, command).into_iter();
    let below = below.flat_map(|name| commands(folder, &[command, &[name.as_str()]].concat()));
    std::iter::once(own).chain(below).collect()
}

fn page_of(command: &[String]) -> String {
    format!("{}.1", [&["epirig".to_owned()], command].concat().join("-"))
}

#[test]
fn each_command_has_a_page_with_its_options_and_examples() {
    let folder = tempfile::tempdir().unwrap();
    let said = succeeds(folder.path(), &["manual", "--out", "share/man1"]);
    let commands = commands(folder.path(), &[]);
    let pages: BTreeSet<String> = commands.iter().map(|command| page_of(command)).collect();
    for known in ["epirig.1", "epirig-match.1", "epirig-stage-move.1", "epirig-camera-set.1"] {
        assert!(pages.contains(known), "{pages:?}");
    }
    assert_eq!(names(&folder.path().join("share/man1")), Vec::from_iter(pages));
    assert!(said.contains(&format!("{} pages", commands.len())), "{said}");
    for command in &commands {
        let words: Vec<&str> = command.iter().map(String::as_str).chain(["--help"]).collect();
        let help = succeeds(folder.path(), &words);
        let page = fs::read_to_string(folder.path().join("share/man1").join(page_of(command))).unwrap();
        let page = page.replace("\\-", "-").replace("\\*(Aq", "'");
        // Texts are indented farther than options are.
        let beginnings = help.lines().filter(|line| !line.starts_with("       "));
        let options =
            beginnings.filter_map(|line| line.trim_start().split_once("--")).filter_map(|(before, after)| {
                // `-q, --quiet` and `--out <DIR>` begin a line; other lines only speak of options.
                let begins = before.is_empty() || (before.len() == 4 && before.starts_with('-'));
                begins.then(|| after.split([' ', '=', '.']).next().unwrap_or_default())
            });
        for option in options {
            assert!(page.contains(&format!("--{option}")), "{command:?} lacks --{option}: {page}");
        }
        let examples = help.lines().skip_while(|line| !matches!(*line, "Example:" | "Examples:")).skip(1);
        // Long lines go on in the next one on a terminal, not in a page.
        for example in
            examples.take_while(|line| !line.is_empty()).filter(|line| line.starts_with("  epirig"))
        {
            assert!(page.contains(&format!("\n{example}")), "{command:?} lacks {example:?}: {page}");
        }
    }
}

#[test]
fn groff_and_man_show_the_pages_without_a_warning() {
    let folder = tempfile::tempdir().unwrap();
    succeeds(folder.path(), &["manual", "--out", "pages"]);
    let pages = names(&folder.path().join("pages"));
    if Command::new("groff").arg("--version").output().is_err() {
        eprintln!("SKIPPED groff_and_man_show_the_pages_without_a_warning: there is no groff");
        return;
    }
    let inside = folder.path().join("pages");
    // The lines of examples are not joined and not broken, and what a shell reads stays as it is.
    for (page, example) in [
        ("epirig-match.1", "epirig match seq"),
        ("epirig-match.1", "epirig match seq --range 420..434 --out results          a range that is known"),
        (
            "epirig-stage-console.1",
            "epirig stage console --driver grbl '$10=1' '$$'       sends two lines, and ends",
        ),
    ] {
        let shown = Command::new("groff")
            .args(["-man", "-Tutf8", "-P-cbou", "-rLL=120n", page])
            .current_dir(&inside)
            .output()
            .unwrap();
        let text = String::from_utf8(shown.stdout).unwrap();
        assert!(text.lines().any(|line| line.trim() == example), "{text}");
    }
    for page in &pages {
        let read = Command::new("groff")
            .args(["-man", "-ww", "-Tutf8", "-z", page])
            .current_dir(&inside)
            .output()
            .unwrap();
        let warned = String::from_utf8_lossy(&read.stderr);
        assert!(read.status.success() && warned.is_empty(), "{page}: {warned}");
    }
    let Ok(shown) = Command::new("man")
        .env("LC_ALL", "C.UTF-8")
        .args(["-l", "pages/epirig.1"])
        .current_dir(&folder)
        .output()
    else {
        eprintln!("SKIPPED groff_and_man_show_the_pages_without_a_warning: there is no man");
        return;
    };
    // Lines are filled with spaces.
    let text = String::from_utf8_lossy(&shown.stdout).split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(
        shown.status.success() && text.contains("epirig-stage(1)") && text.contains("Exit codes"),
        "{text}"
    );
}

#[test]
fn pages_that_are_there_are_not_replaced() {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("pages")).unwrap();
    fs::write(folder.path().join("pages/epirig-match.1"), "mine").unwrap();
    fails(folder.path(), &["manual", "--out", "pages"], 2, &["epirig-match.1", "exists already"]);
    assert_eq!(names(&folder.path().join("pages")), ["epirig-match.1"]);
    assert_eq!(fs::read(folder.path().join("pages/epirig-match.1")).unwrap(), b"mine");
    fs::write(folder.path().join("file"), "").unwrap();
    fails(folder.path(), &["manual", "--out", "file/pages"], 1, &["cannot make", "file/pages"]);
}
