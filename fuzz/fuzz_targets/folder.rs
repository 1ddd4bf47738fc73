//! A sound sequence in a folder in memory, one of whose records is the fuzzer's.

use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use epirig::profile::Profile;
use epirig_core::frame::{Frame, Samples};
use epirig_core::progress::Silent;
use epirig_data::sequence::{FrameKind, Sequence, encode_png, load_volume, verify};

const FRAMES: usize = 4;

/// The folder. It lives as long as the fuzzer.
pub(crate) static FOLDER: LazyLock<PathBuf> = LazyLock::new(|| {
    let place = Some(Path::new("/dev/shm")).filter(|place| place.is_dir());
    let folder = match place {
        Some(place) => tempfile::tempdir_in(place),
        None => tempfile::tempdir(),
    };
    let path = folder.expect("a folder can be made").keep().join("seq");
    write(&path);
    path
});

/// The frames are made here; the records beside them are the seeds of a captured sequence.
fn write(path: &Path) {
    std::fs::create_dir_all(path.join("frames")).expect("a folder can be made");
    for index in 0..FRAMES {
        let samples = (0..48).map(|pixel| ((pixel * 5 + index) % 256) as u8).collect();
        let frame = Frame::new(6, 8, 8, Samples::U8(samples)).expect("a frame");
        let png = encode_png(&frame).expect("a frame can be encoded");
        std::fs::write(path.join(FrameKind::Scan.file(index)), png).expect("a frame can be written");
    }
    let records: [(&str, &[u8]); 3] = [
        ("sequence.json", include_bytes!("../seeds/sequence_record/captured.json")),
        ("journal.jsonl", include_bytes!("../seeds/journal/captured.jsonl")),
        // After the zero byte by which a seed says what it is.
        ("stop.json", &include_bytes!("../seeds/sequence_record/stop")[1..]),
    ];
    for (name, bytes) in records {
        std::fs::write(path.join(name), bytes).expect("a record can be written");
    }
}

/// Does with the sequence whatever reads only. Nothing may panic, hang or ask for more memory than there is.
pub(crate) fn use_it() {
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
