//! Searches for impacts that take more steps than one search may: they go on where they were cut off, and nothing is missed.

use std::sync::Arc;

use carom::DVec3;
use carom::scene::{Scene, SolidBody};
use carom::shape::{BodyGeometry, Compound, Part, Shape};
use carom::simulation::Simulation;

mod support;

/// A dumb-bell that spins about its own axis, x, and a ball beside the ball at its end, `gap` (m) away and coming nearer at
/// `approach` (m/s). Its surface there stands still, but that is not seen from how its parts move.
fn spinning_dumb_bell(spin: f64, gap: f64, approach: f64) -> Scene {
    let end = |x: f64| Part {
        shape: Shape::Ball { radius: 0.4 },
        position: DVec3::new(x, 0.0, 0.0),
        orientation: [1.0, 0.0, 0.0, 0.0],
    };
    let compound = Compound::new(vec![end(-0.8), end(0.8)]).expect("parts");
    let mut scene = Scene {
        solids: vec![SolidBody {
            id: 7,
            geometry: Arc::new(BodyGeometry::new(&compound.into()).expect("a compound")),
            position: DVec3::ZERO,
            orientation: [1.0, 0.0, 0.0, 0.0],
            velocity: DVec3::ZERO,
            angular_velocity: DVec3::new(spin, 0.0, 0.0),
            mass: 1.0,
            inertia: None,
            material: 0,
            fixed: true,
        }],
        ..Scene::default()
    };
    let beside = DVec3::new(0.8, 0.9 + gap, 0.0);
    scene.balls.push(support::ball(3, beside, DVec3::new(0.0, -approach, 0.0), 0.5, 1.0), 3);
    scene
}

fn simulation(scene: &Scene) -> Simulation {
    Simulation::new(scene.build().expect("a scene").0, true)
}

#[test]
fn an_impact_beyond_the_steps_of_one_search_is_found() {
    // It comes 1e-6 m nearer in 1 s; steps go with the root of the gap, some 5e-6 s at most: more than ten searches.
    let scene = spinning_dumb_bell(200.0, 1e-6, 1e-6);
    let mut simulation = simulation(&scene);
    let far = simulation.world().clock.at(10.0);
    let impact = simulation.step(far).expect("no collapse").expect("they meet");
    println!("{:?} {:?}", impact.time, simulation.counts());
    assert_eq!((impact.a, impact.b), (3, 7));
    // δ = 1e-12 of 1.2 m, early by as much time as it takes at this speed; and the gap of places given to 1e-16.
    assert!((impact.time.to_pair().0 - 1.0).abs() <= 2e-6, "{:?}", impact.time);
    assert!(simulation.counts().continued >= 2);
    assert_eq!(simulation.counts().transversal + simulation.counts().within_tolerance, 1);
    assert_eq!(simulation.step(far).expect("no collapse"), None);
}

/// What a run gives, to the last bit, whatever it was asked on the way.
fn outcome(simulation: &mut Simulation) -> (u64, Vec<f64>, Vec<f64>, DVec3) {
    let table = simulation.take_impacts();
    let world = simulation.world();
    (simulation.counts().continued, table.time, table.time_low, world.flights[world.row(0)].velocity())
}

#[test]
fn searches_that_go_on_do_not_depend_on_when_somebody_looks() {
    let scene = spinning_dumb_bell(200.0, 1e-6, 1e-6);
    let mut whole = simulation(&scene);
    let at = |seconds: f64| whole.world().clock.at(seconds);
    let (end, pieces) = (at(2.0), [0.001, 0.1, 0.3, 0.5, 0.77, 0.999_999].map(at));
    whole.run(end, u64::MAX, u64::MAX).expect("no collapse");
    let mut cut = simulation(&scene);
    for until in pieces {
        cut.run(until, u64::MAX, u64::MAX).expect("no collapse");
        // And what a checkpoint leaves out is found again.
        let bytes = cut.checkpoint();
        cut = Simulation::restore(scene.build().expect("a scene").0, &bytes, true).expect("a checkpoint");
    }
    cut.run(end, u64::MAX, u64::MAX).expect("no collapse");
    let (expected, found) = (outcome(&mut whole), outcome(&mut cut));
    assert!(expected.0 > 0 && !expected.1.is_empty());
    assert_eq!(expected, found);
}

#[test]
fn bodies_that_rest_beside_one_that_spins_are_watched_for_as_long_as_the_run_lasts() {
    let scene = spinning_dumb_bell(200.0, 0.0, 0.0);
    let mut simulation = simulation(&scene);
    let end = simulation.world().clock.at(0.01);
    simulation.run(end, u64::MAX, u64::MAX).expect("no collapse");
    println!("{:?}", simulation.counts());
    assert_eq!(simulation.counts().impacts(), 0);
    assert!(simulation.counts().continued >= 1);
    assert_eq!(simulation.now(), end);
}
