//! Runs native work for Python on threads of its own, while the calling thread handles signals and reports progress.
//!
//! Threads do not survive a fork, so a child process makes its own pools. Each call has a pool for itself, so that no call waits
//! for another one; later calls use the pool again.

use std::panic::{catch_unwind, resume_unwind, AssertUnwindSafe};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use pyo3::exceptions::PyOSError;
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

use feedplan_geometry::watch::{Watch, Work};

/// Period of the checks for signals and of the reports of progress.
const PERIOD: Duration = Duration::from_millis(50);
/// The greatest number of idle pools that are kept.
const MOST_IDLE: usize = 4;

/// The idle pools. This mutex is locked only by threads that hold Python's lock, and only such a thread forks the process, so a
/// child process never finds it locked.
static POOLS: Mutex<Pools> = Mutex::new(Pools { process: 0, idle: vec![] });

struct Pools {
    process: u32,
    idle: Vec<ThreadPool>,
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A pool of this process that no other call uses.
fn take(_: Python<'_>) -> PyResult<ThreadPool> {
    let mut pools = lock(&POOLS);
    let process = std::process::id();
    if pools.process != process {
        // Pools of the parent process have no threads here. Dropping them would wait for these threads, so they are leaked.
        std::mem::forget(std::mem::take(&mut pools.idle));
        pools.process = process;
    }
    match pools.idle.pop() {
        Some(pool) => Ok(pool),
        None => ThreadPoolBuilder::new().build().map_err(|error| PyOSError::new_err(error.to_string())),
    }
}

fn give_back(_: Python<'_>, pool: ThreadPool) {
    let mut pools = lock(&POOLS);
    if pools.idle.len() < MOST_IDLE {
        pools.idle.push(pool);
    }
}

/// Does `work` without Python's lock. Meanwhile it handles signals and calls `progress` with the part of the work done, 0 to 1.
/// An error of a signal handler or of `progress` ends the work and is raised.
pub fn run<T: Send>(
    py: Python<'_>,
    progress: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce(Watch<'_>) -> T + Send,
) -> PyResult<T> {
    let (mut work, mut value) = (Some(work), None);
    let mut once = |watch: Watch<'_>| value = work.take().map(|work| work(watch));
    run_once(py, progress, &mut once)?;
    Ok(value.expect("the work is done"))
}

/// The part of `run` that does not depend on the type of the work, so that it is compiled only once.
fn run_once(
    py: Python<'_>,
    progress: Option<&Bound<'_, PyAny>>,
    work: &mut (dyn FnMut(Watch<'_>) + Send),
) -> PyResult<()> {
    let pool = take(py)?;
    let progress = progress.map(|progress| progress.clone().unbind());
    let state = Work::default();
    let outcome: Mutex<Option<std::thread::Result<()>>> = Mutex::new(None);
    let finished = Condvar::new();
    let raised = py.detach(|| {
        pool.in_place_scope(|scope| {
            scope.spawn(|_| {
                let result = catch_unwind(AssertUnwindSafe(|| work(state.watch())));
                *lock(&outcome) = Some(result);
                finished.notify_one();
            });
            serve(&state, progress.as_ref(), &outcome, &finished)
        })
    });
    give_back(py, pool);
    let result = outcome.into_inner().unwrap_or_else(PoisonError::into_inner);
    match (raised, result.expect("the scope ends after its work")) {
        (Some(raised), _) => Err(raised),
        (None, Ok(())) => Ok(()),
        (None, Err(panic)) => resume_unwind(panic),
    }
}

/// Reports progress until the end of the work. Returns the error that has been raised meanwhile, if any; it cancels the work.
fn serve(
    work: &Work,
    progress: Option<&Py<PyAny>>,
    outcome: &Mutex<Option<std::thread::Result<()>>>,
    finished: &Condvar,
) -> Option<PyErr> {
    let mut raised = None;
    let mut guard = lock(outcome);
    loop {
        let waited = finished.wait_timeout_while(guard, PERIOD, |outcome| outcome.is_none());
        guard = waited.unwrap_or_else(PoisonError::into_inner).0;
        let done = guard.is_some();
        drop(guard);
        if raised.is_none() {
            raised = Python::attach(|py| tell(py, work, progress)).err();
            if raised.is_some() {
                work.cancel();
            }
        }
        if done {
            return raised;
        }
        guard = lock(outcome);
    }
}

/// Handles signals and reports the progress.
fn tell(py: Python<'_>, work: &Work, progress: Option<&Py<PyAny>>) -> PyResult<()> {
    py.check_signals()?;
    if let Some(progress) = progress {
        progress.call1(py, (work.done(),))?;
    }
    Ok(())
}
