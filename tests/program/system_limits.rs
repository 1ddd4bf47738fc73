//! Limits of the system that a person or a container has set, and a clock that is wrong: an error, or work without what is missing.

use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use crate::support::{images, names, succeeds};
use epirig_core::progress::Silent;
use epirig_data::sequence::{ExitStatus, Sequence, verify};
use rustix::fs::Mode;

const FRAMES: usize = 24;
const SCAN: [&str; 9] =
    ["capture", "--out", "seq", "--rig", "sim", "--size", "64x48", "--set", "plan.frames=24"];

/// `before` and then the program, as its own words.
fn run(folder: &Path, before: &[&str], arguments: &[&str]) -> Output {
    let program = env!("CARGO_BIN_EXE_epirig");
    let words: Vec<&str> = before.iter().chain([&program]).chain(arguments).copied().collect();
    Command::new(words[0])
        .args(&words[1..])
        .current_dir(folder)
        .env("XDG_CONFIG_HOME", folder)
        .env_remove("EPIRIG_LOG")
        .stdin(Stdio::null())
        .output()
        .unwrap()
}

/// It ended as a program ends, with an error if it failed.
fn assert_told(output: &Output, context: &str) {
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(!stderr.contains("panicked"), "{context}: {stderr}");
    let code = output.status.code().unwrap_or_else(|| panic!("{context}: {:?} {stderr}", output.status));
    assert!(
        code == 0 || stderr.lines().any(|line| line.starts_with("error: ")),
        "{context}: {code} {stderr}"
    );
}

/// The scan is whole.
fn assert_complete(folder: &Path) {
    let sequence = Sequence::open(&folder.join("seq")).unwrap();
    let report = verify(&sequence, &Silent).unwrap();
    assert_eq!((report.findings, report.good_frames), (Vec::new(), FRAMES));
}

/// A user of whom no other process exists, for whom the kernel counts threads; `None`, loudly, without the right to become one.
fn with_threads(most: usize) -> Option<Vec<String>> {
    let most = format!("--nproc={most}:{most}");
    let words = ["setpriv", "--reuid=61234", "--regid=61234", "--clear-groups", "prlimit", &most];
    let words = words.map(str::to_owned).to_vec();
    let tried = Command::new(&words[0]).args(&words[1..]).arg("true").output();
    match tried {
        Ok(output) if output.status.success() => Some(words),
        tried => {
            println!("SKIPPED: {words:?}: {tried:?}");
            None
        }
    }
}

/// A folder that everybody may write to, with the program in it: its own place may be closed to others.
fn open_to_all() -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    rustix::fs::chmod(folder.path(), Mode::from_raw_mode(0o777)).unwrap();
    let program = folder.path().join("epirig");
    std::fs::copy(env!("CARGO_BIN_EXE_epirig"), &program).unwrap();
    (folder, program)
}

#[test]
fn without_threads_it_works_alone_or_says_why_not() {
    for most in [1, 2, 3, 4, 6] {
        let Some(limited) = with_threads(most) else { return };
        let (folder, program) = open_to_all();
        let seq = folder.path().join("photos");
        images(&seq, 6);
        rustix::fs::chmod(&seq, Mode::from_raw_mode(0o755)).unwrap();
        let run = |arguments: &[&str]| {
            Command::new(&limited[0])
                .args(&limited[1..])
                .arg(&program)
                .args(arguments)
                .current_dir(folder.path())
                .env("XDG_CONFIG_HOME", folder.path())
                .stdin(Stdio::null())
                .output()
                .unwrap()
        };
        // What needs no second thread is done.
        let verbs: [&[&str]; 5] = [
            &["import", "photos", "--out", "imported"],
            &["match", "imported"],
            &SCAN,
            &["verify", "seq"],
            &["export", "imported", "--out", "map.npy"],
        ];
        for arguments in verbs {
            let output = run(arguments);
            assert_told(&output, &format!("{most} threads: {arguments:?}"));
            assert_eq!(output.status.code(), Some(0), "{most}: {arguments:?}: {output:?}");
        }
        assert_complete(folder.path());
        if most == 1 {
            let servers: [&[&str]; 3] =
                [&["view", "imported"], &["ui", "--rig", "sim"], &["simulate", "grbl", "--port", "port"]];
            for arguments in servers {
                let output = run(arguments);
                assert_told(&output, &format!("{arguments:?}"));
                assert_eq!(output.status.code(), Some(1), "{arguments:?}: {output:?}");
            }
            let stderr =
                String::from_utf8_lossy(&run(&["match", "imported", "--overwrite"]).stderr).into_owned();
            assert!(stderr.contains("allows no more threads"), "{stderr}");
        }
    }
}

