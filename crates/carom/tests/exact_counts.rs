//! Systems whose number of impacts is known exactly.
#![allow(missing_docs, clippy::unwrap_used)]

mod support;

use carom::DVec3;
use carom::scene::Scene;
use carom::world::{Boundary, Domain};
use support::{Lcg, ball, fixed, plane, positions, run_impacts, run_until, scene, start, vector, velocities};

/// Galperin's balls: a light one at rest between a wall and a heavy one that comes in.
fn pi_scene(ratio: f64) -> Scene {
    let mut scene = scene([
        ball(0, vector(1.0, 0.0, 0.0), DVec3::ZERO, 0.25, 1.0),
        ball(1, vector(2.0, 0.0, 0.0), vector(-1.0, 0.0, 0.0), 0.25, ratio),
    ]);
    scene.planes.push(plane(2, DVec3::X, 0.0));
    scene
}

fn count_of_pi(ratio: f64) -> u64 {
    let mut simulation = start(&pi_scene(ratio));
    // The last impacts come late: the heavy ball leaves hardly faster than the light one follows.
    run_until(&mut simulation, 1e7);
    simulation.counts().impacts()
}

#[test]
fn impacts_count_the_digits_of_pi() {
    for (k, expected) in [3, 31, 314, 3141, 31415, 314_159, 3_141_592].into_iter().enumerate() {
        assert_eq!(count_of_pi(100f64.powi(k as i32)), expected, "mass ratio 100^{k}");
    }
    // Ratio 3 is degenerate: the sixth would be a contact at speed zero.
    for (ratio, expected) in [(2.0, 5), (3.0, 5), (10.0, 10), (16.0, 12)] {
        assert_eq!(count_of_pi(ratio), expected, "mass ratio {ratio}");
    }
}

/// Equal balls on a line exchange velocities, so that the set of positions is that of free flights, sorted (Jepsen 1965),
/// and each crossing of two of these is one impact.
#[test]
fn ghost_gas() {
    const COUNT: usize = 10_000;
    let radius = 1e-4;
    let mut lcg = Lcg(7);
    let mut free: Vec<f64> = (0..COUNT).map(|_| lcg.uniform()).collect();
    free.sort_by(f64::total_cmp);
    let speed: Vec<f64> = (0..COUNT).map(|_| lcg.between(-1.0, 1.0)).collect();
    let scene = scene((0..COUNT).map(|i| {
        let x = free[i] + 2.0 * radius * i as f64;
        ball(i as i64, vector(x, 0.0, 0.0), vector(speed[i], 0.0, 0.0), radius, 1.0)
    }));
    let mut simulation = start(&scene);
    run_impacts(&mut simulation, 1_000_000);
    // A little on, so that no crossing lies at the very instant compared.
    let (time, _) = simulation.now().to_pair();
    let time = time + 1e-9;
    run_until(&mut simulation, time);
    let mut ghosts: Vec<f64> = (0..COUNT).map(|i| free[i] + speed[i] * time).collect();
    let inversions = count_inversions(&ghosts);
    ghosts.sort_by(f64::total_cmp);
    let worst = positions(&simulation)
        .iter()
        .enumerate()
        .map(|(i, x)| (x.x - 2.0 * radius * i as f64 - ghosts[i]).abs())
        .fold(0.0, f64::max);
    println!("ghost gas: {} impacts, worst position {worst:e}", simulation.counts().impacts());
    // Each velocity has passed some 200 hands with an ulp lost at each: 1e-14 of a path of order 1.
    assert!(worst <= 1e-9);
    assert_eq!(simulation.counts().impacts(), inversions);
}

fn count_inversions(x: &[f64]) -> u64 {
    fn sort(x: &mut Vec<f64>) -> u64 {
        if x.len() < 2 {
            return 0;
        }
        let mut right = x.split_off(x.len() / 2);
        let mut count = sort(x) + sort(&mut right);
        let left = std::mem::take(x);
        let (mut i, mut j) = (0, 0);
        while i < left.len() || j < right.len() {
            if j == right.len() || (i < left.len() && left[i] <= right[j]) {
                x.push(left[i]);
                i += 1;
            } else {
                x.push(right[j]);
                count += (left.len() - i) as u64;
                j += 1;
            }
        }
        count
    }
    sort(&mut x.to_vec())
}

