//! epirig turns the frames of a capture rig into a measurement.
//!
//! A stage moves an object (or the camera) along a line; at each stop a camera takes a frame. Stacked over time the
//! frames form a volume f(x, y, t); one row y through all frames is an *epipolar plane image* (EPI), in which every
//! surface point draws a straight line. Its slope is the point's disparity, hence its distance.
//!
//! Data flows one way, and so do the modules' arrows:
//!
//! ```text
//! stage + camera -> capture -> sequence -> volume -> epi -> surface -> results, report
//!    (or simulator)                (on disk)            (matcher)
//! ```
//!
//! - [`simulator`], [`stage`], [`camera`], [`capture`]: where frames come from; the simulated rig knows the truth.
//! - [`doctor`]: what is found out before a scan: whether rig and plan will do.
//! - [`sequence`]: frames on disk with their records; [`sequence::import`] brings in what other software took.
//! - [`profile`]: a rig and a scan, described by a person.
//! - [`frame`], [`plane`], [`tau`], [`volume`]: the data that the stations hand on.
//! - [`photometry`]: dark level, flat field and flicker: from what the sensor gave to what the light was.
//! - [`shift`]: how far the picture has moved between two frames.
//! - [`target`]: chess-boards, found in frames, followed through a sequence, and printed.
//! - [`epi`]: the matcher. It knows no files, stages or cameras: a volume and options in, maps out.
//! - [`surface`]: disparity to height, trend, depth of hollows, profiles, roughness; [`evaluate`]: measured against truth, or against frames left out.
//! - [`formats`], [`results`], [`report`]: files and pictures for other programs and for people.
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
