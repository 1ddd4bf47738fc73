//! Homing within a scan.

use super::CaptureError;
use super::settings::changes;
use epirig_devices::stage::{PositionSettings, Stage};

/// Homes the stage, if its settings are as `recorded`; a wrong one could lead it into its end. Returns the
/// settings.
pub(super) fn home(
    stage: &mut dyn Stage,
    recorded: Option<&PositionSettings>,
) -> Result<PositionSettings, CaptureError> {
    let found = stage.position_settings()?;
    let changes = recorded.map_or(Vec::new(), |recorded| changes(recorded, &found));
    if !changes.is_empty() {
        return Err(CaptureError::SettingsChanged(changes));
    }
    stage.home()?;
    Ok(found)
}
