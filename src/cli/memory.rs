//! Memory that is given back is kept for what asks next.
//!
//! A match holds dozens of planes, a few at a time. The C library hands such large blocks back to the system at once, and the system clears each page
//! when it is touched again: a tenth of the time of a first look. Kept, they raise the peak by an eighth of the frames' bytes at most.

#![cfg_attr(
    all(target_os = "linux", target_env = "gnu"),
    allow(unsafe_code, reason = "the allocator's parameters have no safe interface")
)]

/// Lets the C library's allocator keep up to 1 GiB, where it is glibc's; whether it does. To be called while there is one thread.
pub fn keep_memory() -> bool {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    {
        /// Larger than all planes of one match together; and what older versions take at most.
        const KEPT_BYTES: i32 = 1 << 30;
        const KEPT_BY_OLDER_BYTES: i32 = 32 << 20;
        // SAFETY: takes two numbers by value and changes parameters of the allocator alone, under its own lock; whatever they are, it keeps its
        // promises. What is allocated already stays as it is.
        let set = |parameter, bytes| unsafe { libc::mallopt(parameter, bytes) } == 1;
        // Each thread's arena reserves 64 MiB of addresses, used or not: where those are limited, all share one.
        if is_limited() {
            set(libc::M_ARENA_MAX, 1);
        }
        let threshold = libc::M_MMAP_THRESHOLD;
        let kept = set(threshold, KEPT_BYTES) || set(threshold, KEPT_BY_OLDER_BYTES);
        set(libc::M_TRIM_THRESHOLD, KEPT_BYTES) && kept
    }
    #[cfg(not(all(target_os = "linux", target_env = "gnu")))]
    false
}

/// Whether `ulimit -v` or `-d` bound this process.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
fn is_limited() -> bool {
    use rustix::process::{Resource, getrlimit};
    [Resource::As, Resource::Data].into_iter().any(|resource| getrlimit(resource).current.is_some())
}

#[cfg(all(test, target_os = "linux", target_env = "gnu"))]
mod tests {
    use super::*;

    #[test]
    fn the_allocator_takes_it() {
        assert!(keep_memory());
    }
}
