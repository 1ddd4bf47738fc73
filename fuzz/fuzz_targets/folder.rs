//! A sound sequence in a folder in memory, one of whose records is the fuzzer's.

use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use epirig::profile::{Override, Profile};
use epirig_core::frame::{Frame, Samples};
use epirig_core::progress::Silent;
use epirig_data::sequence::{
    ExitStatus, FORMAT_VERSION, FrameFacts, Origin, Sequence, SequenceRecord, SequenceWriter, StopFacts,
    load_volume, verify,
};

const FRAMES: usize = 4;

/// The folder. It lives as long as the fuzzer.
pub static FOLDER: LazyLock<PathBuf> = LazyLock::new(|| {
    let place = Some(Path::new("/dev/shm")).filter(|place| place.is_dir());
    let folder = match place {
        Some(place) => tempfile::tempdir_in(place),
        None => tempfile::tempdir(),
    };
    let path = folder.expect("a folder can be made").keep().join("seq");
    write(&path);
    path
});

fn write(path: &Path) {
    let rig = Profile::of(&[Override::parse("plan.frames=4", "seed").expect("a setting")]);
    let record = SequenceRecord {
        format: FORMAT_VERSION,
        uid: "00000000-0000-4000-8000-000000000000".to_owned(),
        program: "seed".to_owned(),
        created: "2026-11-23T00:00:00Z".to_owned(),
        origin: Origin::Captured {
            stage: "sim".to_owned(),
            stage_settings: std::collections::BTreeMap::default(),
            camera: "sim".to_owned(),
            configuration: None,
            rig: rig.ok().and_then(|rig| serde_json::to_value(rig).ok()),
            simulator: None,
        },
        rows: 6,
        columns: 8,
        bit_depth: 8,
        frames: FRAMES,
        positions_mm: Some((0..FRAMES).map(|index| 1.5 * index as f64).collect()),
        intrinsics: None,
    };
    let mut writer = SequenceWriter::create(path, &record).expect("a sequence can be written");
    for index in 0..FRAMES {
        let samples = (0..48).map(|pixel| ((pixel * 5 + index) % 256) as u8).collect();
        let frame = Frame::new(6, 8, 8, Samples::U8(samples)).expect("a frame");
        let at = Some(1.5 * index as f64);
        let facts = FrameFacts { commanded_mm: at, reported_mm: at, ..FrameFacts::default() };
        writer.add(&frame, facts).expect("a frame can be written");
    }
    writer.finish(ExitStatus::Complete, StopFacts::default()).expect("an end can be written");
}

/// Does with the sequence whatever reads only. Nothing may panic, hang or ask for more memory than there is.
pub fn use_it() {
    let Ok(sequence) = Sequence::open(&FOLDER) else { return };
    let _ = (verify(&sequence, &Silent), sequence.end_in_words(), sequence.check_closed());
    if let Ok(Some(rig)) = Profile::of_sequence(&sequence) {
        let _ = rig.contradictions(&sequence);
    }
    if let Ok(volume) = load_volume(&sequence, &Silent) {
        // What is loaded is what the files hold, whatever the records say.
        assert_eq!((volume.rows(), volume.columns()), (6, 8));
        let tau = volume.tau().values();
        assert!(
            tau.windows(2).all(|pair| pair[0] < pair[1])
                && tau.first() == Some(&0.0)
                && tau.last() == Some(&1.0)
        );
    }
}
