//! Where impacts accumulate or bodies come to rest the run ends with an error, in no time, and never otherwise.
#![allow(missing_docs, clippy::unwrap_used)]

mod support;

use std::time::Instant;

use carom::DVec3;
use carom::error::{Cause, CollapseError};
use carom::scene::{Placement, Scene, SolidBody};
use carom::shape::Shape;
use carom::simulation::Simulation;
use carom::tolerance;
use carom::world::{Boundary, Domain};
use glam::DQuat;
use support::{ball, cube, fixed, gas, plane, positions, run_until, scene, solid, start, vector, velocities};

fn bouncing(restitution: f64) -> Scene {
    let mut scene = scene([ball(0, vector(0.0, 0.0, 1.5), DVec3::ZERO, 0.5, 1.0)]);
    scene.planes.push(plane(1, DVec3::Z, 0.0));
    scene.gravity = vector(0.0, 0.0, -9.81);
    scene.restitution = restitution;
    scene
}

/// Runs into the collapse, which must come within a second of wall time.
fn collapse(scene: &Scene) -> (Simulation, CollapseError) {
    let mut simulation = start(scene);
    let begin = Instant::now();
    let far = simulation.world().clock.at(1e6);
    let error = simulation.run(far, u64::MAX, u64::MAX).unwrap_err();
    // A promise to the user, not a measure of speed: a hang would be endless.
    assert!(begin.elapsed().as_secs_f64() < 1.0);
    // Whoever goes on regardless is told again, and nothing falls through anything.
    assert_eq!(simulation.run(far, u64::MAX, u64::MAX).unwrap_err().cause, error.cause);
    assert!(support::deepest_overlap(&simulation) < 1e-12);
    for x in positions(&simulation).into_iter().chain(velocities(&simulation)) {
        assert!(x.is_finite());
    }
    println!("{error}");
    (simulation, error)
}

#[test]
fn bouncing_ball_runs_down() {
    let (mut simulation, error) = collapse(&bouncing(0.8));
    assert_eq!(error.bodies, [0, 1]);
    // T = √(2h/g) (1 + e)/(1 - e); what is left is the window, 5e-10 s.
    assert!((error.time - 4.063712768871579).abs() < 1e-9, "{}", error.time);
    // All but the last traces of its energy are booked as lost: m g h.
    let balance = simulation.balance();
    assert!((balance.dissipated - 9.81).abs() < 1e-12);
    assert!(balance.energy_error.abs() < 1e-13);
    assert!(support::deepest_overlap(&simulation) < 1e-12);
}

#[test]
fn without_bounce_it_rests() {
    let (_, error) = collapse(&bouncing(0.0));
    assert_eq!((error.cause, error.bodies.as_slice()), (Cause::Resting, [0, 1].as_slice()));
    assert!((error.time - (2.0_f64 / 9.81).sqrt()).abs() < 1e-12);
}

#[test]
fn resting_from_the_start() {
    let mut scene = bouncing(1.0);
    scene.balls.positions[0] = vector(0.0, 0.0, 0.5);
    let (_, error) = collapse(&scene);
    assert_eq!((error.cause, error.time), (Cause::Resting, 0.0));
    // On the top of a fixed ball too.
    let mut scene = support::scene([
        ball(0, vector(0.0, 0.0, 1.0), DVec3::ZERO, 0.5, 1.0),
        fixed(1, DVec3::ZERO, DVec3::ZERO, 0.5),
    ]);
    scene.gravity = vector(0.0, 0.0, -9.81);
    assert_eq!(collapse(&scene).1.cause, Cause::Resting);
}

/// Two balls thrown at a wall collapse there for e < 3 - 2√2 = 0.1716 and fly back for more.
#[test]
fn balls_thrown_at_a_wall() {
    for (restitution, collapses) in [(0.1, true), (0.16, true), (0.2, false), (0.6, false)] {
        let mut row =
            scene((0..2).map(|i| ball(i, vector(1.0 + 1.5 * i as f64, 0.0, 0.0), vector(-1.0, 0.0, 0.0), 0.5, 1.0)));
        row.planes.push(plane(9, DVec3::X, 0.0));
        row.restitution = restitution;
        if collapses {
            assert_eq!(collapse(&row).1.cause, Cause::Accumulation);
        } else {
            let mut simulation = start(&row);
            run_until(&mut simulation, 100.0);
            assert!(simulation.counts().impacts() < 20);
        }
    }
}

