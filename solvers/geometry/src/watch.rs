//! The progress of a kernel's work, and its cancellation.
//!
//! Kernels count in their outer loops what they have done, at least every few milliseconds. Cancelled work ends there: it
//! unwinds without a message to its caller, through all its threads, so no kernel needs an error for it.

use std::panic::resume_unwind;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering::Relaxed};

/// The whole work in units of its counter: 1e9 equal parts are still counted well, and work that is done again has room
/// above.
const WHOLE: f64 = (1u64 << 52) as f64;
/// Small units of work are counted in groups of this many.
const STEP: usize = 256;

/// The counter of a work, and whether it is cancelled.
#[derive(Debug, Default)]
pub struct Work {
    done: AtomicU64,
    cancelled: AtomicBool,
}

/// The payload with which cancelled work unwinds.
pub struct Cancelled;

impl Work {
    /// The fraction that is done, 0 to 1; it never decreases.
    pub fn done(&self) -> f64 {
        (self.done.load(Relaxed) as f64 / WHOLE).min(1.0)
    }

    /// Makes the work end where it next counts.
    pub fn cancel(&self) {
        self.cancelled.store(true, Relaxed);
    }

    /// The counter for all of the work.
    pub fn watch(&self) -> Watch<'_> {
        Watch { work: Some(self), share: WHOLE }
    }
}

/// Counts a part of a work. The default counts nothing.
#[derive(Clone, Copy, Debug, Default)]
pub struct Watch<'a> {
    work: Option<&'a Work>,
    /// In units of the counter.
    share: f64,
}

impl Watch<'_> {
    /// The counter of this fraction of the part, 0 to 1.
    pub fn part(self, share: f64) -> Self {
        Self { share: share * self.share, ..self }
    }

    /// The counter of one of `count` equal parts.
    pub fn each(self, count: usize) -> Self {
        self.part(1.0 / count.max(1) as f64)
    }

    /// Counts the part `times` times. Unwinds if the work is cancelled.
    #[inline]
    pub fn advance(self, times: usize) {
        if let Some(work) = self.work {
            work.done.fetch_add((times as f64 * self.share) as u64, Relaxed);
            self.check();
        }
    }

    /// Counts the part once, in round `i` of a loop over small parts: a few hundred are counted at once.
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

    /// Unwinds if the work is cancelled, in round `i` of a loop over small parts.
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
