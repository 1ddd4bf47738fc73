//! Connecting a stage, as often as needed.

use super::{Stage, StageError};

/// A source of connections to a stage. A scan connects once, and again if the line is lost.
///
/// Every closure that connects is a source:
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
    /// Connects to the stage. The former connection must have been dropped.
    ///
    /// # Errors
    /// [`StageError`] if it cannot be connected now.
    fn connect(&mut self) -> Result<Box<dyn Stage>, StageError>;
}

impl<F: FnMut() -> Result<Box<dyn Stage>, StageError>> StageSource for F {
    fn connect(&mut self) -> Result<Box<dyn Stage>, StageError> {
        self()
    }
}
