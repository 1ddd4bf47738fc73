//! Messages for the user.

use std::fs;
use std::process::{Command, Stdio};

use super::{folder, imported};
use crate::support::{epirig, fails, images};

#[test]
fn errors_say_what_is_wrong_and_where() {
    let folder = folder();
    imported(folder.path());
    let path = folder.path().join("seq/sequence.json");
    let record = fs::read_to_string(&path).unwrap();
    let said = |arguments: &[&str]| {
        let output = epirig(folder.path(), arguments);
        (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
    };
    // Not UTF-8: the disk is not at fault.
    let mut bytes = record.clone().into_bytes();
    bytes[40] = 0xe9;
    fs::write(&path, bytes).unwrap();
    let (code, error) = said(&["match", "seq"]);
    assert_eq!(code, Some(5), "{error}");
    assert!(
        error.contains("UTF-8") && error.contains("sequence.json") && !error.contains("check the disk"),
        "{error}"
    );
    // A value of another type: its key and line.
    fs::write(&path, record.replace("\"bit_depth\": 8", "\"bit_depth\": \"eight\"")).unwrap();
    let (code, error) = said(&["match", "seq"]);
    assert_eq!(code, Some(5), "{error}");
    let line = record.lines().position(|line| line.contains("bit_depth")).unwrap() + 1;
    assert!(error.contains(&format!("line {line}: bit_depth")), "{error}");
    // Also within what is of several kinds, and in words that need no knowledge of the program.
    fs::write(&path, record.replace("\"conversions\": []", "\"conversions\": [\n7]")).unwrap();
    let (code, error) = said(&["match", "seq"]);
    assert_eq!(code, Some(5), "{error}");
    let line = record.lines().position(|line| line.contains("conversions")).unwrap() + 2;
    assert!(error.contains(&format!("line {line}: origin.conversions[0]: ")), "{error}");
    fs::write(&path, record.replace("\"rows\": 24", "\"rows\": \"a\"")).unwrap();
    let (_, error) = said(&["match", "seq"]);
    assert!(error.contains("rows") && error.contains("expected a whole number from 0 on"), "{error}");
    assert!(!error.contains("usize") && !error.contains("u64"), "{error}");
    fs::write(&path, &record).unwrap();
    let journal = folder.path().join("seq/journal.jsonl");
    let lines = fs::read_to_string(&journal).unwrap();
    fs::write(&journal, lines.replacen("\"mean_dn\":", "\"mean_dn\":\"dark\",\"x\":", 1)).unwrap();
    fails(folder.path(), &["match", "seq"], 5, &["journal.jsonl, line 1: mean_dn"]);
    fs::write(&journal, &lines).unwrap();
    // A size that the frames do not have: the record is at fault, and no frame is to be removed.
    fs::write(
        &path,
        record.replace("\"columns\": 64", "\"columns\": 160").replace("\"rows\": 24", "\"rows\": 1"),
    )
    .unwrap();
    let (code, error) = said(&["match", "seq"]);
    assert_eq!(code, Some(5), "{error}");
    assert!(
        error.contains("160 x 1") && error.contains("64 x 24") && !error.contains("remove it"),
        "{error}"
    );
    fs::write(&path, &record).unwrap();
    // A replay of a damaged sequence cannot be resumed.
    fs::write(folder.path().join("seq/frames/0004.png"), "damaged").unwrap();
    let replay = ["--driver", "sim", "--camera", "replay:seq", "--step-mm", "1.5", "--frames", "9"];
    let (code, error) = said(&[&["capture", "--out", "again"][..], &replay].concat());
    assert_eq!(code, Some(5), "{error}");
    assert!(error.contains("0004.png") && !error.contains("epirig resume"), "{error}");
}

#[test]
fn who_reads_no_further_is_told_nothing() {
    let folder = folder();
    for arguments in
        [&["completions", "bash"][..], &["plan", "--rig", "sim"], &["plan", "--rig", "sim", "--json"]]
    {
        let mut child = Command::new(env!("CARGO_BIN_EXE_epirig"))
            .args(arguments)
            .current_dir(folder.path())
            .env("XDG_CONFIG_HOME", folder.path())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        drop(child.stdout.take());
        let output = child.wait_with_output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success() && !said.contains("error"), "{arguments:?}: {said}");
    }
}

#[test]
fn a_sound_image_of_a_kind_that_is_not_read_is_not_called_damaged() {
    let folder = folder();
    images(&folder.path().join("photos"), 3);
    let map = epirig_core::grid::Grid::filled(24, 64, 0.5_f32);
    let bytes = epirig_data::formats::MapFormat::Tiff.encode(&map).unwrap();
    fs::remove_file(folder.path().join("photos/frame_1.png")).unwrap();
    fs::write(folder.path().join("photos/frame_1.tif"), bytes).unwrap();
    let output = epirig(folder.path(), &["import", "photos", "--out", "seq"]);
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(5), "{said}");
    assert!(
        said.contains("frame_1.tif") && said.contains("8 or 16 bit") && !said.contains("damaged"),
        "{said}"
    );
}

#[test]
fn words_of_a_file_make_no_lines_of_their_own() {
    let folder = folder();
    imported(folder.path());
    super::edit(
        folder.path(),
        "stop.json",
        "\"complete\"",
        "\"not-closed\", \"reason\": \"x\\nerror: fake\\u001b[31m\"",
    );
    let output = epirig(folder.path(), &["match", "seq"]);
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(5), "{said}");
    assert_eq!(said.lines().filter(|line| line.starts_with("error: ")).count(), 1, "{said}");
    assert!(said.contains("fake") && !said.contains('\u{1b}'), "{said}");
    let output = epirig(folder.path(), &["verify", "seq"]);
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(said.contains("not closed") || said.contains("positions are wrong"), "{said}");
    super::edit(folder.path(), "sequence.json", "\"uid\": \"", "\"uid\": \"\\u001b[31m");
    super::change_lines(folder.path(), |lines| lines[3]["commanded_mm"] = 1e308.into());
    let output = epirig(folder.path(), &["verify", "seq"]);
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(said.contains("1e308") && !said.contains('\u{1b}'), "{said}");
    assert!(said.lines().all(|line| line.len() < 400), "{said}");
}
