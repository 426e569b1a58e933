//! Energy, momentum and overlap over millions of impacts: rounding may wander, it may not drift.
#![allow(missing_docs, clippy::unwrap_used)]

mod support;

use carom::DVec3;
use carom::scene::{Placement, Scene};
use carom::simulation::Simulation;
use carom::world::{Boundary, Domain};
use support::{Lcg, ball, cube, deepest_overlap, gas, plane, run_impacts, scene, start, vector};

/// Impacts of each long run: 10⁷ when `make validate` asks for them, a tenth at every change.
fn long_run() -> u64 {
    let asked = std::env::var("CAROM_DRIFT_IMPACTS").ok();
    asked.map_or(1_000_000, |text| text.parse().expect("CAROM_DRIFT_IMPACTS is a number"))
}

/// Relative errors of energy, sampled ten times over `impacts`; each must stay below `bound`, which is meant for 10⁷
/// impacts and scaled as a trend would be.
fn drift(name: &str, simulation: &mut Simulation, impacts: u64, bound: f64) {
    let bound = bound * (impacts as f64 / 1e7).min(1.0);
    let mut errors = Vec::new();
    for _ in 0..10 {
        run_impacts(simulation, impacts / 10);
        simulation.take_impacts();
        errors.push(simulation.balance().energy_error);
    }
    let worst = errors.iter().fold(0.0_f64, |worst, e| worst.max(e.abs()));
    println!("{name}: energy error {worst:.2e} of {bound:.0e} allowed over {impacts} impacts; every tenth: {errors:?}");
    assert!(worst <= bound, "{name}: {worst:e}");
}

fn thousand_unequal() -> Scene {
    let mut scene = gas(1000, 0.2, Placement::Random, 3);
    scene.fills[0].radius = carom::scene::RadiusDistribution::Uniform { low: 0.3, high: 0.6 };
    scene.fills[0].mass = None;
    scene.fills[0].density = Some(0.7);
    scene
}

#[test]
fn thousand_balls_of_unequal_masses() {
    let mut simulation = start(&thousand_unequal());
    drift("1,000 unequal balls", &mut simulation, long_run(), 1e-13);
    // Momentum: each impact rounds two velocities, a random walk of 1e7 steps of 1e-16 / 1000.
    let momentum = simulation.balance().momentum_error;
    println!("1,000 unequal balls: momentum error {momentum:.2e}");
    assert!(momentum <= 1e-13);
}

#[test]
fn two_balls_of_awkward_masses() {
    for (k, ratio) in [1.1, 1.7, 3.3, 7.7, 13.9, 101.3, 997.1, 12345.6].into_iter().enumerate() {
        let mut scene = scene([
            ball(0, vector(-0.6, 0.1, -0.2), vector(0.7, -0.3, 0.2), 0.3, 0.7),
            ball(1, vector(0.5, -0.1, 0.3), vector(-0.2, 0.5, 0.11), 0.3, 0.7 * ratio),
        ]);
        scene.domain = cube(Boundary::Walls, 2.0 + 0.01 * k as f64);
        let mut simulation = start(&scene);
        drift(&format!("two balls, mass ratio {ratio}"), &mut simulation, long_run(), 3e-12);
    }
}

#[test]
fn one_ball_in_a_turned_box() {
    let mut lcg = Lcg(5);
    for k in 0..8 {
        let x = lcg.direction();
        let y = x.cross(lcg.direction()).normalize();
        let z = x.cross(y);
        let mut scene = scene([ball(0, DVec3::ZERO, lcg.direction() * 1.3, 0.1, 1.7)]);
        for (row, axis) in [x, y, z, -x, -y, -z].into_iter().enumerate() {
            scene.planes.push(plane(row as i64 + 1, axis, -1.0));
        }
        let mut simulation = start(&scene);
        drift(&format!("one ball in box {k}"), &mut simulation, long_run(), 1e-12);
    }
}

/// Overlap is looked for among all pairs, every so often, with the clock at zero and at 1e9 s.
#[test]
fn overlaps_are_of_rounding_size() {
    for clock in [0.0, 1e9] {
        for packing in [0.1, 0.45] {
            let mut scene = gas(256, packing, Placement::Random, 9);
            scene.start_time = clock;
            let mut simulation = start(&scene);
            let mut deepest = f64::NEG_INFINITY;
            for _ in 0..100 {
                run_impacts(&mut simulation, 10_000);
                deepest = deepest.max(deepest_overlap(&simulation));
            }
            println!("clock {clock:e}, packing {packing}: deepest overlap {deepest:.2e} radii");
            assert!(deepest <= 1e-12);
        }
    }
}

/// Everything at once: gravity, walls, a piston, unequal elastic balls.
#[test]
fn ledger_closes_with_gravity_walls_and_a_piston() {
    let mut scene = thousand_unequal();
    scene.domain = Domain { boundary: [Boundary::Walls; 3], size: DVec3::splat(16.0) };
    scene.gravity = vector(0.0, 0.0, -1.0);
    let mut piston = plane(5000, -DVec3::X, -7.9);
    piston.velocity = vector(-0.01, 0.0, 0.0);
    scene.fills[0].size = Some(vector(14.0, 15.0, 15.0));
    scene.planes.push(piston);
    let mut simulation = start(&scene);
    run_impacts(&mut simulation, 300_000);
    let balance = simulation.balance();
    println!("{balance:?}");
    assert!(balance.work > 0.0);
    // Sums over 3e5 impacts, each of which rounds by 1e-16 of one ball's energy and momentum, which is a thousandth of all.
    assert!(balance.energy_error.abs() <= 1e-13);
    assert!(balance.momentum_error <= 1e-13);
    assert!(balance.angular_momentum_error.unwrap() <= 1e-13);
    assert!(deepest_overlap(&simulation) <= 1e-12);
}

/// Inelastic: what is lost is booked.
#[test]
fn ledger_closes_with_loss() {
    let mut scene = thousand_unequal();
    scene.restitution = 0.9;
    let mut simulation = start(&scene);
    run_impacts(&mut simulation, 20_000);
    let balance = simulation.balance();
    assert!(balance.dissipated > 0.9 * balance.energy_start);
    // 2e4 impacts, each rounding one ball's energy.
    assert!(balance.energy_error.abs() <= 1e-13, "{balance:?}");
}