/// A ball that bounces along: its sideways speed does not hide the accumulation.
#[test]
fn bouncing_along_runs_down() {
    let mut scene = bouncing(0.5);
    scene.balls.velocities[0] = vector(3.0, 0.0, 0.0);
    let (_, error) = collapse(&scene);
    assert_eq!(error.cause, Cause::Accumulation);
    let expected = (2.0_f64 / 9.81).sqrt() * 3.0;
    assert!((error.time - expected).abs() < 1e-9, "{}", error.time);
}

/// Three balls in free space, the outer ones pressing on the middle one, collapse for e < 7 - 4√3 = 0.0718.
#[test]
fn three_balls_in_free_space() {
    let mut row =
        scene((0..3).map(|i| ball(i, vector(1.5 * i as f64, 0.0, 0.0), vector(1.0 - i as f64, 0.0, 0.0), 0.5, 1.0)));
    row.balls.positions[1].x = 1.4;
    row.restitution = 0.05;
    let (_, error) = collapse(&row);
    assert_eq!(error.cause, Cause::Accumulation);
    row.restitution = 0.1;
    let mut simulation = start(&row);
    run_until(&mut simulation, 1000.0);
    assert!(simulation.counts().impacts() < 100);
}

/// e = 0 sticks two balls together without any collapse, and a touching row settles to its common speed.
#[test]
fn perfectly_inelastic_pairs_are_no_collapse() {
    let mut pair = scene([
        ball(0, vector(-2.0, 0.1, 0.0), vector(1.0, 0.0, 0.0), 0.5, 1.0),
        ball(1, vector(2.0, 0.0, 0.3), vector(-0.3, 0.2, 0.0), 0.5, 3.0),
    ]);
    pair.restitution = 0.0;
    let mut simulation = start(&pair);
    run_until(&mut simulation, 1000.0);
    // The tangential motion is left: they touch once and slide apart.
    assert_eq!(simulation.counts().impacts(), 1);
    let impact = simulation.take_impacts();
    assert!(impact.separation_speed[0].abs() < 1e-15);
    assert!(support::deepest_overlap(&simulation) <= 1e-12);
    let mut row = scene((0..5).map(|i| {
        let v = if i == 0 { 1.0 } else { 0.0 };
        ball(i, vector(i as f64, 0.0, 0.0), vector(v, 0.0, 0.0), 0.5, 1.0)
    }));
    row.restitution = 0.0;
    let mut simulation = start(&row);
    run_until(&mut simulation, 1.0);
    for v in velocities(&simulation) {
        // Each pass leaves a fraction; the last ones are ulps.
        assert!((v.x - 0.2).abs() < 1e-14, "{v}");
    }
}

/// Elastic impacts may follow each other within 1e-12 s; that is no collapse.
#[test]
fn elastic_impacts_are_never_a_collapse() {
    let mut squeezed = scene([
        ball(0, vector(1.0, 0.0, 0.0), vector(0.0, 0.0, 0.0), 0.5, 1.0),
        ball(1, vector(2.5, 0.0, 0.0), vector(-1.0, 0.0, 0.0), 0.5, 1e12),
    ]);
    squeezed.planes.push(plane(2, DVec3::X, 0.0));
    let mut simulation = start(&squeezed);
    run_until(&mut simulation, 10.0);
    let table = simulation.take_impacts();
    let shortest = table.time.windows(2).map(|w| w[1] - w[0]).fold(f64::INFINITY, f64::min);
    println!("{} impacts, closest {shortest:e} s", table.len());
    assert!(table.len() > 1_000_000 && shortest < 1e-11);
}

/// A ball squeezed between two planes in prescribed motion gains speed without end.
#[test]
fn squeezed_without_end() {
    let mut squeezed = scene([ball(0, vector(3.0, 0.0, 0.0), DVec3::ZERO, 0.5, 1.0)]);
    let mut piston = plane(1, DVec3::X, 0.0);
    piston.velocity = vector(1.0, 0.0, 0.0);
    squeezed.planes = vec![piston, plane(2, -DVec3::X, -10.0)];
    let mut simulation = start(&squeezed);
    let far = simulation.world().clock.at(20.0);
    let error = simulation.run(far, u64::MAX, u64::MAX).unwrap_err();
    println!("{error} {:?}", simulation.counts());
    assert_eq!(error.cause, Cause::Resolution);
    assert!(error.time < 9.0 && error.time > 8.9);
}

