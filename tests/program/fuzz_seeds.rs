//! The seeds of the fuzz targets are what the program reads: from one that is refused at its version, a fuzzer does not get
//! further.

use std::path::{Path, PathBuf};

use super::folder::{FOLDER, use_it};
use epirig::calibrate::read_calibration_file;
use epirig_core::progress::Silent;
use epirig_data::sequence::{Sequence, load_volume};

fn seeds(target: &str) -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/seeds").join(target);
    let seeds: Vec<PathBuf> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    assert!(!seeds.is_empty());
    seeds
}

#[test]
fn records_are_read_beside_sound_frames() {
    for (target, name) in [("sequence_record", "sequence.json"), ("journal", "journal.jsonl")] {
        let path = FOLDER.join(name);
        let sound = std::fs::read(&path).unwrap();
        for seed in seeds(target) {
            let bytes = std::fs::read(&seed).unwrap();
            // As the fuzz target does with it.
            let (path, bytes) = match bytes.split_first() {
                Some((0, rest)) => (FOLDER.join("stop.json"), rest),
                _ => (path.clone(), &bytes[..]),
            };
            let before = std::fs::read(&path).unwrap();
            std::fs::write(&path, bytes).unwrap();
            let sequence =
                Sequence::open(&FOLDER).unwrap_or_else(|error| panic!("{}: {error}", seed.display()));
            // The frames are those of the captured sequence.
            let imported = seed.file_stem().is_some_and(|stem| stem == "imported");
            let loaded = load_volume(&sequence, &Silent);
            assert!(loaded.is_ok() || imported, "{}: {loaded:?}", seed.display());
            use_it();
            std::fs::write(&path, before).unwrap();
        }
        assert_eq!(std::fs::read(&path).unwrap(), sound);
    }
}

#[test]
fn calibrations_are_read_and_contradict_nothing() {
    for seed in seeds("calibration") {
        let calibration = read_calibration_file(&seed).unwrap_or_else(|error| panic!("{error}"));
        let (rows, columns) = (calibration.mapping.raw_rows, calibration.mapping.raw_columns);
        assert_eq!(calibration.contradiction(calibration.positions.tau.len(), rows, columns), None);
    }
}
