//! The numbers of axes of random cases, and those for which kernels are compiled.

/// Runs an expression for one of `AXES`, known at run time: `for_axes!(count, M, expression)`.
#[macro_export]
macro_rules! for_axes {
    ($count:expr, $m:ident, $call:expr) => {
        $crate::for_axes!($count, $m, $call, 1 2 3 6)
    };
    ($count:expr, $m:ident, $call:expr, $($axes:literal)+) => {
        match $count {
            $($axes => {
                const $m: usize = $axes;
                $call
            })+
            other => unreachable!("{other} axes"),
        }
    };
}

/// The numbers of axes of cases; with 1 and 2, some axes of the kernels rest.
pub const AXES: [usize; 4] = [1, 2, 3, 6];

/// The numbers of axes of cases for the kernel of curves.
pub const FEW_AXES: [usize; 3] = [1, 2, 3];

/// The number of axes for which kernels are compiled, as in the Python module.
pub const PADDED: usize = 3;

/// The values of all axes, with `still` for axes that rest.
pub fn padded<const M: usize, const P: usize>(values: &[f64; M], still: f64) -> [f64; P] {
    assert!(M <= P, "{M} axes in {P}");
    std::array::from_fn(|k| values.get(k).copied().unwrap_or(still))
}
