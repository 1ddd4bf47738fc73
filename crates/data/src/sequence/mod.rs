//! Frames on disk with the records that make them a measurement.
//!
//! A sequence folder holds `sequence.json` (what was meant to be done), `journal.jsonl` (what happened, one
//! line per event), `frames/` (what the sensor gave) and `stop.json` (how it ended). [`SequenceWriter`] makes
//! one frame by frame, [`import`] makes one of images that other software took, [`Sequence`] reads it and
//! [`verify`] checks every byte.

mod bundle;
mod clock;
mod consistency;
mod course;
mod derived;
mod error;
mod finding;
pub mod import;
mod listing;
mod load;
mod lock;
mod nominal_lens;
mod pixels;
mod positions;
mod reader;
mod record;
mod resume;
mod start_keys;
mod undisturbed;
mod verify;
mod writer;

pub use bundle::{Bundle, bundle};
pub use clock::{now, time};
pub use derived::write_derived;
pub use error::SequenceError;
pub use finding::Finding;
pub use listing::{SequencesBelow, sequences_below, sequences_in};
pub use load::load_volume;
pub use lock::{lock, refuse_busy};
pub use nominal_lens::{FocalLength, NominalLens};
pub use pixels::{
    DecodedImage, ExifFocalLength, ForeignFormat, Header, ImageFault, LARGEST_IMAGE, ToldLength, decode_grey,
    encode_png, header, image_formats, time_taken,
};
pub use positions::read_positions;
pub use reader::{JOURNAL, Sequence};
pub use record::{
    CameraRecord, CertificateRecord, ClosureRecord, ComparisonRecord, Event, ExitStatus, ExposureRecord,
    FORMAT_VERSION, FrameKind, FrameRecord, Intrinsics, LimitsRecord, Origin, ResumedRecord, RetakeRecord,
    SequenceRecord, StopRecord, TimesRecord,
};
pub use verify::{VerifyReport, verify};
pub use writer::refuse_existing;
pub use writer::{FrameFacts, SequenceWriter, StopFacts};
