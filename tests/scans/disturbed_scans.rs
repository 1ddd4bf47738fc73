//! Another program removes, replaces or renames files of a sequence while a scan writes it: the scan never passes for complete without
//! its files, and never writes into a folder that is not its own.

use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};

use crate::scans::{FRAMES, assert_whole, plan, scan, simulator};
use epirig::capture::{CaptureError, PauseSwitch};
use epirig_data::sequence::{ExitStatus, Sequence, SequenceError};
use epirig_data::storage::{Disk, DiskStep, RealDisk};

/// The real disk, to which something is done once, after a number of lines of the journal.
struct Tampered<F> {
    lines: usize,
    act: Option<F>,
}

impl<F: FnOnce() + Send> Disk for Tampered<F> {
    fn act(&mut self, step: DiskStep<'_>) -> io::Result<()> {
        RealDisk.act(step)?;
        let DiskStep::Sync(path) = step else { return Ok(()) };
        if path.file_name().is_some_and(|name| name == "journal.jsonl") {
            self.lines = self.lines.saturating_sub(1);
        }
        if let Some(act) = self.act.take_if(|_| self.lines == 0) {
            act();
        }
        Ok(())
    }
}

/// Syncs of the journal until it names four calibration frames and two frames of the scan: the first is that of the empty journal.
const IN_THE_MIDDLE: usize = 1 + 4 + 2;
/// Until the last frame is there.
const AT_THE_END: usize = 1 + 4 + FRAMES;

/// A place for the sequence `seq`, and a scan to which `act` is done after `lines` syncs of the journal.
fn disturbed(
    lines: usize,
    act: impl FnOnce(PathBuf) + Send + 'static,
) -> (tempfile::TempDir, Result<(), CaptureError>) {
    let simulator = simulator();
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("seq");
    let at = out.clone();
    let disk = Box::new(Tampered { lines, act: Some(move || act(at)) });
    let ended = scan(&simulator, &plan(&simulator), &out, disk, &PauseSwitch::default());
    (folder, ended.map(drop))
}

/// Refused because of what another program did, in these words.
fn is_disturbed(ended: &Result<(), CaptureError>, words: &str) -> bool {
    match ended {
        Err(error @ CaptureError::Sequence(SequenceError::Disturbed { .. })) => {
            println!("{error}");
            error.to_string().contains(words)
        }
        _ => false,
    }
}

/// All files below a folder, with what they hold.
fn files(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        match path.is_dir() {
            true => found.extend(files(&path)),
            false => drop(found.insert(path.clone(), std::fs::read(&path).unwrap())),
        }
    }
    found
}

#[test]
fn a_journal_that_is_not_as_it_was_left_ends_the_scan() {
    let acts: [fn(PathBuf); 4] = [
        |seq| std::fs::remove_file(seq.join("journal.jsonl")).unwrap(),
        // The same lines in another file: ours is not theirs.
        |seq| {
            let journal = seq.join("journal.jsonl");
            let text = std::fs::read(&journal).unwrap();
            std::fs::remove_file(&journal).unwrap();
            std::fs::write(&journal, text).unwrap();
        },
        |seq| std::fs::write(seq.join("journal.jsonl"), "").unwrap(),
        |seq| {
            std::fs::remove_file(seq.join("journal.jsonl")).unwrap();
            std::os::unix::fs::symlink("../elsewhere", seq.join("journal.jsonl")).unwrap();
        },
    ];
    for lines in [IN_THE_MIDDLE, AT_THE_END] {
        for act in acts {
            let (folder, ended) = disturbed(lines, act);
            assert!(is_disturbed(&ended, "journal.jsonl was removed, replaced or changed"), "{ended:?}");
            // Nothing was added to what there is now.
            let journal = std::fs::read_to_string(folder.path().join("seq/journal.jsonl"));
            assert!(journal.is_err() || [0, lines - 1].contains(&journal.unwrap().lines().count()));
            assert!(!folder.path().join("elsewhere").exists());
            assert!(!folder.path().join("seq/stop.json").exists());
        }
    }
}

#[test]
fn frames_that_vanish_are_missed_and_taken_again() {
    type Act = fn(PathBuf);
    let acts: [(&str, Act); 5] = [
        ("frames/0001.png was removed or changed", |seq| {
            std::fs::remove_file(seq.join("frames/0001.png")).unwrap();
        }),
        ("frames/0000.png was removed or changed", |seq| {
            std::fs::write(seq.join("frames/0000.png"), "").unwrap();
        }),
        ("board/0001.png was removed or changed", |seq| {
            std::fs::remove_file(seq.join("board/0001.png")).unwrap();
        }),
        ("dark/0000.png was removed or changed", |seq| {
            std::fs::remove_dir_all(seq.join("dark")).unwrap();
        }),
        ("by another program", |seq| std::fs::remove_dir_all(seq.join("frames")).unwrap()),
    ];
    let simulator = simulator();
    for lines in [IN_THE_MIDDLE, AT_THE_END] {
        for (words, act) in acts {
            let (folder, ended) = disturbed(lines, act);
            assert!(is_disturbed(&ended, words), "{ended:?}");
            let out = folder.path().join("seq");
            let stop = Sequence::open(&out).unwrap().stop().cloned().unwrap();
            assert_eq!(stop.exit_status, ExitStatus::Failed);
            assert!(stop.reason.unwrap().contains(words));
            let plan = plan(&simulator);
            scan(&simulator, &plan, &out, Box::new(RealDisk), &PauseSwitch::default()).unwrap();
            assert_whole(&simulator, &out);
        }
    }
}

