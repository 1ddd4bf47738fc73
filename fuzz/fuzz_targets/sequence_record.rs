//! Any `sequence.json` or, after a zero byte, any `stop.json`, around sound frames.
#![no_main]

mod folder;

use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let (name, bytes) = match bytes.split_first() {
        Some((0, rest)) => ("stop.json", rest),
        _ => ("sequence.json", bytes),
    };
    let path = folder::FOLDER.join(name);
    let before = std::fs::read(&path).expect("the seed is there");
    std::fs::write(&path, bytes).expect("it can be written");
    folder::use_it();
    std::fs::write(&path, before).expect("it can be written");
});
