//! A match in bands: whoever matches them in whatever order, and whatever happens to them, the maps are those of one
//! process, or the merge says what is missing.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use crate::packed::same_maps;
use crate::size::repetitions;
use crate::small_rig::import_all;
use crate::support::{epirig, fails, names, succeeds, write_png};
use epirig_core::frame::{Frame, Samples};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const SURVEY: [&str; 5] = ["match", "seq", "--survey", "--block-rows", "4"];

/// The sequence of the small rig, and its maps by one process as `whole`, in blocks of 4 rows.
fn matched(path: &Path, more: &[&str]) {
    import_all(path, "seq");
    succeeds(path, &[&["match", "seq", "--out", "whole", "--block-rows", "4"], more].concat());
}

fn band(path: &Path, band: usize) -> String {
    succeeds(path, &["match", "seq", "--band", &band.to_string()])
}

#[test]
fn any_number_of_bands_gives_the_bits_of_one_process() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    matched(path, &[]);
    // With a calibration and a region: 136 rows are 34 blocks.
    succeeds(path, &["-q", "calibrate", "seq"]);
    let region = ["--region", "40,60,200,195"];
    succeeds(path, &[&["match", "seq", "--out", "part", "--block-rows", "4"], &region[..]].concat());
    for (bands, expected, more) in
        [(1, "whole", &["--as-captured"][..]), (2, "part", &region), (7, "part", &region)]
    {
        let asked = ["--bands", &bands.to_string(), "--overwrite"];
        succeeds(path, &[&SURVEY[..], &asked, more].concat());
        (0..bands).rev().for_each(|k| drop(band(path, k)));
        succeeds(path, &["match", "seq", "--merge", "--overwrite"]);
        same_maps(&path.join(expected), &path.join("seq/results"));
    }
    let told =
        succeeds(path, &[&SURVEY[..], &["--bands", "64", "--overwrite", "--as-captured", "--json"]].concat());
    let plan: serde_json::Value = serde_json::from_str(&told).unwrap();
    assert_eq!(plan["task"]["bands"].as_array().unwrap().len(), 64);
    // Several at a time, each with a number of threads of its own.
    std::thread::scope(|scope| {
        for first in 0..2 {
            scope.spawn(move || {
                for k in (first..64).step_by(2) {
                    let mut command = assert_cmd::cargo::cargo_bin_cmd!("epirig");
                    command.env("RAYON_NUM_THREADS", (1 + k % 3).to_string()).current_dir(path);
                    command.args(["match", "seq", "--band", &k.to_string()]).assert().success();
                }
            });
        }
    });
    // A survey of the same match leaves all as it is.
    succeeds(path, &[&SURVEY[..], &["--bands", "64", "--as-captured"]].concat());
    succeeds(path, &["match", "seq", "--merge", "--overwrite"]);
    same_maps(&path.join("whole"), &path.join("seq/results"));
}

