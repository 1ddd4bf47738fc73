//! A stage that exists in memory only.

use std::sync::{Arc, Mutex, PoisonError};

use super::{Stage, StageError};

/// The simulated stage: moves at once and exactly.
///
/// Others may watch where it is, as the simulated camera does, which looks at what the stage carries.
///
/// ```
/// use epirig::stage::{SimStage, Stage};
///
/// let mut stage = SimStage::new(200.0);
/// assert!(stage.move_to(10.0).is_err());
/// stage.home()?;
/// stage.move_to(10.0)?;
/// assert_eq!(stage.position_mm()?, 10.0);
/// # Ok::<(), epirig::stage::StageError>(())
/// ```
#[derive(Debug)]
pub struct SimStage {
    travel_mm: f64,
    homed: bool,
    position: StagePosition,
}

/// A view on where a simulated stage is.
#[derive(Debug, Clone, Default)]
pub struct StagePosition(Arc<Mutex<f64>>);

impl StagePosition {
    /// Where the stage is, in mm from home.
    pub fn get_mm(&self) -> f64 {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn set_mm(&self, position_mm: f64) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = position_mm;
    }
}

impl SimStage {
    /// A stage of this travel, not yet homed.
    pub fn new(travel_mm: f64) -> Self {
        Self { travel_mm, homed: false, position: StagePosition::default() }
    }

    /// A view on where the stage is, for those who look at what it carries.
    pub fn watch(&self) -> StagePosition {
        self.position.clone()
    }
}

impl Stage for SimStage {
    fn identity(&self) -> String {
        format!("simulated stage, {} mm", self.travel_mm)
    }

    fn travel_mm(&self) -> f64 {
        self.travel_mm
    }

    fn home(&mut self) -> Result<(), StageError> {
        self.position.set_mm(0.0);
        self.homed = true;
        Ok(())
    }

    fn move_to(&mut self, position_mm: f64) -> Result<(), StageError> {
        if !self.homed {
            return Err(StageError::NotHomed);
        }
        if !(0.0..=self.travel_mm).contains(&position_mm) {
            return Err(StageError::OutsideTravel { position_mm, travel_mm: self.travel_mm });
        }
        self.position.set_mm(position_mm);
        Ok(())
    }

    fn position_mm(&mut self) -> Result<f64, StageError> {
        if self.homed { Ok(self.position.get_mm()) } else { Err(StageError::NotHomed) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_stage_refuses_what_it_cannot_do() {
        let mut stage = SimStage::new(50.0);
        assert_eq!(stage.position_mm(), Err(StageError::NotHomed));
        stage.home().unwrap();
        assert!(matches!(stage.move_to(50.1), Err(StageError::OutsideTravel { .. })));
        assert!(stage.move_to(f64::NAN).is_err());
        stage.move_to(50.0).unwrap();
        assert_eq!(stage.watch().get_mm(), 50.0);
    }
}
