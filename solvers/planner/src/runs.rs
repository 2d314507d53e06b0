//! Plans the runs of a path in parallel and joins their profiles.

use std::cell::RefCell;
use std::ops::Range;
use std::thread::LocalKey;

use feedplan_geometry::parallel::try_map;

use crate::problem::{Fault, Problem};
use crate::profile::Profile;

/// Approximate number of pieces in a group of runs; a thread plans one group at a time.
const GROUP: usize = 8192;
/// After a run of more pieces its memory is freed, so that each thread keeps at most some MB.
const MOST_KEPT: usize = 4096;

/// Memory of each thread for one run, kept from call to call: allocating some MB takes time.
pub type Space<W> = &'static LocalKey<RefCell<W>>;

/// The profiles of all runs as one. `plan` gets the pieces of a run, the squares of the speeds at its ends, memory,
/// and the profile to append to.
pub fn over_runs<const M: usize, W: Default>(
    problem: &Problem<M>,
    space: Space<W>,
    plan: impl Fn((usize, usize), (f64, f64), &mut W, &mut Profile) -> Result<(), Fault> + Sync,
) -> Result<Profile, Fault> {
    let runs = problem.runs;
    let last_run = runs.len() - 2;
    let groups = groups(runs);
    let plans = try_map(groups.len(), 1, |i| {
        let group = &groups[i];
        let pieces = runs[group.end] - runs[group.start];
        let mut profile = Profile::with_capacity(2 * pieces);
        for run in group.clone() {
            let ends = (runs[run], runs[run + 1]);
            let start = if run == 0 { problem.start_speed } else { 0.0 };
            let end = if run == last_run { problem.end_speed } else { 0.0 };
            profile.runs.push(profile.phases.len() as i64);
            space.with_borrow_mut(|space| {
                let planned = plan(ends, (start * start, end * end), space, &mut profile);
                if ends.1 - ends.0 > MOST_KEPT {
                    *space = W::default();
                }
                planned
            })?;
        }
        Ok(profile)
    });
    Ok(Profile::join(plans?))
}

/// Groups of successive runs with about `GROUP` pieces each.
pub fn groups(runs: &[usize]) -> Vec<Range<usize>> {
    let mut groups = vec![];
    let mut first = 0;
    for run in 0..runs.len() - 1 {
        if runs[run + 1] - runs[first] >= GROUP || run + 2 == runs.len() {
            groups.push(first..run + 1);
            first = run + 1;
        }
    }
    groups
}
