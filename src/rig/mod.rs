//! The rig of a profile: opens its devices, and gives its plan.
//!
//! ```
//! use epirig::profile::{Profile, SIM};
//! use epirig::rig::{RigStage, open_camera};
//! use epirig_devices::stage::StageSource as _;
//!
//! let profile = Profile::read(SIM, "sim.toml", &[])?;
//! let mut source = RigStage::of(&profile)?;
//! let mut stage = source.connect()?;
//! stage.home()?;
//! stage.move_to(12.0)?;
//! let opened = open_camera(&profile, &source.watch())?; // looks at what the stage carries
//! assert!(opened.view.is_some());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod bench;
mod calibration;
mod camera;
mod error;
mod faults;
mod plan;
mod simulator;
mod stage;
mod truth;

pub use bench::Bench;
pub use calibration::{calibration_plan, can_be_calibrated};
pub use camera::{camera_settings, open_camera};
pub use error::RigError;
pub use plan::{capture_plan, nominal_lens};
pub use simulator::{simulator, simulator_config};
pub use stage::{RigStage, Tap};
pub use truth::{ScanTruth, scan_truth};
