//! How fast a gas of boxes runs: `turning_gas SIDE PACKING SECONDS [X Y Z]`, side³ boxes (unit cubes unless a size is given) in
//! a periodic box. Prints impacts per second of the processor's time, and the counts. Before that the gas gets as long to forget
//! its lattice, or until there were twenty impacts for each box.

use std::sync::Arc;

use carom::DVec3;
use carom::random::Random;
use carom::scene::{Scene, SolidBody};
use carom::shape::{BodyGeometry, Shape};
use carom::simulation::Simulation;
use carom::world::{Boundary, Domain};

/// Seconds of this thread on a processor, where the system tells; else of the clock on the wall.
fn processor_seconds() -> f64 {
    let of_thread = std::fs::read_to_string("/proc/thread-self/schedstat").ok();
    let nanoseconds = of_thread.and_then(|text| text.split(' ').next()?.parse::<f64>().ok());
    nanoseconds.map_or_else(
        || std::time::UNIX_EPOCH.elapsed().map_or(0.0, |since| since.as_secs_f64()),
        |nanoseconds| nanoseconds * 1e-9,
    )
}

fn main() {
    let arguments: Vec<f64> = std::env::args().skip(1).map(|text| text.parse().expect("numbers")).collect();
    let (side, packing, seconds) = (arguments[0] as usize, arguments[1], arguments[2]);
    let size = if arguments.len() == 6 { DVec3::new(arguments[3], arguments[4], arguments[5]) } else { DVec3::ONE };
    let geometry = Arc::new(BodyGeometry::new(&Shape::cuboid(size).expect("sizes")).expect("a box"));
    let count = side * side * side;
    let length = (geometry.volume * count as f64 / packing).cbrt();
    let mut random = Random::new(1, 0);
    let mut gaussian = || random.normal_vector(3);
    let spacing = length / side as f64;
    let solids = (0..count)
        .map(|k| SolidBody {
            id: k as i64,
            geometry: geometry.clone(),
            position: DVec3::from_array(
                [k % side, k / side % side, k / side / side].map(|i| (i as f64 + 0.5) * spacing - 0.5 * length),
            ),
            orientation: [1.0, 0.0, 0.0, 0.0],
            velocity: gaussian(),
            angular_velocity: gaussian() / DVec3::from_array(geometry.gyration.to_array().map(f64::sqrt)),
            mass: 1.0,
            inertia: None,
            material: 0,
            fixed: false,
        })
        .collect();
    let domain = Domain { boundary: [Boundary::Periodic; 3], size: DVec3::splat(length) };
    let scene = Scene { solids, domain, ..Scene::default() };
    let start = processor_seconds();
    let mut simulation = Simulation::new(scene.build().expect("a scene").0, false);
    let set_up = processor_seconds() - start;
    let far = simulation.world().clock.at(1e300);
    let run = |simulation: &mut Simulation, most: u64| {
        let start = processor_seconds();
        while processor_seconds() - start < seconds && simulation.counts().impacts() < most {
            simulation.run(far, 1000, u64::MAX).expect("no collapse");
        }
    };
    run(&mut simulation, 20 * count as u64);
    let (before, start) = (simulation.counts(), processor_seconds());
    run(&mut simulation, u64::MAX);
    let spent = processor_seconds() - start;
    let counts = simulation.counts();
    let impacts = (counts.impacts() - before.impacts()) as f64;
    println!(
        "{count} boxes at {packing}: {:.0} impacts/s after {:.1} a box, an impact {:.2} list renewals, {:.2} stale; set up in {set_up:.2} s, {} bytes a body, energy error {:.1e}",
        impacts / spent,
        2.0 * before.impacts() as f64 / count as f64,
        (counts.crossings - before.crossings) as f64 / impacts,
        (counts.stale - before.stale) as f64 / impacts,
        simulation.bytes_per_ball(),
        simulation.balance().energy_error
    );
}
