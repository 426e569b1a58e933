//! Bodies that fly freely and turn: when they first touch, against closed forms, symmetries and an independent dense search.

#[path = "support/dense_search.rs"]
mod dense_search;

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};
use std::sync::Arc;

use carom::predict::turning::contact::Feature;
use carom::predict::turning::{Certificate, Impact, Memory, contact_after, first_impact};
use carom::random::Random;
use carom::shape::Shape;
use carom::tolerance;
use dense_search::{Couple, Flyer, Form, HORIZON, KINDS, check, check_aligned, check_pairs, couple};
use glam::{DMat3, DQuat, DVec3};

/// Random pairs of each two kinds of shape in this test; `examples/turning_search.rs` takes any number.
const PAIRS: usize = 200;

fn flyer(shape: Shape, position: DVec3, velocity: DVec3, orientation: DQuat, angular_velocity: DVec3) -> Flyer {
    let form = Form::Shape(shape);
    Flyer {
        solid: form.solid(),
        form,
        position,
        velocity,
        acceleration: DVec3::ZERO,
        rotation: Flyer::rotating(orientation, angular_velocity, None),
        ratio: None,
    }
}

/// The half-space z ≤ 0.
fn floor() -> Flyer {
    let form = Form::HalfSpace;
    Flyer {
        solid: form.solid(),
        form,
        position: DVec3::ZERO,
        velocity: DVec3::ZERO,
        acceleration: DVec3::ZERO,
        rotation: Flyer::rotating(DQuat::IDENTITY, DVec3::ZERO, None),
        ratio: None,
    }
}

fn cuboid(x: f64, y: f64, z: f64) -> Shape {
    Shape::Polyhedron(Arc::new(dense_search::cuboid(DVec3::new(x, y, z))))
}

fn impact_of(a: &Flyer, b: &Flyer) -> Option<Impact> {
    first_impact(&a.body(), &b.body(), 100.0, &mut Memory::default()).impact
}

/// The impact, at a time known, where bodies cross the contact.
fn assert_time(a: &Flyer, b: &Flyer, seconds: f64) -> Impact {
    let impact = impact_of(a, b).expect("an impact");
    // A few ε of the time, and of the size over the speed.
    let tolerance = 8.0 * f64::EPSILON * (seconds + 2.0 / impact.approach_speed);
    assert!((impact.seconds - seconds).abs() <= tolerance, "{} not {seconds}: {impact:?}", impact.seconds);
    assert_eq!(impact.certificate, Certificate::Transversal, "{impact:?}");
    impact
}

fn lying() -> DQuat {
    DQuat::from_rotation_y(FRAC_PI_2)
}

#[test]
fn a_corner_falls_on_a_plane() {
    let orientation = DQuat::from_xyzw(0.1, 0.7, -0.2, 0.5).normalize();
    let m = DMat3::from_quat(orientation);
    // The lowest corner of a box lies Σ |half · axis_z| below its centre.
    let below = 0.5 * m.x_axis.z.abs() + 1.0 * m.y_axis.z.abs() + 1.5 * m.z_axis.z.abs();
    let mut a = flyer(cuboid(1.0, 2.0, 3.0), DVec3::Z * 5.0, DVec3::X, orientation, DVec3::ZERO);
    a.acceleration = DVec3::Z * -9.81;
    let impact = assert_time(&a, &floor(), (2.0 * (5.0 - below) / 9.81).sqrt());
    assert!(matches!(impact.features, [Feature::Vertex(_), Feature::Face(0)]));
    assert_eq!(impact.normal, DVec3::Z);
}

#[test]
fn the_tip_of_a_turning_rod_strikes_a_plane() {
    let rod = Shape::Capsule { radius: 0.1, half_length: 1.0 };
    for spin in [0.1, 1.0, 30.0, 1000.0] {
        let a = flyer(rod.clone(), DVec3::Z * 0.6, DVec3::ZERO, lying(), DVec3::Y * spin);
        // 0.6 − sin(ωt) − 0.1 = 0.
        assert_time(&a, &floor(), (0.5_f64).asin() / spin);
    }
}

