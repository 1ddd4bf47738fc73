//! Chessboards and lenses, against photographs and OpenCV.

#![allow(clippy::unwrap_used, reason = "a test stops at the first thing that does not work")]

mod chessboard_corners;
mod lens_against_opencv;
