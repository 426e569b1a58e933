//! A missed collision shows as an overlap, and as a rate of impacts that is too low.
#![allow(missing_docs, clippy::unwrap_used)]

mod support;

use carom::DVec3;
use carom::scene::{Placement, RadiusDistribution, Scene};
use carom::world::Boundary;
use support::{Lcg, ball, cube, deepest_overlap, fixed, gas, plane, run_impacts, scene, start, vector};

/// Looks for overlaps among all pairs, O(N²), every `every` impacts. Rounding of a contact is some 1e-15 of the larger
/// coordinates, which are at most a few hundred of the smaller radii here.
fn never_overlaps(name: &str, scene: &Scene, rounds: u32, every: u64) {
    let mut simulation = start(scene);
    let mut deepest = f64::NEG_INFINITY;
    for _ in 0..rounds {
        run_impacts(&mut simulation, every);
        deepest = deepest.max(deepest_overlap(&simulation));
    }
    println!("{name}: {:?}, deepest overlap {deepest:.1e} of the smaller radius", simulation.counts());
    assert!(deepest <= 1e-12, "{name}: {deepest:e}");
}

/// Radii 1 : `ratio`, as much volume in the large as in the small.
fn mixture(ratio: f64, small: u64, packing: f64, kind: Boundary) -> Scene {
    let radius = 0.5 / ratio;
    let share = 1.0 / ratio.powi(3);
    let large = ((small as f64 * share).round() as u64).max(3);
    let volume = std::f64::consts::PI / 6.0 * (large as f64 + small as f64 * share);
    let size = (volume / packing).cbrt();
    let mut scene = gas(1, 0.1, Placement::Random, 21);
    scene.domain = cube(kind, size);
    let fill = scene.fills[0].clone();
    scene.fills = vec![
        carom::scene::Fill {
            count: Some(large),
            radius: RadiusDistribution::Constant(0.5),
            mass: None,
            density: Some(1.0),
            ..fill.clone()
        },
        carom::scene::Fill {
            first_id: large as i64,
            count: Some(small),
            radius: RadiusDistribution::Constant(radius),
            mass: None,
            density: Some(1.0),
            ..fill
        },
    ];
    scene
}

#[test]
fn mixtures_of_sizes() {
    never_overlaps("radii 1:3, periodic", &mixture(3.0, 800, 0.3, Boundary::Periodic), 30, 2000);
    never_overlaps("radii 1:10, periodic", &mixture(10.0, 3000, 0.25, Boundary::Periodic), 10, 5000);
    never_overlaps("radii 1:10, walls", &mixture(10.0, 3000, 0.2, Boundary::Walls), 10, 5000);
    never_overlaps("radii 1:100, periodic", &mixture(100.0, 4000, 0.05, Boundary::Periodic), 2, 2000);
    let mut broad = gas(600, 0.3, Placement::Random, 4);
    broad.fills[0].radius = RadiusDistribution::Lognormal { mean: 0.4, deviation: 0.3 };
    broad.fills[0].packing = Some(0.3);
    never_overlaps("lognormal radii, periodic", &broad, 20, 3000);
}

#[test]
fn under_gravity_between_walls_and_on_fixed_balls() {
    let mut scene = mixture(4.0, 500, 0.1, Boundary::Walls);
    scene.gravity = vector(0.3, -0.1, -1.0);
    never_overlaps("gravity, walls", &scene, 20, 2000);
    let mut pegs = gas(300, 0.08, Placement::Random, 8);
    pegs.domain = cube(Boundary::Walls, 14.0);
    pegs.gravity = vector(0.0, 0.0, -0.5);
    for row in 0..8i64 {
        let at = |bit: i64| if row >> bit & 1 == 1 { 3.0 } else { -3.1 };
        pegs.balls.push(fixed(1000 + row, vector(at(0), at(1), at(2)), DVec3::ZERO, 1.5), 3);
    }
    never_overlaps("gravity, pegs", &pegs, 20, 2000);
}

/// Having bounced off one image of a fixed ball, a falling ball flies round the box to the next: that contact is another one.
#[test]
fn off_a_fixed_ball_and_round_the_box() {
    for k in 0..6 {
        let speed = 2.0 + 0.1 * f64::from(k);
        let scene = Scene {
            domain: cube(Boundary::Periodic, 8.0),
            gravity: vector(0.0, 0.0, -0.02),
            ..scene([
                fixed(0, DVec3::ZERO, DVec3::ZERO, 0.5),
                ball(1, vector(-1.5, 0.3, 0.2), vector(speed, 0.0, 0.0), 0.5, 1.0),
            ])
        };
        let mut simulation = start(&scene);
        let far = simulation.world().clock.at(1e4);
        for impact in 0..20 {
            let Some(met) = simulation.step(far).unwrap() else { break };
            // Contact distance 1. The quartic has squares of the way flown, up to a thousand metres, rounded to 2e-10 m².
            let apart = (met.positions[0] - met.positions[1]).length();
            assert!((apart - 1.0).abs() < 1e-9, "speed {speed}, impact {impact}: {apart} m apart");
        }
    }
}

