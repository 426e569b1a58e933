//! Free rotation against bodies computed with 90 digits, and against what must hold of every rotation.
#![allow(missing_docs, clippy::unwrap_used)]

mod support;

use std::collections::BTreeMap;

use carom::rotation::Rotation;
use carom::{DQuat, DVec3};
use serde_json::Value;
use support::{EPSILON, Lcg};

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
        near_separatrix += usize::from(class == "separatrix" && case.separatrix_distance.unwrap() < 1e-9);
        for (step, &(time, orientation, angular_velocity)) in case.states.iter().enumerate() {
            let (found, rates) = rotation.state_after(time);
            assert_eq!((found, rates), (rotation.orientation_after(time), rotation.angular_velocity_after(time)));
            let error = angle_between(orientation, found);
            // The component of ω along L is constant.
            let along = if case.energy > 0.0 { 2.0 * case.energy / case.angular_momentum } else { 0.0 };
            let turned = along * time.abs();
            if step < 3 {
                worst.note(class, "attitude, up to 1e3 periods (rad)", error, row);
            } else {
                worst.note(class, "attitude, 1e6 periods (rad)", error, row);
                if turned > 0.0 {
                    worst.note(class, "attitude, 1e6 periods / angle", error / turned, row);
                }
            }
            // The start and one evaluation are some dozens of roundings, whatever the time; the rates have 32 digits,
            // less what nearly equal moments and the nearness of the separatrix take off. (Promised is less: 1e-11 rad
            // to 1e3 periods, then 1e-15 of the angle, near the separatrix over the distance from it.)
            let allowed = 1e-14 + 1e-19 * turned;
            assert!(error <= allowed, "row {row} ({class}), {time} s: {error:e} rad of {allowed:e}");
            if rotation.fastest() > 0.0 {
                let error = (rates - angular_velocity).length() / rotation.fastest();
                worst.note(class, "angular velocity / fastest", error, row);
                assert!(error <= allowed, "row {row} ({class}), {time} s: angular velocity {error:e}");
            }
            check_conserved(case, (found, rates), &rotation, &mut worst, row);
        }
        if let (Some(period), Some(found)) = (case.period, rotation.wobble_period()) {
            worst.note(class, "period, relative", (found / period - 1.0).abs(), row);
            // It is one over a rate of 32 digits; near the separatrix the rate is that of the exact inputs, too.
            assert!((found / period - 1.0).abs() <= 4.0 * EPSILON, "row {row}: period {found} {period}");
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
    // In a needle that spins about itself the rounding of ω alone turns L by I_max |ω| ε; where the moments are like,
    // that is ε L.
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

// --- what must hold of every rotation
// ---------------------------------------------------------------------------------

/// A body's moments (none is more than the others' sum), an orientation, an angular velocity.
fn random_body(lcg: &mut Lcg) -> (DVec3, DQuat, DVec3) {
    let mut part = || libm::exp(lcg.between(-2.0, 2.0));
    let (a, b, c) = (part(), part(), part());
    let speed = libm::exp(lcg.between(-2.0, 2.0));
    (DVec3::new(b + c, c + a, a + b), random_orientation(lcg), lcg.direction() * speed)
}

fn random_orientation(lcg: &mut Lcg) -> DQuat {
    loop {
        let [x, y, z, w] = std::array::from_fn(|_| lcg.between(-1.0, 1.0));
        let q = DQuat::from_xyzw(x, y, z, w);
        if q.length() > 0.1 && q.length() < 1.0 {
            return q.normalize();
        }
    }
}

/// By how much rounding of ω in the world is magnified in the rates: the largest moment over the smallest.
fn condition(moments: DVec3) -> f64 {
    moments.max_element() / moments.min_element()
}

#[test]
fn it_begins_as_it_was_given() {
    let mut lcg = Lcg(1);
    for _ in 0..1000 {
        let (moments, orientation, rates) = random_body(&mut lcg);
        let rotation = Rotation::new(moments, orientation, rates);
        let (q, w) = rotation.state_after(0.0);
        // Two products of quaternions there and back, and a component that keeps its sign: not only the same rotation.
        assert!((q - orientation).length() <= 8.0 * EPSILON);
        assert!((w - rates).length() <= 16.0 * EPSILON * rotation.fastest());
    }
}

/// No sign of the quaternion jumps, wherever a period ends.
#[test]
fn the_quaternion_is_continuous() {
    let mut lcg = Lcg(9);
    for round in 0..300 {
        let (moments, orientation, rates) = random_body(&mut lcg);
        // Every third near the separatrix of moments 1, 2, 3: m₃² = 3 m₁².
        let near = DVec3::new(1.0, lcg.between(-1.0, 1.0), (1.0 + lcg.between(-1e-4, 1e-4)) / 3.0_f64.sqrt());
        let rotation = match round % 3 {
            0 => Rotation::new(DVec3::new(1.0, 2.0, 3.0), DQuat::IDENTITY, near),
            _ => Rotation::new(moments, orientation, rates),
        };
        let mut before = rotation.orientation_after(-25.0 / rotation.fastest());
        for step in 1..1000 {
            let now = rotation.orientation_after((0.05 * f64::from(step) - 25.0) / rotation.fastest());
            // It turns by at most 0.05 rad, of which the quaternion has half.
            assert!(now.dot(before) >= libm::cos(0.025) - 1e-15, "round {round}, step {step}");
            before = now;
        }
    }
}

#[test]
fn going_on_from_where_it_is_changes_nothing() {
    let mut lcg = Lcg(2);
    let mut worst = 0.0_f64;
    for _ in 0..1000 {
        let (moments, orientation, rates) = random_body(&mut lcg);
        let whole = Rotation::new(moments, orientation, rates);
        let (first, second) = (lcg.between(0.0, 50.0) / whole.fastest(), lcg.between(0.0, 50.0) / whole.fastest());
        let (q, w) = whole.state_after(first);
        let (p, v) = Rotation::new(moments, q, w).state_after(second);
        let (expected, rate) = whole.state_after(first + second);
        // The state in between is rounded, which changes the rates by so many ε; the other axes amplify that, most near
        // the separatrix, where a change of d by ε moves the next flip by ε/d of the time of one: few of these are
        // within 1e-3.
        let allowed = EPSILON * condition(moments) * (10.0 + 10.0 * whole.fastest() * (first + second));
        let error = angle_between(p, expected).max((v - rate).length() / whole.fastest());
        worst = worst.max(error / allowed);
        assert!(error <= allowed, "{error:e} of {allowed:e}");
    }
    println!("gone on: {worst:.3} of what is allowed");
}

#[test]
fn backward_in_time_is_with_the_opposite_rates() {
    let mut lcg = Lcg(3);
    for _ in 0..500 {
        let (moments, orientation, rates) = random_body(&mut lcg);
        let forward = Rotation::new(moments, orientation, rates);
        let backward = Rotation::new(moments, orientation, -rates);
        let time = lcg.between(0.0, 1e4) / forward.fastest();
        let ((q, w), (p, v)) = (forward.state_after(-time), backward.state_after(time));
        // Every number on the way is the same but for its sign, and a few roundings of the frame.
        assert!(angle_between(q, p) <= 32.0 * EPSILON);
        assert!((w + v).length() <= 32.0 * EPSILON * forward.fastest());
    }
}

#[test]
fn no_frame_and_no_order_of_axes_is_special() {
    let mut lcg = Lcg(4);
    // Turns that only exchange the body's axes, and what they do to the moments.
    let (half, root) = (0.5, std::f64::consts::FRAC_1_SQRT_2);
    let exchanges = [
        (DQuat::from_xyzw(half, half, half, half), [1, 2, 0]),
        (DQuat::from_xyzw(-half, -half, -half, half), [2, 0, 1]),
        (DQuat::from_xyzw(root, 0.0, 0.0, root), [0, 2, 1]),
        (DQuat::from_xyzw(0.0, root, 0.0, root), [2, 1, 0]),
        (DQuat::from_xyzw(0.0, 0.0, root, -root), [1, 0, 2]),
        (DQuat::from_xyzw(1.0, 0.0, 0.0, 0.0), [0, 1, 2]),
    ];
    for _ in 0..300 {
        let (moments, orientation, rates) = random_body(&mut lcg);
        let rotation = Rotation::new(moments, orientation, rates);
        let time = lcg.between(0.0, 100.0) / rotation.fastest();
        let (q, w) = rotation.state_after(time);
        // The turned inputs are rounded; see above.
        let allowed = EPSILON * condition(moments) * 1e4;
        for (exchange, order) in exchanges {
            let permuted = DVec3::from_array(order.map(|i: usize| moments[i]));
            let (p, v) = Rotation::new(permuted, orientation * exchange, rates).state_after(time);
            assert!(angle_between(q * exchange, p) <= allowed, "{order:?}");
            assert!((w - v).length() <= allowed * rotation.fastest());
        }
        let frame = random_orientation(&mut lcg);
        let (p, v) = Rotation::new(moments, frame * orientation, frame * rates).state_after(time);
        assert!(angle_between(frame * q, p) <= allowed);
        assert!((frame * w - v).length() <= allowed * rotation.fastest());
    }
}

/// Moments that differ little give a motion that differs as little, from 1e-15 on: no division of small differences.
#[test]
fn symmetric_tops_are_the_limit_of_others() {
    let mut lcg = Lcg(5);
    for _ in 0..200 {
        let (moments, orientation, rates) = random_body(&mut lcg);
        let (round, other) = (moments.x, moments.y);
        let (a, b) = (lcg.between(-1.0, 1.0), lcg.between(-1.0, 1.0));
        for exponent in 3..=15 {
            let small = 10.0_f64.powi(-exponent);
            let near = |inertia: f64, share: f64| inertia * (1.0 + share * small);
            let pairs = [
                ("spherical", DVec3::splat(round), DVec3::new(round, near(round, a), near(round, b))),
                ("symmetric", DVec3::new(round, round, other), DVec3::new(near(round, a), near(round, b), other)),
                ("symmetric", DVec3::new(other, round, round), DVec3::new(other, near(round, a), near(round, b))),
            ];
            for (name, exact, near) in pairs {
                let (exact, near) = (Rotation::new(exact, orientation, rates), Rotation::new(near, orientation, rates));
                let angle = lcg.between(0.0, 10.0);
                let time = angle / exact.fastest();
                let ((q, w), (p, v)) = (exact.state_after(time), near.state_after(time));
                // The rates L/I and their differences change by `small` of themselves, where I_max/I_min magnifies
                // that.
                let allowed = condition(moments) * (64.0 * EPSILON + 8.0 * small * (1.0 + angle));
                let error = angle_between(q, p).max((w - v).length() / exact.fastest());
                assert!(error <= allowed, "{name}, {small:e}: {error:e} of {allowed:e}");
            }
        }
    }
}

/// The turning over of a body that spins about its middle axis (Dzhanibekov), against 4 K(k) / τ from the textbook.
#[test]
fn the_middle_axis_turns_over_on_time() {
    let moments = DVec3::new(1.0, 2.0, 3.0);
    for small in [1e-1, 1e-2, 1e-3, 1e-4] {
        let rates = DVec3::new(0.3 * small, 1.0, small);
        let momentum = moments * rates;
        let (square, twice_energy) = (momentum.length_squared(), momentum.dot(rates));
        assert!(square > twice_energy * 2.0);
        let tau = ((square - twice_energy) / 6.0).sqrt();
        let complement = (2.0 * (square - twice_energy * 2.0) / (square - twice_energy)).sqrt();
        let (mut a, mut b) = (1.0, complement);
        for _ in 0..12 {
            (a, b) = (0.5 * (a + b), f64::sqrt(a * b));
        }
        let period = 2.0 * std::f64::consts::PI / a / tau;
        let rotation = Rotation::new(moments, DQuat::IDENTITY, rates);
        let found = rotation.wobble_period().unwrap();
        // L² - 2 E I₂ = 2.9 small² is a difference of numbers of about 4; T grows as the logarithm of it.
        assert!((found / period - 1.0).abs() <= 16.0 * EPSILON / (small * small), "{small}: {found} {period}");
        for (part, sign) in [(0.5, DVec3::new(-1.0, -1.0, 1.0)), (1.0, DVec3::ONE)] {
            let (q, w) = rotation.state_after(part * found);
            let body = q.conjugate() * w;
            // Half a period on, it spins the other way about its middle axis; rounding of the time moves it by ε T τ.
            assert!((body - rates * sign).length() <= 64.0 * EPSILON, "{small}: {body} after {part} periods");
        }
    }
}

/// On the separatrix itself, L² = 2 E I₂ exactly: one flip and never another, by hyperbolic functions (Landau and
/// Lifshitz, section 37).
#[test]
fn on_the_separatrix_it_turns_over_once() {
    let moments = DVec3::new(2.0, 3.0, 6.0);
    let rates = DVec3::new(3.0, 1.0, 1.0);
    let rotation = Rotation::new(moments, DQuat::IDENTITY, rates);
    assert_eq!(rotation.wobble_period(), Some(f64::INFINITY));
    // L = 9, τ = 3/2, and L₂ = 9 tanh(τ t + artanh 1/3).
    for (time, near) in [(0.7, 1e-9), (-2.0, 1e-9), (5.0, 1e-9), (40.0, 0.0), (-1e6, 0.0)] {
        let (q, w) = rotation.state_after(time);
        let body = q.conjugate() * w;
        let s = 1.5 * time + libm::atanh(1.0 / 3.0);
        let (sech, half) = (1.0 / libm::cosh(s), 0.5_f64.sqrt());
        let expected = DVec3::new(4.5 * half * sech, 3.0 * libm::tanh(s), 1.5 * half * sech);
        // A few roundings of ω.
        assert!((body - expected).length() <= 64.0 * EPSILON, "{time}: {body} {expected}");
        assert!((momentum(moments, q, w, 1.0) - DVec3::new(6.0, 3.0, 6.0)).length() <= 64.0 * EPSILON * 9.0);
        if near > 0.0 {
            // What a little to either side of it does for a while.
            for side in [-near, near] {
                let beside = Rotation::new(moments, DQuat::IDENTITY, rates * DVec3::new(1.0, 1.0, 1.0 + side));
                // 4 K / τ = (2 / τ) ln (16 / k′²), and k′² is of the order of 1e-9.
                assert!((25.0..40.0).contains(&beside.wobble_period().unwrap()));
                // What is unstable grows as e^(τ t), here to 2000 times.
                let allowed = 10.0 * near * libm::exp(1.5 * f64::abs(time));
                assert!(angle_between(beside.orientation_after(time), q) <= allowed, "{time}");
            }
        }
    }
}

#[test]
fn steady_rotations_stay_steady() {
    let moments = DVec3::new(1.0, 2.0, 3.0);
    for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
        let rates = axis * -0.7;
        let rotation = Rotation::new(moments, DQuat::IDENTITY, rates);
        assert_eq!(rotation.wobble_period(), None);
        assert_eq!(rotation.fastest_change(), 0.0);
        assert_eq!(rotation.angular_velocity_after(1e9), rates);
        let expected = DQuat::from_axis_angle(axis, -0.7 * 3.0);
        assert!(angle_between(rotation.orientation_after(3.0), expected) <= 8.0 * EPSILON);
        // In the plane: nothing turns out of it.
        let q = rotation.orientation_after(12.3);
        assert_eq!(DVec3::new(q.x, q.y, q.z) * (DVec3::ONE - axis), DVec3::ZERO);
    }
    let rest = Rotation::new(moments, DQuat::from_xyzw(0.5, 0.5, 0.5, 0.5), DVec3::ZERO);
    assert_eq!(rest.state_after(1e300), (DQuat::from_xyzw(0.5, 0.5, 0.5, 0.5), DVec3::ZERO));
    assert_eq!((rest.energy(), rest.angular_momentum(), rest.fastest()), (0.0, DVec3::ZERO, 0.0));
}

