//! One arena of the C library's allocator for all threads, where addresses are limited.

#![cfg_attr(
    all(target_os = "linux", target_env = "gnu"),
    allow(unsafe_code, reason = "the allocator's parameters have no safe interface")
)]

/// Lets all threads share one arena of glibc's allocator if `ulimit -v` or `-d` limits this process: each
/// arena reserves 64 MiB of addresses. Returns whether they share one; `false` for other allocators. Call it
/// while there is one thread.
pub(super) fn share_arena() -> bool {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    {
        is_limited() && one_arena()
    }
    #[cfg(not(all(target_os = "linux", target_env = "gnu")))]
    false
}

/// Whether the allocator makes no arena besides its first from now on.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
fn one_arena() -> bool {
    // SAFETY: takes two numbers by value and changes only parameters of the allocator, under its own lock. It
    // accepts any values. Existing allocations are not affected.
    unsafe { libc::mallopt(libc::M_ARENA_MAX, 1) == 1 }
}

/// Whether `ulimit -v` or `-d` limits this process.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
fn is_limited() -> bool {
    use rustix::process::{Resource, getrlimit};
    [Resource::As, Resource::Data].into_iter().any(|resource| getrlimit(resource).current.is_some())
}

#[cfg(all(test, target_os = "linux", target_env = "gnu"))]
mod tests {
    use super::*;

    #[test]
    fn threads_share_an_arena_where_addresses_are_limited() {
        assert_eq!(share_arena(), is_limited());
        assert!(one_arena());
    }
}
