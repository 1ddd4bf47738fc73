//! A device that speaks the dialect of another driver is recognised, so that the error can name that driver.

use std::time::Duration;

use super::{Axis, Connection, Driver, Greeting, StageError, drivers};
use crate::link::LinkError;
use epirig_core::settings::Settings;

/// A device answers within this time; a USB adapter adds up to 32 ms.
const PATIENCE: Duration = Duration::from_millis(300);
/// A first question may end an incomplete line.
const TRIES: u32 = 2;

/// Connects by `driver`. If the device does not answer, or not as one of `driver`, it is asked in the dialects of the
/// others.
///
/// # Errors
/// As [`StageDriver::connect`](super::StageDriver::connect); [`StageError::Foreign`] names the driver of the dialect
/// that the device speaks.
pub fn connect(
    driver: Driver,
    connection: &mut Connection<'_>,
    settings: &Settings,
) -> Result<Box<dyn Axis>, StageError> {
    let failed = match driver.connect(connection, settings) {
        Err(error @ (StageError::NoAnswer { .. } | StageError::Foreign { .. })) => error,
        connected => return connected,
    };
    for other in drivers().into_iter().filter(|other| *other != driver) {
        // A line that fails now has answered nobody; the first error tells more.
        if let Some(Ok(Some(port))) = other.greeting().map(|greeting| greet(&greeting, connection)) {
            return Err(StageError::Foreign {
                port,
                expected: driver.name(),
                heard: format!("it answers as a {other} stage"),
                hint: format!("try `--driver {other}`"),
            });
        }
    }
    Err(failed)
}

/// The name of the line, if a device of this dialect answers on it.
fn greet(greeting: &Greeting, connection: &mut Connection<'_>) -> Result<Option<String>, LinkError> {
    let mut line = (connection.open_line)(greeting.baud)?;
    let (mut heard, mut buffer) = (Vec::new(), [0; 256]);
    for _ in 0..TRIES {
        line.send(&(greeting.question)())?;
        let until = line.now() + PATIENCE;
        while line.now() < until {
            let left = until.saturating_sub(line.now());
            let count = line.receive(&mut buffer, left)?;
            heard.extend_from_slice(&buffer[..count]);
            if (greeting.is_answer)(&heard) {
                return Ok(Some(line.name().to_owned()));
            }
        }
    }
    Ok(None)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::link::{Link, SimulatedLink};
    use crate::stage::simulator::FaultScript;
    use crate::stage::{StagePosition, WhenMoving};

    #[test]
    fn every_driver_names_the_right_one_for_the_device_of_every_other() {
        let with_line = || drivers().into_iter().filter(|driver| driver.has_line());
        for owner in with_line() {
            for asked in with_line() {
                let simulated = owner.simulated(FaultScript::default(), 1).unwrap();
                let device = simulated.device;
                let mut open_line =
                    |_| Ok(Box::new(SimulatedLink::new(Arc::clone(&device))) as Box<dyn Link>);
                let mut connection = Connection {
                    open_line: &mut open_line,
                    watch: StagePosition::default(),
                    seed: 0,
                    in_real_time: false,
                    when_moving: WhenMoving::Wait,
                };
                // What a driver needs to be told stands in the settings of its own simulated device.
                let settings = asked.simulated(FaultScript::default(), 1).unwrap().settings;
                match connect(asked, &mut connection, &settings) {
                    Ok(_) => assert_eq!(asked, owner),
                    Err(error) => {
                        let hint = format!("try `--driver {owner}`");
                        assert!(
                            asked != owner && error.to_string().ends_with(&hint),
                            "{asked}, {owner}: {error}"
                        );
                    }
                }
            }
        }
    }
}
