//! Any record of a Zarr array and, after the first zero byte, any chunk: `zarr.json` of version 3, or `.zarray` of
//! version 2.
#![no_main]

use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use epirig_data::packed::ForeignArray;
use libfuzzer_sys::fuzz_target;

/// The folder of the array. It lives as long as the fuzzer.
static FOLDER: LazyLock<PathBuf> = LazyLock::new(|| {
    let place = Some(Path::new("/dev/shm")).filter(|place| place.is_dir());
    let folder = match place {
        Some(place) => tempfile::tempdir_in(place),
        None => tempfile::tempdir(),
    };
    folder.expect("a folder can be made").keep()
});

/// The frames that are read of an array: a record may tell of any number.
const FRAMES: usize = 3;

fuzz_target!(|bytes: &[u8]| {
    let end = bytes.iter().position(|&byte| byte == 0).unwrap_or(bytes.len());
    let (record, chunk) = (&bytes[..end], bytes.get(end + 1..).unwrap_or_default());
    for (name, first_chunk) in [("zarr.json", "c/0/0/0"), (".zarray", "0.0.0")] {
        let chunk_path = FOLDER.join(first_chunk);
        std::fs::create_dir_all(chunk_path.parent().expect("a folder")).expect("a folder can be made");
        std::fs::write(FOLDER.join(name), record).expect("it can be written");
        std::fs::write(&chunk_path, chunk).expect("it can be written");
        if let Ok(array) = ForeignArray::open(&FOLDER) {
            for t in 0..array.frames().min(FRAMES) {
                let _ = array.frame(t);
            }
        }
        std::fs::remove_file(FOLDER.join(name)).expect("it can be removed");
        std::fs::remove_file(chunk_path).expect("it can be removed");
    }
});
