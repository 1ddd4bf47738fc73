//! epirig turns the frames of a capture rig into a measurement.
//!
//! A stage moves an object (or the camera) along a line; at each stop a camera takes a frame. Stacked over time the
//! frames form a volume f(x, y, t); one row y through all frames is an *epipolar plane image* (EPI), in which every
//! surface point draws a straight line. Its slope is the point's disparity, hence its distance.
//!
//! Data flows one way:
//!
//! ```text
//! stage + camera -> capture -> sequence -> photometry -> rectification -> volume -> matcher -> surface -> results, report
//!    (or simulator)                (on disk)
//! ```
//!
//! The stations are crates of their own: `epirig-core` (frames, grids, the volume), `epirig-simulator` (the simulated rig, which
//! knows the truth), `epirig-devices` (stages and cameras), `epirig-data` (frames and maps on disk), `epirig-calibration` (what a
//! rig is really like) and `epirig-matcher` (disparity, surface, evaluation). This crate puts them together:
//!
//! - [`profile`]: a rig and a scan, described by a person; [`rig`]: opens what a profile describes.
//! - [`doctor`]: what is found out before a scan; [`capture`]: the scan.
//! - [`calibrate`] and [`pipeline`]: the stations in their order; [`results`] and [`report`]: files and pictures of them.
//! - [`memory`]: how much memory there is; [`cli`]: the command line, on top.
//!
//! ```
//! use epirig_matcher::{MatchOptions, match_volume};
//! use epirig_core::progress::Silent;
//! use epirig_simulator::{Simulator, SimulatorConfig};
//!
//! let simulator = Simulator::new(SimulatorConfig::textured_plane(64, 48, 9))?;
//! let volume = simulator.render_volume(&Silent)?;
//! let maps = match_volume(&volume, &MatchOptions::default(), &Silent)?;
//! assert_eq!((maps.disparity.rows(), maps.disparity.columns()), (48, 64));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod calibrate;
pub mod capture;
pub mod cli;
pub mod doctor;
pub mod memory;
pub mod pipeline;
pub mod profile;
pub mod report;
pub mod results;
pub mod rig;