#[test]
fn a_limit_of_file_sizes_is_like_a_full_disk() {
    let mut resumed = 0;
    // From nothing at all to more than the journal: the records have 4 and 16 kB, a frame has 1 kB.
    for bytes in [0, 1000, 2000, 4000, 6000, 8000, 12_000, 16_000, 32_000] {
        let folder = tempfile::tempdir().unwrap();
        let limit = format!("--fsize={bytes}:{bytes}");
        let output = run(folder.path(), &["prlimit", &limit], &SCAN);
        let context = format!("{bytes} bytes");
        assert_told(&output, &context);
        let stderr = String::from_utf8_lossy(&output.stderr);
        let begun = folder.path().join("seq").exists();
        match output.status.code() {
            Some(0) => {}
            Some(1) if !begun => assert!(stderr.contains("ulimit -f"), "{context}: {stderr}"),
            Some(7) => {
                assert!(stderr.contains("ulimit -f"), "{context}: {stderr}");
                let sequence = Sequence::open(&folder.path().join("seq")).unwrap();
                assert_eq!(
                    sequence.stop().map(|stop| stop.exit_status),
                    Some(ExitStatus::Failed),
                    "{context}"
                );
                succeeds(folder.path(), &["resume", "seq"]);
                resumed += 1;
            }
            code => panic!("{context}: {code:?} {stderr}"),
        }
        let left = names(folder.path());
        assert!(left.iter().all(|name| name == "seq"), "{context}: {left:?}");
        if begun {
            assert_complete(folder.path());
        }
    }
    assert!(resumed > 0, "no limit ended a scan in its middle");
}

#[test]
fn results_beyond_the_limit_of_file_sizes_leave_nothing() {
    let folder = tempfile::tempdir().unwrap();
    images(&folder.path().join("photos"), 8);
    succeeds(folder.path(), &["import", "photos", "--out", "seq"]);
    let before = names(&folder.path().join("seq"));
    for bytes in [0, 500, 5000] {
        let limit = format!("--fsize={bytes}:{bytes}");
        let output = run(folder.path(), &["prlimit", &limit], &["match", "seq"]);
        assert_told(&output, &format!("{bytes} bytes"));
        assert_eq!(output.status.code(), Some(1), "{output:?}");
        assert_eq!(names(&folder.path().join("seq")), before);
    }
}

/// A library that sets the clock of the program; `None`, loudly, where there is no C compiler.
fn clock_at(folder: &Path, seconds: i64) -> Option<PathBuf> {
    let (source, library) = (folder.join("clock.c"), folder.join("clock.so"));
    let text = format!(
        "#define _GNU_SOURCE\n#include <time.h>\n#include <unistd.h>\n#include <sys/syscall.h>\n\
         int clock_gettime(clockid_t clock, struct timespec *now) {{\n\
         if (syscall(SYS_clock_gettime, clock, now)) return -1;\n\
         if (clock == CLOCK_REALTIME) now->tv_sec = {seconds}L;\nreturn 0; }}\n"
    );
    std::fs::write(&source, text).unwrap();
    let built = Command::new("cc").args(["-shared", "-fPIC", "-o"]).arg(&library).arg(&source).output();
    match built {
        Ok(output) if output.status.success() => Some(library),
        built => {
            println!("SKIPPED: no library for the clock: {built:?}");
            None
        }
    }
}

#[test]
#[cfg(all(target_env = "gnu", target_pointer_width = "64"))]
fn any_clock_gives_records_that_can_be_read() {
    // A second before 1970, the years 1900, -1000 and 12000, and the ends of what the system can say.
    let clocks = [-1, -2_208_988_800, -93_724_128_000, 316_516_550_400, i64::MIN / 2, i64::MAX / 2];
    for seconds in clocks {
        let (folder, place) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
        let Some(library) = clock_at(place.path(), seconds) else { return };
        let preload = format!("LD_PRELOAD={}", library.display());
        let verbs: [&[&str]; 4] =
            [&SCAN, &["verify", "seq"], &["calibrate", "seq", "--target", "none"], &["match", "seq"]];
        for arguments in verbs {
            let output = run(folder.path(), &["env", &preload], arguments);
            assert_told(&output, &format!("{seconds}: {arguments:?}"));
            let is_needed = arguments[0] != "calibrate";
            assert!(!is_needed || output.status.success(), "{seconds}: {arguments:?}: {output:?}");
        }
        // Also by those whose clock is right.
        assert_complete(folder.path());
        let created = Sequence::open(&folder.path().join("seq")).unwrap().record().created.clone();
        println!("{seconds}: {created}");
        assert!(created.ends_with('Z') && !created.starts_with('-'), "{created}");
    }
}
