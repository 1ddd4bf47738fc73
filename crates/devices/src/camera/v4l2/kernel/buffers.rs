//! Buffers that driver and program share.

use std::io;
use std::os::fd::AsRawFd;
use std::ptr::NonNull;

use v4l::v4l_sys as sys;
use v4l::v4l2::{self, vidioc};

use super::call::{Direction, Node, REQBUFS, Request, STREAMOFF, STREAMON, zeroed};

const MEMORY_MAPPED: u32 = 1;

/// Memory of a driver's buffer, mapped into this process.
#[derive(Debug)]
struct Mapping {
    start: NonNull<u8>,
    length: usize,
}

// SAFETY: the mapping is ordinary memory, owned by this value alone.
unsafe impl Send for Mapping {}

impl Mapping {
    fn of(node: &Node, buffer: &sys::v4l2_buffer) -> io::Result<Self> {
        let length = buffer.length as usize;
        // SAFETY: the members of the union are numbers and raw pointers; of mapped buffers it is the offset.
        let offset = unsafe { buffer.m.offset };
        let file = node.file()?.as_raw_fd();
        // SAFETY: a new mapping at a place of the kernel's choice touches no memory of ours; what it returns
        // is `length` bytes long until it is unmapped.
        let start = unsafe {
            v4l2::mmap(std::ptr::null_mut(), length, mmap::READ_WRITE, mmap::SHARED, file, offset.into())?
        };
        let start =
            NonNull::new(start.cast()).ok_or_else(|| io::Error::other("a buffer was mapped nowhere"))?;
        Ok(Self { start, length })
    }
}

/// Constants of `mmap`, the same on all Linux machines.
mod mmap {
    pub(crate) const READ_WRITE: i32 = 3;
    pub(crate) const SHARED: i32 = 1;
}

impl Drop for Mapping {
    fn drop(&mut self) {
        // SAFETY: the mapping was made by `of`, has this start and length, and no slice of it outlives
        // `self`. It fails for mappings that are none only.
        let _ = unsafe { v4l2::munmap(self.start.as_ptr().cast(), self.length) };
    }
}

/// The buffers of a stream.
#[derive(Debug)]
pub(crate) struct Buffers {
    direction: Direction,
    mappings: Vec<Mapping>,
    /// Which buffers the driver owns.
    queued: Vec<bool>,
}

impl Buffers {
    /// Requests buffers from the driver, and maps them; it may create more or fewer.
    pub(crate) fn request(node: &Node, direction: Direction, count: usize) -> io::Result<Self> {
        let made = node.request_buffers(direction, count)?;
        let mut mappings = Vec::with_capacity(made);
        for index in 0..made {
            let mut buffer = node.buffer(direction, index);
            let mapped = exchange(node, vidioc::VIDIOC_QUERYBUF, &mut buffer)
                .and_then(|()| Mapping::of(node, &buffer));
            match mapped {
                Ok(mapping) => mappings.push(mapping),
                Err(error) => {
                    drop(mappings);
                    // The first error is reported.
                    let _ = node.request_buffers(direction, 0);
                    return Err(error);
                }
            }
        }
        Ok(Self { direction, queued: vec![false; made], mappings })
    }

    pub(crate) fn count(&self) -> usize {
        self.mappings.len()
    }

