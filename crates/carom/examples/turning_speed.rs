//! How long the prediction of an impact of two turning bodies takes, cubes and pebbles of up to 10,000 corners: pairs as they meet in a gas at packing 0.15 with kT = 1.
//!
//!     cargo run --release --example turning_speed

use std::hint::black_box;
use std::time::Duration;

use carom::predict::turning::motion::{Body, SteadyRotation};
use carom::predict::turning::solid::Solid;
use carom::predict::turning::{Memory, Search, contact_after, first_impact};
use carom::random::Random;
use carom::shape::{Polyhedron, Shape};
use glam::{DQuat, DVec3};

/// A pair at its start.
#[derive(Clone, Copy)]
struct Case {
    position: DVec3,
    velocity: DVec3,
    rotations: [SteadyRotation; 2],
    elapsed: f64,
}

fn bodies<'a>(case: &'a Case, solid: &'a Solid) -> [Body<'a, SteadyRotation>; 2] {
    let [a, b] = &case.rotations;
    let body = |position, velocity, rotation| Body {
        solid,
        position,
        velocity,
        acceleration: DVec3::ZERO,
        rotation,
        elapsed: case.elapsed,
    };
    [body(case.position, case.velocity, a), body(DVec3::ZERO, DVec3::ZERO, b)]
}

fn rotation(random: &mut Random) -> SteadyRotation {
    let q = [0; 4].map(|_| random.normal());
    SteadyRotation {
        orientation: DQuat::from_xyzw(q[0], q[1], q[2], q[3]).normalize(),
        angular_velocity: random.normal_vector(3) * 6.0_f64.sqrt(),
    }
}

/// Cubes apart, with centres up to 2.5 edges away from each other.
fn case(random: &mut Random, solid: &Solid) -> Case {
    loop {
        let position = DVec3::new(random.uniform(), random.uniform(), random.uniform()) * 5.0 - 2.5;
        let case = Case {
            position,
            velocity: random.normal_vector(3) * 2.0_f64.sqrt(),
            rotations: [rotation(random), rotation(random)],
            elapsed: 0.0,
        };
        let [a, b] = bodies(&case, solid);
        let at_once = first_impact(&a, &b, 0.0, &mut Memory::default());
        let far = position.length() > 1.74;
        if position.length() < 2.5 && (far || (at_once.impact.is_none() && apart(&case, solid))) {
            return case;
        }
    }
}

fn apart(case: &Case, solid: &Solid) -> bool {
    use carom::predict::turning::distance::{Pair, Separation};
    use carom::predict::turning::motion::Pose;
    let [a, b] = bodies(case, solid);
    let pair = Pair { a: Pose::of(&a, 0.0), b: Pose::of(&b, 0.0), offset: case.position };
    pair.separate(&Separation::along(case.position.normalize()), 1e-12).gap > 1e-6
}

fn report(name: &str, cases: &[(Case, Memory)], horizon: f64, solid: &Solid) {
    let (mut steps, mut impacts, mut best) = (0, 0, f64::INFINITY);
    for _ in 0..5 {
        let start = processor_time();
        (steps, impacts) = (0, 0);
        for (case, memory) in cases {
            let [a, b] = bodies(case, solid);
            let found: Search = black_box(first_impact(&a, &b, horizon, &mut memory.clone()));
            steps += found.steps;
            impacts += u32::from(found.impact.is_some());
        }
        best = f64::min(best, (processor_time() - start).as_nanos() as f64 / cases.len() as f64);
    }
    let count = cases.len() as f64;
    println!(
        "{name:24} {best:8.0} ns, {:5.2} steps, {:5.1} % impacts, {} pairs",
        f64::from(steps) / count,
        100.0 * f64::from(impacts) / count,
        cases.len()
    );
}

/// Time this process has had, where the system tells it, else time passed.
fn processor_time() -> Duration {
    let told = std::fs::read_to_string("/proc/self/schedstat").ok();
    let nanoseconds = told.and_then(|text| text.split(' ').next().and_then(|field| field.parse().ok()));
    let passed = || std::time::SystemTime::UNIX_EPOCH.elapsed().unwrap_or_default();
    nanoseconds.map_or_else(passed, Duration::from_nanos)
}

fn main() {
    println!("cubes");
    report_all(&Solid::new(&Shape::cuboid(DVec3::ONE).expect("a size")).expect("a convex shape"));
    for corners in [20, 32, 50, 100, 1_000, 10_000] {
        println!("hulls of {corners} corners on a sphere");
        report_all(&Solid::new(&pebble(corners)).expect("a convex shape"));
    }
}

/// The hull of so many points spread evenly over a sphere, along a spiral (Saff and Kuijlaars 1997), as wide as a unit cube.
fn pebble(corners: usize) -> Shape {
    let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    let point = |k: usize| {
        let z = 1.0 - (2.0 * k as f64 + 1.0) / corners as f64;
        let (sine, cosine) = (golden * k as f64).sin_cos();
        0.5 * DVec3::new((1.0 - z * z).sqrt() * cosine, (1.0 - z * z).sqrt() * sine, z)
    };
    let points: Vec<DVec3> = (0..corners).map(point).collect();
    Polyhedron::from_points(&points).expect("a hull").into()
}

fn report_all(solid: &Solid) {
    let mut random = Random::new(1, 0);
    let mut all = Vec::new();
    let (mut hits, mut misses, mut after) = (Vec::new(), Vec::new(), Vec::new());
    for _ in 0..20_000 {
        let case = case(&mut random, solid);
        let mut memory = Memory::default();
        let [a, b] = bodies(&case, solid);
        let found = first_impact(&a, &b, f64::INFINITY, &mut memory);
        all.push((Case { ..case }, Memory::default()));
        match found.impact {
            Some(impact) => {
                let contact = contact_after(&a, &b, impact.seconds, &memory);
                // An elastic impact at the first point: mass 1, inertia 1/6.
                let n = contact.normal;
                let point = contact.points()[0];
                let arms = [point.from_a.cross(n), point.from_b.cross(n)];
                let j =
                    2.0 * point.approach_speed / (2.0 + 6.0 * (arms[0].length_squared() + arms[1].length_squared()));
                let mut next = Case { position: case.position + case.velocity * impact.seconds, ..case };
                for (rotation, (arm, sign)) in next.rotations.iter_mut().zip(arms.into_iter().zip([1.0, -1.0])) {
                    use carom::predict::turning::motion::Turning;
                    rotation.orientation = rotation.state_after(impact.seconds).0;
                    rotation.angular_velocity += arm * (6.0 * j * sign);
                }
                next.velocity += n * (2.0 * j);
                hits.push((case, Memory::default()));
                after.push((next, memory));
            }
            None if found.steps > 0 => misses.push((case, Memory::default())),
            None => {}
        }
    }
    report("all pairs", &all, f64::INFINITY, solid);
    report("all pairs, 0.15 s", &all, 0.15, solid);
    report("hits", &hits, f64::INFINITY, solid);
    report("misses of near pairs", &misses, f64::INFINITY, solid);
    report("just collided", &after, f64::INFINITY, solid);
    report("just collided, 0.15 s", &after, 0.15, solid);
}
