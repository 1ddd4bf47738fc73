//! Memory that is given back is kept for what asks next.
//!
//! A match holds dozens of planes, a few at a time. The C library hands such large blocks back to the system at once, and the system clears each page
//! when it is touched again: a sixth of the time of a first look. Kept, they raise the peak by a tenth of the frames' bytes at most.

#![cfg_attr(
    all(target_os = "linux", target_env = "gnu"),
    allow(unsafe_code, reason = "the allocator's parameters have no safe interface")
)]

/// Lets the C library's allocator keep up to 1 GiB, where it is glibc's; whether it does. To be called while there is one thread.
pub fn keep_memory() -> bool {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    {
        /// Larger than all planes of one match together.
        const KEPT_BYTES: i32 = 1 << 30;
        // SAFETY: takes two numbers by value and changes parameters of the allocator alone, under its own lock; whatever they are, it keeps its
        // promises. What is allocated already stays as it is.
        let set = |parameter| unsafe { libc::mallopt(parameter, KEPT_BYTES) } == 1;
        set(libc::M_MMAP_THRESHOLD) && set(libc::M_TRIM_THRESHOLD)
    }
    #[cfg(not(all(target_os = "linux", target_env = "gnu")))]
    false
}

#[cfg(all(test, target_os = "linux", target_env = "gnu"))]
mod tests {
    use super::*;

    #[test]
    fn the_allocator_takes_it() {
        assert!(keep_memory());
    }
}
