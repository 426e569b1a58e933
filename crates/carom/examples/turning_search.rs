//! The dense search of `tests/turning.rs` over many pairs.
//!
//!     cargo run --release --example turning_search -- 100000 1

#[path = "../tests/support/dense_search.rs"]
mod dense_search;

use dense_search::{KINDS, check_pairs};

fn main() {
    let mut arguments = std::env::args().skip(1);
    let pairs = arguments.next().and_then(|x| x.parse().ok()).unwrap_or(1000);
    let seed = arguments.next().and_then(|x| x.parse().ok()).unwrap_or(1);
    let only = arguments.next();
    for (a, first) in KINDS.iter().enumerate().take(6) {
        for (b, second) in KINDS.iter().enumerate().skip(a) {
            let name = format!("{first} {second}");
            if only.as_ref().is_some_and(|only| *only != name) {
                continue;
            }
            let verdict = check_pairs([a, b], pairs, seed);
            println!("{name:24} {verdict:?}");
        }
    }
}
