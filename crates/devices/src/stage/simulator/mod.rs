//! Stages that exist in memory and speak their dialect byte by byte, with faults by script.
//!
//! They are [`SimulatedDevice`]s: a
//! [`SimulatedLink`](crate::link::SimulatedLink) connects a driver to one in simulated time, a pseudo-terminal
//! (`link::PtyServer`) in real time. The [`Plant`] tells what the carriage truly did.
//!
//! ```
//! use epirig_devices::link::SimulatedLink;
//! use epirig_devices::stage::native::NativeOptions;
//! use epirig_devices::stage::simulator::NativeDevice;
//! use epirig_devices::stage::{NativeStage, Stage};
//!
//! let device = NativeDevice::default();
//! let plant = device.plant();
//! let mut stage = NativeStage::connect(Box::new(SimulatedLink::new(device)), NativeOptions::default())?;
//! stage.home()?;
//! let home = plant.carriage_steps();
//! stage.move_to(1.5)?;
//! assert_eq!(plant.carriage_steps() - home, 375); // 250 steps/mm
//! # Ok::<(), epirig_devices::stage::StageError>(())
//! ```

mod grbl;
mod native;
mod plant;
mod script;
mod zaber;

pub use grbl::GrblDevice;
pub use native::{Gate, NativeDevice};
pub use plant::Plant;
pub use script::{DeviceFault, FaultScript, Mishap, Troubles};
pub use zaber::ZaberDevice;

use crate::link::SimulatedDevice;
use epirig_core::settings::Settings;

/// A device in memory, with the mechanics that it drives.
pub struct SimulatedStage {
    /// What speaks the dialect.
    pub device: Box<dyn SimulatedDevice>,
    /// What the carriage truly does.
    pub plant: Plant,
    /// Where a carriage at so many steps of the plant is, in mm from home.
    pub mm_from_home: fn(i64) -> f64,
    /// Length of a step, in mm.
    pub step_mm: f64,
    /// The driver's settings for this device.
    pub settings: Settings,
}

/// How often in a second a simulated device decides about a step.
pub const TICK_HZ: u32 = 10_000;

/// Turns passing time into ticks of [`TICK_HZ`].
#[derive(Debug, Clone, Copy, Default)]
pub struct Ticks {
    leftover_ns: u64,
}

impl Ticks {
    const NS: u64 = 1_000_000_000 / TICK_HZ as u64;

    /// The whole ticks in `time` and what was left over before.
    pub fn pass(&mut self, time: std::time::Duration) -> u64 {
        let total = self.leftover_ns + u64::try_from(time.as_nanos()).unwrap_or(u64::MAX / 2);
        self.leftover_ns = total % Self::NS;
        total / Self::NS
    }
}
