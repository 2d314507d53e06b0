//! The number of random cases of a test, and the message for those that fail.

/// The first `count` seeds, or FEEDPLAN_SEEDS of them in a campaign.
pub fn seeds(count: u64) -> std::ops::Range<u64> {
    0..std::env::var("FEEDPLAN_SEEDS").map_or(count, |text| text.parse().expect("a number of seeds"))
}

/// Fails if there are failures, with their number and the first 40 of them.
pub fn assert_none(failures: &[String]) {
    let first = &failures[..failures.len().min(40)];
    assert!(failures.is_empty(), "{} failures\n{}", failures.len(), first.join("\n"));
}
