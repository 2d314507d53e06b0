//! The numbers of axes that kernels are compiled for. Axes beyond those of the path are at rest, and change no result, so a few
//! instances of a kernel suffice instead of nine.

/// Calls a generic kernel for 3 or 9 axes. For another number of axes it raises an error, or evaluates `otherwise`.
macro_rules! with_padded_axes {
    ($($arguments:tt)+) => {
        crate::axes::with_axes!([3 9], $($arguments)+)
    };
}

/// `with_padded_axes` for the audit, whose cost depends more on the number of axes: 3, 6 or 9.
macro_rules! with_axes_of_audit {
    ($($arguments:tt)+) => {
        crate::axes::with_axes!([3 6 9], $($arguments)+)
    };
}

/// Calls a kernel for the least of these numbers that is enough.
macro_rules! with_axes {
    ([$($most:literal)+], $count:expr, $m:ident, $call:expr) => {
        crate::axes::with_axes!([$($most)+], $count, $m, $call, |count| {
            Err(pyo3::exceptions::PyValueError::new_err(format!("{count} axes: 1 to 9 are supported")))
        })
    };
    ([$($most:literal)+], $count:expr, $m:ident, $call:expr, |$other:ident| $otherwise:expr) => {
        match $count {
            $(1..=$most => {
                const $m: usize = $most;
                $call
            })+
            $other => $otherwise,
        }
    };
}
pub(crate) use {with_axes, with_axes_of_audit, with_padded_axes};
