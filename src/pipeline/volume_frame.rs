//! A frame of a volume, to be shown.

use epirig_core::grid::Grid;
use epirig_core::volume::Volume;

/// Frame `t` of a volume, in DN; rows x columns.
pub(super) fn volume_frame(volume: &Volume, t: usize) -> Grid<f32> {
    let mut frame = Grid::filled(volume.rows(), volume.columns(), 0.0_f32);
    (0..volume.rows()).for_each(|y| volume.copy_row(y, t, frame.row_mut(y)));
    frame
}
