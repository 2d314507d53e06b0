//! Loops on all cores. The loop itself is compiled once. An iterator of rayon would be compiled again for each kind of work and
//! each number of axes.

use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};
use std::sync::Mutex;

use rayon::prelude::*;

/// The number of threads that work on a loop.
pub fn threads() -> usize {
    rayon::current_num_threads()
}

/// Calls `work` with the numbers 0 to `count` − 1. The numbers are handed out in order, each to the next free thread, so a loop
/// whose longest work comes first ends on all threads at about the same time.
pub fn each(count: usize, work: &(dyn Fn(usize) + Sync)) {
    let next = AtomicUsize::new(0);
    (0..threads().min(count)).into_par_iter().for_each(|_| loop {
        match next.fetch_add(1, Relaxed) {
            i if i < count => work(i),
            _ => break,
        }
    });
}

/// Divides the items into parts of `size`, and calls `work` with the index of the first item of each part and the part.
pub fn each_part<T: Send>(items: &mut [T], size: usize, work: &(dyn Fn(usize, &mut [T]) + Sync)) {
    let parts: Vec<Mutex<&mut [T]>> = items.chunks_mut(size).map(Mutex::new).collect();
    each(parts.len(), &|part| {
        // No other thread ever locks this part.
        if let Ok(mut own) = parts[part].lock() {
            work(part * size, &mut own);
        }
    });
}

/// The results of `work` for the numbers 0 to `count` − 1, in order. A thread does `size` of them at a time.
pub fn map<T: Send>(count: usize, size: usize, work: impl Fn(usize) -> T + Sync) -> Vec<T> {
    map_with(count, size, || (), |(), i| work(i))
}

/// `map` with memory that the numbers of a part share: `space` makes it.
pub fn map_with<S, T: Send>(
    count: usize,
    size: usize,
    space: impl Fn() -> S + Sync,
    work: impl Fn(&mut S, usize) -> T + Sync,
) -> Vec<T> {
    let mut results: Vec<Option<T>> = std::iter::repeat_with(|| None).take(count).collect();
    each_part(&mut results, size, &|first, results| {
        let mut space = space();
        for (i, result) in (first..).zip(results) {
            *result = Some(work(&mut space, i));
        }
    });
    results.into_iter().flatten().collect()
}

/// `map` for work that may fail: the error is that of the least number that fails. After a failure no
/// greater number is begun.
pub fn try_map<T: Send, E: Send>(
    count: usize,
    size: usize,
    work: impl Fn(usize) -> Result<T, E> + Sync,
) -> Result<Vec<T>, E> {
    let failed = AtomicUsize::new(usize::MAX);
    let results = map(count, size, |i| {
        (i < failed.load(Relaxed)).then(|| {
            let result = work(i);
            if result.is_err() {
                failed.fetch_min(i, Relaxed);
            }
            result
        })
    });
    results.into_iter().flatten().collect()
}

/// The first result of `work` for the numbers 0 to `count` − 1 that is not None. A thread does `size` numbers at a time.
pub fn find_first<T: Send>(count: usize, size: usize, work: impl Fn(usize) -> Option<T> + Sync) -> Option<T> {
    try_map(count.div_ceil(size), 1, |part| {
        let found = (part * size..count.min((part + 1) * size)).find_map(&work);
        found.map_or(Ok(()), Err)
    })
    .err()
}

/// The results of `work` for the items, in order; each item is moved into its call. A thread does one at a time.
pub fn consume<I: Send, T: Send>(items: Vec<I>, work: impl Fn(usize, I) -> T + Sync) -> Vec<T> {
    let mut both: Vec<(Option<I>, Option<T>)> = items.into_iter().map(|item| (Some(item), None)).collect();
    each_part(&mut both, 1, &|first, both| {
        for (i, (item, result)) in (first..).zip(both) {
            *result = item.take().map(|item| work(i, item));
        }
    });
    both.into_iter().filter_map(|(_, result)| result).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_are_in_order_and_each_number_is_worked_on_once() {
        let calls = AtomicUsize::new(0);
        for (count, size) in [(0, 1), (1, 4), (1000, 1), (1000, 7)] {
            calls.store(0, Relaxed);
            let squares = map(count, size, |i| {
                calls.fetch_add(1, Relaxed);
                i * i
            });
            assert_eq!(squares, (0..count).map(|i| i * i).collect::<Vec<_>>());
            assert_eq!(calls.load(Relaxed), count);
            assert_eq!(find_first(count, size, |i| (i * i > 500).then_some(i)), (count > 23).then_some(23));
        }
    }

    #[test]
    fn loops_may_be_nested_and_parts_know_where_they_begin() {
        let sums = map(50, 1, |i| map(i, 3, |j| j).into_iter().sum::<usize>());
        assert!(sums.iter().enumerate().all(|(i, &sum)| sum == i * i.saturating_sub(1) / 2));
        let mut items = vec![0; 100];
        each_part(&mut items, 7, &|first, part| {
            part.iter_mut().enumerate().for_each(|(i, x)| *x = first + i)
        });
        assert_eq!(items, (0..100).collect::<Vec<_>>());
        let texts = (0..100).map(|i| i.to_string()).collect();
        assert!(consume(texts, |i, text| text == i.to_string()).into_iter().all(|same| same));
    }

    #[test]
    fn the_error_is_that_of_the_least_number_and_ends_the_work() {
        let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
        for failing in [0, 7, 400] {
            let calls = AtomicUsize::new(0);
            let work = |i: usize| {
                calls.fetch_add(1, Relaxed);
                if i < failing {
                    Ok(i)
                } else {
                    Err(i)
                }
            };
            assert_eq!(try_map(1000, 3, work), Err(failing));
            calls.store(0, Relaxed);
            assert_eq!(alone.install(|| try_map(1000, 3, work)), Err(failing));
            assert_eq!(calls.load(Relaxed), failing + 1);
        }
        assert_eq!(try_map(3, 1, Ok::<usize, ()>), Ok(vec![0, 1, 2]));
    }

    #[test]
    fn a_panic_of_the_work_is_one_of_the_loop() {
        let ended = std::panic::catch_unwind(|| map(100, 1, |i| assert!(i != 10)));
        assert!(ended.is_err());
    }
}
