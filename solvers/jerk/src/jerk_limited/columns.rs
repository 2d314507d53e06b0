//! Values (w, w') at the stations of a window, stored as one array of w and one of w'. The stations of a block's eight intervals
//! are adjacent in each array, so that they are read and written as one SIMD vector.

use fearless_simd::Simd;

use feedplan_geometry::lanes::eight::{Lanes, Register, LANES};

/// (w, w') at each station: of a spline, a step or a gradient.
#[derive(Clone, Debug, Default)]
pub struct Columns {
    pub w: Vec<f64>,
    pub slope: Vec<f64>,
    /// The value of w beyond the last station, in lanes without an interval; w' is 0 there.
    beyond: f64,
}

impl Columns {
    /// The columns of a spline x = (w_0, w'_0, w_1, …), with w = 1 beyond its last station.
    pub fn new(x: &[f64]) -> Self {
        let mut columns = Self::default();
        columns.resize(x.len() / 2 - 1, 1.0);
        columns.take(x);
        columns
    }

    /// Sizes both columns for a window of `intervals` intervals; w beyond its last station becomes `beyond`.
    pub fn resize(&mut self, intervals: usize, beyond: f64) {
        let length = (intervals.div_ceil(LANES) + 1) * LANES;
        self.beyond = beyond;
        self.w.resize(length, beyond);
        self.slope.resize(length, 0.0);
        self.w[intervals + 1..].fill(beyond);
        self.slope[intervals + 1..].fill(0.0);
    }

    pub fn take(&mut self, x: &[f64]) {
        for ((w, slope), x) in self.w.iter_mut().zip(&mut self.slope).zip(x.chunks_exact(2)) {
            (*w, *slope) = (x[0], x[1]);
        }
    }

    pub fn give(&self, x: &mut [f64]) {
        for ((w, slope), x) in self.w.iter().zip(&self.slope).zip(x.chunks_exact_mut(2)) {
            (x[0], x[1]) = (*w, *slope);
        }
    }

    pub fn at(&self, station: usize) -> [f64; 2] {
        [self.w[station], self.slope[station]]
    }

    /// The local coefficients of the intervals of a block, of length h. `live` is 1 for each lane with an interval, else 0.
    #[inline(always)]
    pub fn local<S: Simd>(&self, block: usize, h: Register<S>, live: Lanes) -> [Register<S>; 4] {
        let at = block * LANES;
        let load = |column: &[f64], at: usize| eight(column, at).load(h.simd());
        // The last station is the start of no interval: such lanes get `beyond` instead of w.
        let beyond = (Lanes::ONE - live.load(h.simd())) * self.beyond;
        [
            load(&self.w, at) * live + beyond,
            load(&self.slope, at) * h * live,
            load(&self.w, at + 1),
            load(&self.slope, at + 1) * h,
        ]
    }
}

/// What each interval contributes to the values at its first station (`start`) and at its last station (`end`).
#[derive(Clone, Debug, Default)]
pub struct Terms {
    pub start: Columns,
    pub end: Columns,
}

impl Terms {
    pub fn resize(&mut self, intervals: usize) {
        self.start.resize(intervals, 0.0);
        self.end.resize(intervals, 0.0);
        (self.end.w[0], self.end.slope[0]) = (0.0, 0.0);
    }

    /// Sets the contributions of a block of intervals, given in its local coefficients.
    #[inline(always)]
    pub fn set<S: Simd>(&mut self, block: usize, h: Register<S>, [w0, d0, w1, d1]: [Register<S>; 4]) {
        let at = block * LANES;
        store(&mut self.start.w, at, w0);
        store(&mut self.start.slope, at, d0 * h);
        store(&mut self.end.w, at + 1, w1);
        store(&mut self.end.slope, at + 1, d1 * h);
    }

    /// Sets `out` to `factor` times the sum of both contributions at each station.
    pub fn give(&self, out: &mut Columns, factor: f64) {
        self.at_each(out, |out, sum| *out = factor * sum);
    }

    /// Adds `part` times the sum of both contributions at each station to `out`.
    pub fn add_to(&self, out: &mut Columns, part: f64) {
        self.at_each(out, |out, sum| *out += part * sum);
    }

    /// Calls f(value of `out`, sum of both contributions) at each station.
    #[inline(always)]
    fn at_each(&self, out: &mut Columns, f: impl Fn(&mut f64, f64)) {
        let Self { start, end } = self;
        let columns = [(&mut out.w, &start.w, &end.w), (&mut out.slope, &start.slope, &end.slope)];
        for (out, start, end) in columns {
            for ((out, start), end) in out.iter_mut().zip(start).zip(end) {
                f(out, start + end);
            }
        }
    }

    /// Sets the contributions of lanes beyond the last interval to 0.
    #[inline(always)]
    pub fn close(&mut self, intervals: usize) {
        self.start.w[intervals..].fill(0.0);
        self.start.slope[intervals..].fill(0.0);
    }
}

#[inline(always)]
fn eight(column: &[f64], at: usize) -> Lanes {
    Lanes::new(column[at..at + LANES].try_into().expect("eight numbers"))
}

#[inline(always)]
pub fn store<S: Simd>(column: &mut [f64], at: usize, values: Register<S>) {
    column[at..at + LANES].copy_from_slice(&values.values());
}

#[cfg(test)]
mod tests {
    use fearless_simd::{dispatch, Level};

    use super::*;

    const LIVE: Lanes = Lanes::new([1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);

    #[test]
    fn lanes_without_an_interval_see_nothing_of_the_last_station() {
        let spline = Columns::new(&[4.0, 7.0, 5.0, 8.0, 6.0, 9.0]);
        let u = dispatch!(Level::new(), simd => {
            spline.local(0, Register::all(simd, 2.0), LIVE).map(Register::values)
        });
        let at = |lane: usize| u.map(|values| values[lane]);
        assert_eq!([at(0), at(1)], [[4.0, 14.0, 5.0, 16.0], [5.0, 16.0, 6.0, 18.0]]);
        for lane in 2..LANES {
            assert_eq!(at(lane), [1.0, 0.0, 1.0, 0.0]);
        }
    }

    #[test]
    fn a_station_has_the_terms_of_the_intervals_on_both_sides_of_it() {
        let mut terms = Terms::default();
        terms.resize(2);
        dispatch!(Level::new(), simd => {
            let h = Register::all(simd, 2.0);
            terms.set(0, h, [1.0, 2.0, 3.0, 4.0].map(|value| Register::all(simd, value)));
        });
        terms.close(2);
        let at = |station: usize| [terms.start.at(station), terms.end.at(station)];
        assert_eq!(at(0), [[1.0, 4.0], [0.0, 0.0]]);
        assert_eq!(at(1), [[1.0, 4.0], [3.0, 8.0]]);
        assert_eq!(at(2), [[0.0, 0.0], [3.0, 8.0]]);
        let mut sums = Columns::default();
        sums.resize(2, 0.0);
        terms.give(&mut sums, 1.0);
        terms.add_to(&mut sums, -3.0);
        assert_eq!([sums.at(0), sums.at(1), sums.at(2)], [[-2.0, -8.0], [-8.0, -24.0], [-6.0, -16.0]]);
    }
}
