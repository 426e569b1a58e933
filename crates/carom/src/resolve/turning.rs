//! Newton's law of restitution, without friction, for bodies that turn: one contact normal, and one or several points of
//! contact at one instant.
//!
//! With one point, v_AB·n after = -e v_AB·n before, v_AB the relative velocity v + ω × r of the points in contact. With
//! several (a face on a face, an edge on a face) the rule is that of *reflections* (Smith, Kaufman, Vouga, Tamstorf,
//! Grinspun 2012): the velocities are reflected, in the metric of kinetic energy, at those that keep all approaching points
//! from approaching, again until none approaches. That keeps energy, momentum and symmetry, and pushes, never pulls. With
//! e < 1 the outcome lies between that and the perfectly plastic one, by the shares e and 1 - e.

use glam::{DMat3, DVec3};

use crate::tolerance::{ENERGY_FEEDBACK, RESTING};

/// How a body moves: velocity of its centre of mass (m/s) and angular velocity (rad/s), world axes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Twist {
    /// m/s
    pub velocity: DVec3,
    /// rad/s
    pub angular_velocity: DVec3,
}

impl Twist {
    /// Velocity (m/s) of the body's point at `arm` (m) from its centre: v + ω × r.
    #[inline(always)]
    pub fn at(&self, arm: DVec3) -> DVec3 {
        self.velocity + self.angular_velocity.cross(arm)
    }
}

/// A body's answer to an impulse; nothing of one in prescribed motion.
#[derive(Clone, Copy, Debug)]
pub struct Mobility {
    /// Mass (kg), infinite if the motion is prescribed.
    pub mass: f64,
    /// Principal axes to world, as columns.
    pub axes: DMat3,
    /// About them, one over the moments of inertia (1/(kg m²)). The tensor is never multiplied out: of a thin body it is so
    /// large along one axis that rounding would show along the others.
    pub inverse_moments: DVec3,
}

impl Mobility {
    /// Of a body in prescribed motion.
    pub const NONE: Self = Self { mass: f64::INFINITY, axes: DMat3::IDENTITY, inverse_moments: DVec3::ZERO };

    /// Of a free body with these principal moments (kg m²) about the columns of `axes` (principal axes to world).
    pub fn new(mass: f64, moments: DVec3, axes: DMat3) -> Self {
        let alike = moments.x == moments.y && moments.y == moments.z;
        Self { mass, axes: if alike { DMat3::IDENTITY } else { axes }, inverse_moments: moments.recip() }
    }

    #[inline(always)]
    fn is_free(&self) -> bool {
        self.mass.is_finite()
    }

    #[inline(always)]
    pub(super) fn inverse_mass(&self) -> f64 {
        if self.is_free() { 1.0 / self.mass } else { 0.0 }
    }

    /// Δω (rad/s) by the moment of an impulse (N m s).
    #[inline(always)]
    pub(super) fn turn(&self, moment: DVec3) -> DVec3 {
        self.axes * (self.inverse_moments * (self.axes.transpose() * moment))
    }

    /// n·(1/m + (I⁻¹ (r × n)) × r)·n of an impulse at `arm` (1/kg), and its answer at the arm `other`.
    #[inline(always)]
    fn along(&self, arm: DVec3, other: DVec3, normal: DVec3) -> f64 {
        self.inverse_mass() + other.cross(normal).dot(self.turn(arm.cross(normal)))
    }
}

/// A point of contact, seen from both centres of mass (m, world axes).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Arms {
    /// From A's centre.
    pub a: DVec3,
    /// From B's centre.
    pub b: DVec3,
}

/// What the law is given.
#[derive(Clone, Copy, Debug)]
pub struct TurningContact<'a> {
    /// Unit vector from B to A.
    pub normal: DVec3,
    /// The points in contact, at least one.
    pub points: &'a [Arms],
    /// Of A and of B; at most one in prescribed motion.
    pub mobilities: [Mobility; 2],
    /// Of A and of B, before.
    pub twists: [Twist; 2],
    /// Coefficient of restitution e.
    pub restitution: f64,
}

