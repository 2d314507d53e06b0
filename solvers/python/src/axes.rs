//! The numbers of axes that kernels are compiled for.

/// Calls a generic kernel for 3, 6 or 9 axes, those beyond `count` at rest. An axis at rest does not change results, so three
/// instances of a kernel suffice instead of nine. For another number of axes it raises an error, or evaluates `otherwise`.
macro_rules! with_padded_axes {
    ($count:expr, $m:ident, $call:expr) => {
        with_padded_axes!($count, $m, $call, |count| {
            Err(pyo3::exceptions::PyValueError::new_err(format!("{count} axes: 1 to 9 are supported")))
        })
    };
    ($count:expr, $m:ident, $call:expr, |$other:ident| $otherwise:expr) => {
        match $count {
            1..=3 => {
                const $m: usize = 3;
                $call
            }
            4..=9 => {
                const $m: usize = 9;
                $call
            }
            $other => $otherwise,
        }
    };
}
pub(crate) use with_padded_axes;
