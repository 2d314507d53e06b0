//! Numbers of axes: those of random cases, and those that kernels are compiled for.

/// Runs an expression for one of `AXES`, known at run time: `for_axes!(count, M, expression)`.
#[macro_export(local_inner_macros)]
macro_rules! for_axes {
    ($count:expr, $m:ident, $call:expr) => {
        match $count {
            6 => {
                const $m: usize = 6;
                $call
            }
            few => for_few_axes!(few, $m, $call),
        }
    };
}

/// The numbers of axes of cases: with 1 and 2 there are axes that rest.
pub const AXES: [usize; 4] = [1, 2, 3, 6];

/// Those for the kernels of curves.
pub const FEW_AXES: [usize; 3] = [1, 2, 3];

/// The number of axes that kernels are compiled for, as in the Python module.
pub const PADDED: usize = 3;

/// The values of all axes, with `still` for axes that rest.
pub fn padded<const M: usize, const P: usize>(values: &[f64; M], still: f64) -> [f64; P] {
    assert!(M <= P, "{M} axes in {P}");
    std::array::from_fn(|k| values.get(k).copied().unwrap_or(still))
}

/// `for_axes!` for one of `FEW_AXES`.
#[macro_export]
macro_rules! for_few_axes {
    ($count:expr, $m:ident, $call:expr) => {
        match $count {
            1 => {
                const $m: usize = 1;
                $call
            }
            2 => {
                const $m: usize = 2;
                $call
            }
            _ => {
                const $m: usize = 3;
                $call
            }
        }
    };
}
