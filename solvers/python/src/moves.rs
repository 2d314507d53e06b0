//! `Moves`: the moves of a program, checked once and held as the path builder and the audit take them.

use numpy::ndarray::ArrayView2;
use numpy::{PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use super::curve::Curve;
use super::native::Of;
use super::views::view;

/// The columns of `feedplan.program.program.Program` that kernels take.
#[pyclass(frozen, module = "feedplan._solvers")]
pub struct Moves {
    /// Where X, Y, Z are among the axes.
    pub xyz: [Option<usize>; 3],
    pub start: Vec<f64>,
    pub kind: Vec<u8>,
    /// Coordinates of one move after the other.
    pub target: Vec<f64>,
    pub line: Vec<i32>,
    pub arc_move: Vec<i64>,
    /// X, Y, Z of one arc after the other.
    pub arc_centre: Vec<f64>,
    pub arc_normal: Vec<u8>,
    pub arc_angle: Vec<f64>,
    pub spline_move: Vec<i64>,
    pub spline_pieces: Vec<i64>,
    pub splines: Option<Py<Curve>>,
    pub change_move: Vec<i64>,
    /// Coordinates of one change after the other.
    pub change_start: Vec<f64>,
}

/// The same columns as arrays.
#[derive(FromPyObject)]
struct Columns<'py> {
    axes: Vec<String>,
    start: PyReadonlyArray1<'py, f64>,
    kind: PyReadonlyArray1<'py, u8>,
    target: PyReadonlyArray2<'py, f64>,
    line: PyReadonlyArray1<'py, i32>,
    arc_move: PyReadonlyArray1<'py, i64>,
    arc_centre: PyReadonlyArray2<'py, f64>,
    arc_normal: PyReadonlyArray1<'py, u8>,
    arc_angle: PyReadonlyArray1<'py, f64>,
    spline_move: PyReadonlyArray1<'py, i64>,
    spline_pieces: PyReadonlyArray1<'py, i64>,
    splines: Option<Of<Curve>>,
    change_move: PyReadonlyArray1<'py, i64>,
    change_start: PyReadonlyArray2<'py, f64>,
}

/// Where X, Y, Z are among these letters.
pub fn places_of_xyz<A: PartialEq<str>>(axes: &[A]) -> [Option<usize>; 3] {
    ["X", "Y", "Z"].map(|letter| axes.iter().position(|axis| axis == letter))
}

impl Moves {
    pub fn axes(&self) -> usize {
        self.start.len()
    }

    pub fn len(&self) -> usize {
        self.kind.len()
    }

    /// Raises ValueError where columns differ in length, or name a move or a piece that does not exist.
    pub fn checked(self) -> PyResult<Self> {
        let (axes, count, arcs) = (self.axes(), self.len(), self.arc_move.len());
        let exist = |moves: &[i64]| moves.iter().all(|index| (0..count as i64).contains(index));
        let splines = self.splines.as_ref().map(Py::get);
        let pieces = splines.map_or(0, |splines| splines.widths().len() as i64);
        let good = axes > 0
            && self.target.len() == axes * count
            && self.line.len() == count
            && self.arc_centre.len() == 3 * arcs
            && [self.arc_normal.len(), self.arc_angle.len()] == [arcs; 2]
            && self.arc_normal.iter().all(|&normal| normal < 3)
            && splines.is_none_or(|splines| splines.axes() == axes)
            && self.spline_pieces.len() == self.spline_move.len() + 1
            && self.spline_pieces.is_sorted()
            && self.spline_pieces.iter().all(|piece| (0..=pieces).contains(piece))
            && self.change_start.len() == axes * self.change_move.len()
            && [&self.arc_move, &self.spline_move, &self.change_move].into_iter().all(|moves| exist(moves));
        good.then_some(self).ok_or_else(|| PyValueError::new_err("the columns of the program do not fit"))
    }
}

#[pymethods]
impl Moves {
    /// From the arrays of a `Program`.
    #[new]
    fn new(columns: Columns<'_>) -> PyResult<Self> {
        let made = Self {
            xyz: places_of_xyz(&columns.axes),
            start: columns.start.as_slice()?.to_vec(),
            kind: columns.kind.as_slice()?.to_vec(),
            target: columns.target.as_slice()?.to_vec(),
            line: columns.line.as_slice()?.to_vec(),
            arc_move: columns.arc_move.as_slice()?.to_vec(),
            arc_centre: columns.arc_centre.as_slice()?.to_vec(),
            arc_normal: columns.arc_normal.as_slice()?.to_vec(),
            arc_angle: columns.arc_angle.as_slice()?.to_vec(),
            spline_move: columns.spline_move.as_slice()?.to_vec(),
            spline_pieces: columns.spline_pieces.as_slice()?.to_vec(),
            splines: columns.splines.map(|splines| splines.into_native()),
            change_move: columns.change_move.as_slice()?.to_vec(),
            change_start: columns.change_start.as_slice()?.to_vec(),
        };
        made.checked()
    }

    /// Views of the columns by name.
    fn fields<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyDict>> {
        let fields = PyDict::new(slf.py());
        macro_rules! columns {
            ($($name:ident),+) => {
                $(fields.set_item(stringify!($name), view(slf, |moves| moves.$name[..].into())?)?;)+
            };
        }
        macro_rules! tables {
            ($($name:ident by $width:expr),+) => {
                $(fields.set_item(stringify!($name), view(slf, |moves| table(&moves.$name, $width(moves)))?)?;)+
            };
        }
        columns!(start, kind, line, arc_move, arc_normal, arc_angle, spline_move, spline_pieces, change_move);
        tables!(target by Self::axes, change_start by Self::axes, arc_centre by (|_: &Self| 3));
        Ok(fields)
    }
}

fn table(flat: &[f64], width: usize) -> ArrayView2<'_, f64> {
    ArrayView2::from_shape((flat.len() / width, width), flat).expect("whole rows")
}

pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<Moves>()
}
