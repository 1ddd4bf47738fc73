use std::path::Path;

use proptest::prelude::*;

use super::*;
use crate::storage::{DiskFault, FaultyDisk};
use epirig_core::frame::{Samples, full_scale};
use epirig_core::progress::Silent;
use epirig_core::tau::Tau;
use epirig_core::volume::{Volume, VolumeShape};

fn shape(rows: usize, columns: usize, frames: usize, (bit_depth, fine): (u8, bool)) -> VolumeShape {
    let tau = Tau::equidistant(frames).unwrap();
    VolumeShape {
        rows,
        columns,
        bit_depth,
        fine,
        frame_gains: (0..frames).map(|t| 1.0 + t as f32).collect(),
        tau,
    }
}

/// Samples of frame `t`; those of frame 1 are zero.
fn samples(shape: &VolumeShape, t: usize) -> Samples {
    let levels = usize::from(full_scale(shape.stored_bit_depth())) + 1;
    let values =
        (0..shape.rows * shape.columns).map(|index| if t == 1 { 0 } else { (index * 31 + 7 * t) % levels });
    match shape.stored_bit_depth() {
        ..=8 => Samples::U8(values.map(|value| value as u8).collect()),
        _ => Samples::U16(values.map(|value| value as u16).collect()),
    }
}

fn record(shape: &VolumeShape, calibration: &str) -> PackedRecord {
    PackedRecord::new("uid".to_owned(), "frames".to_owned(), Some(calibration.to_owned()), shape)
}

fn pack(folder: &Path, shape: &VolumeShape) -> Result<(), PackedError> {
    let mut writer = PackWriter::begin(folder, record(shape, "one"), shape)?;
    for t in 0..shape.tau.frames() {
        if !writer.has(t)? {
            writer.put(t, samples(shape, t))?;
        }
    }
    writer.finish()
}

/// What was packed, as it would be in memory.
fn expected(shape: &VolumeShape) -> Volume {
    let mut volume = shape.of_rows(shape.rows);
    let depth = shape.stored_bit_depth();
    for t in 0..shape.tau.frames() {
        let frame =
            epirig_core::frame::Frame::new(shape.rows, shape.columns, depth, samples(shape, t)).unwrap();
        let put = if shape.fine { volume.insert_counts(t, &frame) } else { volume.insert(t, &frame) };
        put.unwrap();
    }
    volume
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    #[test]
    fn any_rows_are_those_of_the_whole_volume(
        rows in 1_usize..200, columns in 1_usize..40, frames in 2_usize..5,
        kind in prop::sample::select(vec![(8, false), (6, false), (12, false), (8, true), (16, false)]),
        ends in (0.0_f64..1.0, 0.0_f64..1.0),
    ) {
        let shape = shape(rows, columns, frames, kind);
        let place = tempfile::tempdir().unwrap();
        let folder = place.path().join("v.zarr");
        pack(&folder, &shape).unwrap();
        let packed = PackedVolume::open(&folder).unwrap();
        prop_assert_eq!(packed.shape(), &shape);
        prop_assert_eq!(packed.record(), &record(&shape, "one"));
        let whole = expected(&shape);
        prop_assert_eq!(&packed.rows(0..rows, &Silent).unwrap(), &whole);
        let [low, high] = [ends.0.min(ends.1), ends.0.max(ends.1)].map(|end| (end * (rows + 1) as f64) as usize);
        let some: Vec<usize> = (low..high).collect();
        let all: Vec<usize> = (0..frames).collect();
        let part = whole.selected(&some, &all, whole.tau().clone());
        prop_assert_eq!(&packed.rows(low..high, &Silent).unwrap(), &part);
    }
}

#[test]
fn a_volume_that_is_killed_or_meets_a_full_disk_at_any_step_is_completed_by_the_next_run() {
    let shape = shape(70, 9, 3, (8, true));
    for fault in [DiskFault::Killed, DiskFault::Full] {
        let mut steps = 0;
        loop {
            let place = tempfile::tempdir().unwrap();
            let folder = place.path().join("v.zarr");
            // Another calibration's volume is there in every second round.
            if steps % 2 == 1 {
                PackWriter::begin(&folder, record(&shape, "former"), &shape).unwrap();
            }
            let broken = (|| {
                let disk = Box::new(FaultyDisk::new(fault, steps));
                let mut writer = PackWriter::begin_on(disk, &folder, record(&shape, "one"), &shape)?;
                (0..3).try_for_each(|t| writer.put(t, samples(&shape, t)))?;
                writer.finish()
            })();
            // Whoever reads it sees it whole, or not at all.
            if PackedVolume::record_of(&folder).is_ok() {
                let packed = PackedVolume::open(&folder).unwrap();
                assert_eq!(
                    packed.rows(0..70, &Silent).unwrap(),
                    expected(&shape),
                    "{fault:?} after {steps} steps"
                );
            }
            pack(&folder, &shape).unwrap_or_else(|error| panic!("{fault:?} after {steps} steps: {error}"));
            let packed = PackedVolume::open(&folder).unwrap();
            assert_eq!(
                packed.rows(0..70, &Silent).unwrap(),
                expected(&shape),
                "{fault:?} after {steps} steps"
            );
            if broken.is_ok() {
                break;
            }
            steps += 1;
        }
        // A step for each file's making, flushing, naming and folder, of five files.
        assert!(steps > 20, "{steps}");
    }
}

