//! The camera.
//!
//! [`Camera`] is the interface for the rest of the program. It gives frames that began after a given moment,
//! each with the facts that certify it. [`CheckedCamera`] makes a camera of any [`VideoDevice`], which is a
//! bare driver: `V4l2Device` for real cameras (on Linux), [`SimDevice`] for a simulated one, with scripted
//! faults. [`ReplayCamera`] gives the frames of a sequence.

mod assess;
mod automatic;
mod average;
mod checked;
mod configure;
mod consequence;
mod control;
mod device;
mod driver;
mod error;
mod format;
mod identity;
mod moment;
#[cfg(any(test, not(target_os = "linux")))]
#[cfg_attr(
    target_os = "linux",
    allow(unreachable_pub, dead_code, reason = "only its messages are tested here")
)]
mod no_v4l2;
mod onlooker;
pub mod pixels;
mod replay;
mod settings;
mod sim;
mod stillness;
pub mod timing;
mod trusted;
#[cfg(target_os = "linux")]
mod v4l2;

pub use assess::Assessment;
pub use automatic::{exposure_unit, is_gain};
pub use average::{AveragedFrame, average};
pub use checked::CheckedCamera;
pub use consequence::CameraRemedy;
pub use control::{Control, ControlKind, find_control};
pub use device::{FilledBuffer, StampSource, VideoDevice};
pub use driver::{CameraDriver, OpenCamera, Surroundings, add_camera_drivers, camera_driver, camera_drivers};
pub use error::CameraError;
pub use format::{ActiveFormat, Interval, OfferedFormat, Size, Sizes};
pub use identity::{CameraChoice, CameraIdentity, choose};
pub use moment::Moment;
#[cfg(not(target_os = "linux"))]
pub use no_v4l2::{VideoOutput, cameras, open_camera};
pub use onlooker::Onlooker;
pub use replay::ReplayCamera;
pub use settings::{CameraSettings, Configuration, Pinned};
pub use sim::{SimCamera, SimDevice, SimFault, SimStamps, SimView, ViewSwitch};
pub use stillness::Difference;
pub use timing::TimingRule;
pub use trusted::{Camera, FrameFacts, TakenFrame};
#[cfg(target_os = "linux")]
pub use v4l2::{V4l2Camera, V4l2Device, VideoOutput, cameras, open_camera};
