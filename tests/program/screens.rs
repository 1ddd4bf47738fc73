//! What a person sees on terminals of 80 and of 120 columns.

use std::fs::File;
use std::io::Read;
use std::os::fd::{AsFd, OwnedFd};
use std::path::Path;
use std::process::{Command, Stdio};

use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{Winsize, tcsetwinsize};

use crate::support::succeeds;

/// Which stream of the program is the terminal.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Stream {
    Stdout,
    Stderr,
}

/// A terminal of so many columns: the program's side, and the person's.
fn terminal(columns: u16) -> (OwnedFd, File) {
    let person = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).unwrap();
    grantpt(&person).unwrap();
    unlockpt(&person).unwrap();
    let name = ptsname(&person, Vec::new()).unwrap();
    let program = rustix::fs::open(
        name.as_c_str(),
        rustix::fs::OFlags::RDWR | rustix::fs::OFlags::NOCTTY,
        rustix::fs::Mode::empty(),
    )
    .unwrap();
    let size = Winsize { ws_row: 40, ws_col: columns, ws_xpixel: 0, ws_ypixel: 0 };
    tcsetwinsize(person.as_fd(), size).unwrap();
    (program, File::from(person))
}

/// What a terminal of so many columns shows of one stream; the other one is thrown away.
fn shown(folder: &Path, columns: u16, stream: Stream, arguments: &[&str]) -> String {
    let (program, mut person) = terminal(columns);
    let mut command = Command::new(env!("CARGO_BIN_EXE_epirig"));
    command
        .args(arguments)
        .current_dir(folder)
        .stdin(Stdio::null())
        .env("TERM", "xterm")
        .env_remove("NO_COLOR");
    match stream {
        Stream::Stdout => command.stdout(program).stderr(Stdio::null()),
        Stream::Stderr => command.stderr(program).stdout(Stdio::null()),
    };
    let mut running = command.spawn().unwrap();
    // The command holds the program's side open, and with it the terminal.
    drop(command);
    let mut bytes = Vec::new();
    let mut some = [0; 4096];
    // The kernel reports the end of a terminal as an error.
    while let Ok(count) = person.read(&mut some) {
        if count == 0 {
            break;
        }
        bytes.extend_from_slice(&some[..count]);
    }
    running.wait().unwrap();
    String::from_utf8(bytes).unwrap().replace("\r\n", "\n")
}

/// Text without colours.
fn plain(text: &str) -> String {
    let mut plain = String::new();
    let mut rest = text;
    while let Some((before, after)) = rest.split_once('\u{1b}') {
        plain.push_str(before);
        rest = after.split_once('m').map_or("", |(_, after)| after);
    }
    plain + rest
}

/// Every line fits, and none ends with a number whose unit begins the next.
fn assert_fits(text: &str, columns: u16) {
    let lines: Vec<String> = plain(text).lines().map(str::to_owned).collect();
    for line in &lines {
        assert!(line.chars().count() <= usize::from(columns), "{columns}: {line}");
    }
    for pair in lines.windows(2) {
        // A broken line goes on further to the right.
        let goes_on = pair[1].starts_with("  ") && !pair[0].is_empty();
        let ends_with_number = pair[0].trim_end().ends_with(|letter: char| letter.is_ascii_digit());
        let unit = pair[1].trim_start().split([' ', ',', ')']).next().unwrap_or_default();
        let is_unit = ["px", "mm", "%", "deg", "s", "um", "DN", "MB"].contains(&unit);
        assert!(!(goes_on && ends_with_number && is_unit), "{columns}: {} / {}", pair[0], pair[1]);
    }
}

#[test]
fn results_fit_into_80_and_120_columns() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    succeeds(folder, &["-q", "demo", "--size", "256", "--frames", "21", "--out", "d"]);
    let verbs: [&[&str]; 5] = [
        &["plan", "--rig", "sim"],
        &["match", "d", "--overwrite"],
        &["surface", "d", "--overwrite"],
        &["evaluate", "d", "--truth", "d/truth/disparity.pfm"],
        &["doctor", "--rig", "sim", "--short", "--set", "camera.size=256x256"],
    ];
    for columns in [80, 120] {
        for verb in verbs {
            let text = shown(folder, columns, Stream::Stdout, verb);
            assert!(text.lines().count() > 1, "{verb:?}: {text}");
            assert_fits(&text, columns);
        }
    }
}

#[test]
fn errors_are_red_and_break_between_words() {
    let folder = tempfile::tempdir().unwrap();
    let text = shown(folder.path(), 80, Stream::Stderr, &["match", "a folder"]);
    assert_eq!(
        text,
        "\u{1b}[1m\u{1b}[31merror:\u{1b}[0m a folder is no sequence: it has no sequence.json; make one of a folder of\n  \
         images with `epirig import`\n"
    );
    let wide = shown(folder.path(), 120, Stream::Stderr, &["match", "a folder"]);
    assert_eq!(wide.lines().count(), 1, "{wide}");
}

#[test]
fn printed_paths_can_be_pasted() {
    let folder = tempfile::tempdir().unwrap();
    let said = succeeds(folder.path(), &["demo", "--size", "64", "--frames", "11", "--out", "my tile"]);
    assert!(said.contains("'my tile/results/measured-and-truth.png'"), "{said}");
}
