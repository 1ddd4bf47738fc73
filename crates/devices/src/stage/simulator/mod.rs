//! Simulated stages that speak their dialect byte by byte, with scripted faults.
//!
//! They are [`SimulatedDevice`]s: a [`SimulatedLink`](crate::link::SimulatedLink) connects a driver to one in
//! simulated time, a pseudo-terminal (`link::PtyServer`) in real time. The [`Plant`] gives the true motion of the
//! carriage.
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

use std::sync::{Arc, Mutex};

use crate::link::SimulatedDevice;
use epirig_core::settings::Settings;

/// A simulated device with its mechanics.
pub struct SimulatedStage {
    /// The device that speaks the dialect. It stays as it is while lines to it are opened and closed.
    pub device: Arc<Mutex<dyn SimulatedDevice>>,
    /// The mechanics.
    pub plant: Plant,
    /// Position of a carriage at these steps of the plant, in mm from home.
    pub mm_from_home: fn(i64) -> f64,
    /// Length of a step, in mm.
    pub step_mm: f64,
    /// The driver's settings for this device.
    pub settings: Settings,
}

/// Time steps of a simulated device, per second.
pub const TICK_HZ: u32 = 10_000;

/// Converts time to ticks of [`TICK_HZ`].
#[derive(Debug, Clone, Copy, Default)]
pub struct Ticks {
    leftover_ns: u64,
}

impl Ticks {
    const NS: u64 = 1_000_000_000 / TICK_HZ as u64;

    /// The whole ticks in `time` plus the former remainder.
    pub fn pass(&mut self, time: std::time::Duration) -> u64 {
        let total = self.leftover_ns + u64::try_from(time.as_nanos()).unwrap_or(u64::MAX / 2);
        self.leftover_ns = total % Self::NS;
        total / Self::NS
    }
}