    /// Indices of buffers that the program owns.
    pub(crate) fn free(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.count()).filter(|&index| !self.queued[index])
    }

    /// Gives a buffer to the driver. `bytes_used` matters for output only.
    pub(crate) fn queue(&mut self, node: &Node, index: usize, bytes_used: usize) -> io::Result<()> {
        let Some(queued) = self.queued.get_mut(index).filter(|queued| !**queued) else {
            return Err(io::Error::other("the driver owns the buffer already"));
        };
        let mut buffer = node.buffer(self.direction, index);
        buffer.bytesused = u32::try_from(bytes_used).unwrap_or(u32::MAX);
        buffer.field = sys::v4l2_field_V4L2_FIELD_NONE;
        exchange(node, vidioc::VIDIOC_QBUF, &mut buffer)?;
        *queued = true;
        Ok(())
    }

    /// Takes a finished buffer from the driver, which states no more bytes than it has; `None` if there is
    /// none now.
    pub(crate) fn dequeue(&mut self, node: &Node) -> io::Result<Option<sys::v4l2_buffer>> {
        let mut buffer = node.buffer(self.direction, 0);
        match exchange(node, vidioc::VIDIOC_DQBUF, &mut buffer) {
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => return Ok(None),
            done => done?,
        }
        let index = buffer.index as usize;
        let (Some(queued), Some(mapping)) = (self.queued.get_mut(index), self.mappings.get(index)) else {
            return Err(io::Error::other("the driver returned a buffer that does not exist"));
        };
        *queued = false;
        buffer.bytesused = buffer.bytesused.min(u32::try_from(mapping.length).unwrap_or(u32::MAX));
        Ok(Some(buffer))
    }

    /// Copies the first `length` bytes of a buffer that the program owns; `false` if it does not own it, or
    /// it is shorter.
    ///
    /// The bytes are copied, never borrowed: drivers such as `v4l2loopback` may still write to them.
    pub(crate) fn copy(&self, index: usize, length: usize, to: &mut Vec<u8>) -> bool {
        let ours = self.mappings.get(index).filter(|_| !self.queued[index]);
        let Some(mapping) = ours.filter(|mapping| length <= mapping.length) else { return false };
        to.resize(length, 0);
        // SAFETY: the mapping is at least `length` bytes long and lives as long as `self`, `to` was just made
        // that long, and memory of a driver and of a vector do not overlap. If the driver writes meanwhile,
        // bytes are old or new, any of them valid.
        unsafe { std::ptr::copy_nonoverlapping(mapping.start.as_ptr(), to.as_mut_ptr(), length) };
        true
    }

    /// The bytes of an output buffer that the program owns, for writing.
    pub(crate) fn bytes_mut(&mut self, index: usize) -> Option<&mut [u8]> {
        let mapping = self.mappings.get(index).filter(|_| !self.queued[index])?;
        // SAFETY: the mapping is that long and lives as long as `self`; `&mut self` makes this the only slice
        // of it. An output's driver writes to no buffer, and handing it over needs `&mut self`, so that this
        // slice is gone by then.
        Some(unsafe { std::slice::from_raw_parts_mut(mapping.start.as_ptr(), mapping.length) })
    }

    pub(crate) fn start(&self, node: &Node) -> io::Result<()> {
        node.switch_stream(self.direction, true)
    }

    /// Stops the stream and frees the memory.
    pub(crate) fn release(self, node: &Node) -> io::Result<()> {
        let stopped = node.switch_stream(self.direction, false);
        let direction = self.direction;
        drop(self);
        stopped.and(node.request_buffers(direction, 0).map(|_| ()))
    }
}

/// Of memory-mapped buffers in one plane, as [`Node::buffer`] makes them; others are refused.
fn exchange(node: &Node, request: Request, buffer: &mut sys::v4l2_buffer) -> io::Result<()> {
    let takes_buffers =
        [vidioc::VIDIOC_QUERYBUF, vidioc::VIDIOC_QBUF, vidioc::VIDIOC_DQBUF].contains(&request);
    let in_one_plane = [Direction::Capture as u32, Direction::Output as u32].contains(&buffer.type_);
    if !takes_buffers || !in_one_plane || buffer.memory != MEMORY_MAPPED {
        return Err(io::Error::other("a call for other buffers than mapped ones in one plane"));
    }
    // SAFETY: the number is one of three that take this structure. Its union is a pointer for buffers of the
    // caller's own memory and for those of several planes only; this is neither, as just checked.
    unsafe { node.call_with_pointers(request, buffer) }
}

impl Node {
    fn switch_stream(&self, direction: Direction, on: bool) -> io::Result<()> {
        let mut kind = direction as std::os::raw::c_int;
        self.call(if on { STREAMON } else { STREAMOFF }, &mut kind)
    }

    fn request_buffers(&self, direction: Direction, count: usize) -> io::Result<usize> {
        let mut wanted = sys::v4l2_requestbuffers {
            count: u32::try_from(count).unwrap_or(u32::MAX),
            type_: direction as u32,
            memory: MEMORY_MAPPED,
            ..zeroed()
        };
        self.call(REQBUFS, &mut wanted)?;
        Ok(wanted.count as usize)
    }

    fn buffer(&self, direction: Direction, index: usize) -> sys::v4l2_buffer {
        sys::v4l2_buffer { index: index as u32, type_: direction as u32, memory: MEMORY_MAPPED, ..zeroed() }
    }
}
