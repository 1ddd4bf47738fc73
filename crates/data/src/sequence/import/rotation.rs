//! Frames turned by quarters of a turn.

use epirig_core::frame::{Frame, FrameError, Samples};

epirig_core::choices! {
    /// By how many degrees frames are turned, clockwise.
    #[derive(Default)]
    pub enum Rotation {
        /// Not turned.
        #[default]
        None = "0",
        /// What was at the top is on the right.
        Right = "90",
        /// What was at the top is at the bottom.
        Half = "180",
        /// What was at the top is on the left.
        Left = "270",
    }
}

impl Rotation {
    /// The turned frame.
    ///
    /// # Errors
    /// None, for frames that could be made.
    pub(super) fn turn(self, frame: Frame) -> Result<Frame, FrameError> {
        if self == Self::None {
            return Ok(frame);
        }
        let (rows, columns) = (frame.rows(), frame.columns());
        let samples = match frame.samples() {
            Samples::U8(values) => Samples::U8(self.turned(values, rows, columns)),
            Samples::U16(values) => Samples::U16(self.turned(values, rows, columns)),
        };
        let (rows, columns) = if self == Self::Half { (rows, columns) } else { (columns, rows) };
        Frame::new(rows, columns, frame.bit_depth(), samples)
    }

    fn turned<T: Copy>(self, values: &[T], rows: usize, columns: usize) -> Vec<T> {
        let column = |x: usize, upwards: bool| {
            let place = move |y: usize| if upwards { rows - 1 - y } else { y };
            (0..rows).map(move |y| values[place(y) * columns + x])
        };
        match self {
            Self::None => values.to_vec(),
            Self::Half => values.iter().rev().copied().collect(),
            Self::Right => (0..columns).flat_map(|x| column(x, true)).collect(),
            Self::Left => (0..columns).rev().flat_map(|x| column(x, false)).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quarters_turn_as_a_clock_does() {
        let frame = |rows, columns, values: &[u16]| {
            Frame::new(rows, columns, 12, Samples::U16(values.to_vec())).unwrap()
        };
        let upright = frame(2, 3, &[1, 2, 3, 4, 5, 6]);
        let turned = |rotation: Rotation| rotation.turn(upright.clone()).unwrap();
        assert_eq!(turned(Rotation::Right), frame(3, 2, &[4, 1, 5, 2, 6, 3]));
        assert_eq!(turned(Rotation::Half), frame(2, 3, &[6, 5, 4, 3, 2, 1]));
        assert_eq!(turned(Rotation::Left), frame(3, 2, &[3, 6, 2, 5, 1, 4]));
        assert_eq!(turned(Rotation::None), upright);
        let narrow = Frame::new(1, 2, 8, Samples::U8(vec![7, 9])).unwrap();
        assert_eq!(
            Rotation::Right.turn(narrow).unwrap(),
            Frame::new(2, 1, 8, Samples::U8(vec![7, 9])).unwrap()
        );
    }
}
