//! Several contacts of one pair at one instant: what lands flat stays flat, nothing pulls, energy and momentum are kept.

use carom::DVec3;
use carom::resolve::turning::{Arms, Mobility, TurningContact, TurningOutcome, Twist};
use glam::{DMat3, DQuat};

mod support;
use support::Lcg;

const UNIT_CUBE: f64 = 1.0 / 6.0;

fn cube_corners(turned: f64) -> Vec<Arms> {
    let axes = DMat3::from_rotation_z(turned);
    [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)]
        .map(|(x, y)| Arms { a: axes * DVec3::new(0.5 * x, 0.5 * y, -0.5), b: DVec3::ZERO })
        .to_vec()
}

fn on_floor(points: &[Arms], twist: Twist, restitution: f64, moments: DVec3, axes: DMat3) -> TurningOutcome {
    TurningContact {
        normal: DVec3::Z,
        points,
        mobilities: [Mobility::new(1.3, moments, axes), Mobility::NONE],
        twists: [twist, Twist::default()],
        restitution,
    }
    .resolve(None)
}

#[test]
fn a_cube_that_lands_flat_keeps_its_spin_to_the_last_bit() {
    let mut random = Lcg(11);
    for _ in 0..2000 {
        let spin = DVec3::new(0.0, 0.0, 20.0 * random.between(-1.0, 1.0));
        let velocity = DVec3::new(random.between(-1.0, 1.0), random.between(-1.0, 1.0), -random.uniform() - 0.1);
        let restitution = [0.0, 0.3, 0.7, 1.0, random.uniform()][(5.0 * random.uniform()) as usize];
        let points = cube_corners(6.0 * random.uniform());
        let twist = Twist { velocity, angular_velocity: spin };
        let after = on_floor(&points, twist, restitution, DVec3::splat(UNIT_CUBE), DMat3::IDENTITY).twists[0];
        assert_eq!(after.velocity.z, -restitution * velocity.z);
        assert_eq!((after.velocity.x, after.velocity.y), (velocity.x, velocity.y));
        assert_eq!(after.angular_velocity, spin);
    }
}

#[test]
fn a_rod_that_lands_flat_on_both_ends_does_not_turn() {
    let points = [
        Arms { a: DVec3::new(-1.0, 0.0, -0.1), b: DVec3::ZERO },
        Arms { a: DVec3::new(1.0, 0.0, -0.1), b: DVec3::ZERO },
    ];
    let twist = Twist { velocity: DVec3::new(0.0, 0.0, -2.0), angular_velocity: DVec3::ZERO };
    let outcome = on_floor(&points, twist, 1.0, DVec3::new(0.01, 0.3, 0.31), DMat3::IDENTITY);
    assert_eq!(outcome.twists[0].velocity.z, 2.0);
    assert_eq!(outcome.twists[0].angular_velocity, DVec3::ZERO);
}

/// A slightly tilting cube: its low edge hits first in this instant's velocities, and yet no corner may approach after.
#[test]
fn nothing_approaches_after_nothing_pulls_and_energy_is_kept() {
    let mut random = Lcg(12);
    for case in 0..20_000 {
        let count = 2 + (8.0 * random.uniform()) as usize;
        let tilt = DMat3::from_quat(
            DQuat::from_xyzw(
                random.between(-1.0, 1.0),
                random.between(-1.0, 1.0),
                random.between(-1.0, 1.0),
                random.between(-1.0, 1.0),
            )
            .normalize(),
        );
        let n = tilt * DVec3::Z;
        let (a, b) = (
            tilt * DVec3::new(random.between(-1.0, 1.0), random.between(-1.0, 1.0), 1.0),
            tilt * DVec3::new(random.between(-1.0, 1.0), random.between(-1.0, 1.0), -1.0),
        );
        let points: Vec<Arms> = (0..count)
            .map(|_| {
                let point = tilt * DVec3::new(random.between(-1.0, 1.0), random.between(-1.0, 1.0), 0.0);
                Arms { a: point - a, b: point - b }
            })
            .collect();
        let axes = || DMat3::from_quat(DQuat::from_xyzw(0.1, 0.7, -0.3, 0.2).normalize());
        let moments = [DVec3::new(0.3, 0.5, 0.6), DVec3::new(1.0, 0.2, 1.1)];
        let masses = [1.5, 0.4];
        let twist = |random: &mut Lcg| Twist {
            velocity: DVec3::new(random.between(-1.0, 1.0), random.between(-1.0, 1.0), random.between(-1.0, 1.0)),
            angular_velocity: DVec3::new(
                random.between(-1.0, 1.0),
                random.between(-1.0, 1.0),
                random.between(-1.0, 1.0),
            ),
        };
        let twists = [twist(&mut random), twist(&mut random)];
        let restitution = if case % 2 == 0 { 1.0 } else { random.uniform() };
        let contact = TurningContact {
            normal: n,
            points: &points,
            mobilities: [0, 1].map(|k| Mobility::new(masses[k], moments[k], axes())),
            twists,
            restitution,
        };
        let outcome = contact.resolve(None);
        let energy = |twists: &[Twist; 2]| -> f64 {
            (0..2)
                .map(|k| {
                    let body = axes().transpose() * twists[k].angular_velocity;
                    0.5 * masses[k] * twists[k].velocity.length_squared() + 0.5 * body.dot(moments[k] * body)
                })
                .sum()
        };
        // Some forty operations on numbers of order 1 to 30 (small moments, long arms).
        let tolerance = 1e-12;
        let before = points.iter().map(|p| contact.speed(p, &twists)).fold(f64::INFINITY, f64::min);
        let after = points.iter().map(|p| contact.speed(p, &outcome.twists)).fold(f64::INFINITY, f64::min);
        if before >= 0.0 {
            assert_eq!(outcome.twists, twists);
            continue;
        }
        assert!(after >= -tolerance, "case {case}: a point approaches at {after:e}");
        assert!(outcome.impulse > 0.0);
        let lost = energy(&twists) - energy(&outcome.twists);
        assert!(
            (lost - outcome.energy_lost).abs() <= tolerance,
            "case {case}: {lost:e} lost, {:e} told",
            outcome.energy_lost
        );
        assert!(lost >= -tolerance);
        let momentum = |twists: &[Twist; 2]| twists[0].velocity * masses[0] + twists[1].velocity * masses[1];
        assert!((momentum(&twists) - momentum(&outcome.twists)).length() <= tolerance);
        let angular = |twists: &[Twist; 2]| -> DVec3 {
            (0..2)
                .map(|k| {
                    let body = axes().transpose() * twists[k].angular_velocity;
                    let place = [a, b][k];
                    place.cross(twists[k].velocity) * masses[k] + axes() * (moments[k] * body)
                })
                .fold(DVec3::ZERO, |sum, part| sum + part)
        };
        assert!((angular(&twists) - angular(&outcome.twists)).length() <= tolerance);
    }
}
