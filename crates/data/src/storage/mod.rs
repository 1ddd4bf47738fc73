//! Everything that is done to files: reading with limits, and writing so that nothing is lost.
//!
//! Three rules hold for the whole program, because whatever is read or written goes through here; other rooms list folders, and devices have
//! files of their own:
//!
//! - What is written stands under its final name only when it is whole and on disk ([`write_whole`], [`put_in_place`]).
//!   What it replaces is removed after that.
//! - An interruption ends the program between two such steps, never within one ([`Step`], [`abandon`]).
//! - What is read is a file of bounded size ([`read_file`]); a name in a record leads to nothing outside its folder
//!   ([`read_inside`]); a record says which of its keys is wrong ([`read_record`]).

mod disk;
mod faulty;
mod inside;
mod interruption;
mod read;
mod record;
mod replace;
mod scratch;

pub use disk::{Disk, RealDisk, is_in_the_making, is_of_the_system, is_own_folder, is_there, write_whole};
pub use faulty::{DiskFault, FaultyDisk};
pub use inside::read_inside;
pub use interruption::{Step, abandon};
pub use read::kind;
pub use read::{ReadError, open_file, read_file, read_named, read_text};
pub use record::{RecordError, RecordFault, parse_record, parse_value, read_record, read_record_of_kinds};
pub use replace::{put_in_place, recover};
pub use scratch::{Scratch, is_scratch, is_writing, parent};