#[test]
fn what_is_missing_damaged_or_of_another_plan_is_told_and_matched_again() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    matched(path, &["--range", "0..12"]);
    fails(path, &["match", "seq", "--band", "0"], 2, &["seq/bands has no plan", "--survey"]);
    // Parts of a plan with another range.
    succeeds(path, &[&SURVEY[..], &["--bands", "4", "--range", "0..9"]].concat());
    (0..4).for_each(|k| drop(band(path, k)));
    fs::rename(path.join("seq/bands"), path.join("other")).unwrap();
    succeeds(path, &[&SURVEY[..], &["--bands", "4", "--range", "0..12"]].concat());
    fails(path, &["match", "seq", "--band", "4"], 2, &["there is no band 4; the last is 3"]);
    for useless in [&["--quick"][..], &["--method", "variance"], &["--bands", "4"], &["--mask", "x.png"]] {
        let arguments = [&["match", "seq", "--band", "1"], useless].concat();
        fails(path, &arguments, 2, &["cannot be used with"]);
    }
    let two = [&SURVEY[..], &["--bands", "2", "--range", "0..12"]].concat();
    fails(path, &two, 2, &["the plan of another match (other bands)", "--overwrite"]);
    [0, 2, 3].into_iter().for_each(|k| drop(band(path, k)));
    let parts: Vec<String> =
        names(&path.join("seq/bands")).into_iter().filter(|name| name.ends_with("part")).collect();
    assert_eq!(parts.len(), 48);
    let part = |name: &str| path.join("seq/bands").join(name);
    let bytes = fs::read(part("00003.part")).unwrap();
    fs::write(part("00003.part"), &bytes[..bytes.len() / 2]).unwrap();
    fs::copy(path.join("other/00040.part"), part("00040.part")).unwrap();
    let words = ["0 (damaged), 1 (not there), 2 (of another plan);", "--band K"];
    fails(path, &["match", "seq", "--merge"], 5, &words);
    assert!(!path.join("seq/results").exists());
    assert!(band(path, 0).contains("15 of its 16 blocks were before"));
    assert!(band(path, 3).contains("was matched already"));
    [1, 2].into_iter().for_each(|k| drop(band(path, k)));
    succeeds(path, &["match", "seq", "--merge"]);
    same_maps(&path.join("whole"), &path.join("seq/results"));
    // The plan is of the frames and the calibration at the time of the survey.
    fs::remove_dir_all(path.join("seq/volume.zarr")).unwrap();
    fs::remove_file(part("00003.part")).unwrap();
    fails(path, &["match", "seq", "--band", "0"], 2, &["the packed frames are gone", "--survey"]);
    let plan = fs::read_to_string(part("plan.json")).unwrap();
    for (from, to, words) in [
        ("\"epirig 0", "\"epirig 7.0", "another version of epirig"),
        ("\"maximum_px\": 12.0", "\"maximum_px\": 13.0", "of another plan"),
    ] {
        assert!(plan.contains(from));
        fs::write(part("plan.json"), plan.replace(from, to)).unwrap();
        fails(path, &["match", "seq", "--merge", "--overwrite"], 5, &[words]);
    }
    // What contradicts itself is no plan.
    let blocks = "\"start\": 0";
    for (from, to, words) in [
        (blocks, "\"start\": 1", "its bands are not those of its blocks"),
        ("\"rows\": 256", "\"rows\": 1099511627776", "frames of another size"),
        ("\"overview\": {", "\"overview\": null, \"former\": {", "former"),
    ] {
        assert!(plan.contains(from), "{from}");
        fs::write(part("plan.json"), plan.replacen(from, to, 1)).unwrap();
        fails(path, &["match", "seq", "--merge", "--overwrite"], 5, &[words]);
    }
    let wide = plan.replace("\"maximum_px\": 12.0", "\"maximum_px\": 1e300");
    fs::write(part("plan.json"), wide).unwrap();
    assert_ne!(epirig(path, &["match", "seq", "--band", "0"]).status.code(), Some(0));
    fs::write(part("plan.json"), &plan[..plan.len() / 2]).unwrap();
    fails(path, &["match", "seq", "--merge", "--overwrite"], 5, &["plan.json", "--survey --overwrite"]);
}

#[test]
fn a_survey_replaces_nothing_but_a_plan_and_a_mask_is_part_of_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    import_all(path, "seq");
    let bands = path.join("seq/bands");
    fs::create_dir(&bands).unwrap();
    fs::write(bands.join("notes.txt"), "mine").unwrap();
    for more in [&[][..], &["--overwrite"]] {
        let words = ["seq/bands holds notes.txt", "move it away"];
        fails(path, &[&SURVEY[..], more].concat(), 2, &words);
    }
    fs::remove_file(bands.join("notes.txt")).unwrap();
    let mask = |name: &str, from: usize| {
        let inside = (0..256 * 256).map(|pixel| if pixel % 256 > from { 255 } else { 0 }).collect();
        let frame = Frame::new(256, 256, 8, Samples::U8(inside)).unwrap();
        write_png(&path.join(name), &frame);
    };
    mask("one.png", 100);
    mask("other.png", 150);
    let masked = [&SURVEY[..], &["--bands", "2", "--mask", "one.png"]].concat();
    succeeds(path, &masked);
    band(path, 0);
    // The same survey again packs what is missing, and keeps what is matched.
    fs::remove_dir_all(path.join("seq/volume.zarr")).unwrap();
    fails(path, &["match", "seq", "--band", "1"], 2, &["the packed frames are gone"]);
    succeeds(path, &[&masked[..], &["--overwrite"]].concat());
    assert!(band(path, 0).contains("was matched already"));
    fs::copy(path.join("other.png"), bands.join("mask.png")).unwrap();
    fails(path, &["match", "seq", "--band", "1"], 5, &["mask.png is another one", "--survey --overwrite"]);
    fs::remove_file(bands.join("plan.json")).unwrap();
    fails(path, &masked, 2, &["parts without their plan", "--overwrite"]);
    // A region that is one block is read as a part, too.
    let region = ["--region", "0,100,255,120"];
    succeeds(path, &[&["match", "seq", "--survey", "--overwrite"][..], &region].concat());
    band(path, 0);
    succeeds(path, &["match", "seq", "--merge"]);
    succeeds(path, &[&["match", "seq", "--out", "region"][..], &region].concat());
    same_maps(&path.join("region"), &path.join("seq/results"));
}