/// |ω| and |dω/dt| of Euler's equations never exceed their bounds, and come near them within a period.
#[test]
fn bounds_hold_and_are_reached() {
    let mut lcg = Lcg(7);
    for _ in 0..300 {
        let (moments, orientation, rates) = random_body(&mut lcg);
        let rotation = Rotation::new(moments, orientation, rates);
        let (mut fastest, mut change) = (0.0_f64, 0.0_f64);
        let steps = 2000;
        for step in 0..steps {
            let (q, w) = rotation.state_after(rotation.wobble_period().unwrap() * f64::from(step) / f64::from(steps));
            let body = q.conjugate() * w;
            fastest = fastest.max(w.length());
            change = change.max(((moments * body).cross(body) / moments).length());
        }
        // A sample rounds ω, and dω/dt is computed from differences of products of its components.
        assert!(fastest <= rotation.fastest() * (1.0 + 8.0 * EPSILON));
        let rounding = 32.0 * EPSILON * condition(moments) * rotation.fastest() * rotation.fastest();
        assert!(change <= rotation.fastest_change() * (1.0 + 8.0 * EPSILON) + rounding);
        // Between two of 2000 samples the phase moves by K/500, near the separatrix by a twentieth of a flip.
        assert!(fastest >= 0.99 * rotation.fastest() && change >= 0.99 * rotation.fastest_change());
        let least = (2.0 * rotation.energy() / moments.min_element()).sqrt();
        assert!(rotation.fastest() <= least * (1.0 + 8.0 * EPSILON));
    }
}

