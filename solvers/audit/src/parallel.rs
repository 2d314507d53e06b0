//! Loops over blocks on all cores, and their progress callback. The loop itself is compiled once, not for each kind of work and
//! each number of axes.

use std::ops::Range;
use std::sync::Mutex;

use rayon::prelude::*;

use super::tally::Tally;

/// Progress callback: gets the number of phases, pieces or moves checked since its last call. It may stop the audit by a panic.
pub type Seen<'a> = &'a (dyn Fn(usize) + Sync);

/// Number that the callback gets at each call.
const TOLD: usize = 64;

/// Calls the callback at every `TOLD`-th item `i` of a loop.
pub fn tell(seen: Seen, i: usize) {
    if i.is_multiple_of(TOLD) {
        seen(TOLD);
    }
}

/// Number of threads that work on a loop.
pub fn threads() -> usize {
    rayon::current_num_threads()
}

fn each_block(blocks: usize, work: &(dyn Fn(usize) + Sync)) {
    (0..blocks).into_par_iter().for_each(work);
}

/// Divides the items into parts of `size` and calls `work` with the number of each part and the part.
pub fn each_part<T: Send>(items: &mut [T], size: usize, work: &(dyn Fn(usize, &mut [T]) + Sync)) {
    let parts: Vec<Mutex<&mut [T]>> = items.chunks_mut(size).map(Mutex::new).collect();
    each_block(parts.len(), &|number| {
        // No other thread ever locks this part.
        if let Ok(mut part) = parts[number].lock() {
            work(number, &mut part);
        }
    });
}

/// Calls `work` for blocks of `size` of the `count` items and merges what they find. Each block starts from the tally `known`,
/// without its samples.
pub fn tally<const M: usize>(
    known: &Tally<M>,
    count: usize,
    size: usize,
    work: &(dyn Fn(Range<usize>, &mut Tally<M>) + Sync),
) -> Tally<M> {
    let mut found = vec![Tally { samples: 0, ..known.clone() }; count.div_ceil(size)];
    each_part(&mut found, 1, &|number, part| {
        work(number * size..((number + 1) * size).min(count), &mut part[0]);
    });
    found.into_iter().fold(Tally::default(), Tally::merge)
}
