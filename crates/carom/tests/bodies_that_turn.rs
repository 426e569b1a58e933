//! Bodies that turn, set in motion: what is conserved, that nothing overlaps, and that a run does not depend on how it is cut.

use std::sync::Arc;

use carom::DVec3;
use carom::scene::{Scene, SolidBody};
use carom::shape::{BodyGeometry, Compound, Part, Shape};
use carom::simulation::Simulation;
use carom::world::Boundary;
use glam::{DMat3, DQuat};

mod support;
use support::{Lcg, cube};

fn normal(random: &mut Lcg) -> f64 {
    (-2.0 * (1.0 - random.uniform()).ln()).sqrt() * (std::f64::consts::TAU * random.uniform()).cos()
}

fn gaussian(random: &mut Lcg) -> DVec3 {
    DVec3::new(normal(random), normal(random), normal(random))
}

fn random_orientation(random: &mut Lcg) -> [f64; 4] {
    let [w, x, y, z] = [0; 4].map(|_| normal(random));
    let length = (w * w + x * x + y * y + z * z).sqrt();
    [w / length, x / length, y / length, z / length]
}

/// `side`³ boxes of a size on a lattice, turned at random, of unit mass and kT = 1.
fn boxes(side: usize, size: DVec3, packing: f64, boundary: Boundary, seed: u64) -> Scene {
    let geometry = Arc::new(BodyGeometry::new(&Shape::cuboid(size).expect("sizes")).expect("a box"));
    let length = (geometry.volume * (side * side * side) as f64 / packing).cbrt();
    let spacing = length / side as f64;
    let mut random = Lcg(seed);
    let moments = geometry.gyration;
    let solids = (0..side * side * side)
        .map(|k| {
            let at = [k % side, k / side % side, k / side / side].map(|i| (i as f64 + 0.5) * spacing - 0.5 * length);
            let orientation =
                if spacing > 2.0 * geometry.radius { random_orientation(&mut random) } else { [1.0, 0.0, 0.0, 0.0] };
            let [w, x, y, z] = orientation;
            let axes = DMat3::from_quat(DQuat::from_xyzw(x, y, z, w));
            SolidBody {
                id: k as i64,
                geometry: geometry.clone(),
                position: DVec3::from_array(at),
                orientation,
                velocity: gaussian(&mut random),
                angular_velocity: axes
                    * (gaussian(&mut random) / DVec3::new(moments.x.sqrt(), moments.y.sqrt(), moments.z.sqrt())),
                mass: 1.0,
                inertia: None,
                material: 0,
                fixed: false,
            }
        })
        .collect();
    Scene { solids, domain: cube(boundary, length), ..Scene::default() }
}

/// How deep two boxes overlap, by the separating axes (Gottschalk 1996); negative: the gap along the best of them.
fn box_overlap(size: DVec3, relative: DVec3, [a, b]: [DMat3; 2]) -> f64 {
    let half = 0.5 * size;
    let axes = |m: &DMat3| [m.x_axis, m.y_axis, m.z_axis];
    let mut directions: Vec<DVec3> = axes(&a).into_iter().chain(axes(&b)).collect();
    for p in axes(&a) {
        for q in axes(&b) {
            let cross = p.cross(q);
            if cross.length() > 1e-6 {
                directions.push(cross.normalize());
            }
        }
    }
    let reach = |m: &DMat3, d: DVec3| (0..3).map(|k| half[k] * axes(m)[k].dot(d).abs()).sum::<f64>();
    directions.iter().map(|&d| reach(&a, d) + reach(&b, d) - relative.dot(d).abs()).fold(f64::INFINITY, f64::min)
}

/// The deepest overlap (m) of any two of these boxes, all pairs tried.
fn deepest_overlap(simulation: &Simulation, size: DVec3) -> f64 {
    let (world, now) = (simulation.world(), simulation.now());
    let periods = world.domain.periods();
    let axes: Vec<DMat3> = (0..world.len())
        .map(|row| {
            let [w, x, y, z] = world.orientation(row, now);
            DMat3::from_quat(DQuat::from_xyzw(x, y, z, w))
        })
        .collect();
    let mut deepest = f64::NEG_INFINITY;
    for i in 0..world.len() {
        for j in 0..i {
            let mut relative = world.position(i, now) - world.position(j, now);
            for axis in 0..3 {
                if periods[axis] > 0.0 {
                    relative[axis] -= (relative[axis] / periods[axis]).round() * periods[axis];
                }
            }
            if relative.length() < size.length() {
                deepest = deepest.max(box_overlap(size, relative, [axes[i], axes[j]]));
            }
        }
    }
    deepest
}

