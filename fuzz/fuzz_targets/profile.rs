//! Any text as a rig profile, and as one that was recorded.
#![no_main]

use epirig::profile::Profile;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    match Profile::read(text, "fuzz", &[]) {
        Ok(profile) => {
            let positions = profile.plan.positions_mm();
            assert!(positions.is_none_or(|positions| positions.iter().all(|place| place.is_finite())));
            // What a person may write, a record may hold.
            assert_eq!(Profile::of_record(&profile.record()).as_ref(), Ok(&profile));
        }
        Err(error) => assert!(error.to_string().len() < 100_000),
    }
    if let Ok(value) = serde_json::from_str(text)
        && let Ok(profile) = Profile::of_record(&value)
    {
        let _ = profile.plan.positions_mm();
    }
});
