#![doc = include_str!("../README.md")]

pub mod choice;
pub mod fault;
pub mod frame;
pub mod grid;
pub mod image;
pub mod least_squares;
pub mod progress;
pub mod rows;
pub mod settings;
pub mod shell;
pub mod spline;
pub mod statistics;
pub mod tau;
pub mod volume;
