//! Read-only NumPy views of the memory of native objects.

use numpy::ndarray::{ArrayView, Dimension};
use numpy::{Element, PyArray};
use pyo3::prelude::*;
use pyo3::pyclass::boolean_struct::True;
use pyo3::PyClass;

/// A view of an array of `owner`.
#[allow(unsafe_code)]
pub fn view<'py, O: PyClass<Frozen = True> + Sync, T: Element, D: Dimension>(
    owner: &Bound<'py, O>,
    of: fn(&O) -> ArrayView<'_, T, D>,
) -> PyResult<Bound<'py, PyArray<T, D>>> {
    let array = of(owner.get());
    // SAFETY: The memory is the owner's, which is frozen: it neither moves nor changes as long as the owner lives. The
    // view keeps the owner alive, and nobody writes through it: NumPy makes no array writeable whose owner is not.
    let view = unsafe { PyArray::borrow_from_array(&array, owner.clone().into_any()) };
    view.call_method1("setflags", (false,))?;
    Ok(view)
}
