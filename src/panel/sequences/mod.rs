//! All sequences below the folder of the panel: their list, their pictures, and how steady they are.

mod list;
mod pictures;
mod trend;

pub(in crate::panel) use list::{folder_of, name_of, sequences};
pub(in crate::panel) use pictures::{PictureName, Pictures};
pub(in crate::panel) use trend::trend;
