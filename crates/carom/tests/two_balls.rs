//! The notes' first section against 500 cases computed with 60 digits.
#![allow(missing_docs, clippy::unwrap_used)]

mod support;

use carom::DVec3;
use carom::contact::{Body, Shape, collide};
use serde_json::Value;
use support::{EPSILON, ball, scene};

struct Case {
    kind: String,
    a: (DVec3, DVec3, f64, f64),
    b: (DVec3, DVec3, f64, f64),
    restitution: f64,
    impact: Option<Expected>,
}

struct Expected {
    time: f64,
    normal: DVec3,
    impulse: f64,
    velocities: [DVec3; 2],
    condition: f64,
}

/// What was found: time, normal, impulse, velocities after.
type Found = Option<(f64, DVec3, f64, [DVec3; 2])>;

fn vector(value: &Value) -> DVec3 {
    DVec3::new(value[0].as_f64().unwrap(), value[1].as_f64().unwrap(), value[2].as_f64().unwrap())
}

fn cases() -> Vec<Case> {
    let text = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../../vectors/two_balls.json")).unwrap();
    let body = |v: &Value| {
        (vector(&v["position"]), vector(&v["velocity"]), v["radius"].as_f64().unwrap(), v["mass"].as_f64().unwrap())
    };
    let list: Value = serde_json::from_str(&text).unwrap();
    list.as_array()
        .unwrap()
        .iter()
        .map(|case| Case {
            kind: case["kind"].as_str().unwrap().to_owned(),
            a: body(&case["a"]),
            b: body(&case["b"]),
            restitution: case["restitution"].as_f64().unwrap(),
            impact: case["impact"].as_object().map(|impact| Expected {
                time: impact["time"].as_f64().unwrap(),
                normal: vector(&impact["normal"]),
                impulse: impact["impulse"].as_f64().unwrap(),
                velocities: [vector(&impact["velocity_a"]), vector(&impact["velocity_b"])],
                condition: impact["condition"].as_f64().unwrap(),
            }),
        })
        .collect()
}

/// The bounds are the issue's: 8ε times what rounding of the input alone does to each number.
fn compare(how: &str, find: impl Fn(&Case) -> Found) {
    let mut worst = [(0.0_f64, String::new()), (0.0, String::new()), (0.0, String::new()), (0.0, String::new())];
    let mut hits = 0;
    for (row, case) in cases().iter().enumerate() {
        let found = find(case);
        let Some(expected) = &case.impact else {
            assert!(found.is_none(), "{how}: case {row} ({}) must miss", case.kind);
            continue;
        };
        let (time, normal, impulse, velocities) =
            found.unwrap_or_else(|| panic!("{how}: case {row} ({}) must hit", case.kind));
        hits += 1;
        let sum = case.a.2 + case.b.2;
        let kappa = expected.condition;
        let k = kappa * (1.0 + case.a.0.length().max(case.b.0.length()) / sum);
        let speed = (case.a.1 - case.b.1).length();
        let scale = case.a.1.length() + case.b.1.length();
        let change =
            (velocities[0] - expected.velocities[0]).length().max((velocities[1] - expected.velocities[1]).length());
        let errors = [
            (time - expected.time).abs() / (EPSILON * k * (expected.time + sum / speed)),
            (normal - expected.normal).length() / (EPSILON * k),
            (impulse - expected.impulse).abs() / expected.impulse / (EPSILON * k * kappa),
            change / (EPSILON * k * scale),
        ];
        for (worst, error) in worst.iter_mut().zip(errors) {
            if error > worst.0 {
                *worst = (error, format!("case {row}, {}", case.kind));
            }
        }
    }
    for (name, worst) in ["time", "normal", "impulse", "velocity"].iter().zip(&worst) {
        println!("{how}: worst {name} {:.3} ε-units of 8 allowed ({})", worst.0, worst.1);
        assert!(worst.0 <= 8.0, "{how}: {name} is off by {:.3}, 8 allowed ({})", worst.0, worst.1);
    }
    assert_eq!(hits, 460);
}

#[test]
fn collide_agrees_with_sixty_digits() {
    compare("collide", |case| {
        let body = |(position, velocity, radius, mass): (DVec3, DVec3, f64, f64)| Body {
            shape: Shape::Ball { radius },
            mass,
            inertia: DVec3::splat(0.4 * mass * radius * radius),
            position,
            orientation: [1.0, 0.0, 0.0, 0.0],
            velocity,
            angular_velocity: DVec3::ZERO,
        };
        collide(&body(case.a), &body(case.b), case.restitution)
            .unwrap()
            .map(|impact| (impact.time, impact.normal, impact.impulse, impact.velocities))
    });
}

#[test]
fn a_run_agrees_with_sixty_digits() {
    compare("run", |case| {
        let body = |id, (position, velocity, radius, mass): (DVec3, DVec3, f64, f64)| {
            ball(id, position, velocity, radius, mass)
        };
        let mut scene = scene([body(0, case.a), body(1, case.b)]);
        scene.restitution = case.restitution;
        let mut simulation = support::start(&scene);
        let far = simulation.world().clock.at(1e300);
        simulation.step(far).unwrap().map(|impact| {
            let (time, low) = impact.time.to_pair();
            (time + low, impact.normal, impact.impulse, [impact.velocities[2], impact.velocities[3]])
        })
    });
}
