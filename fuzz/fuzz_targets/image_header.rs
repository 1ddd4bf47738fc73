//! Any bytes as an image: its head alone, and the whole of it. Both agree, and nothing large is made of a small file. Of JPEG the head alone: its
//! decoder counts on arithmetic that wraps, which a fuzzer's build does not let it do.
#![no_main]

use epirig_data::sequence::{decode_grey, header};
use libfuzzer_sys::fuzz_target;

/// Larger images are sound, but slow to fuzz.
const LARGEST: usize = 1 << 22;

fuzz_target!(|bytes: &[u8]| {
    let Ok(head) = header(bytes) else {
        assert!(decode_grey(bytes).is_err());
        return;
    };
    if !bytes.starts_with(&[0xff, 0xd8])
        && head.rows * head.columns <= LARGEST
        && let Ok(image) = decode_grey(bytes)
    {
        let frame = &image.frame;
        assert_eq!((frame.rows(), frame.columns(), frame.bit_depth()), (head.rows, head.columns, head.bits));
    }
});
