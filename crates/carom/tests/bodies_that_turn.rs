//! Bodies that turn, set in motion: what is conserved, that nothing overlaps, and that a run does not depend on how it is cut.

use std::sync::Arc;

use carom::DVec3;
use carom::scene::{Scene, SolidBody};
use carom::shape::{BodyGeometry, Shape};
use carom::simulation::Simulation;
use carom::world::{Boundary, Domain};
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

#[test]
fn a_box_on_a_box_is_an_error_that_says_how_deep() {
    let _ = Domain::OPEN;
}
