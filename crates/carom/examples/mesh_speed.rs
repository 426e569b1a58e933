//! Prints how fast balls in a bowl of triangles are simulated: `mesh_speed [balls] [impacts] [rings]`; a bowl has 4 × rings² triangles.

use std::sync::Arc;
use std::time::Instant;

use carom::DVec3;
use carom::scene::{Ball, MeshBody, Scene};
use carom::shape::TriangleMesh;
use carom::simulation::Simulation;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1).map(|argument| argument.parse::<u64>());
    let mut next = |default| arguments.next().unwrap_or(Ok(default));
    let (count, impacts, rings) = (next(1000)?, next(100_000)?, next(35)?);
    let started = Instant::now();
    let mesh = bowl(u32::try_from(rings)?)?;
    let triangles = mesh.triangles.len();
    let mut scene = Scene { gravity: DVec3::new(0.0, 0.0, -9.81), ..Scene::default() };
    scene.meshes.push(MeshBody {
        id: i64::try_from(count)?,
        mesh: Arc::new(mesh),
        position: DVec3::ZERO,
        orientation: [1.0, 0.0, 0.0, 0.0],
        velocity: DVec3::ZERO,
        angular_velocity: DVec3::ZERO,
        material: 0,
    });
    for k in 0..count {
        let at = |step: u64| (k / step % 10) as f64 - 4.5;
        let position = DVec3::new(at(1), at(10), 9.0 + at(100)) * 0.09;
        let velocity = DVec3::new((k as f64).sin(), (2.0 * k as f64).cos(), 0.0) * 0.1;
        scene.balls.push(
            Ball { id: i64::try_from(k)?, position, velocity, radius: 0.02, mass: 1.0, material: 0, fixed: false },
            3,
        );
    }
    let mut simulation = Simulation::new(scene.build()?.0, false);
    let ready = started.elapsed();
    let started = Instant::now();
    simulation.run(carom::time::Time::NEVER, impacts, u64::MAX)?;
    let seconds = started.elapsed().as_secs_f64();
    let counts = simulation.counts();
    println!("{count} balls, {triangles} triangles: set up in {:.3} s", ready.as_secs_f64());
    println!(
        "{:.0} impacts/s, {:.0} % of them with the bowl",
        impacts as f64 / seconds,
        100.0 * counts.ball_plane as f64 / impacts as f64
    );
    println!("energy error {:e}", simulation.balance().energy_error);
    Ok(())
}

/// A bowl z = x² + y² up to z = 4, so deep that nothing leaves it, in rings of triangles.
fn bowl(rings: u32) -> Result<TriangleMesh, carom::shape::ShapeError> {
    let around = 2 * rings;
    let mut vertices = vec![DVec3::ZERO];
    for ring in 1..=rings {
        let radius = 2.0 * f64::from(ring) / f64::from(rings);
        for k in 0..around {
            let angle = std::f64::consts::TAU * f64::from(k) / f64::from(around);
            vertices.push(DVec3::new(radius * angle.cos(), radius * angle.sin(), radius * radius));
        }
    }
    let corner = |ring: u32, k: u32| 1 + (ring - 1) * around + k % around;
    let mut triangles = Vec::new();
    for k in 0..around {
        triangles.push([0, corner(1, k), corner(1, k + 1)]);
        for ring in 1..rings {
            let [a, b, c, d] = [corner(ring, k), corner(ring + 1, k), corner(ring + 1, k + 1), corner(ring, k + 1)];
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    TriangleMesh::new(&vertices, &triangles)
}
