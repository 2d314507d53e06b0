//! How far the work of a kernel is, and whether it is still wanted.
//!
//! Kernels count what they have done in their outer loops, at least every few milliseconds. Work that is no longer wanted
//! ends there by unwinding up to who began it, through all threads of the work, without a message: no kernel has to
//! hand a fault of its own up for it.

use std::panic::resume_unwind;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering::Relaxed};

/// The whole of a work in the units of its counter: fine enough for each of a thousand million parts, with room above for
/// work that is done again.
const WHOLE: f64 = (1u64 << 52) as f64;
/// Small units of work are counted by so many.
const STEP: usize = 256;

/// One work: what is done of it, and whether it is still wanted.
#[derive(Debug, Default)]
pub struct Work {
    done: AtomicU64,
    cancelled: AtomicBool,
}

/// What the unwinding of cancelled work carries.
pub struct Cancelled;

impl Work {
    /// The part that is done, 0 to 1; it never falls.
    pub fn done(&self) -> f64 {
        (self.done.load(Relaxed) as f64 / WHOLE).min(1.0)
    }

    /// Ends the work where it next counts.
    pub fn cancel(&self) {
        self.cancelled.store(true, Relaxed);
    }

    /// Who counts it.
    pub fn watch(&self) -> Watch<'_> {
        Watch { work: Some(self), share: WHOLE }
    }
}

/// Counts a part of a work; that of a work that nobody waits for is the default.
#[derive(Clone, Copy, Debug, Default)]
pub struct Watch<'a> {
    work: Option<&'a Work>,
    /// In units of the counter.
    share: f64,
}

impl Watch<'_> {
    /// Counts this share of the part, 0 to 1.
    pub fn part(self, share: f64) -> Self {
        Self { share: share * self.share, ..self }
    }

    /// Counts each of so many equal parts.
    pub fn each(self, count: usize) -> Self {
        self.part(1.0 / count.max(1) as f64)
    }

    /// So many times the part is done. Unwinds if the work is cancelled.
    #[inline]
    pub fn advance(self, times: usize) {
        if let Some(work) = self.work {
            work.done.fetch_add((times as f64 * self.share) as u64, Relaxed);
            self.check();
        }
    }

    /// The part is done once more, for the number `i` of a loop over small ones: a few hundred are counted at once.
    #[inline]
    pub fn count(self, i: usize) {
        if i.is_multiple_of(STEP) {
            self.advance(STEP);
        }
    }

    /// Unwinds if the work is cancelled.
    #[inline]
    pub fn check(self) {
        if self.work.is_some_and(|work| work.cancelled.load(Relaxed)) {
            resume_unwind(Box::new(Cancelled));
        }
    }

    /// The same in a loop over small units.
    #[inline]
    pub fn check_at(self, i: usize) {
        if i.is_multiple_of(STEP) {
            self.check();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rayon::prelude::*;
    use std::panic::{catch_unwind, AssertUnwindSafe};

    #[test]
    fn parts_of_parts_add_up_to_the_whole() {
        let work = Work::default();
        let [first, rest] = [work.watch().part(0.25), work.watch().part(0.75)];
        (0..1000usize).into_par_iter().for_each(|_| first.each(1000).advance(1));
        assert!((work.done() - 0.25).abs() < 1e-9);
        for i in 0..1024 {
            rest.each(1024).count(i);
        }
        assert!((work.done() - 1.0).abs() < 1e-9);
        rest.advance(1000);
        assert_eq!(work.done(), 1.0);
    }

    #[test]
    fn cancelled_work_ends_in_all_threads() {
        let work = Work::default();
        let watch = work.watch().each(1_000_000);
        let ended = catch_unwind(AssertUnwindSafe(|| {
            (0..1_000_000usize).into_par_iter().for_each(|i| {
                if i == 10 {
                    work.cancel();
                }
                watch.advance(1);
            });
        }));
        assert!(ended.expect_err("it was cancelled").is::<Cancelled>());
        assert!(work.done() < 1.0);
        // Nobody waits: nothing is counted and nothing ends.
        Watch::default().advance(1);
        Watch::default().check();
    }
}
