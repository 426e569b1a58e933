//! Where energy and momentum went: sums that lose nothing to rounding.

use glam::DVec3;

use crate::time::Time;
use crate::world::World;

/// A sum with Neumaier's compensation.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sum {
    total: f64,
    rest: f64,
}

impl Sum {
    /// Adds a term.
    #[inline(always)]
    pub fn add(&mut self, term: f64) {
        let total = self.total + term;
        self.rest +=
            if self.total.abs() >= term.abs() { (self.total - total) + term } else { (term - total) + self.total };
        self.total = total;
    }

    /// The sum so far.
    pub fn value(self) -> f64 {
        self.total + self.rest
    }

    /// Both parts, for checkpoints.
    pub fn parts(self) -> [f64; 2] {
        [self.total, self.rest]
    }

    /// From both parts.
    pub fn from_parts(parts: [f64; 2]) -> Self {
        Self { total: parts[0], rest: parts[1] }
    }
}

/// Three sums.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct VectorSum([Sum; 3]);

impl VectorSum {
    /// Adds a term.
    #[inline(always)]
    pub fn add(&mut self, term: DVec3) {
        self.0[0].add(term.x);
        self.0[1].add(term.y);
        self.0[2].add(term.z);
    }

    /// The sum so far.
    pub fn value(self) -> DVec3 {
        DVec3::from_array(self.0.map(Sum::value))
    }

    /// All parts, for checkpoints.
    pub fn parts(self) -> [f64; 6] {
        let [x, y, z] = self.0.map(Sum::parts);
        [x[0], x[1], y[0], y[1], z[0], z[1]]
    }

    /// From all parts.
    pub fn from_parts(p: [f64; 6]) -> Self {
        Self([[p[0], p[1]], [p[2], p[3]], [p[4], p[5]]].map(Sum::from_parts))
    }
}

/// What was booked at impacts and in flight, and how it began.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Ledger {
    /// Energy lost at impacts (J).
    pub dissipated: Sum,
    /// Work done on free balls by bodies in prescribed motion (J).
    pub work: Sum,
    /// Impulse given to free balls by planes, walls and fixed balls (N s).
    pub wall_impulse: VectorSum,
    /// Its moment about the origin (N m s).
    pub wall_moment: VectorSum,
    /// Moment of gravity about the origin over completed flights (N m s).
    pub gravity_moment: VectorSum,
    /// Energy at the start (J).
    pub energy_start: f64,
    /// Momentum at the start (kg m/s).
    pub momentum_start: DVec3,
    /// Angular momentum about the origin at the start (kg m²/s).
    pub angular_momentum_start: DVec3,
    /// Largest energy seen so far (J): what errors are relative to.
    pub energy_scale: f64,
    /// Largest sum of |m v| seen so far (kg m/s).
    pub momentum_scale: f64,
    /// Largest sum of |m x × v| seen so far (kg m²/s).
    pub angular_momentum_scale: f64,
}

/// The ledger at one instant, all of free balls, SI.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Balance {
    /// Kinetic energy, of translation and spin (J).
    pub kinetic_energy: f64,
    /// Energy in gravity, -Σ m g·x about the origin (J).
    pub potential_energy: f64,
    /// Σ m v (kg m/s).
    pub momentum: DVec3,
    /// Σ m x × v + I ω about the origin (kg m²/s); `None` in periodic boxes, where it has no meaning.
    pub angular_momentum: Option<DVec3>,
    /// Energy lost at impacts since the start (J).
    pub dissipated: f64,
    /// Work done by bodies in prescribed motion since the start (J).
    pub work: f64,
    /// Impulse of planes, walls and fixed balls since the start (N s).
    pub wall_impulse: DVec3,
    /// Impulse of gravity since the start (N s).
    pub gravity_impulse: DVec3,
    /// Energy at the start (J).
    pub energy_start: f64,
    /// (energy - energy at the start + dissipated - work) over the largest energy so far.
    pub energy_error: f64,
    /// |momentum - at the start - wall and gravity impulses| over the largest Σ |m v| so far.
    pub momentum_error: f64,
    /// The same of angular momentum; `None` in periodic boxes.
    pub angular_momentum_error: Option<f64>,
}

struct Totals {
    kinetic: f64,
    potential: f64,
    momentum: DVec3,
    momentum_scale: f64,
    angular: DVec3,
    angular_scale: f64,
    pending_gravity_moment: DVec3,
    free_mass: f64,
}

