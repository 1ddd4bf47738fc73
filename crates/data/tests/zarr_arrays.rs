//! Frames of arrays that zarr-python wrote (`tests/zarr/make.py`).

#![allow(clippy::unwrap_used, reason = "a test stops at the first thing that does not work")]

use std::path::{Path, PathBuf};

use epirig_core::frame::Samples;
use epirig_data::packed::{ForeignArray, PackedError, is_zarr};

fn place(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/zarr").join(name)
}

/// The formula of `make.py`.
fn sample(t: usize, y: usize, x: usize) -> u16 {
    (40 * t + 7 * y + x) as u16
}

fn frame(t: usize, factor: u16) -> Vec<u16> {
    (0..5 * 7).map(|index| factor * sample(t, index / 7, index % 7)).collect()
}

#[test]
fn frames_come_out_of_every_layout() {
    for (name, factor) in [
        ("plain.zarr", 1),
        ("shards.zarr", 100),
        ("image.zarr", 100),
        ("image.zarr/0", 100),
        ("second.zarr", 100),
    ] {
        assert!(is_zarr(&place(name)), "{name}");
        let array = ForeignArray::open(&place(name)).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_eq!(array.frames(), 3, "{name}");
        for t in 0..3 {
            let found = array.frame(t).unwrap_or_else(|error| panic!("{name}: {error}"));
            assert_eq!((found.rows(), found.columns()), (5, 7), "{name}");
            let expected = match factor {
                1 => Samples::U8(frame(t, 1).into_iter().map(|value| value as u8).collect()),
                factor => Samples::U16(frame(t, factor)),
            };
            assert_eq!(*found.samples(), expected, "{name}, frame {t}");
        }
    }
    assert!(!is_zarr(&place("")));
    // Of the last one, frame 2 was not written: it has the fill value.
    let array = ForeignArray::open(&place("wide.zarr")).unwrap();
    for t in [1, 0, 2] {
        let expected = if t < 2 { frame(t, 100) } else { vec![7; 35] };
        assert_eq!(*array.frame(t).unwrap().samples(), Samples::U16(expected), "frame {t}");
    }
}

#[test]
fn what_is_no_array_of_frames_is_refused_with_advice() {
    let refused = |name: &str| ForeignArray::open(&place(name)).err().map(|error| error.to_string()).unwrap();
    assert!(refused("several.zarr").contains("several arrays (left, right); give one of them, such as"));
    assert!(refused("real.zarr").contains("float32; frames are an array of frames x rows x columns"));
    assert!(refused("plain.zarr/c").contains("there is no array in it"));
}

/// A copy of an array that may be damaged.
fn copy(name: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let mut open = vec![place(name)];
    while let Some(from) = open.pop() {
        let to = folder.path().join(from.strip_prefix(place(name)).unwrap());
        std::fs::create_dir_all(&to).unwrap();
        for entry in std::fs::read_dir(&from).unwrap().map(Result::unwrap) {
            match entry.file_type().unwrap().is_dir() {
                true => open.push(entry.path()),
                false => drop(std::fs::copy(entry.path(), to.join(entry.file_name())).unwrap()),
            }
        }
    }
    folder
}

#[test]
fn records_that_ask_for_too_much_are_refused() {
    let folder = copy("shards.zarr");
    let path = folder.path().join("zarr.json");
    let record: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(&path).unwrap()).unwrap();
    let with = |changes: &[(&str, serde_json::Value)]| {
        let mut record = record.clone();
        for (pointer, value) in changes {
            *record.pointer_mut(pointer).unwrap() = value.clone();
        }
        std::fs::write(&path, record.to_string()).unwrap();
        let read = ForeignArray::open(folder.path()).and_then(|array| array.frame(0));
        read.err().unwrap_or_else(|| panic!("{changes:?} is read")).to_string()
    };
    let huge = serde_json::json!([3, 4_000_000_000_u64, 4_000_000_000_u64]);
    let chunk = "/chunk_grid/configuration/chunk_shape";
    let inner = "/codecs/0/configuration/chunk_shape";
    assert!(with(&[("/shape", huge.clone())]).contains("larger than any image"));
    assert!(
        with(&[("/shape", serde_json::json!([3, u64::MAX, u64::MAX]))]).contains("larger than any image")
    );
    assert!(with(&[(chunk, huge)]).contains("a chunk has the shape"));
    assert!(with(&[(chunk, serde_json::json!([0, 6, 7]))]).contains("a chunk has the shape"));
    assert!(with(&[(chunk, serde_json::json!([1, 6]))]).contains("a chunk has the shape"));
    assert!(with(&[(inner, serde_json::json!([1, 4, 7]))]).contains("do not fill a shard"));
    assert!(with(&[(inner, serde_json::json!([1, 0, 7]))]).contains("do not fill a shard"));
    assert!(with(&[("/codecs", serde_json::json!([]))]).contains("no codec for bytes"));
    assert!(with(&[("/codecs/0/name", "blosc".into())]).contains("packed by blosc"));
    assert!(with(&[("/data_type", "int16".into())]).contains("samples of the kind int16"));
    assert!(with(&[("/zarr_format", 4.into())]).contains("version"));
}

#[test]
fn damaged_chunks_are_told_by_their_frame() {
    for (name, chunk) in [("plain.zarr", "c/0/0/0"), ("shards.zarr", "c/0/0/0")] {
        let folder = copy(name);
        let chunk = folder.path().join(chunk);
        let whole = std::fs::read(&chunk).unwrap();
        for length in 0..whole.len() {
            std::fs::write(&chunk, &whole[..length]).unwrap();
            let array = ForeignArray::open(folder.path()).unwrap();
            let error =
                array.frame(0).err().unwrap_or_else(|| panic!("{name} cut to {length} bytes is read"));
            assert!(matches!(error, PackedError::Frame { frame: 0, .. }), "{error}");
            assert!(array.frame(2).is_ok(), "{name}: another chunk");
        }
    }
}
