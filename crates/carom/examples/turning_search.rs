//! The dense search of `tests/turning.rs` over many pairs, a line a pair of shapes. Fails if a prediction was wrong.
//!
//!     cargo run --release --example turning_search -- STARTS SEED ["box cylinder"]

#[path = "../tests/support/dense_search.rs"]
mod dense_search;

use std::process::ExitCode;

use dense_search::{KINDS, Verdict, check_pairs};

fn main() -> ExitCode {
    let mut arguments = std::env::args().skip(1);
    let starts = arguments.next().and_then(|x| x.parse().ok()).unwrap_or(1000);
    let seed = arguments.next().and_then(|x| x.parse().ok()).unwrap_or(1);
    let only = arguments.next();
    println!(
        "{starts} starts a pair of shapes, every second one grazing, each followed through up to three impacts; seed {seed}"
    );
    println!(
        "{:24} {:>8} {:>8} {:>8} {:>7} {:>7} {:>8} {:>10} {:>10} {:>13} {:>13} {:>6}",
        "shapes",
        "searches",
        "impacts",
        "certain",
        "within",
        "missed",
        "invented",
        "unfinished",
        "wrong time",
        "worst time",
        "deepest",
        "steps"
    );
    let mut all_right = true;
    for (a, first) in KINDS.iter().enumerate().take(6) {
        for (b, second) in KINDS.iter().enumerate().skip(a) {
            let name = format!("{first} {second}");
            if only.as_ref().is_some_and(|only| *only != name) {
                continue;
            }
            let verdict = check_pairs([a, b], starts, seed);
            all_right &= verdict.is_right();
            print(&name, &verdict);
        }
    }
    println!(
        "worst time: size over approach speed; deepest: overlap before an impact, in units of the tolerance; steps: a search"
    );
    if all_right { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

fn print(name: &str, found: &Verdict) {
    println!(
        "{name:24} {:8} {:8} {:8} {:7} {:7} {:8} {:10} {:10} {:13.1e} {:13.1e} {:6.1}",
        found.pairs,
        found.impacts,
        found.transversal,
        found.within,
        found.missed,
        found.invented,
        found.unfinished,
        found.wrong_time,
        found.worst_time,
        found.deepest,
        found.steps as f64 / found.pairs as f64
    );
}
