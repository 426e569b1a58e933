//! Exact coincidences, which random gases never show: lattices, flights through the edges of cells, impacts of one instant.
#![allow(missing_docs, clippy::unwrap_used)]

mod support;

use carom::DVec3;
use carom::scene::Scene;
use carom::world::Boundary;
use support::{Lcg, ball, cube, deepest_overlap, fixed, plane, run_until, scene, start, vector};

/// Round-number lattices in periodic boxes: balls cross faces and edges of cells at one instant, and stand half the box apart.
#[test]
fn lattices_with_round_speeds() {
    let mut deepest = f64::NEG_INFINITY;
    for (size, per_axis, radius) in [(6.0, 6, 0.1), (4.0, 4, 0.2), (8.0, 4, 0.3), (10.0, 5, 0.3)] {
        for seed in 0..40 {
            let mut lcg = Lcg(seed);
            let spacing = size / f64::from(per_axis);
            let mut list = Vec::new();
            for i in 0..per_axis * per_axis * per_axis {
                if lcg.uniform() < 0.6 {
                    continue;
                }
                let at = [i % per_axis, i / per_axis % per_axis, i / (per_axis * per_axis)];
                let position = DVec3::from_array(at.map(|k| (f64::from(k) + 0.5) * spacing - 0.5 * size));
                let sign = |lcg: &mut Lcg| if lcg.uniform() < 0.5 { 1.0 } else { -1.0 };
                let velocity = vector(sign(&mut lcg), sign(&mut lcg), 0.0) * 0.7;
                list.push(ball(list.len() as i64, position, velocity, radius, 1.0));
            }
            let scene = Scene { domain: cube(Boundary::Periodic, size), ..scene(list) };
            let mut simulation = start(&scene);
            for step in 1..=20 {
                run_until(&mut simulation, 0.5 * f64::from(step));
                deepest = deepest.max(deepest_overlap(&simulation));
            }
        }
    }
    println!("lattices: deepest overlap {deepest:.1e} radii");
    assert!(deepest <= 1e-12);
}

/// Ball 0 hits ball 1, which touches ball 2, which ball 3 is about to hit within the same instant: whatever the order, ball 3
/// goes on to be watched, and bounces off the floor.
#[test]
fn a_ball_whose_impact_another_forestalls_is_not_forgotten() {
    for k in 0..40 {
        let ahead = 1e-15 * f64::from(k);
        let mut scene = scene([
            ball(0, vector(-2.0, 0.0, 0.0), vector(1.0, 0.0, 0.0), 0.5, 1.0),
            ball(1, vector(0.0, 0.0, 0.0), DVec3::ZERO, 0.5, 1.0),
            ball(2, vector(1.0, 0.0, 0.0), DVec3::ZERO, 0.5, 1.0),
            ball(
                3,
                vector(1.0 + 0.99 - ahead, 0.0, 1.0 + (1.0f64 - 0.99 * 0.99).sqrt()),
                vector(0.0, 0.0, -1.0),
                0.5,
                1.0,
            ),
        ]);
        scene.planes.push(plane(9, DVec3::Z, -5.0));
        let mut simulation = start(&scene);
        run_until(&mut simulation, 30.0);
        assert!(deepest_overlap(&simulation) <= 1e-12, "case {k}");
    }
}

#[test]
fn a_ball_deep_inside_another_is_an_overlap_whatever_the_ids() {
    for large in [0, 9000] {
        let mut lcg = Lcg(1);
        let mut list = vec![
            ball(large, DVec3::ZERO, DVec3::ZERO, 2.0, 1.0),
            ball(8000, vector(0.3, 0.2, 0.1), DVec3::ZERO, 0.05, 1.0),
        ];
        for i in 0..200 {
            list.push(ball(1 + i, lcg.direction() * 3.0 + vector(0.0, 0.0, 20.0 * i as f64), DVec3::ZERO, 0.05, 1.0));
        }
        list.retain(|b| b.id == large || b.id == 8000 || b.position.length() > 5.0);
        let error = scene(list).build().unwrap_err();
        assert_eq!(error.problems.len(), 1, "{error}");
    }
}

#[test]
fn empty_and_extreme_scenes_are_told_or_run() {
    let empty = Scene { domain: cube(Boundary::Periodic, 3.0), ..Scene::default() };
    run_until(&mut start(&empty), 1.0);
    let extreme = |speed: f64, radius: f64, time: f64| {
        let mut scene = scene([
            ball(0, DVec3::ZERO, vector(speed, 0.0, 0.0), radius, 1.0),
            fixed(1, vector(10.0, 0.0, 0.0), DVec3::ZERO, 0.1),
        ]);
        scene.start_time = time;
        scene.build().map(|_| ()).map_err(|error| error.to_string())
    };
    assert!(extreme(1e308, 0.5, 0.0).unwrap_err().contains("velocity"));
    assert!(extreme(1.0, 1e-300, 0.0).unwrap_err().contains("radius"));
    assert!(extreme(300.0, 1e-9, 1e9).unwrap_err().contains("time"));
    assert!(extreme(1.0, 0.5, 1e9).is_ok());
    let mut concentric =
        scene([ball(0, DVec3::ZERO, DVec3::ZERO, 0.5, 1.0), ball(1, DVec3::ZERO, DVec3::ZERO, 0.5, 1.0)]);
    concentric.shrink_overlaps = Some(10.0);
    assert!(concentric.build().unwrap_err().to_string().contains("same centre"));
}
