//! Progress and cancellation of a kernel's work.
//!
//! Kernels count finished work in their outer loops, at least every few milliseconds. If the work was cancelled, it ends there by
//! unwinding to its caller, through all its threads and without a message. So no kernel needs an error for it.

use std::panic::resume_unwind;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering::Relaxed};

/// The whole work in units of the counter: fine enough for 1e9 equal parts, with room above for work that is done again.
const WHOLE: f64 = (1u64 << 52) as f64;
/// Small units of work are counted in groups of this many.
const STEP: usize = 256;

/// The counter of a task's work, and whether it is cancelled.
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

    /// Requests that the work ends where it next counts.
    pub fn cancel(&self) {
        self.cancelled.store(true, Relaxed);
    }

    /// A counter for all of the work.
    pub fn watch(&self) -> Watch<'_> {
        Watch { work: Some(self), share: WHOLE }
    }
}

/// Counts a share of some work. The default counts nothing.
#[derive(Clone, Copy, Debug, Default)]
pub struct Watch<'a> {
    work: Option<&'a Work>,
    /// The share, in units of the counter.
    share: f64,
}

impl Watch<'_> {
    /// A counter for this fraction, 0 to 1, of the share.
    pub fn part(self, share: f64) -> Self {
        Self { share: share * self.share, ..self }
    }

    /// A counter for one of `count` equal parts of the share.
    pub fn each(self, count: usize) -> Self {
        self.part(1.0 / count.max(1) as f64)
    }

    /// Counts the share `times` times. Unwinds if the work is cancelled.
    #[inline]
    pub fn advance(self, times: usize) {
        if let Some(work) = self.work {
            work.done.fetch_add((times as f64 * self.share) as u64, Relaxed);
            self.check();
        }
    }

    /// Counts the share once, in round `i` of a loop over small parts; every 256th round counts for all 256.
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

    /// In round `i` of a loop over small parts: unwinds if the work is cancelled, checked in every 256th round.
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
        // No work is attached: nothing is counted and nothing ends.
        Watch::default().advance(1);
        Watch::default().check();
    }
}
