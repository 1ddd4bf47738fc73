//! The mark of a homed controller.
//!
//! GRBL does not report whether it was homed or only unlocked. An unusual feed rate serves as a mark: it lasts
//! until the next reset, as the position does. The number is a checksum of all that gives a position its
//! meaning, so it is invalid once any of that has changed.

/// Smallest mark. It and the largest are whole numbers that GRBL prints exactly: it adds a half to a 24-bit
/// number before it drops the decimals.
const FIRST: u32 = 1_000_000;
const LAST: u32 = 8_000_000;

/// The feed rate of a controller whose position is unknown.
pub(super) const NOT_HOMED: u32 = 1;

/// The mark of a controller that was homed with these facts.
pub(super) fn homed_mark(facts: &str) -> u32 {
    FIRST + fnv_1a(facts.as_bytes()) % (LAST - FIRST)
}

/// The hash FNV-1a with 32 bits.
fn fnv_1a(bytes: &[u8]) -> u32 {
    bytes.iter().fold(0x811c_9dc5, |hash, byte| (hash ^ u32::from(*byte)).wrapping_mul(0x0100_0193))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hash_is_that_of_its_authors() {
        // Test vectors of Fowler, Noll and Vo.
        assert_eq!(fnv_1a(b""), 0x811c_9dc5);
        assert_eq!(fnv_1a(b"a"), 0xe40c_292c);
        assert_eq!(fnv_1a(b"foobar"), 0xbf9c_f968);
    }

    #[test]
    fn marks_are_printed_exactly_by_single_precision() {
        for facts in ["", "X 250", "Y 250", "X 251"] {
            let mark = homed_mark(facts);
            assert!((FIRST..LAST).contains(&mark));
            // As GRBL's printFloat does: in single precision, a half is added, then the decimals are dropped.
            assert_eq!((mark as f32 + 0.5) as u32, mark);
        }
    }
}
