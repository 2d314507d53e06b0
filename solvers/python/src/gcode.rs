//! `read_gcode`: reads the bytes of a program into the fields of `Program`.

use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

use super::arrays::{padded, rows, Table};
use super::axes::with_padded_axes;
use super::curve::Curve;
use super::moves::Moves;
use super::work::run;
use feedplan_gcode::{read, CoordinateMode, Options, Place, Point, TipControl, Tool};
use feedplan_geometry::spline::CompositeCurve;
use feedplan_geometry::watch::Watch;

pyo3::import_exception!(feedplan.errors, ProgramError);

/// A `feedplan.program.tip.TipControl`.
struct PyTipControl(Py<PyAny>);

impl PyTipControl {
    /// Calls a method of the Python object; if it raises, the message of its exception is the error.
    fn call<T, A>(&self, method: &str, arguments: A) -> Result<T, String>
    where
        T: for<'a, 'py> FromPyObject<'a, 'py>,
        A: for<'py> pyo3::call::PyCallArgs<'py>,
    {
        Python::attach(|py| {
            let result = self.0.bind(py).call_method1(method, arguments);
            match result {
                Ok(value) => {
                    value.extract().map_err(|_| format!("{method} of the machine returns no numbers"))
                }
                Err(error) => Err(error.value(py).to_string()),
            }
        })
    }
}

impl TipControl for PyTipControl {
    fn check(&self, coordinate_mode: CoordinateMode) -> Result<(), String> {
        self.call::<Option<bool>, _>("check", (coordinate_mode as u8,)).map(|_| ())
    }

    fn joints(
        &self,
        coordinate_mode: CoordinateMode,
        tool_length: f64,
        entry: &Point,
        places: &[Place],
    ) -> Result<Point, String> {
        let places: Vec<Vec<f64>> =
            places.iter().map(|(point, direction)| [&point[..], &direction[..]].concat()).collect();
        self.call("joints", (coordinate_mode as u8, tool_length, entry.to_vec(), places))
    }

    fn place(
        &self,
        coordinate_mode: CoordinateMode,
        tool_length: f64,
        joints: &Point,
    ) -> Result<Place, String> {
        self.call("place", (coordinate_mode as u8, tool_length, joints.to_vec()))
    }
}

/// A row of the tool table: number, pocket, offset X to W, diameter, orientation.
type ToolRow = (u32, u32, [f64; 9], f64, u32);

/// Calls the Python function for the name of a subprogram; returns the file name and the bytes that it finds.
fn find(finder: &Py<PyAny>, name: &str) -> Result<Option<(String, Vec<u8>)>, String> {
    Python::attach(|py| {
        let found = finder.bind(py).call1((name,)).map_err(|error| error.value(py).to_string())?;
        found.extract().map_err(|_| format!("the subprogram {name} is not found as a name and bytes"))
    })
}

/// The names of the machines that have an axis, from the Python function; empty if it fails.
fn names_of(names: &Py<PyAny>, letter: char) -> String {
    Python::attach(|py| names.bind(py).call1((letter,)).and_then(|text| text.extract()).unwrap_or_default())
}

/// `feedplan.program.gcode.Options`.
#[derive(FromPyObject)]
pub struct PyOptions<'py> {
    places: Table<'py>,
    machine_axes: String,
    machines_with: Option<Py<PyAny>>,
    tip_control: Option<Py<PyAny>>,
    block_delete: bool,
    max_moves: usize,
    tools: Option<Vec<ToolRow>>,
    subprograms: Option<Py<PyAny>>,
    feed: Option<f64>,
    whole_step: f64,
}

/// Reads a G-code program. Returns its moves and the other fields of `Program` except its name, with a native curve as `splines`,
/// and `event_columns` instead of `events`.
#[pyfunction]
#[pyo3(signature = (source, name, options, progress=None))]
pub fn read_gcode<'py>(
    py: Python<'py>,
    source: &[u8],
    name: &str,
    options: PyOptions<'py>,
    progress: Option<Bound<'py, PyAny>>,
) -> PyResult<(Moves, Bound<'py, PyDict>)> {
    let places = rows::<9>(&options.places)?;
    let [home, start, offsets @ ..] = &places[..] else {
        return Err(pyo3::exceptions::PyValueError::new_err("home and start are two rows"));
    };
    let options = Options {
        offsets: offsets.to_vec(),
        home: *home,
        start: *start,
        machine_axes: options.machine_axes.into_bytes(),
        machines_with: options
            .machines_with
            .map(|names| Box::new(move |letter| names_of(&names, letter)) as _),
        tip_control: options.tip_control.map(|control| Box::new(PyTipControl(control)) as _),
        subprograms: options.subprograms.map(|finder| Box::new(move |name: &str| find(&finder, name)) as _),
        tools: options.tools.map(|rows| {
            let tool = |(number, pocket, offset, diameter, orientation)| Tool {
                number,
                pocket,
                offset,
                diameter,
                orientation,
            };
            rows.into_iter().map(tool).collect()
        }),
        feed: options.feed,
        whole_step: options.whole_step,
        block_delete: options.block_delete,
        max_moves: options.max_moves,
    };
    let lines = source.iter().filter(|&&byte| byte == b'\n').count();
    let read = |watch: Watch| read(source, &options, &|more| watch.each(lines).advance(more));
    let mut columns = run(py, progress.as_ref(), read)?.map_err(|error| {
        let place = error.line.map_or(name.to_string(), |line| format!("{name} line {line}"));
        ProgramError::new_err((format!("{place}: {}", error.message), error.line))
    })?;

    let axes: Vec<String> = columns.axes.iter().map(|&letter| char::from(letter).to_string()).collect();
    let mut moves = Moves::of(&mut columns, &axes);
    let splines = match columns.spline_width.is_empty() {
        true => None,
        false => Some(with_padded_axes!(axes.len(), M, {
            let points = columns.spline_control.chunks_exact(axes.len());
            let pieces = CompositeCurve::<M> {
                control: points.map(|point| padded(point, 0.0)).collect(),
                weights: columns.spline_weights,
                offsets: columns.spline_offsets,
                width: columns.spline_width,
            };
            Curve::checked(pieces, axes.len())
        })?),
    };
    moves.splines = splines.map(|curve| Py::new(py, curve)).transpose()?;
    let (moves, events) = (moves.checked()?, columns.events);
    let event_columns = (
        PyArray1::from_vec(py, events.moves),
        PyArray1::from_vec(py, events.line),
        PyArray1::from_vec(py, events.letter),
        PyArray1::from_vec(py, events.number),
        PyArray1::from_vec(py, events.p),
        PyArray1::from_vec(py, events.q),
        PyTuple::new(py, events.texts)?,
    );
    let fields = PyDict::new(py);
    fields.set_item("splines", moves.splines.as_ref().map(|curve| curve.clone_ref(py)))?;
    macro_rules! set {
        ($($name:ident),+) => {
            $(fields.set_item(stringify!($name), PyArray1::from_vec(py, columns.$name))?;)+
        };
    }
    set!(
        feed,
        control,
        blend_tolerance,
        fit_tolerance,
        stop,
        stop_cause,
        dwell,
        coordinate_mode,
        tool_length
    );
    fields.set_item("event_columns", event_columns)?;
    fields.set_item("start_dwell", columns.start_dwell)?;
    fields.set_item("warnings", PyTuple::new(py, columns.warnings)?)?;
    fields.set_item("axes", PyTuple::new(py, axes)?)?;
    Ok((moves, fields))
}
