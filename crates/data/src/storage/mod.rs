//! All access to files: reading with limits, and writing so that nothing is lost.
//!
//! Three rules hold for the whole program, because all files are read and written here; other rooms list
//! folders, and devices have files of their own:
//!
//! - A file stands under its final name only when it is whole and on disk ([`write_whole`],
//!   [`put_in_place`]). What it replaces is removed after that.
//! - An interruption ends the program between two such steps, never within one ([`Step`], [`abandon`]).
//! - A file that is read is of bounded size ([`read_file`]). A name in a record never leads outside the
//!   record's folder ([`read_inside`]). A record that is wrong names the key that is wrong ([`read_record`]).

mod disk;
mod faulty;
mod free;
mod held;
mod inside;
mod lines;
mod read;
mod record;
mod replace;
mod scratch;
mod scratch_file;
mod step;

pub use disk::{
    Disk, DiskStep, RealDisk, advice, is_in_place, is_in_the_making, is_of_the_system, is_own_folder,
    is_there, write_new, write_whole,
};
pub use faulty::{DiskFault, FaultyDisk};
pub use free::free_bytes;
pub use held::{HeldFolder, if_there, is_same};
pub use inside::read_inside;
pub use lines::open_lines;
pub use read::{ReadError, hash, kind, open_file, read_file, read_named, read_text};
pub use record::{
    LARGEST_RECORD, RecordError, RecordFault, parse_record, read_record, record_in, record_of_kinds,
};
pub use replace::{put_in_place, recover};
pub use scratch::{Scratch, abandon, is_scratch, is_writing, parent};
pub use scratch_file::ScratchFile;
pub use step::Step;
