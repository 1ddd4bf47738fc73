//! The cable: the part of the USB/IP protocol that the kernel's virtual host controller `vhci_hcd` speaks
//! with a device that is plugged in. Kernel: Documentation/usb/usbip_protocol.rst.
//!
//! All numbers are big-endian words of 32 bits; every message begins with a head of 48 bytes. The "network"
//! is a pair of Unix sockets: the controller takes any stream socket of the process that names its number.

use std::fs;
use std::io::{self, Read, Write};
use std::os::fd::AsRawFd;
use std::os::unix::net::UnixStream;

const CONTROLLER: &str = "/sys/devices/platform/vhci_hcd.0";
const HIGH_SPEED: u32 = 3;
const HEAD: usize = 48;

const CMD_SUBMIT: u32 = 1;
const CMD_UNLINK: u32 = 2;
const RET_SUBMIT: u32 = 3;
const RET_UNLINK: u32 = 4;

/// How USB/IP tells a stalled request or a halted endpoint.
pub const EPIPE: i32 = -32;
/// How it tells a packet that was lost on the bus.
pub const EPROTO: i32 = -71;
/// How it tells a transfer that was taken back.
pub const ECONNRESET: i32 = -104;

/// A transfer that the host asks for.
pub struct Transfer {
    pub number: u32,
    pub endpoint: u8,
    pub is_in: bool,
    /// Bytes at most.
    pub length: usize,
    /// The request, on endpoint 0.
    pub setup: [u8; 8],
    /// What the host sends with an outgoing transfer.
    pub data: Vec<u8>,
    /// Offset and length of each packet of an isochronous transfer.
    pub packets: Vec<(u32, u32)>,
}

/// What the host wants.
pub enum Command {
    Submit(Transfer),
    /// Takes the transfer `victim` back.
    Unlink {
        number: u32,
        victim: u32,
    },
}

/// Plugs a device into a port, and returns the device's end of the cable.
pub fn plug(port: u32) -> io::Result<UnixStream> {
    let (ours, theirs) = UnixStream::pair()?;
    // The kernel keeps its own reference to `theirs`. Any number of the device but 0 will do.
    fs::write(format!("{CONTROLLER}/attach"), format!("{port} {} 1 {HIGH_SPEED}", theirs.as_raw_fd()))?;
    Ok(ours)
}

/// Pulls the plug.
pub fn unplug(port: u32) -> io::Result<()> {
    fs::write(format!("{CONTROLLER}/detach"), port.to_string())
}

fn word(bytes: &[u8], index: usize) -> u32 {
    u32::from_be_bytes(bytes[4 * index..4 * index + 4].try_into().unwrap())
}

/// Waits for the next command; an error when the plug is pulled.
pub fn read_command(from: &mut impl Read) -> io::Result<Command> {
    let mut head = [0; HEAD];
    from.read_exact(&mut head)?;
    let number = word(&head, 1);
    match word(&head, 0) {
        CMD_SUBMIT => {
            let (is_in, length) = (word(&head, 3) == 1, word(&head, 6) as usize);
            let mut data = vec![0; if is_in { 0 } else { length }];
            from.read_exact(&mut data)?;
            // All ones where there are no packets.
            let count = Some(word(&head, 8)).filter(|count| *count != u32::MAX).unwrap_or(0);
            let mut packets = Vec::new();
            for _ in 0..count {
                let mut packet = [0; 16];
                from.read_exact(&mut packet)?;
                packets.push((word(&packet, 0), word(&packet, 1)));
            }
            let (endpoint, setup) = (word(&head, 4) as u8, head[40..].try_into().unwrap());
            Ok(Command::Submit(Transfer { number, endpoint, is_in, length, setup, data, packets }))
        }
        CMD_UNLINK => Ok(Command::Unlink { number, victim: word(&head, 5) }),
        other => Err(io::Error::other(format!("command {other} of USB/IP"))),
    }
}

fn head(command: u32, number: u32, status: i32) -> Vec<u8> {
    let mut head = vec![0; HEAD];
    head[0..4].copy_from_slice(&command.to_be_bytes());
    head[4..8].copy_from_slice(&number.to_be_bytes());
    head[20..24].copy_from_slice(&status.to_be_bytes());
    head
}

/// Ends a transfer with a status, 0 or minus an errno, and the data of an incoming one.
pub fn complete(to: &mut impl Write, transfer: &Transfer, status: i32, data: &[u8]) -> io::Result<()> {
    let sent = if status == 0 { transfer.length } else { 0 };
    let actual = if transfer.is_in { data.len() } else { sent };
    let mut message = head(RET_SUBMIT, transfer.number, status);
    message[24..28].copy_from_slice(&(actual as u32).to_be_bytes());
    message.extend(data);
    to.write_all(&message)
}

/// Ends an incoming isochronous transfer: a status and data for each of its first packets; the others are
/// empty.
pub fn complete_packets(
    to: &mut impl Write,
    transfer: &Transfer,
    filled: &[(i32, Vec<u8>)],
) -> io::Result<()> {
    let actual: usize = filled.iter().map(|(_, data)| data.len()).sum();
    let failed = filled.iter().filter(|(status, _)| *status != 0).count();
    let mut message = head(RET_SUBMIT, transfer.number, 0);
    for (place, value) in [(24, actual), (32, transfer.packets.len()), (36, failed)] {
        message[place..place + 4].copy_from_slice(&(value as u32).to_be_bytes());
    }
    // The data come without gaps; the kernel spreads them out by the descriptions that follow.
    filled.iter().for_each(|(_, data)| message.extend(data));
    let nothing = (0, Vec::new());
    for (index, (offset, length)) in transfer.packets.iter().enumerate() {
        let (status, data) = filled.get(index).unwrap_or(&nothing);
        for value in [*offset, *length, data.len() as u32, *status as u32] {
            message.extend(value.to_be_bytes());
        }
    }
    to.write_all(&message)
}

/// Confirms that a transfer was taken back ([`ECONNRESET`]), or that it had been answered before (0).
pub fn confirm_unlink(to: &mut impl Write, number: u32, status: i32) -> io::Result<()> {
    to.write_all(&head(RET_UNLINK, number, status))
}
