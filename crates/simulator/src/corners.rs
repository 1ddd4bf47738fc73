//! The true places of chess-board corners in simulated frames.

use super::simulator::Simulator;

/// An inner corner of a band on the tile, or of the board in the hand, in a frame as the camera gives it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Corner {
    /// 0 for the band at the tile's upper edge and for the board, 1 for the band at the lower edge.
    pub band: usize,
    /// Number of the corner in its row, from the left; along the board's u.
    pub column: usize,
    /// Number of the row, from the top; along the board's v.
    pub row: usize,
    /// Column of the image, in px; that of a band's corner may lie outside.
    pub x_px: f64,
    /// Row of the image, in px; likewise.
    pub y_px: f64,
}

impl Simulator {
    /// The inner corners of the bands on the tile when the stage says that it is at `position_mm`, band by
    /// band and row by row, whether or not they are in view; none if the scene has no bands.
    pub fn target_corners(&self, position_mm: f64) -> Vec<Corner> {
        let Some(print) = self.print else { return Vec::new() };
        let offset_mm = self.scene_offset_mm(position_mm);
        let corner = |(band, column, row, u, v)| {
            let depth_mm = self.config.scene.raised_depth(u, v);
            let (x_px, y_px) = self.config.optics.pixel(((u + offset_mm) / depth_mm, v / depth_mm));
            Corner { band, column, row, x_px, y_px }
        };
        print.corners().map(corner).collect()
    }

    /// The inner corners of the board in pose number `pose` (see
    /// [`board_irradiance`](Self::board_irradiance)), row by row; none if the simulator has no board.
    pub fn board_corners(&self, pose: usize) -> Vec<Corner> {
        let optics = &self.config.optics;
        let Some(board) = self.config.board else { return Vec::new() };
        let (sight, pose) = (optics.sight(), board.pose(optics, pose));
        let corner = |(column, row, u, v)| {
            let (x_px, y_px) = sight.raw_pixel(pose.ray(u, v));
            Corner { band: 0, column, row, x_px, y_px }
        };
        board.chess(1.0).corners().map(corner).collect()
    }
}
