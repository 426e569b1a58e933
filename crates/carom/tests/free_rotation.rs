//! Free rotation against bodies computed with 90 digits, and against what must hold of every rotation.
#![allow(missing_docs, clippy::unwrap_used)]

mod support;

use std::collections::BTreeMap;

use carom::rotation::Rotation;
use carom::{DQuat, DVec3};
use serde_json::Value;
use support::EPSILON;

/// A body of `vectors/free_rotation.json`.
struct Case {
    kind: String,
    moments: DVec3,
    orientation: DQuat,
    angular_velocity: DVec3,
    /// kg m²/s, J, s
    angular_momentum: f64,
    energy: f64,
    period: Option<f64>,
    /// |L² - 2 E I₂| / L².
    separatrix_distance: Option<f64>,
    states: Vec<(f64, DQuat, DVec3)>,
}

impl Case {
    fn rotation(&self) -> Rotation {
        Rotation::new(self.moments, self.orientation, self.angular_velocity)
    }
}

fn numbers<const N: usize>(value: &Value) -> [f64; N] {
    let list = value.as_array().unwrap();
    std::array::from_fn(|i| number(&list[i]).unwrap())
}

/// A number, or one with more digits in quotes.
fn number(value: &Value) -> Option<f64> {
    value.as_f64().or_else(|| value.as_str().map(|digits| digits.parse().unwrap()))
}

fn quaternion(value: &Value) -> DQuat {
    let [w, x, y, z] = numbers(value);
    DQuat::from_xyzw(x, y, z, w)
}

fn cases() -> Vec<Case> {
    let text =
        std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../../vectors/free_rotation.json")).unwrap();
    let list: Value = serde_json::from_str(&text).unwrap();
    let case = |case: &Value| Case {
        kind: case["kind"].as_str().unwrap().to_owned(),
        moments: DVec3::from_array(numbers(&case["moments"])),
        orientation: quaternion(&case["orientation"]),
        angular_velocity: DVec3::from_array(numbers(&case["angular_velocity"])),
        angular_momentum: number(&case["angular_momentum"]).unwrap(),
        energy: number(&case["energy"]).unwrap(),
        period: number(&case["period"]),
        separatrix_distance: number(&case["separatrix_distance"]),
        states: (case["states"].as_array().unwrap().iter())
            .map(|state| {
                let rates = DVec3::from_array(numbers(&state["angular_velocity"]));
                (state["time"].as_f64().unwrap(), quaternion(&state["orientation"]), rates)
            })
            .collect(),
    };
    list.as_array().unwrap().iter().map(case).collect()
}

/// The angle (rad) of the rotation from one orientation to another.
fn angle_between(a: DQuat, b: DQuat) -> f64 {
    let between = a.conjugate() * b;
    2.0 * libm::asin(DVec3::new(between.x, between.y, between.z).length().min(1.0))
}

/// Angular momentum in world axes, scaled so that nothing overflows: I ω / `unit`.
fn momentum(moments: DVec3, orientation: DQuat, angular_velocity: DVec3, unit: f64) -> DVec3 {
    orientation * (moments / unit * (orientation.conjugate() * angular_velocity))
}

