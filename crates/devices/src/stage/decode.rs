//! Decodes the traffic of a line to text.

use crate::link::Side;

/// Decodes the bytes of both sides of a line into one line of text per message. Its memory is bounded for any
/// input.
///
/// ```
/// use epirig_devices::link::Side;
/// use epirig_devices::stage::Driver;
///
/// let native = Driver::named("native").ok_or("no such driver")?;
/// let mut decoder = native.decoder().ok_or("no line")?;
/// let frame = [0x00, 0x0a, 0x03, 0x03, 0x02, 0xc0, 0x8d, 0xb7, 0x01, 0x3b, 0xfe, 0x00];
/// assert_eq!(decoder.push(Side::Host, &frame), ["#3 move 2 to 1.500000 mm"]);
/// # Ok::<(), &str>(())
/// ```
pub trait Decoder: Send {
    /// Takes the next bytes of one side; returns the completed messages.
    fn push(&mut self, side: Side, bytes: &[u8]) -> Vec<String>;

    /// The incomplete message of one side.
    fn unfinished(&self, side: Side) -> Option<String>;
}

/// Longest line of a text dialect; longer lines are cut.
const LONGEST_LINE: usize = 256;

/// A decoder for text dialects.
#[derive(Debug)]
pub struct LineDecoder {
    /// Explains a line.
    explain: fn(Side, &str) -> String,
    /// Explains a byte that is a message by itself.
    real_time: fn(Side, u8) -> Option<&'static str>,
    /// The incomplete line of each side.
    lines: [Vec<u8>; 2],
}

impl LineDecoder {
    /// A decoder that explains lines with `explain`.
    pub fn new(explain: fn(Side, &str) -> String) -> Self {
        Self { explain, real_time: |_, _| None, lines: [Vec::new(), Vec::new()] }
    }

    /// The same for a dialect with single bytes that are messages.
    pub fn with_real_time(self, real_time: fn(Side, u8) -> Option<&'static str>) -> Self {
        Self { real_time, ..self }
    }
}

impl Decoder for LineDecoder {
    fn push(&mut self, side: Side, bytes: &[u8]) -> Vec<String> {
        let line = &mut self.lines[side as usize];
        let mut texts = Vec::new();
        for &byte in bytes {
            match ((self.real_time)(side, byte), byte) {
                (Some(meaning), _) => texts.push(meaning.to_owned()),
                (None, b'\r' | b'\n') if line.is_empty() => {}
                (None, b'\r' | b'\n') => {
                    let words = std::mem::take(line);
                    texts.push((self.explain)(side, &String::from_utf8_lossy(&words)));
                }
                (None, _) if line.len() < LONGEST_LINE => line.push(byte),
                (None, _) => {}
            }
        }
        texts
    }

    fn unfinished(&self, side: Side) -> Option<String> {
        let line = &self.lines[side as usize];
        (!line.is_empty()).then(|| format!("unfinished: {:?}", String::from_utf8_lossy(line)))
    }
}
