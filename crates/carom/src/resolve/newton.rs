//! Newton's law of restitution without friction: v_AB·n after = -e v_AB·n before.

use glam::DVec3;

use crate::tolerance::ENERGY_FEEDBACK;

/// What the law is given: one contact of two bodies without rotational effects.
#[derive(Clone, Copy, Debug)]
pub struct Contact {
    /// Unit vector from B to A.
    pub normal: DVec3,
    /// Velocity of A (m/s).
    pub velocity_a: DVec3,
    /// Velocity of B (m/s).
    pub velocity_b: DVec3,
    /// Mass of A (kg), infinite if its motion is prescribed.
    pub mass_a: f64,
    /// Mass of B (kg); at most one of the two is infinite.
    pub mass_b: f64,
    /// Coefficient of restitution e.
    pub restitution: f64,
    /// -v_AB·n (m/s), positive; more than that by the growth of the surfaces while balls are placed.
    pub approach_speed: f64,
}

/// What the law gives.
#[derive(Clone, Copy, Debug)]
pub struct Outcome {
    /// Velocity of A after (m/s).
    pub velocity_a: DVec3,
    /// Velocity of B after (m/s).
    pub velocity_b: DVec3,
    /// By how much v_AB·n has changed (m/s): (1 + e) times the approach speed, up to rounding.
    pub change: f64,
}

/// The shares of a change of relative velocity that fall to A and to B: m_B/(m_A + m_B) and m_A/(m_A + m_B). Equal masses
/// share exactly in halves, so that a row of equal balls passes a blow on whole.
#[inline(always)]
fn shares(mass_a: f64, mass_b: f64) -> (f64, f64) {
    if mass_a == mass_b {
        (0.5, 0.5)
    } else if mass_a == f64::INFINITY {
        (0.0, 1.0)
    } else if mass_b == f64::INFINITY {
        (1.0, 0.0)
    } else {
        // Scaled by the larger mass, so that no sum of masses can overflow.
        let larger = mass_a.max(mass_b);
        let (a, b) = (mass_a / larger, mass_b / larger);
        (b / (a + b), a / (a + b))
    }
}

/// μ = 1 / (1/m_A + 1/m_B) (kg).
#[inline(always)]
pub fn reduced_mass(mass_a: f64, mass_b: f64) -> f64 {
    1.0 / (1.0 / mass_a + 1.0 / mass_b)
}

impl Contact {
    /// Work (J) that a partner in prescribed motion, at velocity V, does in this impact: J·V; 0 if both are free.
    pub fn work_of_prescribed(&self) -> f64 {
        let change = (1.0 + self.restitution) * self.approach_speed;
        if self.mass_b == f64::INFINITY {
            self.mass_a * change * self.normal.dot(self.velocity_b)
        } else if self.mass_a == f64::INFINITY {
            -self.mass_b * change * self.normal.dot(self.velocity_a)
        } else {
            0.0
        }
    }

    /// The impact: j = -(1 + e) v_AB·n / (1/m_A + 1/m_B), v_A += j n / m_A, v_B -= j n / m_B.
    ///
    /// `kinetic_energy` (J), for e = 1: what the free bodies' kinetic energy must be after the impact, carried from impact
    /// to impact. The rounding residual against it is fed back along n, at most [`ENERGY_FEEDBACK`] of the relative speed.
    /// `parts`: whether the pair, in the arithmetic by which it is predicted, parts at this relative velocity; where
    /// rounding leaves it approaching (e = 0), the least impulse that makes it part is added.
    #[inline(always)]
    pub fn resolve(&self, kinetic_energy: Option<f64>, parts: impl Fn(DVec3, DVec3) -> bool) -> Outcome {
        let n = self.normal;
        let relative = self.velocity_a - self.velocity_b;
        let approach_speed = self.approach_speed;
        let (share_a, share_b) = shares(self.mass_a, self.mass_b);
        let mut change = (1.0 + self.restitution) * approach_speed;
        let kicked = |change: f64| (self.velocity_a + n * (share_a * change), self.velocity_b - n * (share_b * change));
        let (mut velocity_a, mut velocity_b) = kicked(change);
        if let Some(energy) = kinetic_energy {
            let residual = energy - (kinetic(self.mass_a, velocity_a) + kinetic(self.mass_b, velocity_b));
            // dK/d(change): the free bodies' momenta along n, by their shares.
            let slope =
                moving(self.mass_a) * share_a * velocity_a.dot(n) - moving(self.mass_b) * share_b * velocity_b.dot(n);
            let most = ENERGY_FEEDBACK * relative.length();
            let correction = residual / slope;
            // A grazing impact has no leverage (and slope 0 none at all): what is left waits for the next.
            if correction.is_finite() {
                change += correction.clamp(-most, most);
                (velocity_a, velocity_b) = kicked(change);
            }
        }
        let mut extra = (f64::EPSILON * approach_speed).max(f64::MIN_POSITIVE);
        while !parts(velocity_a, velocity_b) && change.is_finite() {
            change += extra;
            extra *= 2.0;
            (velocity_a, velocity_b) = kicked(change);
        }
        Outcome { velocity_a, velocity_b, change }
    }

    /// j (N s): the reduced mass times the change of v_AB·n.
    #[inline(always)]
    pub fn impulse(&self, outcome: &Outcome) -> f64 {
        reduced_mass(self.mass_a, self.mass_b) * outcome.change
    }

    /// ½ μ (1 - e²) (v_AB·n)² (J).
    #[inline(always)]
    pub fn energy_lost(&self) -> f64 {
        let mu = reduced_mass(self.mass_a, self.mass_b);
        0.5 * mu * (1.0 - self.restitution * self.restitution) * self.approach_speed * self.approach_speed
    }
}

/// Kinetic energy (J) of a free body; 0 of one in prescribed motion.
#[inline(always)]
fn kinetic(mass: f64, velocity: DVec3) -> f64 {
    if mass == f64::INFINITY { 0.0 } else { 0.5 * mass * velocity.length_squared() }
}

#[inline(always)]
fn moving(mass: f64) -> f64 {
    if mass == f64::INFINITY { 0.0 } else { mass }
}
