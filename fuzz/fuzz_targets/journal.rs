//! Any journal around sound frames.
#![no_main]

mod folder;

use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let path = folder::FOLDER.join("journal.jsonl");
    std::fs::write(&path, bytes).expect("it can be written");
    folder::use_it();
});