/// What the law gives.
#[derive(Clone, Copy, Debug)]
pub struct TurningOutcome {
    /// Of A and of B, after.
    pub twists: [Twist; 2],
    /// j (N s), summed over the points: +j n acts on A, -j n on B. 0 if no point approaches.
    pub impulse: f64,
    /// Of it (N s) what acts at each point, none negative. Of four points and more it is one choice of several with the same
    /// velocities after.
    pub impulses: [f64; MOST_POINTS],
    /// Where the impulse acts: the points' mean, weighted by their shares of it.
    pub centre: Arms,
    /// -v_AB·n before at the centre of the impulse (m/s).
    pub approach_speed: f64,
    /// v_AB·n after at the centre of the impulse (m/s).
    pub separation_speed: f64,
    /// Energy lost (J): ½ (1 - e²) (v_AB·n)² / (n·K n) of a single point; minus the work of the impulses otherwise.
    pub energy_lost: f64,
}

/// Points at most.
pub const MOST_POINTS: usize = 16;

/// What the kinetic energy (J) must be after, less what it is with the given twists of A and B.
pub type EnergyResidual<'a> = &'a dyn Fn(&[Twist; 2]) -> f64;

type Shares = [f64; MOST_POINTS];

/// Reflections after which the rule gives up (a count). It ends in a few; points of one normal need more than one only where
/// an impulse makes others approach.
const PASSES: usize = 256;