#[test]
fn a_frame_that_is_missing_cut_or_changed_is_told() {
    let shape = shape(130, 9, 3, (12, false));
    let place = tempfile::tempdir().unwrap();
    let folder = place.path().join("v.zarr");
    pack(&folder, &shape).unwrap();
    let file = folder.join("0/c/2/0/0");
    let whole = std::fs::read(&file).unwrap();
    let refused = |what: &str| {
        let error = PackedVolume::open(&folder).unwrap().rows(0..130, &Silent).err();
        let error = error.unwrap_or_else(|| panic!("{what} is read"));
        assert!(matches!(error, PackedError::Frame { frame: 2, .. }), "{what}: {error}");
        assert!(error.to_string().ends_with("remove the volume, and run `epirig pack` again"), "{error}");
    };
    for length in (0..whole.len()).step_by(97) {
        std::fs::write(&file, &whole[..length]).unwrap();
        refused(&format!("a file cut to {length} bytes"));
    }
    for at in (0..whole.len()).step_by(31) {
        let mut bytes = whole.clone();
        bytes[at] ^= 4;
        std::fs::write(&file, bytes).unwrap();
        refused(&format!("a file with byte {at} changed"));
    }
    std::fs::remove_file(&file).unwrap();
    refused("no file");
}

#[test]
fn only_a_volume_of_the_same_sequence_is_replaced() {
    let shape = shape(3, 4, 2, (8, false));
    let place = tempfile::tempdir().unwrap();
    let folder = place.path().join("v.zarr");
    pack(&folder, &shape).unwrap();
    let mut writer = PackWriter::begin(&folder, record(&shape, "two"), &shape).unwrap();
    assert!(PackedVolume::record_of(&folder).is_err(), "it is not whole");
    let busy = PackWriter::begin(&folder, record(&shape, "two"), &shape).err();
    assert!(matches!(busy, Some(PackedError::Busy(_))), "another program packs it");
    assert!(writer.has(0).is_ok_and(|has| !has), "frames of the former volume are gone");
    writer.put(0, samples(&shape, 0)).unwrap();
    let missing = writer.finish().unwrap_err();
    assert!(matches!(missing, PackedError::Frame { frame: 1, .. }), "{missing}");
    let other = PackedRecord { sequence_uid: "other".to_owned(), ..record(&shape, "two") };
    for taken in [place.path().join("folder"), folder.clone()] {
        std::fs::create_dir_all(taken.join("something")).unwrap();
        let _ = std::fs::remove_file(taken.join("packing.json"));
        let error = PackWriter::begin(&taken, other.clone(), &shape).err().unwrap();
        assert!(matches!(error, PackedError::Taken(_)), "{error}");
    }
}

#[test]
fn a_record_that_contradicts_its_array_is_refused() {
    let shape = shape(3, 4, 2, (8, false));
    let place = tempfile::tempdir().unwrap();
    let folder = place.path().join("v.zarr");
    pack(&folder, &shape).unwrap();
    let path = folder.join("zarr.json");
    let text = std::fs::read_to_string(&path).unwrap();
    let record: serde_json::Value = serde_json::from_str(&text).unwrap();
    let changed = |key: &str, value: serde_json::Value| {
        let mut record = record.clone();
        record["attributes"]["epirig"][key] = value;
        std::fs::write(&path, record.to_string()).unwrap();
        PackedVolume::open(&folder).err().unwrap_or_else(|| panic!("{key} is accepted")).to_string()
    };
    for (key, value) in [
        ("fine", true.into()),
        ("bit_depth", 12.into()),
        ("rows", 4.into()),
        ("columns", 0.into()),
        ("rows", u64::MAX.into()),
        ("bit_depth", 0.into()),
        ("tau", serde_json::json!([0.0, 0.5, 1.0])),
        ("frame_gains", serde_json::json!([1.0])),
    ] {
        assert!(changed(key, value).contains("run `epirig pack` again"), "{key}");
    }
    assert!(changed("tau", serde_json::json!([1.0, 0.0])).contains("position"));
    assert!(changed("format", 99.into()).contains("format version 99"));
    assert!(changed("bit_depth", "8".into()).contains("attributes.epirig.bit_depth"));
    std::fs::remove_file(folder.join("0/zarr.json")).unwrap();
    std::fs::write(&path, text).unwrap();
    assert!(matches!(PackedVolume::open(&folder), Err(PackedError::Record(_))));
}
