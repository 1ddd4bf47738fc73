//! What can go wrong with the camera, by call of a test.

/// Faults of the next frames, and lasting ones.
#[derive(Debug, Clone, Default)]
pub struct Faults {
    /// Frames with the error bit in a header.
    pub error_bit: u32,
    /// Frames that lack a payload.
    pub short: u32,
    /// Frames whose FID, which tells a frame from the one before, is not toggled.
    pub same_fid: u32,
    /// Frames whose FID is toggled in their middle.
    pub split_fid: u32,
    /// Frames of which a packet is lost on the bus; isochronous only.
    pub lost_packet: u32,
    /// Frames in whose middle the endpoint halts; bulk only.
    pub halt: u32,
    /// Nothing is sent any more.
    pub silent: bool,
    /// Requests for this control are stalled, with an error code of UVC.
    pub stall: Option<(&'static str, u8)>,
    /// This control takes every value and keeps the old one.
    pub deaf: Option<&'static str>,
}

/// The faults of one frame.
#[derive(Debug, Clone, Copy)]
pub struct FrameFaults {
    pub error_bit: bool,
    pub short: bool,
    pub same_fid: bool,
    pub split_fid: bool,
    pub lost_packet: bool,
    pub halt: bool,
}

impl Faults {
    /// Takes those of the next frame.
    pub fn of_next_frame(&mut self) -> FrameFaults {
        let take = |count: &mut u32| {
            let now = *count > 0;
            *count = count.saturating_sub(1);
            now
        };
        FrameFaults {
            error_bit: take(&mut self.error_bit),
            short: take(&mut self.short),
            same_fid: take(&mut self.same_fid),
            split_fid: take(&mut self.split_fid),
            lost_packet: take(&mut self.lost_packet),
            halt: take(&mut self.halt),
        }
    }

    /// Whether all faults of single frames have come to pass.
    pub fn are_spent(&self) -> bool {
        let counts = [self.error_bit, self.short, self.same_fid, self.split_fid, self.lost_packet, self.halt];
        counts == [0; 6]
    }
}