impl TurningContact<'_> {
    /// v_AB·n (m/s) of a point; negative: approaching.
    #[inline(always)]
    pub fn speed(&self, point: &Arms, twists: &[Twist; 2]) -> f64 {
        (twists[0].at(point.a) - twists[1].at(point.b)).dot(self.normal)
    }

    /// The impact. `energy_residual`, for e = 1: it is fed back along the impulse, at most [`ENERGY_FEEDBACK`] of the velocities;
    /// not where bodies meet flat, whose velocities are exact. No point approaches after.
    pub fn resolve(&self, energy_residual: Option<EnergyResidual>) -> TurningOutcome {
        let points = &self.points[..self.points.len().min(MOST_POINTS)];
        let approaching = points.iter().any(|point| self.speed(point, &self.twists) < 0.0);
        if !approaching {
            return self.unchanged(points);
        }
        match points {
            [point] => self.single(*point, energy_residual),
            _ => match self.central(points) {
                Some(outcome) => outcome,
                None => self.several(points, energy_residual),
            },
        }
    }

    /// Work (J) that a partner in prescribed motion does in the impact: J·V at the centre of the impulse; 0 if both are free.
    pub fn work_of_prescribed(&self, outcome: &TurningOutcome) -> f64 {
        let [a, b] = &self.twists;
        match self.mobilities.map(|mobility| mobility.is_free()) {
            [true, false] => outcome.impulse * self.normal.dot(b.at(outcome.centre.b)),
            [false, true] => -outcome.impulse * self.normal.dot(a.at(outcome.centre.a)),
            _ => 0.0,
        }
    }

    fn unchanged(&self, points: &[Arms]) -> TurningOutcome {
        let centre = points
            .iter()
            .copied()
            .reduce(|a, b| if self.speed(&b, &self.twists) < self.speed(&a, &self.twists) { b } else { a });
        let centre = centre.unwrap_or_default();
        let speed = self.speed(&centre, &self.twists);
        TurningOutcome {
            twists: self.twists,
            impulse: 0.0,
            impulses: [0.0; MOST_POINTS],
            centre,
            approach_speed: -speed,
            separation_speed: speed,
            energy_lost: 0.0,
        }
    }

    /// n·K n (1/kg) between two points: the change of v_AB·n at `other` by a unit impulse at `point`.
    #[inline(always)]
    fn answer(&self, point: &Arms, other: &Arms) -> f64 {
        self.mobilities[0].along(point.a, other.a, self.normal)
            + self.mobilities[1].along(point.b, other.b, self.normal)
    }

    /// The twists after impulses (N s) at the points.
    fn kicked(&self, points: &[Arms], impulses: &[f64]) -> [Twist; 2] {
        let sum: f64 = impulses.iter().sum();
        let kick = self.normal * sum;
        let mut moments = [DVec3::ZERO; 2];
        for (point, &impulse) in points.iter().zip(impulses) {
            let kick = self.normal * impulse;
            moments[0] += point.a.cross(kick);
            moments[1] += point.b.cross(kick);
        }
        let [a, b] = self.twists;
        let [mobility_a, mobility_b] = &self.mobilities;
        [
            Twist {
                velocity: a.velocity + kick * mobility_a.inverse_mass(),
                angular_velocity: a.angular_velocity + mobility_a.turn(moments[0]),
            },
            Twist {
                velocity: b.velocity - kick * mobility_b.inverse_mass(),
                angular_velocity: b.angular_velocity - mobility_b.turn(moments[1]),
            },
        ]
    }

    /// j = -(1 + e) v_AB·n / (1/m_A + 1/m_B + n·[(I_A⁻¹ (r_A × n)) × r_A] + n·[(I_B⁻¹ (r_B × n)) × r_B]).
    fn single(&self, point: Arms, energy_residual: Option<EnergyResidual>) -> TurningOutcome {
        let inverse_mass = self.answer(&point, &point);
        let approach_speed = -self.speed(&point, &self.twists);
        let impulse = (1.0 + self.restitution) * approach_speed / inverse_mass;
        let mut outcome = self.fed_back(&[point], &[impulse], energy_residual);
        outcome.energy_lost =
            0.5 * (1.0 - self.restitution * self.restitution) * approach_speed * approach_speed / inverse_mass;
        outcome
    }

    /// Several points that approach at one speed, with the line through the centres of mass of the free bodies between them:
    /// bodies that meet flat. The impulse acts along that line, and no spin changes, to the last bit.
    fn central(&self, points: &[Arms]) -> Option<TurningOutcome> {
        let n = self.normal;
        let first = self.speed(&points[0], &self.twists);
        if !points.iter().all(|point| self.speed(point, &self.twists) == first) {
            return None;
        }
        let [a, b] = self.mobilities;
        let arms = if a.is_free() { points.map_first(|p| p.a) } else { points.map_first(|p| p.b) };
        // The centre of mass, seen along n, from the first point.
        let across = |v: DVec3| v - n * n.dot(v);
        if a.is_free() && b.is_free() {
            let offset = across(points[0].b - points[0].a);
            let size = points.iter().map(|p| p.a.length() + p.b.length()).fold(0.0, f64::max);
            if offset.length() > RESTING * size {
                return None;
            }
        }
        let weights = weights_of_centre(&arms[..points.len()], n)?;
        let centre = points.iter().zip(weights).fold(Arms::default(), |sum, (point, weight)| Arms {
            a: sum.a + point.a * weight,
            b: sum.b + point.b * weight,
        });
        let approach_speed = -first;
        let inverse_mass = a.inverse_mass() + b.inverse_mass();
        let share = |mobility: &Mobility| mobility.inverse_mass() / inverse_mass;
        let impulse = (1.0 + self.restitution) * approach_speed / inverse_mass;
        // What approaches is taken away, what parts is put in its place: each without the rounding of the other.
        let moved = |twist: Twist, share: f64| Twist {
            velocity: (twist.velocity + n * (approach_speed * share)) + n * (self.restitution * approach_speed * share),
            ..twist
        };
        Some(TurningOutcome {
            twists: [moved(self.twists[0], share(&a)), moved(self.twists[1], -share(&b))],
            impulse,
            impulses: weights.map(|weight| weight * impulse),
            centre,
            approach_speed,
            separation_speed: self.restitution * approach_speed,
            energy_lost: 0.5 * (1.0 - self.restitution * self.restitution) * approach_speed * approach_speed
                / inverse_mass,
        })
    }

    fn several(&self, points: &[Arms], energy_residual: Option<EnergyResidual>) -> TurningOutcome {
        let e = self.restitution;
        let mut impulses = [0.0; MOST_POINTS];
        if e > 0.0 {
            let reflected = self.passes(points, 2.0);
            impulses.iter_mut().zip(reflected).for_each(|(sum, impulse)| *sum += e * impulse);
        }
        if e < 1.0 {
            let plastic = self.passes(points, 1.0);
            impulses.iter_mut().zip(plastic).for_each(|(sum, impulse)| *sum += (1.0 - e) * impulse);
        }
        let impulses = &impulses[..points.len()];
        let mut outcome = self.fed_back(points, impulses, energy_residual);
        let work = points.iter().zip(impulses).map(|(point, impulse)| {
            0.5 * impulse * (self.speed(point, &self.twists) + self.speed(point, &outcome.twists))
        });
        outcome.energy_lost = if e == 1.0 { 0.0 } else { -work.sum::<f64>() };
        outcome
    }

    /// The impulses (N s) that keep approaching points from approaching (`factor` 1) or reflect them (2), until none approaches.
    fn passes(&self, points: &[Arms], factor: f64) -> Shares {
        let mut total = [0.0; MOST_POINTS];
        let mut twists = self.twists;
        let least = RESTING * self.fastest(points);
        for _ in 0..PASSES {
            let mut approaching = [0; MOST_POINTS];
            let mut count = 0;
            for (k, point) in points.iter().enumerate() {
                if self.speed(point, &twists) < -least {
                    approaching[count] = k;
                    count += 1;
                }
            }
            if count == 0 {
                break;
            }
            let impulses = self.stopping(points, &approaching[..count], &twists);
            for k in 0..points.len() {
                total[k] += factor * impulses[k];
            }
            twists = self.kicked(points, &total[..points.len()]);
        }
        total
    }

    /// Speed (m/s) that none of the points exceeds.
    fn fastest(&self, points: &[Arms]) -> f64 {
        let arms = points
            .iter()
            .fold([0.0; 2], |most: [f64; 2], point| [most[0].max(point.a.length()), most[1].max(point.b.length())]);
        let of = |twist: &Twist, arm: f64| twist.velocity.length() + twist.angular_velocity.length() * arm;
        of(&self.twists[0], arms[0]) + of(&self.twists[1], arms[1])
    }

    /// The least impulses, none of them negative, after which none of the `chosen` points approaches:
    /// 0 ≤ λ ⊥ u + W λ ≥ 0. The velocities that follow are unique; impulses at three points are enough for them, as one
    /// normal and points in a plane have three degrees of freedom, so every one, two and three of the points are tried.
    fn stopping(&self, points: &[Arms], chosen: &[usize], twists: &[Twist; 2]) -> Shares {
        let count = chosen.len();
        let mut w = [[0.0; MOST_POINTS]; MOST_POINTS];
        let mut u = [0.0; MOST_POINTS];
        for i in 0..count {
            u[i] = self.speed(&points[chosen[i]], twists);
            for j in 0..=i {
                w[i][j] = self.answer(&points[chosen[j]], &points[chosen[i]]);
                w[j][i] = w[i][j];
            }
        }
        // The least speed at which a point still approaches, of the best so far.
        let mut best = ([0.0; MOST_POINTS], f64::NEG_INFINITY);
        let mut consider = |set: &[usize]| {
            let Some(lambda) = solve(&w, &u, set) else { return };
            let mut shares = [0.0; MOST_POINTS];
            for (&k, lambda) in set.iter().zip(lambda) {
                if !(lambda >= 0.0) {
                    return;
                }
                shares[k] = lambda;
            }
            let least = (0..count)
                .filter(|k| !set.contains(k))
                .map(|i| u[i] + (0..count).map(|j| w[i][j] * shares[j]).sum::<f64>())
                .fold(0.0, f64::min);
            if least > best.1 {
                best = (shares, least);
            }
        };
        for i in 0..count {
            consider(&[i]);
            for j in 0..i {
                consider(&[j, i]);
                for k in 0..j {
                    consider(&[k, j, i]);
                }
            }
        }
        let mut impulses = [0.0; MOST_POINTS];
        for (&k, share) in chosen.iter().zip(best.0) {
            impulses[k] = share;
        }
        impulses
    }

    /// The outcome of impulses, after the residual of energy, if there is any, was fed back by scaling them.
    fn fed_back(&self, points: &[Arms], impulses: &[f64], energy_residual: Option<EnergyResidual>) -> TurningOutcome {
        let mut twists = self.kicked(points, impulses);
        let mut scaled = [0.0; MOST_POINTS];
        scaled[..impulses.len()].copy_from_slice(impulses);
        if let Some(residual) = energy_residual {
            // dE/d(scale) = Σ j_i v_AB·n_i after.
            let slope: f64 =
                points.iter().zip(impulses).map(|(point, impulse)| impulse * self.speed(point, &twists)).sum();
            let parting: f64 = slope / impulses.iter().sum::<f64>();
            let most = ENERGY_FEEDBACK * self.fastest(points) / parting;
            let correction = residual(&twists) / slope;
            if correction.is_finite() && most.is_finite() {
                let scale = correction.clamp(-most.abs(), most.abs());
                scaled.iter_mut().for_each(|impulse| *impulse += *impulse * scale);
                twists = self.kicked(points, &scaled[..impulses.len()]);
            }
        }
        let impulse: f64 = scaled.iter().sum();
        let centre = points.iter().zip(scaled).fold(Arms::default(), |sum, (point, share)| Arms {
            a: sum.a + point.a * (share / impulse),
            b: sum.b + point.b * (share / impulse),
        });
        let centre = if points.len() == 1 { points[0] } else { centre };
        TurningOutcome {
            twists,
            impulse,
            impulses: scaled,
            centre,
            approach_speed: -self.speed(&centre, &self.twists),
            separation_speed: self.speed(&centre, &twists),
            energy_lost: 0.0,
        }
    }
}

