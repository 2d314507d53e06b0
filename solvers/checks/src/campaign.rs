//! The number of random cases of a test.

/// The first `count` seeds, or FEEDPLAN_SEEDS of them in a campaign.
pub fn seeds(count: u64) -> std::ops::Range<u64> {
    0..std::env::var("FEEDPLAN_SEEDS").map_or(count, |text| text.parse().expect("a number of seeds"))
}
