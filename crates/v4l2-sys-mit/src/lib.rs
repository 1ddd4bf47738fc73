//! The kernel's structures and numbers for video devices (V4L2), as `bindgen` makes them of
//! `linux/videodev2.h`.
//!
//! The crate of this name on crates.io makes them when it is built, for which it needs libclang. These are
//! checked in, so a build needs Rust and a linker only. They are the same for x86_64, aarch64 and 32-bit Arm:
//! what differs there, pointers and `long`, differs by the types of `core::ffi`. `tests/layout.rs` compares
//! them with the header of the machine.
//!
//! The names are the kernel's; its documentation is the "Linux Media Infrastructure userspace API".

#![allow(
    non_camel_case_types,
    non_snake_case,
    non_upper_case_globals,
    reason = "generated, with the names of the kernel"
)]

include!("bindings.rs");
