//! Contacts of several pairs at one instant, by reflections: theory's numbers, symmetry, and the books.

use std::sync::Arc;

use carom::DVec3;
use carom::scene::{MeshBody, Scene, Simultaneous, SolidBody};
use carom::shape::{Shape, TriangleMesh};
use carom::simulation::Simulation;
use carom::world::Boundary;

mod support;
use support::{Lcg, ball, cube};

fn scene(restitution: f64) -> Scene {
    Scene { restitution, simultaneous: Simultaneous::Reflections, ..Scene::default() }
}

/// Unit balls in a row along x that touch, those before `still` flying at 1 m/s from 1 m away.
fn cradle(count: i64, still: i64, restitution: f64) -> Scene {
    let mut scene = scene(restitution);
    for id in 0..count {
        let flying = id < still;
        let x = 2.0 * id as f64 - if flying { 1.0 } else { 0.0 };
        let velocity = if flying { DVec3::X } else { DVec3::ZERO };
        scene.balls.push(ball(id, DVec3::new(x, 0.0, 0.0), velocity, 1.0, 1.0), 3);
    }
    scene
}

fn run(scene: &Scene, seconds: f64) -> Simulation {
    let mut simulation = Simulation::new(scene.build().expect("a scene").0, true);
    let end = simulation.world().clock.at(seconds);
    simulation.run(end, u64::MAX, u64::MAX).expect("no collapse");
    simulation
}

fn velocities(simulation: &Simulation) -> Vec<DVec3> {
    let world = simulation.world();
    (0..world.len()).map(|rank| world.velocity(world.row(rank), simulation.now())).collect()
}

#[test]
fn a_cradle_hands_on_what_comes_in() {
    for (count, flying) in [(2, 1), (3, 1), (5, 1), (5, 2), (5, 3), (40, 1), (40, 7)] {
        let found = velocities(&run(&cradle(count, flying, 1.0), 3.0));
        for (id, velocity) in found.iter().enumerate() {
            let leaves = id as i64 >= count - flying;
            // Rounding of as many reflections as there are balls.
            let expected = if leaves { DVec3::X } else { DVec3::ZERO };
            assert!((*velocity - expected).length() <= 1e-15 * count as f64, "{id} of {count}: {velocity}");
        }
    }
}

#[test]
fn with_restitution_it_lies_between_the_plastic_blow_and_the_elastic_one() {
    // (1 − e) (1/3, 1/3, 1/3) + e (0, 0, 1); the first two touch on, and no contact lasts so long as to end the run.
    for e in [0.0, 0.25, 0.5, 0.9] {
        let simulation = &mut run(&cradle(3, 1, e), 50.0);
        let found: Vec<f64> = velocities(simulation).iter().map(|velocity| velocity.x).collect();
        let shared = (1.0 - e) / 3.0;
        for (found, expected) in found.iter().zip([shared, shared, shared + e]) {
            assert!((found - expected).abs() <= 1e-15, "{e}: {found} {expected}");
        }
        let kept = 1.5 * shared * shared + shared * e + 0.5 * e * e;
        let balance = simulation.balance();
        assert!((balance.dissipated - (0.5 - kept)).abs() <= 1e-15);
        assert!(balance.energy_error.abs() <= 1e-15);
    }
}

/// A unit ball that flies along x into two that touch each other, at 30 degrees to either side (Bernoulli).
fn bernoulli(reversed: bool) -> Scene {
    let mut scene = scene(1.0);
    let root = 3.0_f64.sqrt();
    let mut balls = vec![
        ball(0, DVec3::new(-1.0, 0.0, 0.0), DVec3::X, 1.0, 1.0),
        ball(1, DVec3::new(root, 1.0, 0.0), DVec3::ZERO, 1.0, 1.0),
        ball(2, DVec3::new(root, -1.0, 0.0), DVec3::ZERO, 1.0, 1.0),
    ];
    if reversed {
        balls.reverse();
    }
    balls.into_iter().for_each(|ball| scene.balls.push(ball, 3));
    scene
}

#[test]
fn a_ball_that_hits_two_is_symmetric() {
    let found = velocities(&run(&bernoulli(false), 2.0));
    let expected = [(-0.2, 0.0), (0.6, 0.2 * 3.0_f64.sqrt()), (0.6, -0.2 * 3.0_f64.sqrt())];
    for (found, (x, y)) in found.iter().zip(expected) {
        // Normals are rounded, and the place of the impact by 1e-16 of 1 m.
        assert!((*found - DVec3::new(x, y, 0.0)).length() <= 2e-15, "{found}");
    }
    // The order of the file is no part of the physics; nor, here, is that of the ids.
    assert_eq!(found, velocities(&run(&bernoulli(true), 2.0)));
    // Pair by pair it is neither.
    let pairwise = velocities(&run(&Scene { simultaneous: Simultaneous::Pairwise, ..bernoulli(false) }, 2.0));
    assert!((pairwise[0] - DVec3::new(-0.125, -0.216_506_350_946_109_66, 0.0)).length() <= 1e-14, "{pairwise:?}");
}