#[test]
fn cubes_in_a_periodic_box_keep_energy_and_momentum_and_never_overlap() {
    for (packing, boundary) in [(0.15, Boundary::Periodic), (0.4, Boundary::Periodic), (0.2, Boundary::Walls)] {
        let mut simulation =
            Simulation::new(boxes(5, DVec3::ONE, packing, boundary, 3).build().expect("a scene").0, false);
        for _ in 0..20 {
            let far = simulation.world().clock.at(1e300);
            simulation.run(far, 500, u64::MAX).expect("no collapse");
            // δ of a unit cube.
            assert!(deepest_overlap(&simulation, DVec3::ONE) <= 4e-12);
        }
        let balance = simulation.balance();
        println!(
            "{packing} {boundary:?}: {:?} energy {:e} momentum {:e}",
            simulation.counts(),
            balance.energy_error,
            balance.momentum_error
        );
        assert!(balance.energy_error.abs() <= 1e-13);
        assert!(balance.momentum_error <= 1e-13);
    }
}

#[test]
fn boxes_of_three_sizes_keep_energy_and_momentum_and_never_overlap() {
    let size = DVec3::new(1.0, 2.0, 3.0);
    let mut simulation =
        Simulation::new(boxes(4, size, 0.08, Boundary::Periodic, 5).build().expect("a scene").0, false);
    for _ in 0..10 {
        let far = simulation.world().clock.at(1e300);
        simulation.run(far, 500, u64::MAX).expect("no collapse");
        assert!(deepest_overlap(&simulation, size) <= 1e-11);
    }
    let balance = simulation.balance();
    println!("{:?} energy {:e} momentum {:e}", simulation.counts(), balance.energy_error, balance.momentum_error);
    assert!(balance.energy_error.abs() <= 1e-12);
    assert!(balance.momentum_error <= 1e-12);
}

#[test]
fn a_run_that_is_resumed_goes_on_bit_for_bit() {
    let scene = boxes(4, DVec3::new(1.0, 1.5, 0.7), 0.1, Boundary::Periodic, 7);
    let world = || scene.build().expect("a scene").0;
    let mut whole = Simulation::new(world(), false);
    let far = whole.world().clock.at(1e300);
    whole.run(far, 1000, u64::MAX).expect("no collapse");
    let saved = whole.checkpoint();
    let mut resumed = Simulation::restore(world(), &saved, false).expect("a checkpoint");
    whole.run(far, 1000, u64::MAX).expect("no collapse");
    resumed.run(far, 1000, u64::MAX).expect("no collapse");
    let state = |simulation: &Simulation| {
        let world = simulation.world();
        (0..world.len())
            .map(|rank| {
                let row = world.row(rank);
                (world.flights[row], world.turning_body(row).expect("a box").angular_velocity)
            })
            .collect::<Vec<_>>()
    };
    assert_eq!(state(&whole), state(&resumed));
}

/// One cube over a floor, level, spinning about the vertical.
fn cube_over_a_floor(height: f64, velocity: DVec3, spin: f64, restitution: f64, gravity: f64) -> Scene {
    let geometry = Arc::new(BodyGeometry::new(&Shape::cuboid(DVec3::ONE).expect("sizes")).expect("a box"));
    Scene {
        gravity: DVec3::new(0.0, 0.0, -gravity),
        restitution,
        planes: vec![support::plane(100, DVec3::Z, 0.0)],
        solids: vec![SolidBody {
            id: 0,
            geometry,
            position: DVec3::new(0.0, 0.0, height + 0.5),
            orientation: [0.8, 0.0, 0.0, 0.6],
            velocity,
            angular_velocity: DVec3::new(0.0, 0.0, spin),
            mass: 2.0,
            inertia: None,
            material: 0,
            fixed: false,
        }],
        ..Scene::default()
    }
}