#[test]
fn frames_of_others_in_place_of_its_own_keep_every_byte() {
    let (folder, ended) = disturbed(IN_THE_MIDDLE, |seq| {
        std::fs::rename(seq.join("frames"), seq.with_file_name("frames")).unwrap();
        std::fs::create_dir(seq.join("frames")).unwrap();
        (0..FRAMES).for_each(|index| {
            std::fs::write(seq.join(format!("frames/{index:04}.png")), "theirs").unwrap();
        });
    });
    assert!(is_disturbed(&ended, "frames was removed or replaced"), "{ended:?}");
    let theirs = files(&folder.path().join("seq/frames"));
    assert!(theirs.len() == FRAMES && theirs.values().all(|bytes| bytes == b"theirs"));
    // Put back, it is gone on with.
    std::fs::remove_dir_all(folder.path().join("seq/frames")).unwrap();
    std::fs::rename(folder.path().join("frames"), folder.path().join("seq/frames")).unwrap();
    let (out, simulator) = (folder.path().join("seq"), simulator());
    scan(&simulator, &plan(&simulator), &out, Box::new(RealDisk), &PauseSwitch::default()).unwrap();
    assert_whole(&simulator, &out);
}

#[test]
fn a_folder_that_is_removed_is_not_made_again() {
    for lines in [2, IN_THE_MIDDLE, AT_THE_END] {
        let (folder, ended) = disturbed(lines, |seq| std::fs::remove_dir_all(seq).unwrap());
        assert!(is_disturbed(&ended, "the folder was removed"), "{ended:?}");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    }
}

#[test]
#[cfg(target_os = "linux")]
fn a_folder_that_is_renamed_is_written_to_its_end_and_told() {
    // The first line of the journal, the scan's first frames, its last.
    for lines in [2, IN_THE_MIDDLE, AT_THE_END] {
        let (folder, ended) = disturbed(lines, |seq| {
            std::fs::rename(&seq, seq.with_file_name("other name")).unwrap();
        });
        let other = folder.path().canonicalize().unwrap().join("other name");
        let Err(CaptureError::Sequence(SequenceError::Renamed { now, .. })) = &ended else {
            panic!("{ended:?}")
        };
        assert_eq!(*now, other);
        assert!(ended.unwrap_err().to_string().contains("other name'"));
        assert_whole(&simulator(), &other);
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}

#[test]
#[cfg(target_os = "linux")]
fn another_sequence_in_its_place_keeps_every_byte() {
    let simulator = simulator();
    let place = tempfile::tempdir().unwrap();
    let theirs = place.path().join("theirs");
    let plan = plan(&simulator);
    scan(&simulator, &plan, &theirs, Box::new(RealDisk), &PauseSwitch::default()).unwrap();
    let before: Vec<Vec<u8>> = files(&theirs).into_values().collect();
    for lines in [2, IN_THE_MIDDLE, AT_THE_END] {
        let from = theirs.clone();
        let (folder, ended) = disturbed(lines, move |seq| {
            std::fs::rename(&seq, seq.with_file_name("ours")).unwrap();
            std::fs::rename(from, seq).unwrap();
        });
        assert!(matches!(ended, Err(CaptureError::Sequence(SequenceError::Renamed { .. }))), "{ended:?}");
        let after: Vec<Vec<u8>> = files(&folder.path().join("seq")).into_values().collect();
        assert!(after == before, "{lines}");
        assert_whole(&simulator, &folder.path().join("ours"));
        std::fs::rename(folder.path().join("seq"), &theirs).unwrap();
    }
}

#[test]
#[cfg(target_os = "linux")]
fn who_interrupts_a_renamed_scan_is_told_where_it_is() {
    let simulator = simulator();
    let folder = tempfile::tempdir().unwrap();
    let (out, pause) = (folder.path().join("seq"), PauseSwitch::default());
    let (at, press) = (out.clone(), pause.clone());
    let act = move || {
        std::fs::rename(&at, at.with_file_name("other")).unwrap();
        press.press();
    };
    let disk = Box::new(Tampered { lines: IN_THE_MIDDLE, act: Some(act) });
    let error = scan(&simulator, &plan(&simulator), &out, disk, &pause).unwrap_err();
    let words = error.to_string();
    let CaptureError::Interrupted { folder: told, done, .. } = error else { panic!("{error}") };
    let other = folder.path().canonicalize().unwrap().join("other");
    assert_eq!(told, other);
    // The one that was written, and what was on its way meanwhile.
    assert_eq!(done, Sequence::open(&other).unwrap().frames().len());
    assert!(done >= 2 && words.contains(&format!("{done} of {FRAMES} frames are in")), "{words}");
    scan(&simulator, &plan(&simulator), &other, Box::new(RealDisk), &PauseSwitch::default()).unwrap();
    assert_whole(&simulator, &other);
}
