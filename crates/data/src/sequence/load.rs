//! Frames of a sequence, read as a volume.

use rayon::prelude::*;

use super::{Sequence, SequenceError};
use epirig_core::frame::Frame;
use epirig_core::progress::Progress;
use epirig_core::volume::Volume;

/// Reads all frames of `sequence` into a volume. Each thread has one frame in its hands and puts it into the
/// volume itself, so that besides the volume only those are in memory. Frames that were rectified have the DN
/// of their originals: noise and cost mean the same in both.
///
/// # Errors
/// [`SequenceError`] naming the first frame that cannot be used, or
/// [`Contradiction`](SequenceError::Contradiction) if the records are not to be believed.
pub fn load_volume(sequence: &Sequence, progress: &dyn Progress) -> Result<Volume, SequenceError> {
    let record = sequence.record();
    let tau = sequence.tau()?;
    sequence.check_records()?;
    let frames = sequence.frames();
    progress.begin("reading frames", frames.len() as u64);
    // The size in the record is believed only after a frame has shown it.
    let first = frames.first().map(|first| sequence.read(first)).transpose()?;
    let original_bits = record.origin.original_bit_depth();
    let mut volume = match original_bits {
        Some(bits) => Volume::fine(record.rows, record.columns, bits, tau),
        None => Volume::new(record.rows, record.columns, record.bit_depth, tau),
    };
    let filling = volume.filling();
    let put = |index: usize, frame: &Frame| -> Result<(), SequenceError> {
        progress.unless_cancelled()?;
        match original_bits {
            Some(_) => filling.insert_counts(index, frame)?,
            None => filling.insert(index, frame)?,
        }
        progress.advance(1);
        Ok(())
    };
    if let Some(first) = first {
        put(0, &first)?;
    }
    let others = frames.par_iter().enumerate().skip(1);
    let failures = others.filter_map(|(index, record)| {
        let read = sequence.read(record);
        read.and_then(|frame| put(index, &frame)).err()
    });
    // Of several frames that fail, the first in their order, whichever thread was faster.
    if let Some(failure) = failures.find_first(|_| true) {
        return Err(failure);
    }
    progress.end();
    Ok(volume)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sequence::encode_png;
    use crate::sequence::import::{ImportOptions, import, list_images};
    use epirig_core::frame::Samples;
    use epirig_core::progress::Silent;

    #[test]
    fn frames_lie_in_their_order_and_the_first_that_fails_is_named() {
        const FRAMES: u8 = 12;
        let place = tempfile::tempdir().unwrap();
        let (images, folder) = (place.path().join("images"), place.path().join("seq"));
        std::fs::create_dir(&images).unwrap();
        for t in 0..FRAMES {
            let frame = Frame::new(40, 6, 8, Samples::U8((0..240).map(|index| index % 13 + t).collect()));
            std::fs::write(images.join(format!("{t:02}.png")), encode_png(&frame.unwrap()).unwrap()).unwrap();
        }
        import(&list_images(&images).unwrap(), &folder, &ImportOptions::default(), &mut (), &Silent).unwrap();
        let sequence = Sequence::open(&folder).unwrap();
        let threads = |count: usize| rayon::ThreadPoolBuilder::new().num_threads(count).build().unwrap();
        let alone = threads(1).install(|| load_volume(&sequence, &Silent)).unwrap();
        let together = threads(4).install(|| load_volume(&sequence, &Silent)).unwrap();
        assert_eq!(alone, together);
        let mut row = [0.0; 6];
        for t in 0..FRAMES {
            together.copy_row(1, t.into(), &mut row);
            assert_eq!(row, [6, 7, 8, 9, 10, 11].map(|value: u8| f32::from(value + t)));
        }
        for missing in [9, 5] {
            std::fs::remove_file(sequence.path(&sequence.frames()[missing])).unwrap();
            let failure = threads(4).install(|| load_volume(&sequence, &Silent)).unwrap_err();
            let expected = sequence.path(&sequence.frames()[missing]);
            assert!(matches!(&failure, SequenceError::MissingFrame(path) if *path == expected), "{failure}");
        }
    }
}