#[test]
fn a_tip_that_just_misses_a_plane_misses_it_for_ever_and_one_that_just_grazes_it_does_not() {
    let rod = Shape::Capsule { radius: 0.1, half_length: 1.0 };
    let at = |height: f64| {
        let a = flyer(rod.clone(), DVec3::Z * height, DVec3::ZERO, lying(), DVec3::Y * 10.0);
        first_impact(&a.body(), &floor().body(), 10.0, &mut Memory::default())
    };
    for gap in [1e-3, 1e-6, 1e-9, 1e-11] {
        let missed = at(1.1 + gap);
        assert!(missed.impact.is_none() && missed.clear_until == 10.0, "{gap} {missed:?}");
        let touched = at(1.1 - gap).impact.expect("a graze");
        let expected = (1.0 - gap).asin() / 10.0;
        // Near a graze the time is uncertain by √(δ/curvature) at most.
        assert!((touched.seconds - expected).abs() < 1e-12 / (gap / 50.0).sqrt(), "{gap} {touched:?}");
    }
}

/// Passes that come within δ of contact or by less than δ into it, and soon part.
#[test]
fn what_parts_within_the_tolerance_is_not_called_certain() {
    let ball = Shape::Ball { radius: 1.0 };
    let delta = tolerance::contact(1.0, 2.0);
    for gap in [-0.4, -0.1, 0.1, 0.3].map(|share| share * delta) {
        // A spin of half the speed makes the surfaces of two balls roll on each other.
        let above = DVec3::new(-3.0, 0.0, 2.0 + gap);
        let spin = DVec3::new(0.0, 0.5, 0.0);
        let a = flyer(ball.clone(), above, DVec3::X, DQuat::IDENTITY, spin);
        let b = flyer(ball.clone(), DVec3::ZERO, DVec3::ZERO, DQuat::IDENTITY, spin);
        let impact = impact_of(&a, &b).expect("within δ");
        assert_eq!(impact.certificate, Certificate::WithinTolerance, "{gap:e} {impact:?}");
        // A ball thrown down at a floor that an acceleration upwards stops.
        let mut a = flyer(ball.clone(), DVec3::Z * (1.5 + gap), -DVec3::Z, DQuat::IDENTITY, DVec3::ZERO);
        a.acceleration = DVec3::Z;
        let impact = impact_of(&a, &floor()).expect("within δ");
        assert_eq!(impact.certificate, Certificate::WithinTolerance, "{gap:e} {impact:?}");
    }
}

#[test]
fn a_ball_meets_a_face_an_edge_and_a_corner() {
    let ball = Shape::Ball { radius: 0.25 };
    let at = |x: DVec3, v: DVec3| flyer(ball.clone(), x, v, DQuat::IDENTITY, DVec3::ZERO);
    let b = flyer(cuboid(2.0, 2.0, 2.0), DVec3::ZERO, DVec3::ZERO, DQuat::IDENTITY, DVec3::ZERO);
    let face = assert_time(&at(DVec3::new(5.0, 0.3, -0.2), -DVec3::X), &b, 3.75);
    assert!((face.normal - DVec3::X).length() < 1e-12);
    // Distance 0.25 from the edge x = y = 1, at z in between: y stays 1.15.
    let edge = assert_time(&at(DVec3::new(5.0, 1.15, 0.4), -DVec3::X), &b, 3.8);
    // The normal is that at the last step, δ before contact at most.
    assert!((edge.normal - DVec3::new(0.8, 0.6, 0.0)).length() < 1e-11);
    let corner = assert_time(&at(DVec3::new(3.0, 3.0, 3.0), -DVec3::ONE), &b, 2.0 - 0.25 / 3.0_f64.sqrt());
    assert!(matches!(corner.features, [Feature::Surface, Feature::Vertex(_)]));
}