#[test]
fn impacts_of_one_instant_are_told_one_by_one() {
    let mut simulation = Simulation::new(bernoulli(false).build().expect("a scene").0, true);
    let end = simulation.world().clock.at(2.0);
    let mut step = || simulation.step(end).expect("no collapse");
    let (first, second) = (step().expect("one"), step().expect("the other"));
    assert_eq!([(first.a, first.b), (second.a, second.b)], [(0, 1), (0, 2)]);
    assert_eq!(first.time, second.time);
    // 2 √3/5 each, along the normals.
    for impact in [first, second] {
        assert!((impact.impulse - 0.4 * 3.0_f64.sqrt()).abs() <= 2e-15, "{}", impact.impulse);
    }
    assert!((first.energy_lost + second.energy_lost).abs() <= 1e-15);
    assert_eq!(step(), None);
    assert_eq!(simulation.counts().impacts(), 2);
    assert_eq!(simulation.take_impacts().len(), 2);
}

/// m₂ on m₁ = 3 m₂, e = 1, dropped on a floor at z = 0: the lower one stops dead, the upper one rises at twice the speed.
fn assert_stack_is_thrown(mut scene: Scene) {
    scene.balls.push(ball(1, DVec3::new(0.0, 0.0, 2.0), -DVec3::Z, 1.0, 3.0), 3);
    scene.balls.push(ball(2, DVec3::new(0.0, 0.0, 3.5), -DVec3::Z, 0.5, 1.0), 3);
    let mut simulation = run(&scene, 2.0);
    let found = velocities(&simulation);
    assert!(found[0].length() <= 1e-15 && (found[1] - 2.0 * DVec3::Z).length() <= 1e-15, "{found:?}");
    let balance = simulation.balance();
    assert!(balance.energy_error.abs() <= 1e-15 && balance.momentum_error <= 1e-15, "{balance:?}");
}

#[test]
fn a_stack_dropped_on_a_floor_throws_its_top_ball_as_theory_says() {
    let mut scene = scene(1.0);
    scene.planes.push(support::plane(9, DVec3::Z, 0.0));
    assert_stack_is_thrown(scene);
}

/// The square |x|, |y| ≤ 4 at z = 0, of two triangles.
fn floor_of_triangles() -> MeshBody {
    let corners = [[-4.0, -4.0], [4.0, -4.0], [4.0, 4.0], [-4.0, 4.0]].map(|[x, y]| DVec3::new(x, y, 0.0));
    MeshBody {
        id: 9,
        mesh: Arc::new(TriangleMesh::new(&corners, &[[0, 1, 2], [0, 2, 3]]).expect("a square")),
        position: DVec3::ZERO,
        orientation: [1.0, 0.0, 0.0, 0.0],
        velocity: DVec3::ZERO,
        angular_velocity: DVec3::ZERO,
        material: 0,
    }
}

#[test]
fn a_floor_of_triangles_throws_it_as_well() {
    // The stack stands on the seam.
    let mut scene = scene(1.0);
    scene.meshes.push(floor_of_triangles());
    assert_stack_is_thrown(scene);
}

#[test]
fn a_ball_dropped_on_two_that_lie_on_a_floor_is_symmetric() {
    for on_triangles in [false, true] {
        let mut scene = scene(1.0);
        if on_triangles {
            scene.meshes.push(floor_of_triangles());
        } else {
            scene.planes.push(support::plane(9, DVec3::Z, 0.0));
        }
        scene.balls.push(ball(1, DVec3::new(-1.0, 0.0, 1.0), DVec3::ZERO, 1.0, 1.0), 3);
        scene.balls.push(ball(2, DVec3::new(1.0, 0.0, 1.0), DVec3::ZERO, 1.0, 1.0), 3);
        scene.balls.push(ball(3, DVec3::new(0.0, 0.0, 4.0), -DVec3::Z, 1.0, 1.0), 3);
        let mut simulation = run(&scene, 3.0);
        let [left, right, top] = velocities(&simulation)[..] else { panic!("three balls") };
        // The mirror plane x = 0 is that of the start; pair by pair one side would come before the other.
        assert!((left.x + right.x).abs() <= 4e-15 && top.x.abs() <= 4e-15, "{on_triangles}: {left} {right} {top}");
        assert!(
            (left.z - right.z).abs() <= 4e-15 && left.y == 0.0 && top.z > 0.0,
            "{on_triangles}: {left} {right} {top}"
        );
        let balance = simulation.balance();
        assert!(balance.energy_error.abs() <= 1e-14 && balance.momentum_error <= 1e-14, "{balance:?}");
    }
}

