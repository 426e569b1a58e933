//! The standard hard-sphere fluid, to be timed or counted:
//!
//!     fluid_speed COUNT PACKING SECONDS [record]    how fast it runs here
//!     fluid_speed COUNT PACKING IMPACTS impacts     so many impacts and nothing else
//!
//! The second does the same work to the last instruction each time, for tools that count them (benches/instructions.py).
#![allow(clippy::unwrap_used)]

use std::time::Instant;

use carom::DVec3;
use carom::scene::{Fill, Placement, RadiusDistribution, Scene};
use carom::simulation::Simulation;
use carom::world::{Boundary, Domain, World};

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let count: u64 = arguments[1].parse().unwrap();
    let packing: f64 = arguments[2].parse().unwrap();
    let what = arguments.get(4).map(String::as_str);
    if what == Some("impacts") {
        let mut simulation = Simulation::new(fluid(count, packing), false);
        let far = simulation.world().clock.at(1e300);
        simulation.run(far, arguments[3].parse().unwrap(), u64::MAX).unwrap();
    } else {
        time(count, packing, arguments[3].parse().unwrap(), what == Some("record"));
    }
}

/// Equal spheres of diameter 1 in a periodic cube.
fn fluid(count: u64, packing: f64) -> World {
    let size = (count as f64 * std::f64::consts::PI / 6.0 / packing).cbrt();
    let on_lattice = |placement| Scene {
        domain: Domain { boundary: [Boundary::Periodic; 3], size: DVec3::splat(size) },
        fills: vec![Fill {
            first_id: 0,
            placement,
            count: Some(count),
            packing: None,
            radius: RadiusDistribution::Constant(0.5),
            mass: Some(1.0),
            density: None,
            temperature: 1.0,
            velocity: DVec3::ZERO,
            center: None,
            size: None,
            material: 0,
        }],
        ..Scene::default()
    };
    // A cubic lattice melts within some collisions a sphere, a dense face-centred one hardly, but it holds more.
    let built = on_lattice(Placement::Cubic).build().or_else(|_| on_lattice(Placement::Fcc).build());
    built.unwrap().0
}

fn time(count: u64, packing: f64, seconds: f64, record: bool) {
    let start = Instant::now();
    let mut simulation = Simulation::new(fluid(count, packing), record);
    println!("set up in {:.3} s, {} bytes a ball", start.elapsed().as_secs_f64(), simulation.bytes_per_ball());
    let far = simulation.world().clock.at(1e300);
    simulation.run(far, 30 * count, u64::MAX).unwrap();
    simulation.take_impacts();
    let before = simulation.counts();
    let processor_start = processor_seconds();
    let start = Instant::now();
    while start.elapsed().as_secs_f64() < seconds {
        simulation.run(far, 20_000, u64::MAX).unwrap();
        simulation.take_impacts();
    }
    let elapsed = processor_seconds() - processor_start;
    let after = simulation.counts();
    let impacts = (after.impacts() - before.impacts()) as f64;
    println!(
        "N {count}, packing {packing}: {:.0} collisions per CPU second; a collision: {:.2} crossings, {:.2} stale; {} bytes a ball; energy error {:.1e}",
        impacts / elapsed,
        (after.crossings - before.crossings) as f64 / impacts,
        (after.stale - before.stale) as f64 / impacts,
        simulation.bytes_per_ball(),
        simulation.balance().energy_error
    );
}

/// CPU seconds of this thread, where the system tells (Linux); wall seconds elsewhere.
fn processor_seconds() -> f64 {
    let told = std::fs::read_to_string("/proc/thread-self/schedstat").ok();
    let nanoseconds = told.and_then(|text| text.split(' ').next().and_then(|n| n.parse::<f64>().ok()));
    nanoseconds.map_or_else(
        || std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).unwrap().as_secs_f64(),
        |n| n * 1e-9,
    )
}
