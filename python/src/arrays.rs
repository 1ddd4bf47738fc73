//! Frames from arrays of NumPy, and back.

use std::path::PathBuf;

use epirig::calibrate::{Calibration, read_calibration};
use epirig::cli::embedded::Refusal;
use epirig::pipeline::{Frames as Size, load};
use epirig_calibration::photometry::Maps;
use epirig_core::fault::Blame;
use epirig_core::frame::{Frame, Samples};
use epirig_core::volume::Volume;
use epirig_data::sequence::Sequence;
use epirig_matcher::{FloatLevels, Stack, StackError};
use numpy::{Element, IntoPyArray as _, PyArrayMethods as _, PyReadonlyArray2, PyUntypedArray};
use numpy::{PyArrayDescrMethods as _, PyUntypedArrayMethods as _};
use pyo3::prelude::*;
use serde_json::json;

use crate::errors::{data, exception};
use crate::work::done;

/// The samples of a frame, as a caller may have them.
enum Kind {
    U8,
    U16,
    Float,
}

/// The frames of a caller: an array of (frames, rows, columns), or a sequence of arrays of (rows, columns).
pub(crate) struct Frames<'py> {
    all: Bound<'py, PyAny>,
    count: usize,
}

impl<'py> Frames<'py> {
    pub(crate) fn of(all: Bound<'py, PyAny>) -> PyResult<Self> {
        let py = all.py();
        let count = all.len().map_err(|_| {
            data(py, format!("{} has no frames; give an array of (frames, rows, columns)", kind_of(&all)))
        })?;
        Ok(Self { all, count })
    }

    /// Their number and size.
    pub(crate) fn size(&self) -> PyResult<Size> {
        let py = self.all.py();
        if self.count == 0 {
            return Err(data(py, "there are no frames".to_owned()));
        }
        let (first, kind) = self.at(0)?;
        let sample_bytes = if matches!(kind, Kind::U8) { 1 } else { 2 };
        Ok(Size { count: self.count, rows: first.shape()[0], columns: first.shape()[1], sample_bytes })
    }

    /// The stack that is matched. Each frame is copied once, or three times if its samples are floating point.
    pub(crate) fn stack(&self) -> PyResult<Stack> {
        let py = self.all.py();
        let float = matches!(self.at(0)?.1, Kind::Float);
        let levels = if float { Some(self.levels()?) } else { None };
        Stack::from_frames(FrameIterator { frames: self, next: 0, levels }).map_err(|error| error.raised(py))
    }

    /// Frame `t`, and what its samples are.
    fn at(&self, t: usize) -> PyResult<(Bound<'py, PyUntypedArray>, Kind)> {
        let py = self.all.py();
        // Ctrl-C is heard between two frames.
        py.check_signals()?;
        let numpy = py.import("numpy")?;
        let no_array = |error: PyErr| {
            let refusal = data(py, format!("frame {t} is no array of (rows, columns): {error}"));
            refusal.set_cause(py, Some(error));
            refusal
        };
        let item = self.all.get_item(t).map_err(no_array)?;
        if numpy.getattr("ma")?.call_method1("isMaskedArray", (&item,))?.is_truthy()? {
            let why = format!(
                "frame {t} is a masked array, whose mask would be lost; leave pixels out by the argument mask"
            );
            return Err(data(py, why));
        }
        let array =
            numpy.call_method1("asarray", (item,)).map_err(no_array)?.cast_into::<PyUntypedArray>()?;
        if array.ndim() != 2 {
            let found = array.getattr("shape")?;
            let hint = match array.ndim() {
                3 => "; take one channel of a colour image, such as frames[..., 1]",
                _ => "",
            };
            return Err(data(
                py,
                format!(
                    "frame {t} has the shape {found}, but frames are (rows, columns), and all of them (frames, rows, columns){hint}"
                ),
            ));
        }
        let dtype = array.dtype();
        let kind = match (dtype.kind(), dtype.itemsize()) {
            (b'u', 1) => Kind::U8,
            (b'u', 2) => Kind::U16,
            (b'f', 2 | 4 | 8) => Kind::Float,
            _ => {
                return Err(data(
                    py,
                    format!(
                        "frame {t} is of {dtype}; frames are of uint8, uint16 or float32, such as frames.astype(\"float32\")"
                    ),
                ));
            }
        };
        Ok((array, kind))
    }

