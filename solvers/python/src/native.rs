//! Gives access to the native objects of Python's records, and to their contents in 3 or 9 axes.

use std::any::Any;
use std::ops::Deref;

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::pyclass::boolean_struct::True;
use pyo3::{Borrowed, PyClass};

/// The native object of a `feedplan.native.OfNative`.
pub struct Of<T>(Py<T>);

impl<T> Of<T> {
    pub fn native(&self) -> &Py<T> {
        &self.0
    }

    pub fn into_native(self) -> Py<T> {
        self.0
    }
}

impl<'a, 'py, T: PyClass> FromPyObject<'a, 'py> for Of<T> {
    type Error = PyErr;

    fn extract(record: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        Ok(Self(record.getattr("native")?.cast_into::<T>()?.unbind()))
    }
}

impl<T: PyClass<Frozen = True> + Sync> Deref for Of<T> {
    type Target = T;

    fn deref(&self) -> &T {
        self.0.get()
    }
}

/// An object in M axes, where M is the number that `with_padded_axes` gives for `axes`.
pub struct InAxes {
    pub axes: usize,
    object: Box<dyn Any + Send + Sync>,
}

impl InAxes {
    pub fn new(axes: usize, object: impl Any + Send + Sync) -> Self {
        Self { axes, object: Box::new(object) }
    }

    pub fn get<T: Any>(&self) -> PyResult<&T> {
        self.object.downcast_ref().ok_or_else(|| PyValueError::new_err("this has another number of axes"))
    }
}

/// Calls a generic kernel with the object of an `InAxes`.
macro_rules! with_object {
    ($of:expr, $m:ident, $object:ident: $type:ty, $call:expr) => {
        super::axes::with_padded_axes!(
            $of.axes,
            $m,
            {
                let $object = $of.get::<$type>().expect("an object in its own axes");
                $call
            },
            |count| unreachable!("an object in {count} axes")
        )
    };
}
pub(crate) use with_object;