#[test]
fn a_cube_lands_flat_and_bounces_straight_up_to_the_last_bit() {
    for restitution in [1.0, 0.7, 0.25] {
        for spin in [0.0, 3.0, -41.5] {
            let scene = cube_over_a_floor(1.0, DVec3::new(0.3, -0.2, -2.0), spin, restitution, 0.0);
            let mut simulation = Simulation::new(scene.build().expect("a scene").0, false);
            let far = simulation.world().clock.at(10.0);
            let impact = simulation.step(far).expect("no collapse").expect("it falls");
            // 1 m at 2 m/s; δ of a cube is 1e-12, at that speed half of it in time.
            assert!((impact.time.to_pair().0 - 0.5).abs() <= 1e-12);
            assert_eq!(impact.kind.name(), "face-plane");
            let world = simulation.world();
            assert_eq!(world.flights[0].velocity(), DVec3::new(0.3, -0.2, 2.0 * restitution));
            assert_eq!(world.turning_body(0).expect("a cube").angular_velocity, DVec3::new(0.0, 0.0, spin));
            assert_eq!(simulation.step(far).expect("no collapse"), None);
        }
    }
}

#[test]
fn a_cube_dropped_flat_bounces_to_its_height_a_thousand_times() {
    let scene = cube_over_a_floor(1.0, DVec3::ZERO, 5.0, 1.0, 9.81);
    let mut simulation = Simulation::new(scene.build().expect("a scene").0, false);
    let far = simulation.world().clock.at(1e6);
    for k in 0..1000 {
        let impact = simulation.step(far).expect("no collapse").expect("it falls");
        let exact = f64::from(2 * k + 1) * (2.0_f64 / 9.81).sqrt();
        // Each bounce is within δ/v = 2.3e-13 s of its instant, early, and the early ones push the next.
        assert!((impact.time.to_pair().0 - exact).abs() <= 1e-12 * f64::from(k + 1), "bounce {k}");
        assert_eq!(simulation.world().turning_body(0).expect("a cube").angular_velocity, DVec3::new(0.0, 0.0, 5.0));
    }
    assert!(simulation.balance().energy_error.abs() <= 1e-11);
}

/// A gas of boxes and balls between walls, some of the boxes fixed and one of them turning at a constant rate.
#[test]
fn balls_and_boxes_between_walls_keep_the_books() {
    let mut scene = boxes(4, DVec3::new(0.6, 0.8, 1.0), 0.05, Boundary::Walls, 9);
    let length = scene.domain.size.x;
    let spacing = length / 4.0;
    for solid in scene.solids.iter_mut().take(3) {
        solid.fixed = true;
        solid.velocity = DVec3::ZERO;
        solid.angular_velocity = DVec3::ZERO;
    }
    scene.solids[1].angular_velocity = DVec3::new(0.4, 0.3, -0.5);
    let mut random = Lcg(4);
    for k in 0..27 {
        let at = [k % 3, k / 3 % 3, k / 9].map(|i| (i as f64 + 1.0) * spacing - 0.5 * length);
        let ball = support::ball(1000 + k as i64, DVec3::from_array(at), gaussian(&mut random), 0.15, 0.5);
        scene.balls.push(ball, 3);
    }
    for (gravity, restitution) in
        [(DVec3::ZERO, 1.0), (DVec3::new(0.0, 0.0, -0.5), 1.0), (DVec3::new(0.1, 0.0, -0.5), 0.95)]
    {
        let scene = Scene { gravity, restitution, ..scene.clone() };
        let mut simulation = Simulation::new(scene.build().expect("a scene").0, true);
        let far = simulation.world().clock.at(1e300);
        simulation.run(far, 4000, u64::MAX).expect("no collapse");
        let balance = simulation.balance();
        println!("{gravity} {restitution}: {:?} {balance:?}", simulation.counts());
        assert!(balance.energy_error.abs() <= 1e-12);
        assert!(balance.momentum_error <= 1e-12);
        assert!(balance.angular_momentum_error.expect("no periods") <= 1e-12);
        let kinds = simulation.take_impacts().kind;
        let seen = |name: &str| kinds.iter().any(|&kind| carom::event::Kind::ALL[kind as usize].name() == name);
        for name in ["ball-ball", "ball-plane", "ball-face", "vertex-face", "edge-edge", "vertex-plane"] {
            assert!(seen(name), "no {name} impact");
        }
    }
}

