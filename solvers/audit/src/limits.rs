//! The limits of the machine and of the path that hold at all places.

use super::tolerance::PASS_EXCESS;
use super::vectors;

/// Number of speeds that a feed can limit: along X, Y, Z; along U, V, W; of all other axes; and of all axes together.
pub const FEEDS: usize = 4;

/// A limit of each axis for positive and for negative values, both as absolute values.
#[derive(Clone, Copy, Debug)]
pub struct Sided<const M: usize> {
    pub positive: [f64; M],
    pub negative: [f64; M],
}

impl<const M: usize> Sided<M> {
    /// The limit that holds for a value, by its sign.
    #[inline(always)]
    pub fn of(&self, axis: usize, value: f64) -> f64 {
        // Both are read, so that there is no branch on a sign that changes often.
        let (positive, negative) = (self.positive[axis], self.negative[axis]);
        if value < 0.0 {
            negative
        } else {
            positive
        }
    }

    /// The limits that hold for a value of each axis.
    #[inline(always)]
    pub fn of_each(&self, values: &[f64; M]) -> [f64; M] {
        vectors::vector_of(|k| self.of(k, values[k]))
    }

    /// 1/limit: value × inverse is the use of the limit. A limit of 0 gives the greatest finite number, so that any value but 0
    /// exceeds it.
    pub fn inverse(&self) -> Self {
        let inverse = |limits: [f64; M]| limits.map(|limit| (1.0 / limit).min(f64::MAX));
        Self { positive: inverse(self.positive), negative: inverse(self.negative) }
    }

    /// The smaller limit.
    #[inline]
    pub fn least(&self, axis: usize) -> f64 {
        self.positive[axis].min(self.negative[axis])
    }

    /// The greater limit.
    #[inline]
    pub fn greatest(&self, axis: usize) -> f64 {
        self.positive[axis].max(self.negative[axis])
    }

    /// The greater limit of each axis.
    pub fn greater(&self) -> [f64; M] {
        std::array::from_fn(|k| self.greatest(k))
    }
}

/// The limits that hold everywhere.
#[derive(Clone, Copy, Debug)]
pub struct Limits<const M: usize> {
    /// Number of axes. The limits of axes beyond are 0, and their travel is not limited.
    pub axes: usize,
    /// In mm/s, mm/s² and mm/s³.
    pub velocity: Sided<M>,
    pub acceleration: Sided<M>,
    pub jerk: [f64; M],
    /// Whether jerk limits are checked; otherwise jerk is only measured where that costs nothing.
    pub judges_jerk: bool,
    /// Jump of each axis velocity that is allowed at a corner, in mm/s.
    pub jump: [f64; M],
    /// Jump of each axis velocity at a corner, in mm/s, that may show in differences of setpoints as an acceleration above its
    /// limit; 0 if `jump` is only what the acceleration limit gives in a period.
    pub jump_beyond: [f64; M],
    /// Least and greatest position, in mm.
    pub travel: [[f64; 2]; M],
    /// The factor, 0 or 1, of each axis velocity in each speed that a feed can limit.
    pub feed_axes: [[f64; M]; FEEDS],
    /// In mm; infinite: not limited.
    pub chord_tolerance: f64,
    /// Servo period in s.
    pub period: f64,
    /// Speeds at the two ends of the path, in mm/s.
    pub end_speeds: [f64; 2],
}

impl<const M: usize> Limits<M> {
    /// The components of a velocity or displacement that count towards a kind of feed; the others are 0.
    #[inline]
    pub fn counted(&self, feed: usize, of: &[f64; M]) -> [f64; M] {
        std::array::from_fn(|k| self.feed_axes[feed][k] * of[k])
    }

    /// How far the mean of the recorded velocities of one axis at both ends of a step may be from the mean velocity, in mm/s: an
    /// eighth of the range of accelerations times `step` in s, and half of a jump.
    #[inline(always)]
    pub fn mean_velocity_off(&self, axis: usize, step: f64) -> f64 {
        let span = self.acceleration.positive[axis] + self.acceleration.negative[axis];
        0.125 * span * step + 0.5 * self.jump[axis]
    }

    /// The greatest jump of one axis velocity that is negligible, in mm/s: over `time` in s it adds no more than `PASS_EXCESS` of
    /// the acceleration limit.
    #[inline]
    pub fn negligible_jump(&self, axis: usize, time: f64) -> f64 {
        PASS_EXCESS * self.acceleration.least(axis) * time
    }
}

#[cfg(test)]
impl<const M: usize> Limits<M> {
    /// Limits that allow everything.
    pub fn none() -> Self {
        let anything = Sided { positive: [f64::INFINITY; M], negative: [f64::INFINITY; M] };
        Self {
            axes: M,
            velocity: anything,
            acceleration: anything,
            jerk: [f64::INFINITY; M],
            judges_jerk: false,
            jump: [0.0; M],
            jump_beyond: [0.0; M],
            travel: [[f64::NEG_INFINITY, f64::INFINITY]; M],
            feed_axes: [[1.0; M]; FEEDS],
            chord_tolerance: f64::INFINITY,
            period: 1e-3,
            end_speeds: [0.0; 2],
        }
    }
}