trait MapFirst {
    fn map_first(&self, f: impl Fn(&Arms) -> DVec3) -> [DVec3; MOST_POINTS];
}

impl MapFirst for [Arms] {
    fn map_first(&self, f: impl Fn(&Arms) -> DVec3) -> [DVec3; MOST_POINTS] {
        std::array::from_fn(|k| self.get(k).map_or(DVec3::ZERO, &f))
    }
}

/// λ with u + W λ = 0 on a set of one, two or three points; `None` if their equations depend on each other.
fn solve(w: &[[f64; MOST_POINTS]; MOST_POINTS], u: &[f64; MOST_POINTS], set: &[usize]) -> Option<[f64; 3]> {
    let mut rows = [[0.0; 4]; 3];
    let n = set.len();
    for (row, &i) in rows.iter_mut().zip(set) {
        for (column, &j) in set.iter().enumerate() {
            row[column] = w[i][j];
        }
        row[3] = -u[i];
    }
    // Symmetric and positive: no pivot is better than the next.
    for k in 0..n {
        let scale = w[set[k]][set[k]];
        if !(rows[k][k] > SINGULAR * scale) {
            return None;
        }
        for i in k + 1..n {
            let factor = rows[i][k] / rows[k][k];
            for column in [0, 1, 2, 3] {
                rows[i][column] -= factor * rows[k][column];
            }
        }
    }
    let mut lambda = [0.0; 3];
    for k in (0..n).rev() {
        let known: f64 = (k + 1..n).map(|j| rows[k][j] * lambda[j]).sum();
        lambda[k] = (rows[k][3] - known) / rows[k][k];
    }
    Some(lambda)
}