/// A granular gas collapses somewhere at last, or runs on; either way without a hang.
#[test]
fn granular_gas_ends_well() {
    for restitution in [0.3, 0.6] {
        let mut scene = gas(200, 0.3, Placement::Random, 3);
        scene.domain = Domain { boundary: [Boundary::Periodic; 3], ..cube(Boundary::Periodic, scene.domain.size.x) };
        scene.restitution = restitution;
        let mut simulation = start(&scene);
        let far = simulation.world().clock.at(1e6);
        let ended = simulation.run(far, 200_000, u64::MAX);
        println!("e = {restitution}: {ended:?} after {:?}", simulation.counts());
        assert!(simulation.balance().energy_error.abs() < 1e-12);
    }
}

/// Bodies that turn meet anew within δ of where they met before, for ever, and sink: that is told before they are δ deep.
#[test]
fn bodies_that_turn_rest_on_planes_and_on_each_other() {
    let upright = Shape::Cylinder { radius: 0.5, half_length: 0.5 };
    let shapes = [
        Shape::cuboid(DVec3::ONE).unwrap(),
        upright.clone(),
        Shape::Capsule { radius: 0.3, half_length: 0.2 },
        Shape::Ellipsoid { semi_axes: vector(0.4, 0.3, 0.5) },
    ];
    for shape in &shapes {
        for (height, tilt) in [(0.0, 0.0), (0.3, 0.0), (0.3, 0.2)] {
            for restitution in [0.0, 0.5, 1.0] {
                if restitution == 1.0 && height > 0.0 {
                    continue;
                }
                for on_solid in [false, true] {
                    let mut scene = scene([]);
                    scene.gravity = vector(0.0, 0.0, -9.81);
                    scene.restitution = restitution;
                    if on_solid {
                        let slab = Shape::cuboid(vector(40.0, 40.0, 1.0)).unwrap();
                        scene.solids.push(SolidBody { fixed: true, ..solid(0, &slab, vector(0.0, 0.0, -0.5)) });
                    } else {
                        scene.planes.push(plane(0, DVec3::Z, 0.0));
                    }
                    let mut body = solid(1, shape, vector(0.0, 0.0, 0.5 + height));
                    let turn = DQuat::from_rotation_x(tilt);
                    body.orientation = [turn.w, turn.x, turn.y, turn.z];
                    scene.solids.push(body);
                    let mut simulation = Simulation::new(scene.build().unwrap().0, true);
                    let far = simulation.world().clock.at(60.0);
                    let error = simulation.run(far, 100_000, u64::MAX).unwrap_err();
                    let told = format!("{shape:?} from {height} tilted {tilt}, e = {restitution}: {error}");
                    assert_eq!(error.bodies, [0, 1], "{told}");
                    assert!(matches!(error.cause, Cause::Resting | Cause::Accumulation), "{told}");
                    // δ of the larger of the two, which is farthest from its centre by this.
                    let reach = if on_solid { 29.0 } else { 1.0 };
                    let impacts = simulation.take_impacts();
                    let deepest = impacts.point.chunks(3).map(|point| point[2]).fold(0.0, f64::min);
                    assert!(deepest >= -tolerance::CONTACT * reach, "{told}: {deepest}");
                }
            }
        }
    }
}

/// A rod that turns pushes a ball before it, with e = 0: a lasting contact without gravity.
#[test]
fn a_rod_that_pushes_a_ball_is_a_lasting_contact() {
    let mut scene = scene([ball(1, vector(1.5, 0.9, 0.0), DVec3::ZERO, 0.3, 1.0)]);
    scene.restitution = 0.0;
    let mut rod = solid(0, &Shape::cuboid(vector(4.0, 0.2, 0.2)).unwrap(), DVec3::ZERO);
    (rod.angular_velocity, rod.mass) = (DVec3::Z, 10.0);
    scene.solids.push(rod);
    let mut simulation = start(&scene);
    let far = simulation.world().clock.at(60.0);
    let error = simulation.run(far, 10_000, u64::MAX).unwrap_err();
    assert_eq!((error.cause, error.bodies.as_slice()), (Cause::Accumulation, [0, 1].as_slice()));
}
