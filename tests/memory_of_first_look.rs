//! A first look needs no more memory than a whole match may.

#![allow(clippy::unwrap_used, reason = "a test stops at the first thing that does not work")]

#[path = "support/peak_memory.rs"]
mod peak_memory;

use epirig::epi::MatchOptions;
use peak_memory::assert_three_times_the_frames;

#[test]
fn a_first_look_at_a_hundred_frames_takes_at_most_three_times_their_bytes() {
    assert_three_times_the_frames(
        "a_first_look_at_a_hundred_frames_takes_at_most_three_times_their_bytes",
        &MatchOptions::default().quick(),
    );
}
