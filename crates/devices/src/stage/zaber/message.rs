//! Commands and replies of the Zaber ASCII protocol, with message ids and checksums.
//!
//! Crate `zproto` implements it too, but builds serialport with libudev, a C library that a first build must
//! not need.

use crate::link::Side;

/// The checksum of the text between the first character of a message and its colon: the two's complement of
/// the sum.
pub(in crate::stage) fn checksum(text: &str) -> u8 {
    text.bytes().fold(0_u8, u8::wrapping_sub)
}

/// A complete command for an axis: `/1 1 42 move abs 10000:XX`.
pub(super) fn command(device: u8, axis: u8, id: u8, words: &str) -> String {
    let inside = format!("{device} {axis} {id} {words}");
    let inside = inside.trim_end();
    format!("/{inside}:{:02X}\n", checksum(inside))
}

/// A reply: `@01 1 42 OK BUSY -- 0:XX`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ZaberReply {
    /// Number of the device in its chain.
    pub device: u8,
    /// Number of the axis; 0 is the device as a whole.
    pub axis: u8,
    /// Id of the answered command, 0 to 99.
    pub id: u8,
    /// Whether the command was accepted.
    pub accepted: bool,
    /// Whether the axis is moving.
    pub busy: bool,
    /// The warning of the highest priority, such as `WR` (no reference position); `--` for none.
    pub warning: String,
    /// The requested value, or the reason of a rejection.
    pub data: String,
}

impl ZaberReply {
    /// Parses a line without its end; `None` if it is not a reply with an id and the right checksum.
    ///
    /// ```
    /// use epirig_devices::stage::zaber::ZaberReply;
    ///
    /// // The checksum is 256 minus the sum of the characters between @ and the colon, modulo 256.
    /// let reply = ZaberReply::parse("@01 1 42 OK IDLE WR 0:B7").unwrap();
    /// assert_eq!((reply.id, reply.busy, reply.warning.as_str()), (42, false, "WR"));
    /// assert_eq!(ZaberReply::parse("@01 1 42 OK IDLE WR 1:B7"), None);
    /// ```
    pub fn parse(line: &str) -> Option<Self> {
        let (inside, sum) = line.trim().strip_prefix('@')?.rsplit_once(':')?;
        if sum.len() != 2 || u8::from_str_radix(sum, 16).ok()? != checksum(inside) {
            return None;
        }
        let mut words = inside.splitn(7, ' ');
        Some(Self {
            device: words.next()?.parse().ok()?,
            axis: words.next()?.parse().ok()?,
            id: words.next()?.parse().ok()?,
            accepted: match words.next()? {
                "OK" => true,
                "RJ" => false,
                _ => return None,
            },
            busy: match words.next()? {
                "BUSY" => true,
                "IDLE" => false,
                _ => return None,
            },
            warning: words.next()?.to_owned(),
            data: words.next()?.to_owned(),
        })
    }
}

/// Whether bytes hold a reply, with or without id and checksum.
pub(super) fn is_of_zaber(heard: &[u8]) -> bool {
    let is_reply = |line: &str| {
        let mut words = line.trim_start_matches('@').split(' ');
        let is_addressed = words.next().is_some_and(|device| device.parse::<u8>().is_ok());
        line.starts_with('@') && is_addressed && words.any(|word| matches!(word, "OK" | "RJ"))
    };
    String::from_utf8_lossy(heard).lines().any(is_reply)
}

/// Meaning of a warning and what to do, if the position is invalid.
pub(super) fn fault_text(warning: &str) -> Option<&'static str> {
    Some(match warning {
        "FF" => "a critical error of its electronics; switch it off and on",
        "FN" => "it does not support the stage that is connected to it; connect the right one",
        "FZ" => "the axis is not active; activate it",
        "FH" => "its emergency stop is pressed; release it",
        "FV" | "FO" | "FD" | "FQ" => {
            "its motor driver has switched itself off; check the supply, then switch it off and on"
        }
        "FC" | "FM" | "FP" => "its encoder or its current fails; check the cable, then switch it off and on",
        "FS" => "it stalled; look for what blocks the carriage, then home it",
        "FE" | "WL" => "a limit switch closed unexpectedly; home it",
        "WS" => "it stalled and continued; look for what blocks the carriage, then home it",
        "WM" => "it was displaced at rest; home it",
        "WR" => "it has lost its position (power or reset); home it",
        _ if warning.starts_with('F') => "it reports a fault; see its manual",
        _ => return None,
    })
}

/// Meaning of a rejection and what to do.
pub(super) fn rejection_text(reason: &str) -> String {
    let text = match reason {
        "BADDATA" => "the value is out of its range; check --microstep-um",
        "STATUSBUSY" => "it is busy; stop it first",
        "PARKED" => "it is parked; unpark it",
        "BADCOMMAND" | "BADAXIS" | "DEVICEONLY" => {
            "it does not know the command; it may be another device than a linear stage"
        }
        "NOACCESS" => "the command needs another access level",
        _ => "see its manual",
    };
    format!("{text} (RJ {reason})")
}

/// A line of either side, as text.
pub(super) fn line_text(side: Side, line: &str) -> String {
    match (side, ZaberReply::parse(line)) {
        (Side::Host, _) => format!("command {line:?}"),
        (Side::Device, Some(reply)) => {
            let ZaberReply { device, axis, id, accepted, busy, warning, data } = reply;
            let verdict = if accepted { "OK" } else { "REJECTED" };
            let state = if busy { "busy" } else { "idle" };
            format!("#{id} device {device} axis {axis}: {verdict}, {state}, warning {warning}, {data}")
        }
        (Side::Device, None) => format!("no reply with id and checksum: {line:?}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn checksums_are_those_of_the_manual() {
        // The protocol manual's example, as other programs test it too: "/01 tools echo:8F".
        assert_eq!(checksum("01 tools echo"), 0x8F);
        // "1 1 0 home": 49+32+49+32+48+32+104+111+109+101 = 667, 667 mod 256 = 155, 256 - 155 = 101 = 0x65.
        assert_eq!(command(1, 1, 0, "home"), "/1 1 0 home:65\n");
        assert_eq!(command(1, 1, 0, ""), format!("/1 1 0:{:02X}\n", 256 - (49 + 32 + 49 + 32 + 48)));
    }

    #[test]
    fn replies_are_explained() {
        assert_eq!(
            line_text(Side::Device, "@01 1 42 OK IDLE WR 0:B7"),
            "#42 device 1 axis 1: OK, idle, warning WR, 0"
        );
    }
}
