//! The keys of section `stage`.

use super::super::parts::{AxisName, Driver};
use super::super::quantity::{MM, MM_S, MM_S2, UM};
use super::key::{Allowed, Key, Kind, key, keys, measure, names};

const GRBL: &[&str] = &["grbl"];
const ZABER: &[&str] = &["zaber"];
const SIM: &[&str] = &["sim"];
const REAL: &[&str] = &["native", "grbl", "zaber"];
const NATIVE_OR_SIM: &[&str] = &["native", "sim"];

keys!(
    "stage",
    DRIVER = key(
        "driver",
        Kind::Choice(&names(&Driver::ALL)),
        "grbl",
        "The language that it speaks: epirig's own firmware, GRBL 1.1, Zaber ASCII; sim is a stage in memory",
    )
    .or("native"),
    PORT = key(
        "port",
        Kind::Text,
        "/dev/ttyACM0",
        "Its port: a path, usb:SERIAL or usb:VID:PID; without it, the only USB serial port"
    )
    .only_with(REAL),
    AXIS = key("axis", Kind::Choice(&names(&AxisName::ALL)), "x", "Its axis; without it, x").only_with(GRBL),
    DEVICE = key("device", Kind::Whole(1, 99), "1", "Number of the device in its chain; without it, 1")
        .only_with(ZABER),
    MICROSTEP = key(
        "microstep",
        measure(UM, Allowed::Positive),
        "0.047625 um",
        "Length of a microstep, from its data sheet; needed",
    )
    .only_with(ZABER),
    APPROACH = key(
        "approach",
        measure(MM, Allowed::ZeroOrMore),
        "0.5 mm",
        "Come to every position from so far below, against backlash",
    )
    .or("0 mm"),
    TOLERANCE = key(
        "tolerance",
        measure(MM, Allowed::ZeroOrMore),
        "0.01 mm",
        "How far the reported position may be off, beyond half a step",
    )
    .or("0 mm")
    .only_with(REAL),
    TRAVEL =
        key("travel", measure(MM, Allowed::Positive), "200 mm", "Positions go from 0 to this").only_with(SIM),
    VELOCITY = key("velocity", measure(MM_S, Allowed::Positive), "5 mm/s", "Velocity of a long move")
        .only_with(NATIVE_OR_SIM),
    ACCELERATION =
        key("acceleration", measure(MM_S2, Allowed::Positive), "20 mm/s2", "Acceleration and deceleration",)
            .only_with(NATIVE_OR_SIM),
    POSITION_NOISE = key(
        "position_noise",
        measure(UM, Allowed::ZeroOrMore),
        "2 um",
        "Standard deviation of the place where the carriage comes to rest",
    )
    .or("0 um")
    .only_with(SIM),
    BACKLASH = key("backlash", measure(UM, Allowed::ZeroOrMore), "10 um", "Play between screw and nut",)
        .or("0 um")
        .only_with(SIM),
);
