//! A volume without its samples, for those that are read a few at a time.

use super::Volume;
use crate::frame::Samples;
use crate::tau::Tau;

/// A volume without its samples.
#[derive(Debug, Clone, PartialEq)]
pub struct VolumeShape {
    /// Number of rows.
    pub rows: usize,
    /// Number of columns.
    pub columns: usize,
    /// Bits of the camera's samples.
    pub bit_depth: u8,
    /// Whether samples are fractions of a level; see [`Volume::fine`].
    pub fine: bool,
    /// Positions of the frames on the baseline.
    pub tau: Tau,
    /// Factor of the samples of each frame.
    pub frame_gains: Vec<f32>,
}

impl VolumeShape {
    /// A volume of zeros with so many rows of all frames.
    pub fn of_rows(&self, rows: usize) -> Volume {
        let mut volume = self.zeros(rows, self.tau.clone());
        self.frame_gains.iter().enumerate().for_each(|(t, gain)| volume.set_frame_gain(t, *gain));
        volume
    }

    /// A volume of zeros for other frames of this kind, at `tau`, without gains.
    pub fn of_frames(&self, tau: Tau) -> Volume {
        self.zeros(self.rows, tau)
    }

    fn zeros(&self, rows: usize, tau: Tau) -> Volume {
        Volume::of_zeros(rows, self.columns, self.bit_depth, tau, self.fine)
    }

    /// Bits of a stored sample: 16 in a [fine](Volume::fine) volume, else those of the camera.
    pub fn stored_bit_depth(&self) -> u8 {
        if self.fine { 16 } else { self.bit_depth }
    }
}

impl Volume {
    /// The same without samples.
    pub fn shape(&self) -> VolumeShape {
        VolumeShape {
            rows: self.rows,
            columns: self.columns,
            bit_depth: self.bit_depth,
            fine: self.is_fine(),
            tau: self.tau.clone(),
            frame_gains: self.frame_gains.clone(),
        }
    }

    /// The stored samples of frame `t`, without its gain: rows x columns. Counts in a [fine](Self::fine) volume.
    ///
    /// # Panics
    /// If `t` lies outside the volume, or its pixels are means of others.
    pub fn samples_of_frame(&self, t: usize) -> Samples {
        assert!(t < self.frames() && !self.halved);
        let start = |y: usize| (y * self.stored_frames + self.stored_frame(t)) * self.stored_columns;
        let rows = (0..self.rows).map(start);
        match &*self.samples {
            Samples::U8(values) => Samples::U8(gathered(values, rows, self.columns)),
            Samples::U16(values) => Samples::U16(gathered(values, rows, self.columns)),
        }
    }
}

fn gathered<T: Copy>(values: &[T], starts: impl Iterator<Item = usize>, length: usize) -> Vec<T> {
    starts.flat_map(|start| values[start..start + length].iter().copied()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::Frame;

    #[test]
    fn a_frame_comes_out_as_it_was_put_in() {
        let tau = Tau::from_positions(&[0.0, 1.0, 3.0]).unwrap();
        let shape = VolumeShape {
            rows: 2,
            columns: 3,
            bit_depth: 10,
            fine: false,
            tau,
            frame_gains: vec![1.0, 0.5, 2.0],
        };
        let mut volume = shape.of_rows(2);
        let frame = |t: u16| Frame::new(2, 3, 10, Samples::U16((0..6).map(|i| 100 * t + i).collect()));
        (0..3).for_each(|t| volume.insert(t.into(), &frame(t).unwrap()).unwrap());
        for t in 0..3 {
            assert_eq!(&volume.samples_of_frame(t.into()), frame(t).unwrap().samples());
        }
        let mut row = [0.0; 3];
        volume.copy_row(1, 2, &mut row);
        assert_eq!(row, [406.0, 408.0, 410.0]);
        assert_eq!(
            (shape.stored_bit_depth(), VolumeShape { fine: true, ..shape }.stored_bit_depth()),
            (10, 16)
        );
    }
}