    /// What the largest of all samples is, and whether each is a number.
    fn levels(&self) -> PyResult<FloatLevels> {
        let py = self.all.py();
        let range = |t: usize| {
            let (array, _) = self.at(t)?;
            let samples = typed::<f64>(&array, "float64")?;
            let columns = samples.shape()[1].max(1);
            FloatLevels::of(t, columns, samples.as_array().iter().copied())
                .map_err(|error| data(py, error.to_string()))
        };
        let ranges: Vec<FloatLevels> = (0..self.count).map(range).collect::<PyResult<_>>()?;
        Ok(FloatLevels::of_all(&ranges))
    }

    fn frame(&self, t: usize, levels: Option<FloatLevels>) -> Result<Frame, Why> {
        let (array, kind) = self.at(t)?;
        let (rows, columns) = (array.shape()[0], array.shape()[1]);
        let (bit_depth, samples) = match (kind, levels) {
            (Kind::U8, None) => (8, Samples::U8(values(&typed::<u8>(&array, "uint8")?))),
            (Kind::U16, None) => (16, Samples::U16(values(&typed::<u16>(&array, "uint16")?))),
            (Kind::Float, Some(levels)) => {
                let floats = typed::<f64>(&array, "float64")?;
                (16, Samples::U16(floats.as_array().iter().map(|&value| levels.level(value)).collect()))
            }
            _ => {
                let what = format!(
                    "frame {t} is of {}, and frame 0 is not; all frames must be alike",
                    array.dtype()
                );
                return Err(Why::Raised(data(self.all.py(), what)));
            }
        };
        Frame::new(rows, columns, bit_depth, samples)
            .map_err(|source| Why::Stack(StackError::Frame { index: t, source }))
    }
}

/// The samples of `array` as this machine has them: the array itself, if its samples lie so.
fn typed<'py, T: Element>(
    array: &Bound<'py, PyUntypedArray>,
    name: &str,
) -> PyResult<PyReadonlyArray2<'py, T>> {
    if let Ok(same) = array.cast::<numpy::PyArray2<T>>()
        && array.getattr("flags")?.getattr("aligned")?.is_truthy()?
    {
        return Ok(same.try_readonly()?);
    }
    Ok(array.call_method1("astype", (name,))?.cast_into::<numpy::PyArray2<T>>()?.try_readonly()?)
}

/// All samples row by row, however they lie in memory.
fn values<T: Element + Copy>(array: &PyReadonlyArray2<'_, T>) -> Vec<T> {
    // Its slice would have the columns of an array in Fortran's order.
    match array.as_array().to_slice() {
        Some(row_by_row) => row_by_row.to_vec(),
        None => array.as_array().iter().copied().collect(),
    }
}

fn kind_of(object: &Bound<'_, PyAny>) -> String {
    object.get_type().name().map_or_else(|_| "this".to_owned(), |name| name.to_string())
}

/// Why frames make no stack.
enum Why {
    Stack(StackError),
    Raised(PyErr),
}

impl From<StackError> for Why {
    fn from(error: StackError) -> Self {
        Self::Stack(error)
    }
}

impl From<PyErr> for Why {
    fn from(error: PyErr) -> Self {
        Self::Raised(error)
    }
}

impl Why {
    fn raised(self, py: Python<'_>) -> PyErr {
        match self {
            Self::Stack(error) => data(py, error.to_string()),
            Self::Raised(error) => error,
        }
    }
}

struct FrameIterator<'a, 'py> {
    frames: &'a Frames<'py>,
    next: usize,
    levels: Option<FloatLevels>,
}

impl Iterator for FrameIterator<'_, '_> {
    type Item = Result<Frame, Why>;