#[test]
fn bands_that_are_killed_or_matched_twice_at_once_leave_no_wrong_map() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    matched(path, &[]);
    succeeds(path, &[&SURVEY[..], &["--bands", "2"]].concat());
    let spawned = |k: usize| {
        Command::new(assert_cmd::cargo::cargo_bin!("epirig"))
            .args(["match", "seq", "--band", &k.to_string()])
            .current_dir(path)
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap()
    };
    let begun = Instant::now();
    assert!(spawned(0).wait().unwrap().success());
    let whole = begun.elapsed();
    let forget = |share: f64, random: &mut ChaCha8Rng| {
        for name in names(&path.join("seq/bands")).iter().filter(|name| name.ends_with(".part")) {
            if random.random::<f64>() < share {
                fs::remove_file(path.join("seq/bands").join(name)).unwrap();
            }
        }
    };
    let mut random = ChaCha8Rng::seed_from_u64(45);
    for _ in 0..repetitions(50) {
        forget(0.5, &mut random);
        // Two processes match the same band, and another process the other one; each is killed at some moment.
        let mut running = [spawned(0), spawned(0), spawned(1)];
        for process in &mut running {
            sleep(Duration::from_secs_f64(whole.as_secs_f64() * 0.5 * random.random::<f64>()));
            // One that has ended already cannot be killed.
            let _ = process.kill();
            process.wait().unwrap();
        }
        let merge = epirig(path, &["match", "seq", "--merge", "--overwrite"]);
        match merge.status.code() {
            Some(0) => same_maps(&path.join("whole"), &path.join("seq/results")),
            Some(5) => assert!(String::from_utf8_lossy(&merge.stderr).contains("missing or not to be used")),
            code => panic!("{code:?}: {}", String::from_utf8_lossy(&merge.stderr)),
        }
        // A second submission heals.
        [0, 1].into_iter().for_each(|k| drop(band(path, k)));
        succeeds(path, &["match", "seq", "--merge", "--overwrite"]);
        same_maps(&path.join("whole"), &path.join("seq/results"));
    }
    let left: Vec<String> =
        names(&path.join("seq/bands")).into_iter().filter(|name| !name.ends_with(".part")).collect();
    assert!(left.iter().all(|name| name == "plan.json" || name.starts_with('.')), "{left:?}");
}

/// An `sbatch` that does the job at once, element by element, and counts the jobs. It refuses a job whose dependency has
/// failed, as Slurm cancels it.
const SBATCH: &str = r#"#!/bin/bash
set -u
cat > "$STATE/script"
number=$(($(ls "$STATE" | grep -c '^job') + 1))
after=$(printf '%s\n' "$@" | sed -n 's/^--dependency=afterok://p')
elements=$(sed -n 's/^#SBATCH --array=0-\([0-9]*\).*/\1/p' "$STATE/script")
status=0
if [ -n "$after" ] && [ "$(cat "$STATE/job$after")" != 0 ]; then
  status=cancelled
elif [ -n "$elements" ]; then
  for element in $(seq 0 "$elements"); do
    SLURM_ARRAY_TASK_ID=$element SLURM_CPUS_PER_TASK=2 bash "$STATE/script" >> "$STATE/log" 2>&1 || status=1
  done
