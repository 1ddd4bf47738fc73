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

mod body;
mod grbl;
mod native;
mod plant;
mod script;
mod shown;
mod zaber;

pub use body::{Body, TICK_HZ};
pub use grbl::GrblDevice;
pub use native::{Gate, NativeDevice};
pub use plant::Plant;
pub use script::{FaultInlet, FaultScript, Mishap, StageFault, Troubles};
pub(crate) use script::{amount, names};
pub use zaber::ZaberDevice;

use std::sync::{Arc, Mutex};

use super::StagePosition;
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

impl SimulatedStage {
    /// A device whose driver needs no settings.
    pub fn new(
        device: impl SimulatedDevice + 'static,
        plant: Plant,
        mm_from_home: fn(i64) -> f64,
        step_mm: f64,
    ) -> Self {
        let settings = Settings::default();
        Self { device: Arc::new(Mutex::new(device)), plant, mm_from_home, step_mm, settings }
    }
    /// The same, with its carriage shown at `watch`, whose time continues.
    pub fn shown_at(self, watch: StagePosition) -> Self {
        let Self { device, plant, mm_from_home, .. } = &self;
        let shown = shown::Shown::new(Arc::clone(device), plant.clone(), *mm_from_home, watch);
        Self { device: Arc::new(Mutex::new(shown)), ..self }
    }
}
