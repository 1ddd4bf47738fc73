//! epirig computes height maps from the frames of a capture rig.
//!
//! A stage moves an object (or the camera) along a line; at each stop a camera takes a frame. Stacked over
//! time the frames form a volume f(x, y, t); one row y through all frames is an *epipolar plane image* (EPI),
//! in which every surface point draws a straight line. Its slope is the point's disparity, hence its
//! distance.
//!
//! Data flows one way:
//!
//! ```text
//! stage + camera -> capture -> sequence -> photometry -> rectification -> volume -> matcher -> surface -> results, report
//!    (or simulator)                (on disk)
//! ```
//!
//! The parts are separate crates: `epirig-core` (frames, grids, the volume), `epirig-simulator` (the
//! simulated rig, with known truth), `epirig-devices` (stages and cameras), `epirig-data` (frames and maps on
//! disk), `epirig-calibration` (the properties of a real rig) and `epirig-matcher` (disparity, surface,
//! evaluation). This crate combines them:
//!
//! - [`profile`]: the description of a rig and a scan; [`rig`]: opens the devices of a profile.
//! - [`doctor`]: checks before a scan; [`capture`]: the scan.
//! - [`calibrate`] and [`pipeline`]: the steps in order; [`results`] and [`report`]: files and pictures.
//! - [`series`]: many sequences, and what was measured of each.
//! - [`panel`]: results in a browser; [`memory`]: the available memory; [`cli`]: the command line, on top.
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

pub mod bands;
pub mod calibrate;
pub mod capture;
pub mod cli;
pub mod doctor;
pub mod memory;
mod number;
pub mod panel;
pub mod pipeline;
pub mod profile;
pub mod report;
pub mod results;
pub mod rig;
pub mod series;
