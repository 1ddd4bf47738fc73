//! The live map: disparity and sigma from all frames so far, while a scan runs.
//!
//! Frames are made smaller as they come ([`binned`]) and matched again with each new one ([`making`]), in a
//! thread that takes one core at most and gives way to the scan ([`maker`]).

mod binned;
mod maker;
mod making;
mod map;
#[cfg(test)]
mod tests;

pub use maker::LiveMapMaker;
pub use map::LiveMap;