#[test]
fn crossed_rods_and_crossed_edges() {
    let rod = Shape::Capsule { radius: 0.1, half_length: 1.0 };
    let a = flyer(rod.clone(), DVec3::Z * 2.0, -DVec3::Z, lying(), DVec3::Z);
    let b = flyer(rod, DVec3::ZERO, DVec3::ZERO, DQuat::from_rotation_x(FRAC_PI_2), DVec3::ZERO);
    let impact = assert_time(&a, &b, 1.8);
    assert!((impact.normal - DVec3::Z).length() < 1e-14);
    // Two boxes turned by 45° about their long axes, edge over edge; their half diagonals are √½.
    let roof = DQuat::from_rotation_x(FRAC_PI_4);
    let a = flyer(cuboid(4.0, 1.0, 1.0), DVec3::Z * 2.0, -DVec3::Z, roof, DVec3::ZERO);
    let b = flyer(cuboid(4.0, 1.0, 1.0), DVec3::ZERO, DVec3::ZERO, DQuat::from_rotation_z(1.0) * roof, DVec3::ZERO);
    let impact = assert_time(&a, &b, 2.0 - 2.0_f64.sqrt());
    assert!(matches!(impact.features, [Feature::Edge(_), Feature::Edge(_)]), "{impact:?}");
    assert!((impact.normal - DVec3::Z).length() < 1e-14);
}

#[test]
fn a_turning_ellipsoid_and_a_plane() {
    let semi_axes = DVec3::new(0.5, 1.0, 2.0);
    let a = flyer(Shape::Ellipsoid { semi_axes }, DVec3::Z * 4.0, -DVec3::Z, DQuat::IDENTITY, DVec3::X * 3.0);
    // Height of the lowest point: 4 − t − √(sin² + 4 cos²)(3t); the first root by bisection in a bracket without a second one.
    let gap = |t: f64| 4.0 - t - ((3.0 * t).sin().powi(2) + 4.0 * (3.0 * t).cos().powi(2)).sqrt();
    let (mut early, mut late) = (1.7, 2.1);
    assert!((0..1700).all(|k| gap(f64::from(k) * 1e-3) > 0.0) && gap(late) < 0.0);
    for _ in 0..100 {
        let middle = 0.5 * (early + late);
        if gap(middle) > 0.0 { early = middle } else { late = middle }
    }
    assert_time(&a, &floor(), early);
}

#[test]
fn a_half_space_that_turns_meets_a_ball() {
    // z ≤ 0 turning about x reaches the direction of a ball at (0, 2, 1) when 2 sin φ = cos φ less the radius.
    let ball = flyer(Shape::Ball { radius: 0.1 }, DVec3::new(0.0, 2.0, 1.0), DVec3::ZERO, DQuat::IDENTITY, DVec3::ZERO);
    let mut b = floor();
    b.rotation = Flyer::rotating(DQuat::IDENTITY, DVec3::X * 0.5, None);
    // Height above the plane: cos φ − 2 sin φ = √5 cos(φ + atan 2) = 0.1.
    let angle = (0.1 / 5.0_f64.sqrt()).acos() - 2.0_f64.atan();
    assert_time(&ball, &b, angle / 0.5);
}

#[test]
fn the_rim_the_side_and_the_cap_of_a_cylinder() {
    let cylinder = Shape::Cylinder { radius: 0.5, half_length: 1.0 };
    let falling = |angle: f64| {
        let orientation = DQuat::from_rotation_x(angle);
        flyer(cylinder.clone(), DVec3::Z * 3.0, -DVec3::Z, orientation, DVec3::ZERO)
    };
    let rim = assert_time(&falling(0.7), &floor(), 3.0 - 0.5 * 0.7_f64.sin() - 0.7_f64.cos());
    assert!(matches!(rim.features, [Feature::Rim(_), _]));
    let cap = assert_time(&falling(0.0), &floor(), 2.0);
    assert!(matches!(cap.features, [Feature::Cap(0), _]));
    let contact = contact_after(&falling(0.0).body(), &floor().body(), 2.0, &Memory::default());
    assert_eq!(contact.count, 8);
    let side = falling(FRAC_PI_2);
    let impact = assert_time(&side, &floor(), 2.5);
    assert!(matches!(impact.features, [Feature::Side, _]));
    assert_eq!(contact_after(&side.body(), &floor().body(), 2.5, &Memory::default()).count, 2);
}

