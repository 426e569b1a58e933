//! Balls placed by the program: as many as asked for, as hot, as dense, and none in another.
#![allow(missing_docs, clippy::unwrap_used)]

mod support;

use carom::DVec3;
use carom::scene::{Fill, Placement, RadiusDistribution, Scene};
use carom::world::{Boundary, Domain, World};
use support::{balls, deepest_overlap, fixed, gas, start, vector};

fn packing(world: &World, volume: f64) -> f64 {
    let sum: f64 = world.radii.iter().map(|r| 4.0 / 3.0 * std::f64::consts::PI * r.powi(3)).sum();
    sum / volume
}

/// Nothing overlaps, the momentum is zero, and the kinetic energy is d/2 (N - 1) kT.
fn check(name: &str, scene: &Scene, kinetic_temperature: f64) -> World {
    let mut simulation = start(scene);
    let deepest = deepest_overlap(&simulation);
    let world = simulation.world();
    let count = (0..world.len()).filter(|&ball| !world.is_fixed(ball)).count() as f64;
    let balance = simulation.balance();
    println!("{name}: {count} balls, deepest overlap {deepest:.1e}");
    assert!(deepest <= 1e-12, "{name}");
    let degrees = f64::from(scene.dimensions);
    let expected = 0.5 * degrees * (count - 1.0) * kinetic_temperature;
    // Sums of `count` terms, each rounded once or twice.
    assert!((balance.kinetic_energy / expected - 1.0).abs() < 1e-13, "{name}");
    assert!(balance.momentum.length() < 1e-12 * count, "{name}");
    simulation.world().clone()
}

#[test]
fn lattices_and_random_places() {
    for (placement, density) in [
        (Placement::Cubic, 0.3),
        (Placement::Cubic, 0.52),
        (Placement::Fcc, 0.49),
        (Placement::Fcc, 0.74),
        (Placement::Random, 0.05),
        (Placement::Random, 0.30),
        (Placement::Random, 0.49),
        (Placement::Random, 0.58),
    ] {
        // Whole cells of either lattice.
        let scene = gas(if placement == Placement::Cubic { 512 } else { 500 }, density, placement, 7);
        let world = check(&format!("{placement:?} at {density}"), &scene, 1.0);
        assert!((packing(&world, scene.domain.size.element_product()) - density).abs() < 1e-12);
    }
}

#[test]
fn between_walls_in_regions_and_in_two_dimensions() {
    for (placement, density) in [(Placement::Cubic, 0.2), (Placement::Fcc, 0.2), (Placement::Random, 0.4)] {
        let mut scene = gas(300, density, placement, 3);
        scene.domain.boundary = [Boundary::Walls; 3];
        check(&format!("walls, {placement:?}"), &scene, 1.0);
        scene.domain = Domain { boundary: [Boundary::Periodic, Boundary::Open, Boundary::Walls], ..scene.domain };
        scene.fills[0].size = Some(scene.domain.size * vector(0.9, 1.0, 0.95));
        scene.fills[0].center = Some(vector(0.1, 5.0, 0.0));
        check(&format!("a region, {placement:?}"), &scene, 1.0);
        if placement != Placement::Fcc {
            let size = (300.0 * std::f64::consts::PI * 0.25 / density).sqrt();
            let mut flat = gas(300, 0.1, placement, 3);
            flat.dimensions = 2;
            flat.domain = Domain {
                boundary: [Boundary::Periodic, Boundary::Walls, Boundary::Open],
                size: vector(size, size, 0.0),
            };
            let world = check(&format!("two dimensions, {placement:?}"), &flat, 1.0);
            assert!(world.flights.iter().all(|flight| flight.position().z == 0.0 && flight.velocity().z == 0.0));
        }
    }
}

#[test]
fn sizes_and_masses_follow_their_distributions() {
    let mut scene = gas(4000, 0.2, Placement::Random, 11);
    let fill = Fill { mass: None, density: Some(2.0), temperature: 0.5, ..scene.fills[0].clone() };
    for (radius, mean, deviation) in [
        (RadiusDistribution::Uniform { low: 0.2, high: 0.4 }, 0.3, 0.2 / 12f64.sqrt()),
        (RadiusDistribution::Normal { mean: 0.3, deviation: 0.05 }, 0.3, 0.05),
        (RadiusDistribution::Lognormal { mean: 0.3, deviation: 0.05 }, 0.3, 0.05),
        (RadiusDistribution::Mixture { radii: vec![0.2, 0.4], shares: vec![3.0, 1.0] }, 0.25, 0.2 * 0.1875f64.sqrt()),
    ] {
        scene.fills = vec![Fill { radius: radius.clone(), ..fill.clone() }];
        let world = check(&format!("{radius:?}"), &scene, 0.5);
        let found = world.radii.iter().sum::<f64>() / world.len() as f64;
        // Four standard errors of 4,000 draws; the cut at three deviations narrows them by 1.3 %.
        assert!((found - mean).abs() < 4.0 * deviation / 4000f64.sqrt(), "{radius:?}: {found}");
        let spread = (world.radii.iter().map(|r| (r - found).powi(2)).sum::<f64>() / world.len() as f64).sqrt();
        assert!((spread / deviation - 1.0).abs() < 0.06, "{radius:?}: {spread}");
        for (body, radius) in world.bodies.iter().zip(world.radii.iter()) {
            assert!((body.mass / (8.0 / 3.0 * std::f64::consts::PI * radius.powi(3)) - 1.0).abs() < 1e-14);
        }
    }
}

#[test]
fn around_bodies_that_are_there() {
    let mut scene = gas(400, 0.35, Placement::Random, 5);
    scene.balls =
        balls([fixed(1000, DVec3::ZERO, DVec3::ZERO, 2.0), fixed(1001, vector(3.0, 0.0, 0.0), DVec3::ZERO, 0.5)]);
    check("around two fixed balls", &scene, 1.0);
}

#[test]
fn what_does_not_fit_is_said() {
    let text = |scene: &Scene| scene.build().unwrap_err().to_string();
    let mut dense = gas(500, 0.70, Placement::Random, 1);
    assert!(text(&dense).contains("too dense to be reached"), "{}", text(&dense));
    dense.fills[0].placement = Placement::Cubic;
    assert!(text(&dense).contains("less than the largest diameter"));
    let mut open = gas(10, 0.1, Placement::Cubic, 1);
    open.domain = Domain::OPEN;
    assert!(text(&open).contains("because the domain is open"));
    let mut twice = gas(10, 0.1, Placement::Cubic, 1);
    twice.fills.push(twice.fills[0].clone());
    assert!(text(&twice).contains("ball 0: id = 0: is given twice"), "{}", text(&twice));
    let mut overlapping = gas(10, 0.1, Placement::Cubic, 1);
    overlapping.fills.push(Fill { first_id: 10, ..overlapping.fills[0].clone() });
    let error = overlapping.build().unwrap_err();
    assert_eq!(error.problems.len(), 10);
    assert_eq!(
        (error.problems[3].id, error.problems[3].other, error.problems[3].depth),
        (Some(3), Some(13), Some(1.0))
    );
}

/// The same seed gives the same places, another seed others.
#[test]
fn seeds() {
    let places = |seed| gas(100, 0.4, Placement::Random, seed).build().unwrap().0.flights;
    assert_eq!(places(1), places(1));
    assert_ne!(places(1), places(2));
}
