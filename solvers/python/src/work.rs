//! Native work for Python: on threads of this process, while the thread that asked for it serves signals and progress.
//!
//! Threads do not outlive a fork: pools are those of one process, and a child makes its own. Each call has a pool to
//! itself while it works, so that none waits for another's work; a pool that rests is taken again by the next call.

use std::panic::{catch_unwind, resume_unwind, AssertUnwindSafe};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use pyo3::exceptions::PyOSError;
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

use feedplan_geometry::watch::{Watch, Work};

/// How often signals are looked for and progress is told.
const PERIOD: Duration = Duration::from_millis(50);
/// Pools kept for the next calls.
const MOST_IDLE: usize = 4;

/// The pools that rest. It is locked only by who holds Python's lock, and a process is forked by who holds that: a child
/// never finds it locked.
static POOLS: Mutex<Pools> = Mutex::new(Pools { process: 0, idle: vec![] });

struct Pools {
    process: u32,
    idle: Vec<ThreadPool>,
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A pool of this process that nobody else uses.
fn take(_: Python<'_>) -> PyResult<ThreadPool> {
    let mut pools = lock(&POOLS);
    let process = std::process::id();
    if pools.process != process {
        // The parent's: their threads are not here, and to end them would be to wait for them.
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

/// Does `work` without Python's lock. Meanwhile signals are handled, and `progress` is called with the part that is done;
/// what a handler or `progress` raises ends the work and is raised here.
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

/// The same for work of one type: it is compiled once.
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

/// Waits for the end of the work, which is told as well; what was raised meanwhile, which cancels it.
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

/// Handles signals and tells the progress.
fn tell(py: Python<'_>, work: &Work, progress: Option<&Py<PyAny>>) -> PyResult<()> {
    py.check_signals()?;
    if let Some(progress) = progress {
        progress.call1(py, (work.done(),))?;
    }
    Ok(())
}