#[test]
fn faces_meet_in_the_corners_of_what_they_have_in_common() {
    let still = |x: DVec3, v: DVec3, size: f64| flyer(cuboid(size, size, size), x, v, DQuat::IDENTITY, DVec3::ZERO);
    let b = still(DVec3::ZERO, DVec3::ZERO, 2.0);
    let count = |a: &Flyer, expected: usize| {
        let mut memory = Memory::default();
        let impact = first_impact(&a.body(), &b.body(), 10.0, &mut memory).impact.expect("an impact");
        assert!(matches!(impact.features, [Feature::Face(_), Feature::Face(_)]));
        let contact = contact_after(&a.body(), &b.body(), impact.seconds, &memory);
        assert_eq!(contact.count, expected, "{contact:?}");
        assert!((impact.normal - DVec3::X).length() < 1e-15);
        for point in contact.points() {
            assert!((point.from_b.x - 1.0).abs() < 1e-14 && point.approach_speed == 1.0);
        }
    };
    count(&still(DVec3::new(4.0, 0.0, 0.0), -DVec3::X, 2.0), 4);
    count(&still(DVec3::new(4.0, 0.3, 0.2), -DVec3::X, 2.0), 4);
    count(&still(DVec3::new(4.0, 1.0, 0.2), -DVec3::X, 1.0), 4);
    let mut turned = still(DVec3::new(4.0, 0.0, 0.0), -DVec3::X, 2.0);
    turned.rotation = Flyer::rotating(DQuat::from_rotation_x(FRAC_PI_4), DVec3::ZERO, None);
    count(&turned, 8);
}

#[test]
fn a_pair_that_has_just_collided_is_found_again_only_when_it_meets_again() {
    // A rod strikes a plane with one tip, is turned by it, and strikes with the other.
    let rod = Shape::Capsule { radius: 0.05, half_length: 1.0 };
    let a = flyer(rod, DVec3::Z * 0.5, -DVec3::Z, DQuat::from_rotation_y(1.4), DVec3::ZERO);
    let now = Couple { a, b: floor() };
    let mut memory = Memory::default();
    let (first, verdict) = check(&now, HORIZON, false, &mut memory);
    verdict.assert_right("first tip");
    let next = dense_search::rebound(&now, &first, &memory).expect("a rebound");
    let (second, verdict) = check(&next, HORIZON, true, &mut memory);
    verdict.assert_right("second tip");
    assert!(second.impact.expect("the other tip").seconds > 0.05);
}

#[test]
fn a_box_that_slides_on_another_meets_nothing() {
    // Face on face, no approach, no spin: they touch for ever and never collide.
    let a = flyer(cuboid(1.0, 1.0, 1.0), DVec3::Z, DVec3::X, DQuat::IDENTITY, DVec3::ZERO);
    let b = flyer(cuboid(4.0, 4.0, 1.0), DVec3::ZERO, DVec3::ZERO, DQuat::IDENTITY, DVec3::ZERO);
    let search = first_impact(&a.body(), &b.body(), 10.0, &mut Memory::default());
    assert!(search.impact.is_none() && search.clear_until == 10.0, "{search:?}");
    // The same spinning about the normal on a plane.
    let a = flyer(cuboid(1.0, 1.0, 1.0), DVec3::Z * 0.5, DVec3::X, DQuat::IDENTITY, DVec3::Z * 7.0);
    let search = first_impact(&a.body(), &floor().body(), 10.0, &mut Memory::default());
    assert!(search.impact.is_none() && search.clear_until == 10.0, "{search:?}");
}

