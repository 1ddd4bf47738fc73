//! The kernel's calls for video devices, which hold nearly all of the program's unsafe code.
//!
//! The interface of this folder is safe: plain values, the kernel's structures, and slices of buffers that the
//! driver does not own at the moment. The structures and most call numbers come from crate `v4l`, generated
//! from the kernel's header.

#![allow(
    unsafe_code,
    reason = "calls of the kernel and memory that it maps; each block says why it is sound"
)]

mod buffers;
mod call;
mod controls;
mod formats;
mod inputs;

pub(super) use buffers::Buffers;
pub(super) use call::{Capabilities, Direction, Node, has_none};
pub(super) use controls::{NEXT_CONTROL, title};
pub(super) use inputs::is_like;
