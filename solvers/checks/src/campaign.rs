//! How many random cases a test takes.

/// The first `count` seeds, or as many as FEEDPLAN_SEEDS says for a long campaign.
pub fn seeds(count: u64) -> std::ops::Range<u64> {
    0..std::env::var("FEEDPLAN_SEEDS").map_or(count, |text| text.parse().expect("a number of seeds"))
}