/// A pivot below this fraction of the diagonal is what rounding leaves of none (pure number, 2⁻⁴⁰).
const SINGULAR: f64 = 1.0 / (1u64 << 40) as f64;

/// Weights, none negative and of sum 1, that put the mean of the arms on the axis along n through the centre; of one, two or
/// three of them. `None` if the axis does not pass between them.
fn weights_of_centre(arms: &[DVec3], n: DVec3) -> Option<Shares> {
    let side = if n.x.abs() < 0.7 { DVec3::X } else { DVec3::Y };
    let x = side.cross(n);
    let y = n.cross(x);
    let place = |k: usize| (arms[k].dot(x), arms[k].dot(y));
    let size = arms.iter().map(|arm| arm.length()).fold(0.0, f64::max);
    let mut weights = [0.0; MOST_POINTS];
    for i in 0..arms.len() {
        let (xi, yi) = place(i);
        if xi.abs().max(yi.abs()) <= RESTING * size {
            weights[i] = 1.0;
            return Some(weights);
        }
        for j in 0..i {
            let (xj, yj) = place(j);
            let (dx, dy) = (xi - xj, yi - yj);
            let share = -(xj * dx + yj * dy) / (dx * dx + dy * dy);
            let (x, y) = (xj + share * dx, yj + share * dy);
            if (0.0..=1.0).contains(&share) && x.abs().max(y.abs()) <= RESTING * size {
                (weights[i], weights[j]) = (share, 1.0 - share);
                return Some(weights);
            }
        }
    }
    for i in 0..arms.len() {
        for j in 0..i {
            for k in 0..j {
                let (p, q, r) = (place(i), place(j), place(k));
                let area = |a: (f64, f64), b: (f64, f64)| a.0 * b.1 - a.1 * b.0;
                let parts = [area(q, r), area(r, p), area(p, q)];
                let whole: f64 = parts.iter().sum();
                if whole != 0.0 && parts.iter().all(|part| part / whole >= 0.0) {
                    (weights[i], weights[j], weights[k]) = (parts[0] / whole, parts[1] / whole, parts[2] / whole);
                    return Some(weights);
                }
            }
        }
    }
    None
}