/// Height and upward passages of an independent bouncer: released at `height` at rest, floor at 0.
fn bouncer(height: f64, gravity: f64, time: f64) -> f64 {
    let fall = (2.0 * height / gravity).sqrt();
    let phase = (time + fall) % (2.0 * fall);
    let up = phase - fall;
    height - 0.5 * gravity * up * up
}

/// How often two bouncers have crossed by `time`: their order changes at each crossing, and crossings are separated by
/// the impacts with the floor, so sampling every stretch of free flight (where both heights differ by a straight line in
/// time) counts each one.
fn crossings(a: f64, b: f64, gravity: f64, time: f64) -> u64 {
    let (fall_a, fall_b) = ((2.0 * a / gravity).sqrt(), (2.0 * b / gravity).sqrt());
    let mut knots: Vec<f64> = vec![0.0];
    for fall in [fall_a, fall_b] {
        let mut k = 0.0;
        loop {
            let t = fall * (2.0 * k + 1.0);
            if t >= time {
                break;
            }
            knots.push(t);
            k += 1.0;
        }
    }
    knots.sort_by(f64::total_cmp);
    knots.push(time);
    let higher = |t: f64| bouncer(a, gravity, t) > bouncer(b, gravity, t);
    let mut count = 0;
    let mut before = higher(0.0);
    for &t in &knots[1..] {
        let now = higher(t);
        if now != before {
            count += 1;
        }
        before = now;
    }
    count
}

/// Equal balls over a floor under gravity are sorted independent bouncers, shifted by (2i + 1) r.
#[test]
fn column_of_a_hundred() {
    const COUNT: usize = 100;
    let (gravity, radius) = (9.81, 0.01);
    let mut lcg = Lcg(11);
    let mut heights: Vec<f64> = (0..COUNT).map(|_| lcg.between(0.5, 2.0)).collect();
    heights.sort_by(f64::total_cmp);
    let shift = |i: usize| (2 * i + 1) as f64 * radius;
    let mut scene =
        scene((0..COUNT).map(|i| ball(i as i64, vector(0.0, 0.0, heights[i] + shift(i)), DVec3::ZERO, radius, 1.0)));
    scene.planes.push(plane(COUNT as i64, DVec3::Z, 0.0));
    scene.gravity = vector(0.0, 0.0, -gravity);
    let mut simulation = start(&scene);
    run_impacts(&mut simulation, 1_000_000);
    let (time, _) = simulation.now().to_pair();
    let time = time + 1e-7;
    run_until(&mut simulation, time);
    let mut ghosts: Vec<f64> = heights.iter().map(|&h| bouncer(h, gravity, time)).collect();
    ghosts.sort_by(f64::total_cmp);
    let worst =
        positions(&simulation).iter().enumerate().map(|(i, x)| (x.z - shift(i) - ghosts[i]).abs()).fold(0.0, f64::max);
    let counts = simulation.counts();
    let mut expected = 0;
    for a in 0..COUNT {
        for b in 0..a {
            expected += crossings(heights[a], heights[b], gravity, time);
        }
    }
    println!("column: {counts:?} at t = {time}, worst height {worst:e}, crossings {expected}");
    assert!(worst <= 1e-9);
    assert_eq!(counts.ball_ball, expected);
}

/// Rows of touching balls at i·2r: as many leave as were swung, the others stay at rest, to the last bit.
#[test]
fn cradles() {
    for radius in [0.5, 0.1, 0.02865, 1.0 / 3.0] {
        for mass in [1.0, 0.17] {
            for count in 2..=50 {
                for swung in 1..=5.min(count - 1) {
                    for speed in [1.0, 0.7] {
                        let scene = scene((0..count).map(|i| {
                            let moving = i < swung;
                            // The swung ones are still on their way, in a row of their own.
                            let x = f64::from(i) * 2.0 * radius - if moving { 0.5 } else { 0.0 };
                            let v = if moving { speed } else { 0.0 };
                            ball(i64::from(i), vector(x, 0.0, 0.0), vector(v, 0.0, 0.0), radius, mass)
                        }));
                        let mut simulation = start(&scene);
                        run_until(&mut simulation, 10.0);
                        let after = velocities(&simulation);
                        for (i, v) in after.iter().enumerate() {
                            let expected = if i as i32 >= count - swung { speed } else { 0.0 };
                            assert_eq!(
                                *v,
                                vector(expected, 0.0, 0.0),
                                "radius {radius}, {count} balls, {swung} swung, ball {i}"
                            );
                        }
                    }
                }
            }
        }
    }
}