/// The worst of each figure, with the case in which it was.
#[derive(Default)]
struct Worst(BTreeMap<(String, &'static str), (f64, usize)>);

impl Worst {
    fn note(&mut self, class: &str, figure: &'static str, value: f64, row: usize) {
        let entry = self.0.entry((class.to_owned(), figure)).or_insert((0.0, row));
        if !(value <= entry.0) {
            *entry = (value, row);
        }
    }

    fn print(&self) {
        for ((class, figure), (value, row)) in &self.0 {
            println!("{class:17} {figure:42} {value:9.2e} (row {row})");
        }
    }
}

#[test]
fn rotation_agrees_with_ninety_digits() {
    let mut worst = Worst::default();
    let mut near_separatrix = 0;
    let cases = cases();
    for (row, case) in cases.iter().enumerate() {
        let rotation = case.rotation();
        let class = &case.kind;
        let distance = case.separatrix_distance.unwrap_or(1.0);
        near_separatrix += usize::from(distance < 1e-9);
        for (step, &(time, orientation, angular_velocity)) in case.states.iter().enumerate() {
            let (found, rates) = rotation.state_after(time);
            assert_eq!((found, rates), (rotation.orientation_after(time), rotation.angular_velocity_after(time)));
            let error = angle_between(orientation, found);
            let turned = 2.0 * case.energy / case.angular_momentum * time.abs();
            if step < 3 {
                worst.note(class, "attitude, up to 1e3 periods (rad)", error, row);
            } else {
                worst.note(class, "attitude, 1e6 periods (rad)", error, row);
                if turned > 0.0 {
                    worst.note(class, "attitude, 1e6 periods / angle", error / turned, row);
                }
            }
            // What is allowed: 1e-11 rad, or beyond that 1e-15 of the angle; near the separatrix that over the distance.
            let allowed = 1e-11_f64.max(1e-15 * turned) / distance.min(1e-9).max(1e-16) * 1e-9;
            let allowed = if distance < 1e-9 { allowed } else { 1e-11_f64.max(1e-15 * turned) };
            assert!(error <= allowed, "row {row} ({class}), {time} s: {error:e} rad of {allowed:e}");
            if rotation.fastest() > 0.0 {
                let error = (rates - angular_velocity).length() / rotation.fastest();
                worst.note(class, "angular velocity / fastest", error, row);
                assert!(error <= allowed, "row {row} ({class}), {time} s: angular velocity {error:e}");
            }
            check_conserved(case, (found, rates), &rotation, &mut worst, row);
        }
    }
    worst.print();
    assert!(cases.len() >= 250 && near_separatrix >= 20);
}

fn check_conserved(case: &Case, state: (DQuat, DVec3), rotation: &Rotation, worst: &mut Worst, row: usize) {
    let (orientation, rates) = state;
    let unit_error = (orientation.length() - 1.0).abs();
    worst.note(&case.kind, "length of the quaternion - 1", unit_error, row);
    // The last product of two unit quaternions rounds each component a few times.
    assert!(unit_error <= 4.0 * EPSILON);
    if case.energy == 0.0 {
        return;
    }
    // In a needle that spins about itself the rounding of ω alone turns L by I_max |ω| ε; where the moments are like, that is ε L.
    let unit = case.moments.max_element();
    let size = case.angular_momentum / unit;
    let condition = rates.length() / size;
    let vector = momentum(case.moments, orientation, rates, unit);
    let start = momentum(case.moments, case.orientation.normalize(), case.angular_velocity, unit);
    let length_error = (vector.length() / size - 1.0).abs();
    let vector_error = (vector - start).length() / size;
    let energy_error = (0.5 * vector.dot(rates) / (case.energy / unit) - 1.0).abs();
    worst.note(&case.kind, "|L|, relative", length_error, row);
    worst.note(&case.kind, "|L|, relative, / condition", length_error / condition, row);
    worst.note(&case.kind, "L in the world, relative, / condition", vector_error / condition, row);
    worst.note(&case.kind, "energy, relative", energy_error, row);
    assert!(length_error <= 1e-14 * condition, "row {row}: |L| {length_error:e}");
    assert!(vector_error <= 1e-14 * condition, "row {row}: L {vector_error:e}");
    assert!(energy_error <= 1e-14 * condition, "row {row}: energy {energy_error:e}");
    // The stated ones: a few roundings of sums of positive terms.
    assert!((rotation.energy() / case.energy - 1.0).abs() <= 4.0 * EPSILON);
    let stated = rotation.angular_momentum() / unit;
    assert!((stated.length() / size - 1.0).abs() <= 8.0 * EPSILON);
    assert!((stated - start).length() <= 8.0 * EPSILON * size * condition);
}
