//! Somebody who watches the pictures of a camera while a scan takes its frames.

use std::fmt;
use std::sync::Arc;

use epirig_core::frame::Frame;

/// Somebody who watches the pictures of a camera, such as a window that shows them.
///
/// The camera calls it in the thread that takes frames, so both functions must return soon.
pub trait Onlooker: Send + Sync {
    /// Whether it wants the next picture. If not, the camera does no work for it.
    fn wants(&self) -> bool;

    /// Receives a picture. Pictures that a scan rejects, because they are too old or unsteady, come too.
    fn see(&self, frame: &Frame);
}

/// The onlooker of a camera, if there is one.
#[derive(Clone, Default)]
pub(super) struct Audience(Option<Arc<dyn Onlooker>>);

impl Audience {
    pub(super) fn of(onlooker: Option<Arc<dyn Onlooker>>) -> Self {
        Self(onlooker)
    }

    /// Shows the picture that `picture` makes, if it makes one. Nothing is made if nobody wants it.
    pub(super) fn show(&self, picture: impl FnOnce() -> Option<Frame>) {
        if let Some(onlooker) = self.0.as_ref().filter(|onlooker| onlooker.wants())
            && let Some(frame) = picture()
        {
            onlooker.see(&frame);
        }
    }

    /// Shows a picture, if it is wanted.
    pub(super) fn show_this(&self, frame: &Frame) {
        if let Some(onlooker) = self.0.as_ref().filter(|onlooker| onlooker.wants()) {
            onlooker.see(frame);
        }
    }
}

impl fmt::Debug for Audience {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        to.write_str(if self.0.is_some() { "Audience(one)" } else { "Audience(none)" })
    }
}