/// The first certain impact of random pairs, changed in two ways that must not matter.
fn assert_same(change: impl Fn(&Couple) -> Couple, back: impl Fn(&Impact) -> (f64, DVec3)) {
    let mut random = Random::new(5, 0);
    let mut impacts = 0;
    for k in 0..600 {
        let now = couple([k % 6, k / 6 % 6], &mut random);
        let Some(one) = now.search(HORIZON, &mut Memory::default()).impact else { continue };
        let other = change(&now).search(HORIZON, &mut Memory::default()).impact.expect("the same impact");
        if one.certificate == Certificate::Transversal && other.certificate == Certificate::Transversal {
            impacts += 1;
            let (seconds, normal) = back(&other);
            let scale = 1e-12 * (1.0 + 1.0 / one.approach_speed);
            assert!((seconds - one.seconds).abs() <= scale, "{one:?} {other:?}");
            // The normal turns during what δ takes.
            assert!((normal - one.normal).length() <= 1e-9 * (1.0 + 1.0 / one.approach_speed), "{one:?} {other:?}");
        }
    }
    assert!(impacts > 150, "{impacts}");
}

#[test]
fn it_does_not_matter_which_is_a() {
    assert_same(|now| Couple { a: now.b.clone(), b: now.a.clone() }, |impact| (impact.seconds, -impact.normal));
}

#[test]
fn it_does_not_matter_how_the_frame_stands_moves_and_when_it_starts() {
    let turn = DQuat::from_xyzw(0.3, -0.5, 0.1, 0.8).normalize();
    let view = |f: &Flyer| {
        let (orientation, angular_velocity) = carom::predict::turning::motion::Turning::state_after(&f.rotation, 0.0);
        Flyer {
            position: turn * f.position + DVec3::new(3.0, -2.0, 1.0),
            velocity: turn * f.velocity + DVec3::new(0.5, 1.5, -2.5),
            acceleration: turn * f.acceleration,
            rotation: Flyer::rotating((turn * orientation).normalize(), turn * angular_velocity, f.ratio),
            ..f.clone()
        }
    };
    assert_same(
        |now| Couple { a: view(&now.a), b: view(&now.b) },
        |impact| (impact.seconds, turn.conjugate() * impact.normal),
    );
    // Earlier or later by 0.01 s.
    let later = |f: &Flyer| f.moved(-0.01, DVec3::ZERO, DVec3::ZERO);
    assert_same(|now| Couple { a: later(&now.a), b: later(&now.b) }, |impact| (impact.seconds - 0.01, impact.normal));
}

#[test]
fn a_search_can_be_cut_in_pieces() {
    let mut random = Random::new(6, 0);
    for k in 0..300 {
        let now = couple([k % 6, k / 6 % 7], &mut random);
        let whole = now.search(HORIZON, &mut Memory::default());
        for share in [0.3, 0.9] {
            let horizon = share * whole.impact.map_or(HORIZON, |impact| impact.seconds);
            let part = now.search(horizon, &mut Memory::default());
            assert!(part.impact.is_none() && part.clear_until == horizon, "{part:?}");
        }
    }
}

#[test]
fn bodies_square_to_each_other_meet_rightly() {
    for kinds in [[1, 1], [1, 6], [4, 4], [4, 6], [1, 4], [3, 3], [3, 1], [3, 6], [5, 1], [4, 5], [5, 5], [5, 6]] {
        check_aligned(kinds, 150, 3).assert_right(&format!("{} and {}", KINDS[kinds[0]], KINDS[kinds[1]]));
    }
}

fn dense(a: usize) {
    for (b, name) in KINDS.iter().enumerate().skip(a) {
        let verdict = check_pairs([a, b], PAIRS, 1);
        verdict.assert_right(&format!("{} and {name}", KINDS[a]));
        assert!(verdict.transversal > PAIRS / 4, "{verdict:?}");
    }
}

#[test]
fn dense_search_of_balls() {
    dense(0);
}

#[test]
fn dense_search_of_boxes() {
    dense(1);
}

#[test]
fn dense_search_of_tetrahedra() {
    dense(2);
}

#[test]
fn dense_search_of_capsules() {
    dense(3);
}

#[test]
fn dense_search_of_cylinders() {
    dense(4);
}

#[test]
fn dense_search_of_ellipsoids() {
    dense(5);
}
