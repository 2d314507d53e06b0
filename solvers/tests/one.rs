mod support;
use support::{audit, random_case, Audit};
#[test]
fn one() {
    let seed: u64 = std::env::var("SEED").unwrap().parse().unwrap();
    let count = 1 + (seed % 6) as usize;
    let _ = Audit::default();
    for_axes!(count, M, {
        let case = random_case::<M>(seed);
        match case.plan() {
            Err(f) => println!("seed {seed}: {f}"),
            Ok(p) => println!("{:?}", audit(&case, &p, 20)),
        }
    });
}
