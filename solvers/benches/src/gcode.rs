//! Measures the number of blocks read per second: straight moves, arcs, calls and expressions. A line counts each time that it is
//! run.

use std::fmt::Write;
use std::hint::black_box;

use criterion::{criterion_group, Criterion, Throughput};
use feedplan_gcode::{read, Options};

const BLOCKS: usize = 500_000;

/// A finishing pass: three coordinates to four decimals in each block.
fn lines() -> String {
    let mut text = String::from("G21 G90 G17 G64 P0.01\nG0 Z5\nF2000\n");
    for i in 0..BLOCKS {
        let t = i as f64 * 1e-3;
        let (x, y, z) = (100.0 * t.cos(), 80.0 * (1.3 * t).sin(), -2.0 - (3.0 * t).sin());
        writeln!(text, "G1 X{x:.4} Y{y:.4} Z{z:.4}").unwrap();
    }
    text + "M30\n"
}

/// Modal blocks with as little text as possible.
fn short_lines() -> String {
    let mut text = String::from("G21G90G17\nG0Z5\nG1F2000\n");
    for i in 0..BLOCKS {
        let t = i as f64 * 1e-3;
        writeln!(text, "X{:.3}Y{:.3}", 100.0 * t.cos(), 80.0 * (1.3 * t).sin()).unwrap();
    }
    text + "M30\n"
}

/// Numbered half circles.
fn arcs() -> String {
    let mut text = String::from("G21 G90 G17\nG0 X0 Y0\nG1 X0 F2000\n");
    for i in 0..BLOCKS {
        let code = 2 + i % 2;
        writeln!(text, "N{i} G{code} X{} Y{:.3} I0.500 J0. F{}", i % 50_000 + 1, 0.0, 1000 + i % 7).unwrap();
        if (i + 1) % 50_000 == 0 {
            text += "G0 X0 Y0\n";
        }
    }
    text + "M30\n"
}

/// Calls in a loop: seven lines for each move.
fn calls() -> String {
    let calls = BLOCKS / 7;
    format!(
        "G21 F1000\no100 sub\n#3=[#1*2+sin[#2]]\nG1 X[#3+1.5] Y#1\no100 endsub\n#<i>=0\n\
         o1 while [#<i> lt {calls}]\no100 call [#<i>*0.001] [30]\n#<i>=[#<i>+1]\no1 endwhile\nM2\n"
    )
}

/// Expressions in a loop: three lines for each move.
fn expressions() -> String {
    let times = BLOCKS / 3;
    format!(
        "G21 F1000\n#<i>=0\no1 repeat [{times}]\nG1 X[#<i>*0.001+1.5*sin[#<i>]] Y[#<i>/2000-#<i>*0.01]\n\
         #<i>=[#<i>+1]\no1 endrepeat\nM2\n"
    )
}

fn bench(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("read G-code");
    group.throughput(Throughput::Elements(BLOCKS as u64)).sample_size(20);
    let options = Options::default();
    for (name, text) in [
        ("lines", lines()),
        ("short lines", short_lines()),
        ("arcs", arcs()),
        ("calls", calls()),
        ("expressions", expressions()),
    ] {
        if let Err(error) = read(text.as_bytes(), &options, &|_| ()) {
            panic!("{name}: {error:?}");
        }
        group.bench_function(name, |bencher| {
            bencher.iter(|| {
                read(black_box(text.as_bytes()), &options, &|_| ()).map(|columns| columns.kind.len())
            });
        });
    }
    group.finish();
}

criterion_group!(benches, bench);
