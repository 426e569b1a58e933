//! Every impact as a row.

use glam::DVec3;

use crate::event::{Certificate, Kind};
use crate::time::Time;

/// One impact with all that the law was given and gave.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Impact {
    /// When.
    pub time: Time,
    /// Ids, a < b; walls of the domain have negative ones.
    pub a: i64,
    /// The other id.
    pub b: i64,
    /// What kind of surfaces met.
    pub kind: Kind,
    /// How its time was certified.
    pub certificate: Certificate,
    /// Where they touched (m).
    pub point: DVec3,
    /// Unit vector from B to A.
    pub normal: DVec3,
    /// -v_AB·n before (m/s), positive.
    pub approach_speed: f64,
    /// v_AB·n after (m/s).
    pub separation_speed: f64,
    /// j ≥ 0 (N s): +j n acts on A, -j n on B.
    pub impulse: f64,
    /// Coefficient of restitution of the pair.
    pub restitution: f64,
    /// ½ μ (1 - e²) (v_AB·n)² (J).
    pub energy_lost: f64,
    /// Velocities (m/s): A before, B before, A after, B after.
    pub velocities: [DVec3; 4],
    /// Centres (m) of A and B; of a plane, the point touched; of a mesh, the origin of its frame.
    pub positions: [DVec3; 2],
    /// Masses (kg).
    pub masses: [f64; 2],
}

impl Impact {
    /// The same impact with A and B exchanged.
    pub fn from_the_other_side(self) -> Self {
        let ([before_a, before_b, after_a, after_b], [at_a, at_b], [mass_a, mass_b]) =
            (self.velocities, self.positions, self.masses);
        Self {
            a: self.b,
            b: self.a,
            normal: -self.normal,
            velocities: [before_b, before_a, after_b, after_a],
            positions: [at_b, at_a],
            masses: [mass_b, mass_a],
            ..self
        }
    }
}

/// Impacts by column.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ImpactTable {
    /// When: nearest double (s).
    pub time: Vec<f64>,
    /// What `time` leaves out (s).
    pub time_low: Vec<f64>,
    /// Ids of A.
    pub a: Vec<i64>,
    /// Ids of B.
    pub b: Vec<i64>,
    /// [`Kind`] as a number.
    pub kind: Vec<u8>,
    /// Contact points, three numbers a row (m).
    pub point: Vec<f64>,
    /// Normals, three numbers a row.
    pub normal: Vec<f64>,
    /// m/s.
    pub approach_speed: Vec<f64>,
    /// m/s.
    pub separation_speed: Vec<f64>,
    /// N s.
    pub impulse: Vec<f64>,
    /// Pure numbers.
    pub restitution: Vec<f64>,
    /// J.
    pub energy_lost: Vec<f64>,
    /// How A and B are oriented and turn right after; without rows where no body of the scene turns.
    pub turns: [Turns; 2],
    /// [`Certificate`] as a number; without rows where no body of the scene turns.
    pub certificate: Vec<u8>,
}

/// How one of the bodies of each impact is oriented and turns right after it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Turns {
    /// Unit quaternions (w, x, y, z), the frame in which the shape was given to world, four numbers a row; 1, 0, 0, 0 of a plane.
    pub orientation: Vec<f64>,
    /// World axes, three numbers a row (rad/s); 0 of a plane.
    pub angular_velocity: Vec<f64>,
}

impl ImpactTable {
    /// Adds a row.
    #[inline]
    pub fn push(&mut self, impact: &Impact) {
        let (time, time_low) = impact.time.to_pair();
        self.time.push(time);
        self.time_low.push(time_low);
        self.a.push(impact.a);
        self.b.push(impact.b);
        self.kind.push(impact.kind as u8);
        self.point.extend_from_slice(&impact.point.to_array());
        self.normal.extend_from_slice(&impact.normal.to_array());
        self.approach_speed.push(impact.approach_speed);
        self.separation_speed.push(impact.separation_speed);
        self.impulse.push(impact.impulse);
        self.restitution.push(impact.restitution);
        self.energy_lost.push(impact.energy_lost);
    }

    /// Adds how the last row is certified, and how its A and B are oriented and turn.
    pub fn push_turns(&mut self, certificate: Certificate, turns: [([f64; 4], DVec3); 2]) {
        self.certificate.push(certificate as u8);
        for (columns, (orientation, angular_velocity)) in self.turns.iter_mut().zip(turns) {
            columns.orientation.extend_from_slice(&orientation);
            columns.angular_velocity.extend_from_slice(&angular_velocity.to_array());
        }
    }

    /// How many rows there are.
    pub fn len(&self) -> usize {
        self.time.len()
    }

    /// Whether there are no rows.
    pub fn is_empty(&self) -> bool {
        self.time.is_empty()
    }
}
