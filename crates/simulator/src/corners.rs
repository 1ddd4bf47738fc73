//! The true places of chess-board corners in simulated frames.

use super::simulator::Simulator;

/// An inner corner of a band on the tile, in a frame as the camera gives it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TargetCorner {
    /// 0 for the band at the tile's upper edge, 1 for that at the lower one.
    pub band: usize,
    /// Number of the corner in its row, from the left.
    pub column: usize,
    /// Number of the row, from the top.
    pub row: usize,
    /// Column of the image, in px; it may lie outside.
    pub x_px: f64,
    /// Row of the image, in px; it may lie outside.
    pub y_px: f64,
}

/// An inner corner of the board in the hand, in a frame as the camera gives it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoardCorner {
    /// Number of the corner along the board's u.
    pub column: usize,
    /// Number of the corner along the board's v.
    pub row: usize,
    /// Column of the image, in px.
    pub x_px: f64,
    /// Row of the image, in px.
    pub y_px: f64,
}

impl Simulator {
    /// The inner corners of the bands on the tile when the stage says that it is at `position_mm`, band by
    /// band and row by row, whether or not they are in view; none if the scene has no bands.
    pub fn target_corners(&self, position_mm: f64) -> Vec<TargetCorner> {
        let Some(print) = self.print else { return Vec::new() };
        let offset_mm = self.scene_offset_mm(position_mm);
        let corner = |(band, column, row, u, v)| {
            let depth_mm = self.config.scene.raised_depth(u, v);
            let (x_px, y_px) = self.config.optics.pixel(((u + offset_mm) / depth_mm, v / depth_mm));
            TargetCorner { band, column, row, x_px, y_px }
        };
        print.corners().map(corner).collect()
    }

    /// The inner corners of the board in pose number `pose` (see
    /// [`board_irradiance`](Self::board_irradiance)), row by row; none if the simulator has no board.
    pub fn board_corners(&self, pose: usize) -> Vec<BoardCorner> {
        let optics = &self.config.optics;
        let Some(board) = self.config.board else { return Vec::new() };
        let corners = board.corners(optics, &board.pose(optics, pose));
        corners.into_iter().map(|(column, row, x_px, y_px)| BoardCorner { column, row, x_px, y_px }).collect()
    }
}