/// Whatever the moments, the rates and the time, what comes out is a unit quaternion and keeps the energy.
#[test]
fn nothing_breaks_at_the_extremes() {
    let mut lcg = Lcg(8);
    let extreme = |lcg: &mut Lcg, decades: f64| match (lcg.uniform() * 5.0) as u32 {
        0 => 1.0,
        1 => 1.0 + lcg.between(-4.0, 4.0) * EPSILON,
        2 => libm::exp(lcg.between(-2.3, 2.3) * decades),
        _ => lcg.between(0.1, 1.0),
    };
    for round in 0..200_000 {
        let decades = if round % 2 == 0 { 4.0 } else { 30.0 };
        let moments = DVec3::from_array(std::array::from_fn(|_| extreme(&mut lcg, decades)));
        let mut rates = DVec3::from_array(std::array::from_fn(|_| extreme(&mut lcg, 100.0)));
        if lcg.uniform() < 0.3 {
            rates[(lcg.uniform() * 3.0) as usize] = 0.0;
        }
        let orientation = if lcg.uniform() < 0.5 { DQuat::IDENTITY } else { random_orientation(&mut lcg) };
        let rotation = Rotation::new(moments, orientation, rates);
        let time = lcg.between(-1.0, 1.0) * libm::exp(lcg.between(-20.0, 20.0)) / rotation.fastest();
        let (q, w) = rotation.state_after(time);
        let what = || format!("round {round}: {moments} {orientation} {rates} {time}");
        assert!((q.length() - 1.0).abs() <= 4.0 * EPSILON, "{}", what());
        assert!(w.length() <= rotation.fastest() * (1.0 + 8.0 * EPSILON), "{}", what());
        let scale = moments.max_element() / moments.min_element();
        let body = q.conjugate() * w / rotation.fastest();
        let energy = 0.5 * (body * body).dot(moments) * rotation.fastest() * rotation.fastest();
        assert!((energy / rotation.energy() - 1.0).abs() <= 32.0 * EPSILON * scale, "{}", what());
    }
}
