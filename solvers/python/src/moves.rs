//! `Moves`: the moves of a program, checked once and stored in the form that the path builder and the audit take.

use numpy::ndarray::ArrayView2;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use super::arrays::{require, Column, Table};
use super::curve::Curve;
use super::native::Of;
use super::views::view;
use feedplan_gcode::Columns as Program;

macro_rules! moves {
    (columns: $($column:ident: $type:ty),+; tables: $($table:ident by $width:expr),+) => {
        /// The columns of `feedplan.program.program.Program` that kernels take.
        #[pyclass(frozen, module = "feedplan._solvers")]
        pub struct Moves {
            /// The columns of X, Y and Z among the axes.
            pub xyz: [Option<usize>; 3],
            pub splines: Option<Py<Curve>>,
            $(pub $column: Vec<$type>,)+
            /// Stored row by row.
            $(pub $table: Vec<f64>,)+
        }

        /// The same columns as arrays.
        #[derive(FromPyObject)]
        struct Columns<'py> {
            axes: Vec<String>,
            splines: Option<Of<Curve>>,
            $($column: Column<'py, $type>,)+
            $($table: Table<'py>,)+
        }

        impl Moves {
            /// Takes the columns out of a program that has been read; its splines are not included.
            pub fn of(program: &mut Program, axes: &[String]) -> Self {
                Self {
                    xyz: places_of_xyz(axes),
                    splines: None,
                    $($column: std::mem::take(&mut program.$column),)+
                    $($table: std::mem::take(&mut program.$table),)+
                }
            }
        }

        #[pymethods]
        impl Moves {
            /// From the arrays of a `Program`.
            #[new]
            fn new(columns: Columns<'_>) -> PyResult<Self> {
                let made = Self {
                    xyz: places_of_xyz(&columns.axes),
                    splines: columns.splines.map(|splines| splines.into_native()),
                    $($column: columns.$column.as_slice()?.to_vec(),)+
                    $($table: columns.$table.as_slice()?.to_vec(),)+
                };
                made.checked()
            }

            /// Views of the columns by name.
            fn fields<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyDict>> {
                let fields = PyDict::new(slf.py());
                $(fields.set_item(stringify!($column), view(slf, |moves| moves.$column[..].into())?)?;)+
                $(fields.set_item(stringify!($table), view(slf, |moves| table(&moves.$table, $width(moves)))?)?;)+
                Ok(fields)
            }
        }
    };
}

moves! {
    columns: start: f64, kind: u8, line: i32, arc_move: i64, arc_normal: u8, arc_angle: f64, spline_move: i64,
        spline_pieces: i64, change_move: i64;
    tables: target by Moves::axes, change_start by Moves::axes, arc_centre by (|_: &Moves| 3)
}

/// The indices of X, Y and Z among these letters.
fn places_of_xyz<A: PartialEq<str>>(axes: &[A]) -> [Option<usize>; 3] {
    ["X", "Y", "Z"].map(|letter| axes.iter().position(|axis| axis == letter))
}

impl Moves {
    pub fn axes(&self) -> usize {
        self.start.len()
    }

    pub fn len(&self) -> usize {
        self.kind.len()
    }

    /// Raises ValueError where columns differ in length, or contain the number of a move or a piece that does not exist.
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
        require(good, "the columns of the program do not fit")?;
        Ok(self)
    }
}

fn table(flat: &[f64], width: usize) -> ArrayView2<'_, f64> {
    ArrayView2::from_shape((flat.len() / width, width), flat).expect("whole rows")
}