    fn next(&mut self) -> Option<Self::Item> {
        let t = self.next;
        self.next += 1;
        (t < self.frames.count).then(|| self.frames.frame(t, self.levels))
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        let left = self.frames.count - self.next.min(self.frames.count);
        (left, Some(left))
    }
}

impl ExactSizeIterator for FrameIterator<'_, '_> {}

fn calibration_of(sequence: &Sequence) -> Result<(Calibration, Maps), Refusal> {
    let why = || format!("{} has no calibration; calibrate it first", sequence.folder().display());
    read_calibration(sequence).map_err(Refusal::of)?.ok_or_else(|| Refusal::new(Blame::Request, why()))
}

/// The frames of the sequence in `folder`, (frames, rows, columns).
///
/// Without `rectified` as they were captured, of uint8 or uint16; with it corrected and rectified by the calibration of
/// the sequence, of float32 in DN.
#[pyfunction]
#[pyo3(signature = (folder, rectified, progress=None))]
pub(crate) fn read_frames<'py>(
    py: Python<'py>,
    folder: PathBuf,
    rectified: bool,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyAny>> {
    let (size, values) = done(py, progress, |told| {
        let sequence = Sequence::open(&folder).map_err(Refusal::of)?;
        let calibration = if rectified { Some(calibration_of(&sequence)?) } else { None };
        let volume = load(&sequence, calibration.as_ref(), &*told).map_err(Refusal::of)?;
        let values = match (rectified, volume.bit_depth()) {
            (true, _) => Values::Float(frame_by_frame(&volume, |value| value)),
            (false, 1..=8) => Values::U8(frame_by_frame(&volume, |value| value as u8)),
            (false, _) => Values::U16(frame_by_frame(&volume, |value| value as u16)),
        };
        Ok(([volume.frames(), volume.rows(), volume.columns()], values))
    })?;
    Ok(match values {
        Values::U8(values) => values.into_pyarray(py).reshape(size)?.into_any(),
        Values::U16(values) => values.into_pyarray(py).reshape(size)?.into_any(),
        Values::Float(values) => values.into_pyarray(py).reshape(size)?.into_any(),
    })
}

/// Frames x rows x columns.
enum Values {
    U8(Vec<u8>),
    U16(Vec<u16>),
    Float(Vec<f32>),
}

/// Frames x rows x columns of a volume.
fn frame_by_frame<T>(volume: &Volume, convert: fn(f32) -> T) -> Vec<T> {
    let mut values = Vec::with_capacity(volume.frames() * volume.rows() * volume.columns());
    let mut row = vec![0.0; volume.columns()];
    for t in 0..volume.frames() {
        for y in 0..volume.rows() {
            volume.copy_row(y, t, &mut row);
            values.extend(row.iter().map(|&value| convert(value)));
        }
    }
    values
}

/// Record, number of frames, positions and end of the sequence in `folder`, as text (JSON).
#[pyfunction]
pub(crate) fn sequence_facts(py: Python<'_>, folder: PathBuf) -> PyResult<String> {
    let sequence = Sequence::open(&folder).map_err(|fault| exception(py, Refusal::of(fault)))?;
    let facts = json!({
        "record": sequence.record(),
        "frames": sequence.frames().len(),
        "positions_mm": sequence.positions_mm(),
        "ended": sequence.ended(),
    });
    Ok(facts.to_string())
}

/// Position of each frame on the baseline, from 0 to 1; if `rectified`, that of the calibration.
#[pyfunction]
pub(crate) fn sequence_tau(py: Python<'_>, folder: PathBuf, rectified: bool) -> PyResult<Vec<f64>> {
    let tau = || -> Result<Vec<f64>, Refusal> {
        let sequence = Sequence::open(&folder).map_err(Refusal::of)?;
        if rectified {
            return Ok(calibration_of(&sequence)?.0.positions.tau);
        }
        Ok(sequence.tau().map_err(Refusal::of)?.values().to_vec())
    };
    tau().map_err(|refusal| exception(py, refusal))
}