#[test]
fn in_narrow_periodic_boxes() {
    // Three to six balls in boxes hardly wider than two of them: pairs meet through several images.
    let mut lcg = Lcg(3);
    for size in [2.05, 2.5, 3.3] {
        let scene = Scene {
            domain: cube(Boundary::Periodic, size),
            ..scene((0..3).map(|i| {
                let z = (f64::from(i) - 1.0) * size / 3.0;
                ball(i64::from(i), vector(0.2 * f64::from(i), -0.3, z), lcg.direction(), 0.3 * size / 3.0 + 0.1, 1.0)
            }))
        };
        never_overlaps(&format!("box of {size}"), &scene, 200, 100);
    }
}

#[test]
fn in_open_space_after_an_explosion() {
    let mut scene = gas(400, 0.2, Placement::Random, 2);
    scene.fills[0].size = Some(scene.domain.size);
    scene.domain = carom::world::Domain::OPEN;
    let mut simulation = start(&scene);
    // Until they all fly apart: the number of impacts is finite, and the cells grow with the cloud.
    support::run_until(&mut simulation, 1e9);
    let counts = simulation.counts();
    println!("{counts:?}");
    assert!(counts.impacts() > 300 && counts.crossings < 400 * 64 * 50);
    assert!(deepest_overlap(&simulation) <= 1e-12);
}

#[test]
fn moving_walls_and_balls() {
    let mut scene = gas(200, 0.05, Placement::Random, 6);
    scene.domain = cube(Boundary::Walls, 14.0);
    let mut piston = plane(900, DVec3::X, -7.0);
    piston.velocity = vector(0.05, 0.0, 0.0);
    scene.fills[0].size = Some(vector(12.0, 13.0, 13.0));
    scene.fills[0].center = Some(vector(0.8, 0.0, 0.0));
    scene.planes.push(piston);
    scene.balls.push(fixed(901, vector(0.0, 0.0, 0.0), vector(0.02, 0.01, 0.0), 0.7), 3);
    never_overlaps("piston and a moving ball", &scene, 20, 1000);
}

/// Exact for every duration when the start is drawn from the invariant measure (Liouville): two balls of diameter σ in a
/// periodic box of side L meet v_rel π σ² / (L³ - 4πσ³/3) times a second.
#[test]
fn two_balls_meet_as_often_as_liouville_says() {
    let (size, sigma) = (4.0_f64, 1.0_f64);
    let rate = std::f64::consts::PI * sigma.powi(2) / (size.powi(3) - 4.0 / 3.0 * std::f64::consts::PI * sigma.powi(3));
    assert!((rate - 0.05252514811765602).abs() < 1e-15);
    let mut lcg = Lcg(17);
    let (starts, duration) = (2000, 2000.0);
    let mut counts = Vec::new();
    while counts.len() < starts {
        let place = |lcg: &mut Lcg| vector(lcg.between(-2.0, 2.0), lcg.between(-2.0, 2.0), lcg.between(-2.0, 2.0));
        let (a, b) = (place(&mut lcg), place(&mut lcg));
        let mut r = a - b;
        r -= (r / size).round() * size;
        if r.length() < sigma {
            continue;
        }
        let direction = lcg.direction();
        // Relative speed 1, with a common drift that has no effect.
        let drift = lcg.direction() * 0.3;
        let scene = Scene {
            domain: cube(Boundary::Periodic, size),
            ..scene([
                ball(0, a, drift + direction * 0.25, 0.5 * sigma, 3.0),
                ball(1, b, drift - direction * 0.75, 0.5 * sigma, 1.0),
            ])
        };
        let mut simulation = start(&scene);
        support::run_until(&mut simulation, duration);
        counts.push(simulation.counts().impacts() as f64);
    }
    let mean = counts.iter().sum::<f64>() / starts as f64;
    let variance = counts.iter().map(|n| (n - mean).powi(2)).sum::<f64>() / (starts - 1) as f64;
    let sigma_of_mean = (variance / starts as f64).sqrt();
    let expected = rate * duration;
    println!(
        "impacts a start: {mean:.3} ± {sigma_of_mean:.3}, expected {expected:.3}; {} in all",
        mean * starts as f64
    );
    // Four standard errors, from the scatter between starts; a miss of 0.3 % (grazing hits) would be 0.3 of 105 impacts.
    assert!((mean - expected).abs() <= 4.0 * sigma_of_mean);
    assert!(sigma_of_mean < 0.004 * expected);
}

/// Also where they come near each other from cell to cell.
#[test]
fn bodies_in_prescribed_motion_pass_through_each_other() {
    let at_rest = (0..90i64).map(|id| {
        let site = vector((id % 10) as f64, (id / 10) as f64, 0.0) * 1.9 - vector(8.5, 8.5, -6.0);
        ball(id, site, DVec3::ZERO, 0.5, 1.0)
    });
    let movers = [
        fixed(900, vector(-8.0, 0.1, -4.0), vector(1.0, 0.0, 0.0), 0.5),
        fixed(901, vector(8.0, 0.0, -4.0), vector(-1.0, 0.0, 0.0), 0.5),
    ];
    let scene = Scene { domain: cube(Boundary::Periodic, 20.0), ..scene(at_rest.chain(movers)) };
    let mut simulation = start(&scene);
    support::run_until(&mut simulation, 60.0);
    assert_eq!(simulation.counts().impacts(), 0);
}
