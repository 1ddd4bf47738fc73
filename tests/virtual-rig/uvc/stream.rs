//! The camera's stream: a picture each frame interval, cut into UVC payloads (2.4.3 of the class
//! definition), with faults.

use std::collections::VecDeque;
use std::sync::MutexGuard;
use std::thread;
use std::time::{Duration, Instant};

use std::os::unix::net::UnixStream;

use super::descriptors::{PACKET, chosen};
use super::device::{Device, monotonic_us};
use super::faults::FrameFaults;
use super::picture::{Format, Stamp, encoded, grey};
use super::usbip::{self, EPIPE, EPROTO, Transfer};

const HEADER: usize = 12;
// Bits of a header: tells frames apart; end of a frame; the contents are damaged; header as below.
const FID: u8 = 1;
const EOF: u8 = 2;
const ERROR: u8 = 0x40;
const WITH_TIMES: u8 = 0x8C;

/// The plug is pulled, or the stream stopped.
struct Ended;

impl Device {
    /// Takes and sends pictures while the host asks for them, until the plug is pulled.
    pub(super) fn film(&self) {
        let mut settings = VecDeque::new();
        let mut fid = 0;
        let mut due = Instant::now();
        loop {
            let mut state = self.state();
            // A bulk stream has no switch: it is on while the host asks for data.
            while !state.unplugged && (state.faults.silent || state.waiting.is_empty()) {
                state = self.changed.wait(state).unwrap();
            }
            if state.unplugged {
                return;
            }
            let commit = state.probe;
            let interval_100ns = u32::from_le_bytes(commit[4..8].try_into().unwrap());
            let interval = Duration::from_nanos(100 * u64::from(interval_100ns));
            let now = Instant::now();
            if now < due {
                drop(state);
                thread::sleep(due - now);
                continue;
            }
            // A sensor does not wait: pictures that could not be sent in time are gone.
            while due + interval < now {
                due += interval;
                state.frame = state.frame.wrapping_add(1);
            }
            due += interval;
            let frame = state.frame;
            settings.push_back(state.controls.settings(frame));
            while settings.len() > self.delay + 1 {
                settings.pop_front();
            }
            state.frame = state.frame.wrapping_add(1);
            let faults = state.faults.of_next_frame();
            let stops = state.stops;
            drop(state);

            let taken_us = monotonic_us();
            let (steps, scene) = self.scene.now();
            let stamp = Stamp {
                frame,
                steps: steps.map(|steps| i32::try_from(steps).unwrap()),
                settings: settings[0],
                taken_us,
            };
            let (format, (columns, rows)) = chosen(&commit);
            let picture = self.picture(stamp, &scene, format, columns.into(), rows.into());
            // Exposure, and what the camera computes, before the first byte is sent.
            let since = monotonic_us().wrapping_sub(taken_us);
            thread::sleep(self.lag.saturating_sub(Duration::from_micros(since.into())));
            // A camera's own clock sends it in time. Where this process had to wait for the processor, the picture is
            // gone as well: no stamp could tell how old it is.
            let since = Duration::from_micros(monotonic_us().wrapping_sub(taken_us).into());
            if since > self.lag + interval / 2 {
                continue;
            }
            fid ^= if faults.same_fid { 0 } else { FID };
            let payloads = self.payloads(&picture, fid, &faults);
            fid ^= if faults.split_fid { FID } else { 0 };
            let sent = if self.model.isochronous {
                self.send_packets(payloads, &faults, stops)
            } else {
                self.send_bulk(&payloads, &faults, stops)
            };
            // The rest of a frame whose stream has ended is dropped; the loop sees a pulled plug.
            let _ = sent;
        }
    }

    fn picture(&self, stamp: Stamp, scene: &[u8], format: Format, columns: usize, rows: usize) -> Vec<u8> {
        let size = self.scene.size();
        let white = stamp.settings.white;
        if (size.columns, size.rows) == (columns, rows) {
            return encoded(&grey(scene, columns, stamp, format), columns, white, format);
        }
        // The nearest sample.
        let row = |y: usize| &scene[y * size.rows / rows * size.columns..][..size.columns];
        let scaled: Vec<u8> =
            (0..rows).flat_map(|y| (0..columns).map(move |x| row(y)[x * size.columns / columns])).collect();
        encoded(&grey(&scaled, columns, stamp, format), columns, white, format)
    }

