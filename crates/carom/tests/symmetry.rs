//! The laws hold for every observer: shifted, moving, turned, relabelled, and with time running back.
#![allow(missing_docs, clippy::unwrap_used)]

mod support;

use carom::DVec3;
use carom::scene::{Ball, Placement};
use carom::simulation::Simulation;
use carom::world::Boundary;
use glam::{DMat3, EulerRot};
use support::{Lcg, ball, cube, gas, positions, run_impacts, run_until, scene, start, velocities};

/// A loose cloud that collides some dozens of times and flies apart.
fn cloud(seed: u64) -> Vec<Ball> {
    let mut lcg = Lcg(seed);
    let mut list: Vec<Ball> = Vec::new();
    while list.len() < 40 {
        let position = lcg.direction() * lcg.between(0.5, 4.0);
        let radius = lcg.between(0.2, 0.5);
        if list.iter().all(|other| (other.position - position).length() > 1.02 * (other.radius + radius)) {
            let velocity = -position * 0.3 + lcg.direction() * 0.3;
            list.push(ball(list.len() as i64, position, velocity, radius, lcg.between(0.5, 2.0)));
        }
    }
    list
}

fn run(list: Vec<Ball>, seconds: f64) -> (Simulation, Vec<(i64, i64)>) {
    let mut simulation = start(&scene(list));
    run_until(&mut simulation, seconds);
    let table = simulation.take_impacts();
    let pairs = table.a.iter().copied().zip(table.b.iter().copied()).collect();
    (simulation, pairs)
}

/// Rounding of 1e-16 grows at each impact by about the mean free path over the radius, some tenfold; in 4 s a ball has
/// about five impacts.
const GROWN_ROUNDING: f64 = 1e-10;
const SECONDS: f64 = 4.0;

#[test]
fn galilean_shift() {
    let drift = DVec3::new(0.7, -1.3, 0.2);
    let place = DVec3::new(3.0, 1.0, -2.0);
    let (here, pairs) = run(cloud(1), SECONDS);
    let moved = cloud(1)
        .into_iter()
        .map(|b| Ball { position: b.position + place, velocity: b.velocity + drift, ..b })
        .collect();
    let (there, moved_pairs) = run(moved, SECONDS);
    assert!(pairs.len() > 30, "{}", pairs.len());
    assert_eq!(pairs, moved_pairs);
    for (x, y) in positions(&here).iter().zip(positions(&there)) {
        assert!((*x + place + drift * SECONDS - y).length() < GROWN_ROUNDING);
    }
}

#[test]
fn rotation() {
    let turn = DMat3::from_euler(EulerRot::XYZ, 0.3, 1.1, -2.0);
    let (here, pairs) = run(cloud(2), SECONDS);
    let turned =
        cloud(2).into_iter().map(|b| Ball { position: turn * b.position, velocity: turn * b.velocity, ..b }).collect();
    let (there, turned_pairs) = run(turned, SECONDS);
    assert_eq!(pairs, turned_pairs);
    for (x, y) in positions(&here).iter().zip(positions(&there)) {
        assert!((turn * *x - y).length() < GROWN_ROUNDING);
    }
}

#[test]
fn time_reversal() {
    let (mut simulation, pairs) = run(cloud(3), SECONDS);
    let (x, v) = (positions(&simulation), velocities(&simulation));
    let back = cloud(3).into_iter().enumerate().map(|(i, b)| Ball { position: x[i], velocity: -v[i], ..b }).collect();
    let (there, mut back_pairs) = run(back, SECONDS);
    back_pairs.reverse();
    assert_eq!(pairs, back_pairs);
    for (b, y) in cloud(3).iter().zip(positions(&there)) {
        assert!((b.position - y).length() < GROWN_ROUNDING, "{:e}", (b.position - y).length());
    }
    assert!(simulation.balance().energy_error.abs() < 1e-15);
}

/// Other ids give the same motion: nothing but the order at one instant may depend on them.
#[test]
fn relabelling() {
    let (here, pairs) = run(cloud(4), SECONDS);
    let relabelled = cloud(4).into_iter().map(|b| Ball { id: 1000 - 7 * b.id, ..b }).collect();
    let (there, other_pairs) = run(relabelled, SECONDS);
    let translated: Vec<(i64, i64)> =
        pairs.iter().map(|&(a, b)| (1000 - 7 * a, 1000 - 7 * b)).map(|(a, b)| (a.min(b), a.max(b))).collect();
    assert_eq!(translated, other_pairs);
    let mut y = positions(&there);
    y.reverse();
    for (x, y) in positions(&here).iter().zip(y) {
        // A and B change places, which may round r and n differently in sign only: to the bit, but for sums over pairs.
        assert!((*x - y).length() < GROWN_ROUNDING);
    }
}

/// The gas is reversible too, for as long as chaos lets rounding stay small.
#[test]
fn reversed_gas() {
    let scene = gas(1000, 0.1, Placement::Random, 5);
    let mut simulation = start(&scene);
    let begin = positions(&simulation);
    run_impacts(&mut simulation, 2000);
    let seconds = simulation.now().to_pair().0;
    let (x, v) = (positions(&simulation), velocities(&simulation));
    let size = scene.domain.size;
    let wrap = |r: DVec3| r - (r / size).round() * size;
    let mut back = support::scene((0..x.len()).map(|i| ball(i as i64, wrap(x[i]), -v[i], 0.5, 1.0)));
    back.domain = cube(Boundary::Periodic, size.x);
    let mut reversed = start(&back);
    run_until(&mut reversed, seconds);
    let worst = positions(&reversed).iter().zip(&begin).map(|(y, x)| wrap(*y - *x).length()).fold(0.0, f64::max);
    println!(
        "reversed gas: 2000 impacts there, {} back, farthest from its start {worst:e}",
        reversed.counts().impacts()
    );
    assert_eq!(reversed.counts().impacts(), 2000);
    // Four impacts a ball there and back, each multiplying rounding by about ten.
    assert!(worst < 1e-6);
}
