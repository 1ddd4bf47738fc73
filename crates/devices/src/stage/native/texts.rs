//! Explanations of the firmware's refusals and faults.

use firmware_protocol::message::{Fault, Refusal};

pub(super) fn refusal_text(refusal: Refusal) -> &'static str {
    match refusal {
        Refusal::Unknown => "it does not know the request; its firmware may be of another version",
        Refusal::NotHomed => "it has not been homed; home it first",
        Refusal::OutsideTravel => "the position is outside its travel",
        Refusal::Busy => "it is busy with another operation; stop it first",
        Refusal::StaleId => "another program has sent commands; home it again",
        Refusal::BadSettings => {
            "it cannot reach these settings; lower velocity or acceleration (at most half a step a tick of its timer)"
        }
    }
}

pub(super) fn fault_text(fault: Fault) -> &'static str {
    match fault {
        Fault::None => "it gives no reason; home it",
        Fault::Watchdog => {
            "it received nothing from this program for too long and stopped; check the cable, then home it"
        }
        Fault::HardLimit => {
            "a limit switch closed, so steps were lost or the travel is set too long; home it"
        }
        Fault::EmergencyStop => "an emergency stop was received, and the position is lost; home it",
        Fault::SwitchNeverClosed => {
            "the home switch never closed; check the switch, its cable, and that the motor has power and turns the right way"
        }
        Fault::SwitchNeverOpened => {
            "the home switch stayed closed; check the switch, its cable, and that the carriage moves off it"
        }
    }
}