    fn payloads(&self, picture: &[u8], fid: u8, faults: &FrameFaults) -> Vec<Vec<u8>> {
        let most = if self.model.isochronous { PACKET } else { self.model.payload };
        let pieces: Vec<&[u8]> = picture.chunks(most - HEADER).collect();
        let (count, middle) = (pieces.len(), pieces.len() / 2);
        let clock = self.clock();
        let mut payloads: Vec<Vec<u8>> = Vec::with_capacity(count);
        for (index, piece) in pieces.into_iter().enumerate() {
            let end = if index + 1 == count { EOF } else { 0 };
            let error = if faults.error_bit && index == middle { ERROR } else { 0 };
            let split = if faults.split_fid && index >= middle { FID } else { 0 };
            let mut payload = vec![HEADER as u8, WITH_TIMES | (fid ^ split) | end | error];
            // When it was taken; now, and the number of the USB frame, one each millisecond.
            payload.extend((clock as u32).to_le_bytes());
            payload.extend((self.clock() as u32).to_le_bytes());
            payload.extend(((self.clock() / 10_000) as u16 & 0x7FF).to_le_bytes());
            payload.extend(piece);
            payloads.push(payload);
        }
        if faults.short {
            payloads.remove(middle);
        }
        payloads
    }

    /// The next transfer that the host asks for, with the wire held: were the transfer taken back before its
    /// answer, the kernel would get an answer to what it no longer knows, and unplug the device.
    fn next_transfer(&self, stops: u32) -> Result<(Transfer, MutexGuard<'_, UnixStream>), Ended> {
        loop {
            let mut state = self.state();
            while state.waiting.is_empty() {
                if state.unplugged || state.stops != stops {
                    return Err(Ended);
                }
                state = self.changed.wait(state).unwrap();
            }
            drop(state);
            // The wire always comes before the state.
            let wire = self.wire.lock().unwrap();
            let mut state = self.state();
            if state.unplugged || state.stops != stops {
                return Err(Ended);
            }
            if let Some(transfer) = state.waiting.pop_front() {
                return Ok((transfer, wire));
            }
        }
    }

    /// A payload may fill several transfers; the one that it does not fill ends it.
    fn send_bulk(&self, payloads: &[Vec<u8>], faults: &FrameFaults, stops: u32) -> Result<(), Ended> {
        for (index, payload) in payloads.iter().enumerate() {
            let mut rest = &payload[..];
            loop {
                let (transfer, mut wire) = self.next_transfer(stops)?;
                let (part, after) = rest.split_at(rest.len().min(transfer.length));
                rest = after;
                let halts = faults.halt && index == payloads.len() / 2;
                let (status, part) = if halts { (EPIPE, &[][..]) } else { (0, part) };
                usbip::complete(&mut *wire, &transfer, status, part).map_err(|_| Ended)?;
                // The greatest payload ends without a short transfer.
                let is_whole = part.len() < transfer.length || payload.len() == self.model.payload;
                if rest.is_empty() && is_whole {
                    break;
                }
            }
        }
        Ok(())
    }

    /// One payload in each packet. Empty packets between pictures are left out.
    fn send_packets(&self, payloads: Vec<Vec<u8>>, faults: &FrameFaults, stops: u32) -> Result<(), Ended> {
        let mut packets: Vec<(i32, Vec<u8>)> = payloads.into_iter().map(|payload| (0, payload)).collect();
        if faults.lost_packet {
            let middle = packets.len() / 2;
            packets[middle] = (EPROTO, Vec::new());
        }
        while !packets.is_empty() {
            let (transfer, mut wire) = self.next_transfer(stops)?;
            let now: Vec<_> = packets.drain(..packets.len().min(transfer.packets.len())).collect();
            usbip::complete_packets(&mut *wire, &transfer, &now).map_err(|_| Ended)?;
        }
        Ok(())
    }
}
