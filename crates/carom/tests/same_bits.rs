//! The same scene gives the same bits: in two runs, for any order of insertion, optimised or not, and after a
//! checkpoint. `make test` compares the golden hashes with and without optimisation.
#![allow(missing_docs, clippy::unwrap_used)]

mod support;

use carom::DQuat;
use carom::rotation::Rotation;
use carom::scene::{Balls, Placement, RadiusDistribution, Scene};
use carom::simulation::Simulation;
use carom::world::Boundary;
use sha2::{Digest, Sha256};
use support::{Lcg, cube, gas, plane, run_impacts, scene, start, vector};

fn hash(simulation: &mut Simulation) -> String {
    let mut digest = Sha256::new();
    let mut number = |x: f64| digest.update(x.to_bits().to_le_bytes());
    let world = simulation.world();
    let (time, low) = simulation.now().to_pair();
    number(time);
    number(low);
    for rank in 0..world.len() {
        let ball = world.row(rank);
        for x in world.wrapped(ball, simulation.now()).0.to_array() {
            number(x);
        }
        for x in world.velocity(ball, simulation.now()).to_array() {
            number(x);
        }
    }
    let table = simulation.take_impacts();
    let columns = [&table.time, &table.time_low, &table.point, &table.normal, &table.approach_speed];
    let more = [&table.separation_speed, &table.impulse, &table.restitution, &table.energy_lost];
    for column in columns.into_iter().chain(more) {
        column.iter().for_each(|&x| number(x));
    }
    for column in [&table.a, &table.b] {
        column.iter().for_each(|x| digest.update(x.to_le_bytes()));
    }
    digest.update(&table.kind);
    digest.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Name, scene, impacts, golden hash.
fn cases() -> Vec<(&'static str, Scene, u64, &'static str)> {
    let mut box_of_sizes = gas(300, 0.25, Placement::Random, 12);
    box_of_sizes.fills[0].radius = RadiusDistribution::Uniform { low: 0.1, high: 0.6 };
    box_of_sizes.domain = cube(Boundary::Walls, 14.0);
    box_of_sizes.gravity = vector(0.0, 0.0, -0.2);
    box_of_sizes.restitution = 0.99;
    let mut lattice = gas(256, 0.3, Placement::Fcc, 5);
    // Velocities of ±1 along the axes: many impacts at one instant.
    lattice.fills[0].temperature = 0.0;
    let mut lcg = Lcg(1);
    let (world, _) = lattice.build().unwrap();
    let mut balls = Balls::default();
    for (row, flight) in world.flights.iter().enumerate() {
        let mut velocity = vector(0.0, 0.0, 0.0);
        velocity[(lcg.uniform() * 3.0) as usize] = if lcg.uniform() < 0.5 { 1.0 } else { -1.0 };
        balls.push(support::ball(world.id(row), flight.position(), velocity, 0.5, 1.0), 3);
    }
    lattice = Scene { balls, fills: Vec::new(), ..lattice };
    let mut column = scene((0..20).map(|i| {
        support::ball(i, vector(0.0, 0.0, 1.5 * i as f64 + 1.0), vector(0.0, 0.0, 0.0), 0.5, 1.0 + 0.1 * i as f64)
    }));
    column.planes.push(plane(99, vector(0.0, 0.0, 1.0), 0.0));
    column.gravity = vector(0.0, 0.0, -9.81);
    vec![
        ("gas", gas(500, 0.4, Placement::Random, 3), 20_000, GOLDEN[0]),
        ("walls, gravity, loss, sizes", box_of_sizes, 5_000, GOLDEN[1]),
        ("lattice, many at one instant", lattice, 5_000, GOLDEN[2]),
        ("column", column, 5_000, GOLDEN[3]),
    ]
}

/// Made when balls found each other by cells alone, were predicted one by one and lay in memory by id: what came later
/// has changed no bit.
const GOLDEN: [&str; 4] = [
    "b3dc4a4c3980871e05168028fd97617d105cea2ab0561b3dedaa8b923837ec7a",
    "413f4c7c25c8a0cfcad1b348b5b0769379b0ca2194eb768ba285d8985d0b27d5",
    "e817e6d9a111b39aa0c4aeae8e6286360d54fad731a07b8c93cf9280fd2c39a1",
    "8bd5de78518f0a88d82780abfdb345b97b16edd8ec733868253a2d9f88237d10",
];

#[test]
fn same_hash_as_ever() {
    let mut found = Vec::new();
    for (name, scene, impacts, golden) in cases() {
        let mut simulation = start(&scene);
        run_impacts(&mut simulation, impacts);
        let hash = hash(&mut simulation);
        println!("{name}: {hash}");
        found.push((name, hash, golden));
    }
    for (name, hash, golden) in found {
        assert_eq!(hash, golden, "{name}");
    }
}

/// Orientations and angular velocities of tops of every kind, near the separatrix and far from it.
#[test]
fn same_hash_as_ever_of_rotations() {
    let mut lcg = Lcg(4);
    let mut digest = Sha256::new();
    for round in 0..3000 {
        let mut moments = vector(lcg.between(1.0, 2.0), lcg.between(1.0, 2.0), lcg.between(1.0, 2.0));
        let mut rates = lcg.direction();
        match round % 4 {
            0 => moments.y = moments.x,
            1 => rates = (rates * 1e-3 + carom::DVec3::Y).normalize(),
            _ => {}
        }
        let rotation = Rotation::new(moments, DQuat::IDENTITY, rates);
        for time in [0.0, lcg.between(0.0, 10.0), lcg.between(-1e6, 1e6)] {
            let (q, w) = rotation.state_after(time);
            for x in [q.w, q.x, q.y, q.z, w.x, w.y, w.z, rotation.fastest(), rotation.fastest_change()] {
                digest.update(x.to_bits().to_le_bytes());
            }
        }
    }
    let hash: String = digest.finalize().iter().map(|byte| format!("{byte:02x}")).collect();
    assert_eq!(hash, GOLDEN_ROTATIONS);
}

const GOLDEN_ROTATIONS: &str = "dc827c1413219d4791eb1e8435fe7d977a15a44fed12a6d3a3aa252ffdb9df91";

/// With two, four and eight numbers side by side, as far as this machine has registers so wide.
#[test]
fn any_width_of_registers() {
    for (name, scene, impacts, golden) in cases() {
        for lanes in [2, 4, 8] {
            let mut simulation = Simulation::with_lanes(scene.build().unwrap().0, true, lanes);
            run_impacts(&mut simulation, impacts);
            assert_eq!(hash(&mut simulation), golden, "{name}, {lanes} lanes");
        }
    }
}

/// Balls are put into another order in memory as they mix. A run resumed from a checkpoint does so at other moments.
#[test]
fn any_order_in_memory() {
    let thin = gas(2500, 0.1, Placement::Random, 9);
    let mut whole = start(&thin);
    let mut layouts = 0;
    for round in 0..4 {
        let bytes = whole.checkpoint();
        let mut resumed = Simulation::restore(thin.build().unwrap().0, &bytes, true).unwrap();
        run_impacts(&mut whole, 40_000);
        run_impacts(&mut resumed, 40_000);
        layouts = whole.counts().layouts;
        assert_eq!(whole.balance(), resumed.balance());
        assert_eq!(hash(&mut whole), hash(&mut resumed), "{round}");
    }
    assert!(layouts > 0, "the balls were never put into another order");
}

/// Where pairs meet through several images, it must not matter from which of them the images are counted: that depends
/// on when a prediction was made.
#[test]
fn narrow_boxes_go_on_from_a_checkpoint() {
    let mut lcg = Lcg(79);
    for size in [1.0, 2.05, std::f64::consts::PI] {
        let balls = (0..3).map(|i| {
            let z = (f64::from(i) - 1.0) * size / 3.0;
            support::ball(i64::from(i), vector(0.1 * f64::from(i), -0.1, z), lcg.direction(), 0.105 * size, 1.0)
        });
        let narrow = Scene { domain: cube(Boundary::Periodic, size), ..scene(balls) };
        let mut whole = start(&narrow);
        for round in 0..100 {
            let bytes = whole.checkpoint();
            let mut resumed = Simulation::restore(narrow.build().unwrap().0, &bytes, true).unwrap();
            run_impacts(&mut whole, 25);
            run_impacts(&mut resumed, 25);
            assert_eq!(hash(&mut whole), hash(&mut resumed), "box of {size}, {round}");
        }
    }
}

#[test]
fn any_order_of_insertion() {
    let mut lcg = Lcg(77);
    for (name, scene, impacts, golden) in cases() {
        let (world, _) = scene.build().unwrap();
        for _ in 0..20 {
            let mut order: Vec<usize> = (0..world.len()).collect();
            for i in (1..order.len()).rev() {
                order.swap(i, (lcg.uniform() * (i + 1) as f64) as usize);
            }
            let mut balls = Balls::default();
            for &row in &order {
                let flight = &world.flights[row];
                let ball = support::ball(
                    world.id(row),
                    flight.position(),
                    flight.velocity(),
                    world.radii[row],
                    world.bodies[row].mass,
                );
                balls.push(ball, 3);
            }
            let shuffled = Scene { balls, fills: Vec::new(), ..scene.clone() };
            let mut simulation = start(&shuffled);
            run_impacts(&mut simulation, impacts);
            assert_eq!(hash(&mut simulation), golden, "{name}");
        }
    }
}

#[test]
fn goes_on_from_a_checkpoint() {
    let mut lcg = Lcg(78);
    for (name, scene, impacts, _) in cases() {
        for _ in 0..10 {
            let stop = (lcg.uniform() * impacts as f64) as u64;
            let mut whole = start(&scene);
            run_impacts(&mut whole, stop);
            whole.take_impacts();
            let bytes = whole.checkpoint();
            let mut resumed = Simulation::restore(scene.build().unwrap().0, &bytes, true).unwrap();
            assert_eq!(resumed.checkpoint(), bytes, "{name}, {stop}");
            run_impacts(&mut whole, impacts - stop);
            run_impacts(&mut resumed, impacts - stop);
            assert_eq!(whole.balance(), resumed.balance());
            assert_eq!(hash(&mut whole), hash(&mut resumed), "{name}, {stop}");
            // Torn or foreign bytes are refused.
            assert!(Simulation::restore(scene.build().unwrap().0, &bytes[..bytes.len() - 1], true).is_err());
            assert!(Simulation::restore(scene.build().unwrap().0, b"CAROM", true).is_err());
        }
    }
}