/// Three balls can collide four times at most, and here they do (computed for `theory.md` 3.3 with high precision).
#[test]
fn three_discs_four_impacts() {
    let x = [(-2.5, -1.3), (-0.08, 0.82), (2.58, 0.49)];
    let v = [(1.6, 1.06), (0.18, -1.05), (-1.78, -0.01)];
    let scene =
        scene((0..3).map(|i| ball(i as i64 + 1, vector(x[i].0, x[i].1, 0.0), vector(v[i].0, v[i].1, 0.0), 0.5, 1.0)));
    let mut simulation = start(&scene);
    let far = simulation.world().clock.at(1e6);
    for (a, b, time) in [(2, 3, 0.995425370093), (1, 2, 0.998901620992), (2, 3, 1.002355839098), (1, 3, 2.551614139189)]
    {
        let impact = simulation.step(far).unwrap().unwrap();
        assert_eq!((impact.a, impact.b), (a, b));
        // The reference has 12 decimals.
        assert!((impact.time.to_pair().0 - time).abs() < 1e-11, "{} {time}", impact.time.to_pair().0);
    }
    assert!(simulation.step(far).unwrap().is_none());
}

/// A piston: balls gain what the moving wall's work gives them, and one ball's energy follows the closed form.
#[test]
fn piston_does_work() {
    let mut scene = scene([ball(0, vector(1.0, 0.0, 0.0), vector(1.0, 0.0, 0.0), 0.1, 2.0)]);
    scene.planes.push(plane(1, DVec3::X, 0.0));
    let mut piston = plane(2, -DVec3::X, -3.0);
    piston.velocity = vector(-0.125, 0.0, 0.0);
    scene.planes.push(piston);
    let mut simulation = start(&scene);
    run_impacts(&mut simulation, 3);
    // Each meeting with the piston adds twice its speed: 1, 1.25 after the first, 1.25 off the wall, 1.5 after the third.
    assert_eq!(velocities(&simulation)[0], vector(-1.5, 0.0, 0.0));
    let balance = simulation.balance();
    assert_eq!(balance.work, 2.25 - 1.0);
    assert_eq!(balance.energy_error, 0.0);
}

/// A ball falls on a fixed ball: a quartic, here head on, where it is a free fall from 1 m.
#[test]
fn falls_on_a_fixed_ball() {
    let mut scene =
        scene([ball(0, vector(0.0, 0.0, 2.0), DVec3::ZERO, 0.5, 1.0), fixed(1, DVec3::ZERO, DVec3::ZERO, 0.5)]);
    scene.gravity = vector(0.0, 0.0, -9.81);
    let mut simulation = start(&scene);
    let far = simulation.world().clock.at(1e3);
    let fall = (2.0_f64 / 9.81).sqrt();
    for bounce in 0..100 {
        let impact = simulation.step(far).unwrap().unwrap();
        let expected = fall * f64::from(2 * bounce + 1);
        // Speed and interval repeat to an ulp or two; the errors of 100 intervals add up.
        assert!((impact.time.to_pair().0 - expected).abs() < 1e-13 * expected, "bounce {bounce}");
        assert_eq!(impact.normal, DVec3::Z);
    }
    // And past a grazing one: nothing.
    let mut miss = support::scene([
        ball(0, vector(1.0 + 1e-9, 0.0, 2.0), DVec3::ZERO, 0.5, 1.0),
        fixed(1, DVec3::ZERO, DVec3::ZERO, 0.5),
    ]);
    miss.gravity = scene.gravity;
    assert!(start(&miss).step(far).unwrap().is_none());
}

/// Walls of a domain count and carry their ids.
#[test]
fn walls_have_names() {
    let mut scene = scene([ball(5, DVec3::ZERO, vector(1.0, 0.0, 0.0), 0.5, 1.0)]);
    scene.domain = Domain { boundary: [Boundary::Walls; 3], size: vector(3.0, 2.0, 2.0) };
    let mut simulation = start(&scene);
    let far = simulation.world().clock.at(10.0);
    let first = simulation.step(far).unwrap().unwrap();
    assert_eq!((first.a, first.b, first.normal, first.impulse), (-2, 5, DVec3::X, 2.0));
    let second = simulation.step(far).unwrap().unwrap();
    assert_eq!((second.a, second.b, second.time.to_pair().0), (-1, 5, 3.0));
}
