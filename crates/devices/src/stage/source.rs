//! How a stage is connected, as often as it takes.

use super::{Stage, StageError};

/// Where a stage comes from. A scan connects once, and again if the line to the stage is lost.
///
/// Every closure that connects is one:
///
/// ```
/// use epirig_devices::stage::{SimStage, SimStageConfig, Stage, StageSource};
///
/// let mut source = || Ok(Box::new(SimStage::new(SimStageConfig::ideal(200.0))) as Box<dyn Stage>);
/// let stage = source.connect()?;
/// assert_eq!(stage.travel_mm(), 200.0);
/// # Ok::<(), epirig_devices::stage::StageError>(())
/// ```
pub trait StageSource {
    /// Connects to the stage. Whatever had it before has been dropped.
    ///
    /// # Errors
    /// [`StageError`] if it cannot be had now.
    fn connect(&mut self) -> Result<Box<dyn Stage>, StageError>;
}

impl<F: FnMut() -> Result<Box<dyn Stage>, StageError>> StageSource for F {
    fn connect(&mut self) -> Result<Box<dyn Stage>, StageError> {
        self()
    }
}
