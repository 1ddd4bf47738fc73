//! The protocol between epirig and the firmware of its stage; `PROTOCOL.md` describes it for other languages.
//!
//! Without allocation, input/output or clock of its own, so that host, simulator and firmware run the same code:
//!
//! - [`message`]: what is said. [`frame`]: how it travels: COBS frames with a CRC, and one raw byte that stops at once.
//! - [`ramp`]: the trapezoidal velocity profile, in integers. [`axis`]: motion, homing, limits, watchdog, driven by
//!   a timer. [`device`]: the stage's side of the conversation.
//!
//! ```
//! use firmware_protocol::axis::{Axis, Limits};
//! use firmware_protocol::device::{Build, Device};
//! use firmware_protocol::frame::{Direction, decode, encode};
//! use firmware_protocol::message::{Refusal, Reply, Request};
//!
//! let build = Build { number: 1, steps_per_mm: 250, travel_nm: 200_000_000, tick_hz: 10_000 };
//! let (mut device, mut axis) = (Device::new(build, 7), Axis::default());
//! // An unhomed stage refuses to move.
//! let question = encode(Direction::Request, 3, &Request::Move { id: 1, position_nm: 1_500_000 }).unwrap();
//! let answer = question.bytes().iter().find_map(|&byte| device.receive(byte, &mut axis)).unwrap();
//! let mut payload = answer.bytes()[1..answer.bytes().len() - 1].to_vec();
//! let reply = decode::<Reply>(Direction::Reply, &mut payload).unwrap();
//! assert_eq!((reply.sequence, reply.message), (3, Reply::Refused(Refusal::NotHomed)));
//! assert_eq!(axis.tick(Limits::default()), None);
//! ```
#![no_std]

pub mod axis;
pub mod device;
pub mod frame;
pub mod message;
pub mod ramp;