fn solid(id: i64, shape: Shape, position: DVec3, velocity: DVec3) -> SolidBody {
    SolidBody { velocity, ..support::solid(id, &shape, position) }
}

#[test]
fn a_beam_that_lands_on_two_posts_at_once_stays_level() {
    let cuboid = |x: f64, y: f64, z: f64| Shape::cuboid(DVec3::new(x, y, z)).expect("sizes");
    for e in [1.0, 0.5, 0.0] {
        let mut scene = scene(e);
        scene.solids.push(solid(0, cuboid(4.0, 0.5, 0.5), DVec3::new(0.0, 0.0, 1.75), -DVec3::Z));
        for (id, x) in [(1, -1.5), (2, 1.5)] {
            scene.solids.push(solid(id, cuboid(0.5, 0.5, 1.0), DVec3::new(x, 0.0, 0.0), DVec3::ZERO));
        }
        let mut simulation = run(&scene, 1.5);
        let found = velocities(&simulation);
        // One of mass 1 against two: v = (1 − e·2)/3 downwards, and (1 + e)/3.
        let (beam, post) = ((2.0 * e - 1.0) / 3.0, -(1.0 + e) / 3.0);
        for (found, z) in found.iter().zip([beam, post, post]) {
            assert!((*found - DVec3::new(0.0, 0.0, z)).length() <= 1e-15, "{e}: {found}");
        }
        for row in 0..3 {
            let spin = simulation.world().angular_velocity(row, simulation.now());
            assert!(spin.length() <= 1e-15, "{e}: {spin}");
        }
        let counts = simulation.counts();
        assert_eq!((counts.ball_ball, counts.transversal + counts.within_tolerance), (2, 2));
        assert!(simulation.balance().energy_error.abs() <= 1e-15);
    }
}

#[test]
fn a_crystal_that_is_struck_keeps_the_books_and_its_symmetry() {
    // 27 touching balls, struck in the middle of a face by one that flies; walls around. Mirrored in y and z.
    for e in [1.0, 0.8] {
        let mut scene = scene(e);
        scene.domain = cube(Boundary::Walls, 12.0);
        for k in 0..27 {
            let at = [k % 3, k / 3 % 3, k / 9].map(|i| (i - 1) as f64);
            scene.balls.push(ball(k, DVec3::from_array(at), DVec3::ZERO, 0.5, 1.0), 3);
        }
        scene.balls.push(ball(99, DVec3::new(-3.0, 0.0, 0.0), DVec3::X, 0.5, 2.0), 3);
        let mut simulation = run(&scene, 2.5);
        let balance = simulation.balance();
        println!("{:?} {balance:?}", simulation.counts());
        assert!(simulation.counts().impacts() >= 3);
        assert!(balance.energy_error.abs() <= 1e-14 && balance.momentum_error <= 1e-14);
        assert!(balance.angular_momentum_error.expect("walls") <= 1e-14);
        let found = velocities(&simulation);
        let mirror = |k: usize| (k % 3) + 3 * (2 - k / 3 % 3) + 9 * (2 - k / 9);
        for k in 0..27 {
            let (one, other) = (found[k], found[mirror(k)]);
            assert!((one - DVec3::new(other.x, -other.y, -other.z)).length() <= 1e-13, "{k}: {one} {other}");
        }
    }
}

#[test]
fn where_no_two_pairs_meet_at_once_nothing_changes() {
    let gas = |simultaneous: Simultaneous| {
        let mut random = Lcg(3);
        let mut scene =
            Scene { restitution: 0.9, simultaneous, domain: cube(Boundary::Walls, 10.0), ..Scene::default() };
        for k in 0..125 {
            let at = [k % 5, k / 5 % 5, k / 25].map(|i| 2.0 * (i - 2) as f64);
            let velocity = DVec3::new(random.uniform() - 0.5, random.uniform() - 0.5, random.uniform() - 0.5);
            scene.balls.push(ball(k, DVec3::from_array(at), velocity, 0.5, 1.0), 3);
        }
        let mut simulation = run(&scene, 100.0);
        (simulation.take_impacts(), velocities(&simulation))
    };
    let (pairwise, together) = (gas(Simultaneous::Pairwise), gas(Simultaneous::Reflections));
    assert!(pairwise.0.len() > 500, "{}", pairwise.0.len());
    assert_eq!(pairwise, together);
}