fn totals(world: &World, now: Time) -> Totals {
    let mut kinetic = Sum::default();
    let mut potential = Sum::default();
    let mut momentum = VectorSum::default();
    let mut momentum_scale = Sum::default();
    let mut angular = VectorSum::default();
    let mut angular_scale = Sum::default();
    let mut pending = VectorSum::default();
    let mut free_mass = Sum::default();
    // In the order of ids: sums of floating-point numbers depend on it.
    for rank in 0..world.len() {
        let ball = world.row(rank);
        if world.is_fixed(ball) {
            continue;
        }
        let mass = world.bodies[ball].mass;
        let velocity = world.velocity(ball, now);
        let position = world.position(ball, now);
        kinetic.add(0.5 * mass * velocity.length_squared());
        potential.add(world.potential_energy(ball, position));
        momentum.add(velocity * mass);
        momentum_scale.add(mass * velocity.length());
        let moment = position.cross(velocity) * mass;
        angular.add(moment);
        angular_scale.add(moment.length());
        free_mass.add(mass);
        pending.add(gravity_moment(world, ball, now));
        if let Some(body) = world.turning_body(ball) {
            let momentum = body.angular_momentum();
            kinetic.add(body.rotational_energy(body.orientation, body.angular_velocity));
            angular.add(momentum);
            angular_scale.add(momentum.length());
        } else if let Some(spin) = &world.spin {
            let omega = spin.angular_velocity[ball];
            kinetic.add(0.5 * spin.inertia[ball] * omega.length_squared());
            angular.add(omega * spin.inertia[ball]);
            angular_scale.add(omega.length() * spin.inertia[ball]);
        }
    }
    Totals {
        kinetic: kinetic.value(),
        potential: potential.value(),
        momentum: momentum.value(),
        momentum_scale: momentum_scale.value(),
        angular: angular.value(),
        angular_scale: angular_scale.value(),
        pending_gravity_moment: pending.value(),
        free_mass: free_mass.value(),
    }
}

/// Moment of gravity (N m s) about the origin over the ball's present flight until `time`: ∫ x(t) × m g dt in closed form
/// (the part along g of x(t) has no moment, so x₀ t + v₀ t²/2 is enough).
pub fn gravity_moment(world: &World, ball: usize, time: Time) -> DVec3 {
    if !world.falls(ball) {
        return DVec3::ZERO;
    }
    let flight = &world.flights[ball];
    let seconds = time.since(flight.start());
    let path = (flight.position() + flight.velocity() * (0.5 * seconds)) * seconds;
    path.cross(world.gravity) * world.bodies[ball].mass
}

impl Ledger {
    /// The books opened on `world` at its start.
    pub fn open(world: &World) -> Self {
        let totals = totals(world, world.start);
        Self {
            energy_start: totals.kinetic + totals.potential,
            momentum_start: totals.momentum,
            angular_momentum_start: totals.angular,
            energy_scale: energy_scale(&totals),
            momentum_scale: totals.momentum_scale,
            angular_momentum_scale: totals.angular_scale,
            ..Self::default()
        }
    }

    /// The books at `now`. Notes the largest energy seen, which errors are relative to.
    pub fn balance(&mut self, world: &World, now: Time) -> Balance {
        let totals = totals(world, now);
        self.energy_scale = self.energy_scale.max(energy_scale(&totals));
        self.momentum_scale = self.momentum_scale.max(totals.momentum_scale);
        self.angular_momentum_scale = self.angular_momentum_scale.max(totals.angular_scale);
        let (dissipated, work) = (self.dissipated.value(), self.work.value());
        let wall_impulse = self.wall_impulse.value();
        let gravity_impulse = world.gravity * (totals.free_mass * now.since(world.start));
        let mut energy = Sum::default();
        for term in [totals.kinetic, totals.potential, -self.energy_start, dissipated, -work] {
            energy.add(term);
        }
        let momentum_residual = totals.momentum - self.momentum_start - wall_impulse - gravity_impulse;
        let angular_residual = totals.angular
            - self.angular_momentum_start
            - self.wall_moment.value()
            - self.gravity_moment.value()
            - totals.pending_gravity_moment;
        let aperiodic = !world.domain.is_periodic();
        Balance {
            kinetic_energy: totals.kinetic,
            potential_energy: totals.potential,
            momentum: totals.momentum,
            angular_momentum: aperiodic.then_some(totals.angular),
            dissipated,
            work,
            wall_impulse,
            gravity_impulse,
            energy_start: self.energy_start,
            energy_error: relative(energy.value(), self.energy_scale),
            momentum_error: relative(momentum_residual.length(), self.momentum_scale),
            angular_momentum_error: aperiodic.then(|| relative(angular_residual.length(), self.angular_momentum_scale)),
        }
    }
}

fn energy_scale(totals: &Totals) -> f64 {
    totals.kinetic.max((totals.kinetic + totals.potential).abs())
}

fn relative(error: f64, scale: f64) -> f64 {
    if scale > 0.0 { error / scale } else { error }
}