else
  bash "$STATE/script" >> "$STATE/log" 2>&1 || status=1
fi
echo "$status" > "$STATE/job$number"
echo "$number;cluster"
"#;

#[test]
fn submitted_bands_and_sequences_are_matched_and_what_failed_is_sent_again() {
    let folder = tempfile::tempdir().unwrap();
    let path = &folder.path().canonicalize().unwrap();
    matched(path, &[]);
    fs::create_dir(path.join("state")).unwrap();
    let sbatch = path.join("sbatch");
    fs::write(&sbatch, SBATCH).unwrap();
    assert!(Command::new("chmod").arg("+x").arg(&sbatch).status().unwrap().success());
    let submit = |arguments: &[&str]| {
        let mut command = assert_cmd::cargo::cargo_bin_cmd!("epirig");
        let search = format!("{}:{}", path.display(), std::env::var("PATH").unwrap());
        command.current_dir(path).env("PATH", search).env("STATE", path.join("state"));
        let output = command.arg("submit").args(arguments).output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8(output.stdout).unwrap()
    };
    let state =
        |job: usize| fs::read_to_string(path.join(format!("state/job{job}"))).unwrap().trim().to_owned();
    fails(path, &["submit", "seq"], 2, &["has no plan of bands", "--survey"]);
    succeeds(path, &[&SURVEY[..], &["--bands", "3"]].concat());
    // The scripts alone, with the options of a person.
    let scripts = submit(&["seq", "--dry-run", "--slurm", "partition=lab,mem=9G", "--at-once", "2"]);
    for line in ["#SBATCH --array=0-2%2", "#SBATCH --partition=lab", "#SBATCH --mem=9G", "tasks=(0 1 2)"] {
        assert!(scripts.contains(line), "{scripts}");
    }
    assert!(names(&path.join("state")).is_empty());
    // A frame that cannot be read: the merge does not run.
    let shard = path.join("seq/volume.zarr/0/c/4/0/0");
    let frame = fs::read(&shard).unwrap();
    fs::write(&shard, &frame[..100]).unwrap();
    let told = submit(&["seq", "--slurm", "partition=lab"]);
    assert!(told.contains("job 1: 3 of 3 bands\njob 2: the merge"), "{told}");
    assert_eq!((state(1), state(2)), ("1".to_owned(), "cancelled".to_owned()));
    fs::write(&shard, frame).unwrap();
    band(path, 1);
    let told: serde_json::Value = serde_json::from_str(&submit(&["seq", "--json"])).unwrap();
    assert_eq!(told["tasks"], serde_json::json!(["0", "2"]), "{told}");
    assert_eq!((state(3), state(4)), ("0".to_owned(), "0".to_owned()));
    same_maps(&path.join("whole"), &path.join("seq/results"));
    fails(path, &["submit", "seq"], 2, &["holds results already", "--overwrite"]);
    let told = submit(&["seq", "--overwrite"]);
    assert!(told.contains("job 5: the merge; all bands are matched"), "{told}");
    // Several sequences, of which one has results.
    import_all(path, "second");
    let told = submit(&["seq", "second", "--", "--block-rows", "4"]);
    assert!(told.contains("job 6: 1 of 2 sequences"), "{told}");
    assert_eq!(state(6), "0");
    assert!(path.join("second/results/match.json").exists());
    assert!(submit(&["seq", "second"]).contains("nothing is sent"));
    for (words, why) in
        [(&["--out", "x"][..], "--out"), (&["--metod", "variance"], "--metod"), (&["third"], "third")]
    {
        fails(
            path,
            &[&["submit", "seq", "second", "--overwrite", "--"], words].concat(),
            2,
            &[why, "after --"],
        );
    }
    fs::create_dir(path.join("a\\b")).unwrap();
    fails(path, &["submit", "seq", "a\\b"], 2, &["rename it"]);
    fails(path, &["submit", "seq", "--slurm", "array=0-1"], 2, &["own option of sbatch"]);
    fails(path, &["submit", "seq", "--slurm", "a b"], 2, &["no list of sbatch's options", "partition=lab"]);
}