/// Two dumb-bells of balls and a capsule, and tables of a board and four legs.
#[test]
fn compounds_keep_the_books_and_a_table_lands_on_four_legs() {
    let part = |shape: Shape, position: DVec3| Part { shape, position, orientation: [1.0, 0.0, 0.0, 0.0] };
    let ball = |x: f64| part(Shape::Ball { radius: 0.4 }, DVec3::new(x, 0.0, 0.0));
    let rod = Part {
        orientation: [0.5_f64.sqrt(), 0.0, 0.5_f64.sqrt(), 0.0],
        ..part(Shape::Capsule { radius: 0.1, half_length: 0.6 }, DVec3::ZERO)
    };
    let leg = |x: f64, y: f64| part(Shape::cuboid(DVec3::new(0.1, 0.1, 0.5)).expect("sizes"), DVec3::new(x, y, -0.25));
    let board = part(Shape::cuboid(DVec3::new(1.0, 1.0, 0.1)).expect("sizes"), DVec3::new(0.0, 0.0, 0.05));
    let geometry = |parts: Vec<Part>| {
        Arc::new(BodyGeometry::new(&Compound::new(parts).expect("parts").into()).expect("a compound"))
    };
    let dumb_bell = geometry(vec![ball(-0.8), rod, ball(0.8)]);
    let table = geometry(vec![board, leg(0.4, 0.4), leg(-0.4, 0.4), leg(-0.4, -0.4), leg(0.4, -0.4)]);
    let mut scene = cube_over_a_floor(1.0, DVec3::new(0.0, 0.0, -1.0), 2.0, 1.0, 0.0);
    scene.solids[0].geometry = table.clone();
    let mut simulation = Simulation::new(scene.build().expect("a scene").0, false);
    let far = simulation.world().clock.at(100.0);
    let impact = simulation.step(far).expect("no collapse").expect("it falls");
    assert_eq!(impact.kind.name(), "face-plane");
    assert_eq!(simulation.world().flights[0].velocity(), DVec3::Z);
    assert_eq!(simulation.world().turning_body(0).expect("a table").angular_velocity, DVec3::new(0.0, 0.0, 2.0));
    let mut scene = boxes(3, DVec3::splat(1.6), 0.1, Boundary::Walls, 17);
    for (k, solid) in scene.solids.iter_mut().enumerate() {
        solid.geometry = if k % 2 == 0 { dumb_bell.clone() } else { table.clone() };
    }
    let mut simulation = Simulation::new(scene.build().expect("a scene").0, false);
    let far = simulation.world().clock.at(1e300);
    simulation.run(far, 3000, u64::MAX).expect("no collapse");
    let balance = simulation.balance();
    println!("{:?} {balance:?}", simulation.counts());
    assert!(balance.energy_error.abs() <= 1e-12);
    assert!(balance.momentum_error <= 1e-12);
    assert!(balance.angular_momentum_error.expect("no periods") <= 1e-12);
}

#[test]
fn a_box_in_a_box_is_an_error_that_says_how_deep() {
    let mut scene = boxes(2, DVec3::ONE, 0.1, Boundary::Periodic, 3);
    scene.solids[1].position = scene.solids[0].position + DVec3::new(0.9, 0.0, 0.0);
    scene.solids[0].orientation = [1.0, 0.0, 0.0, 0.0];
    scene.solids[1].orientation = [1.0, 0.0, 0.0, 0.0];
    let error = scene.build().expect_err("they overlap").to_string();
    assert!(error.contains("body 0: position") && error.contains("overlaps body 1 by 9.9999999999"), "{error}");
}

#[test]
fn a_periodic_box_too_small_or_too_long_for_what_turns_is_an_error() {
    let mut scene = boxes(1, DVec3::new(1.0, 2.0, 3.0), 0.1, Boundary::Periodic, 3);
    scene.domain.size = DVec3::splat(3.8);
    let error = scene.build().expect_err("too small").to_string();
    assert!(error.contains("size = [3.8, 3.8, 3.8]: is too small along x for bodies that turn"), "{error}");
    // The sphere around it has a radius of √14 / 2 m; it may go (0.49 × 8 - √14 / 2) / 4 m, and 2^28 times that is 1.37e8 m.
    scene.domain.size = DVec3::new(8.0, 1.3e8, 8.0);
    scene.build().expect("long, but not too long");
    scene.domain.size = DVec3::new(8.0, 1.4e8, 8.0);
    let error = scene.build().expect_err("too long").to_string();
    assert!(error.contains("size = [8, 140000000, 8]: has too long a side beside the shortest"), "{error}");
}
