#![doc = include_str!("../README.md")]

pub mod formats;
pub mod packed;
pub mod sequence;
pub mod storage;
