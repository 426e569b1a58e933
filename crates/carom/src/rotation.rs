//! Free rotation in closed form: how a body is oriented and how it turns, any time after its last impact.
//!
//! A body with three equal moments of inertia, or one that turns exactly about a principal axis, turns about a fixed
//! axis. In every other case the angular momentum L, which stays where it is in the world, wanders in the body (Euler's
//! equations), round one principal axis, the pole: that of the largest moment if L² > 2 E I₂, of the smallest if less.
//! The orientation is then a product of three rotations: the smallest one that brings the direction of L in the body to
//! the pole; a turn about the pole by an angle θ; and a constant one that brings the pole to where L points in the
//! world. The angle grows by
//!
//!   dθ/dt = (2E + L ω₃) / (L + I₃ ω₃),
//!
//! where 3 is the pole: at a constant rate on average, and the rest has the period of the wobble. A symmetric top is
//! the limit in which two plain rotations are left.
//!
//! What is evaluated is exact up to rounding, after any time: nothing is integrated in steps. The two rates, that of
//! the wobble and the mean one of the angle, have 32 digits, because their errors grow with time; everything else has
//! the precision of a double, because its errors do not. Close to the separatrix, L² = 2 E I₂, and for nearly equal
//! moments the rates depend on small differences; these are taken with 32 digits too, and the complementary modulus
//! from them, never from 1 - k².
//!
//! Sources: L. D. Landau and E. M. Lifshitz, Mechanics, section 37; R. van Zon and J. Schofield, J. Comput. Phys. 225
//! (2007) 145. How the angle is summed is explained with the wobble.

mod double_double;
mod elliptic;
mod top;
mod turns;
mod wobble;

use glam::{DQuat, DVec3};

use double_double::DoubleDouble;
use top::{Top, WobbleAxes};
use turns::{TurnRate, sine_cosine};
use wobble::Wobble;

use crate::tolerance::NEGLIGIBLE_MOMENTUM;

/// A body's rotation right after its last impact, prepared so that it can be evaluated any time later.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rotation {
    motion: Motion,
    energy: f64,
    angular_momentum: f64,
    fastest: f64,
    fastest_change: f64,
}

/// The two ways in which bodies turn.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Motion {
    Steady(Steady),
    Tumbling(Tumbling),
}

/// About an axis that is fixed in the world and in the body.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Steady {
    /// At the start, body to world.
    orientation: DQuat,
    /// World axes (rad/s).
    angular_velocity: DVec3,
    /// Unit vector of it; zero at rest.
    axis: DVec3,
    /// Of half of the angle turned.
    half_turn: TurnRate,
}

/// The angular momentum wanders in the body.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Tumbling {
    axes: WobbleAxes,
    wobble: Wobble,
    /// Of v, the phase of the wobble.
    phase: TurnRate,
    /// v at the start (turns).
    phase_at_start: f64,
    /// Of half of the even part of the angle about the angular momentum.
    half_turn: TurnRate,
    /// The sense of the wobble seen from the pole: 1 about the axis of the largest moment, -1 about the smallest's.
    sense: f64,
    /// L over each moment (rad/s), along the axes of the wobble.
    rates: DVec3,
    /// From body axes in which the angular momentum is at the pole, and which are turned by θ = 0, to the world.
    to_world: DQuat,
}

impl Rotation {
    /// Of what does not turn.
    pub const REST: Self = Self {
        motion: Motion::Steady(Steady {
            orientation: DQuat::IDENTITY,
            angular_velocity: DVec3::ZERO,
            axis: DVec3::ZERO,
            half_turn: TurnRate::NONE,
        }),
        energy: 0.0,
        angular_momentum: 0.0,
        fastest: 0.0,
        fastest_change: 0.0,
    };

    /// The rotation of a body with these principal moments of inertia (kg m², in the order of its axes; each positive,
    /// none more than 1e60 times another), of this orientation (principal axes to world; a unit quaternion but for
    /// rounding, of which only the direction counts) and this angular velocity (rad/s, world axes).
    pub fn new(moments: DVec3, orientation: DQuat, angular_velocity: DVec3) -> Self {
        // Powers of two, taken off and put back without rounding, so that no square below leaves the range of a double.
        let (inertia_unit, rate_unit) = (binary_unit(moments), binary_unit(angular_velocity));
        let start =
            Start { moments: (moments / inertia_unit).to_array(), orientation, rates: angular_velocity / rate_unit };
        let mut rotation = start.rotation(angular_velocity);
        match &mut rotation.motion {
            Motion::Steady(steady) => steady.half_turn = steady.half_turn.scaled(rate_unit),
            Motion::Tumbling(tumbling) => {
                tumbling.phase = tumbling.phase.scaled(rate_unit);
                tumbling.half_turn = tumbling.half_turn.scaled(rate_unit);
                tumbling.rates *= rate_unit;
            }
        }
        rotation.energy *= inertia_unit * rate_unit * rate_unit;
        rotation.angular_momentum *= inertia_unit * rate_unit;
        rotation.fastest *= rate_unit;
        rotation.fastest_change *= rate_unit * rate_unit;
        rotation
    }

    /// The orientation `seconds` after the start: a unit quaternion, principal axes to world. It is continuous in time:
    /// its sign is that which the body has turned to.
    pub fn orientation_after(&self, seconds: f64) -> DQuat {
        match &self.motion {
            Motion::Steady(steady) => steady.orientation_after(seconds),
            Motion::Tumbling(tumbling) => tumbling.state_after(seconds).0,
        }
    }

    /// The angular velocity (rad/s, world axes) `seconds` after the start.
    pub fn angular_velocity_after(&self, seconds: f64) -> DVec3 {
        match &self.motion {
            Motion::Steady(steady) => steady.angular_velocity,
            Motion::Tumbling(tumbling) => tumbling.state_after(seconds).1,
        }
    }

    /// Both of them, for the cost of one.
    pub fn state_after(&self, seconds: f64) -> (DQuat, DVec3) {
        match &self.motion {
            Motion::Steady(steady) => (steady.orientation_after(seconds), steady.angular_velocity),
            Motion::Tumbling(tumbling) => tumbling.state_after(seconds),
        }
    }

    /// The largest |ω| (rad/s) of the whole flight, or up to 4 ulp more: a bound, and one that is reached.
    pub fn fastest(&self) -> f64 {
        self.fastest
    }

    /// The largest |dω/dt| (rad/s²) of the whole flight, or up to a few ulp more: a bound, and one that is reached. It
    /// is the same in the world and in the body, because the two differ by ω × ω.
    pub fn fastest_change(&self) -> f64 {
        self.fastest_change
    }

    /// The kinetic energy of the rotation (J): ½ Σ I ω².
    pub fn energy(&self) -> f64 {
        self.energy
    }

    /// The angular momentum about the centre of mass (kg m²/s, world axes).
    pub fn angular_momentum(&self) -> DVec3 {
        let direction = match &self.motion {
            Motion::Steady(steady) => steady.axis,
            Motion::Tumbling(tumbling) => tumbling.to_world * tumbling.axes.to_body(DVec3::Z),
        };
        direction * self.angular_momentum
    }

    /// The time (s) after which the angular velocity is the same again in body axes, 4 K / τ. Infinite on the
    /// separatrix; `None` if the body turns about a fixed axis.
    pub fn wobble_period(&self) -> Option<f64> {
        match &self.motion {
            Motion::Steady(_) => None,
            Motion::Tumbling(tumbling) if tumbling.wobble.is_open() => Some(f64::INFINITY),
            Motion::Tumbling(tumbling) => Some(1.0 / tumbling.phase.turns_per_second()),
        }
    }
}

impl Steady {
    /// exp(ω t / 2) q.
    #[inline(always)]
    fn orientation_after(&self, seconds: f64) -> DQuat {
        let (sine, cosine) = sine_cosine(self.half_turn.after(seconds, 0.0));
        let turn = self.axis * sine;
        DQuat::from_xyzw(turn.x, turn.y, turn.z, cosine) * self.orientation
    }
}

impl Tumbling {
    #[inline(always)]
    fn state_after(&self, seconds: f64) -> (DQuat, DVec3) {
        let (to_pole, direction) = self.turned_to_pole(seconds);
        let orientation = self.to_world * to_pole;
        (orientation, orientation * self.axes.to_body(self.rates * direction))
    }

    /// The rotation, in body axes, that brings the angular momentum to the pole and turns about it; and the direction
    /// of the angular momentum, along the axes of the wobble.
    #[inline(always)]
    fn turned_to_pole(&self, seconds: f64) -> (DQuat, DVec3) {
        let point = self.wobble.at(self.phase_after(seconds));
        let n = point.direction;
        let (sine, cosine) = sine_cosine(self.half_turn.after(seconds, self.sense * point.lead));
        let [real, imaginary] = [point.uneven[0], self.sense * point.uneven[1]];
        let (c, s) = (cosine * real - sine * imaginary, cosine * imaginary + sine * real);
        // (c + s e₃) (1 + n₃ + n × e₃): the second factor is the smallest rotation from n to the pole e₃, times a
        // number.
        let (along, scalar) = (s * (1.0 + n.z), c * (1.0 + n.z));
        let vector = self.axes.to_body(DVec3::new(c * n.y + s * n.x, s * n.y - c * n.x, along));
        (DQuat::from_xyzw(vector.x, vector.y, vector.z, scalar).normalize(), n)
    }

    #[inline(always)]
    fn phase_after(&self, seconds: f64) -> f64 {
        if self.wobble.is_open() {
            // Nothing is periodic, and far from the start nothing moves in the body.
            return self.phase.turns_per_second() * seconds + self.phase_at_start;
        }
        self.phase.after(seconds, self.phase_at_start)
    }
}

/// The largest power of two that is at most the largest component's magnitude; 1 for a zero vector.
fn binary_unit(vector: DVec3) -> f64 {
    let largest = vector.abs().max_element();
    if largest > 0.0 { libm::scalbn(1.0, libm::frexp(largest).1 - 1) } else { 1.0 }
}

/// The state right after an impact, in units that leave the largest moment and the largest component of ω in [1, 2).
struct Start {
    moments: [f64; 3],
    orientation: DQuat,
    /// Angular velocity, world axes.
    rates: DVec3,
}

impl Start {
    /// `angular_velocity` as it was given.
    fn rotation(&self, angular_velocity: DVec3) -> Rotation {
        let [first, second, third] = self.moments;
        if first == second && second == third {
            let square = self.rates.length_squared();
            return self.steady(angular_velocity, 0.5 * first * square, first * square.sqrt());
        }
        let momentum = self.momentum();
        let size = (momentum[0].squared() + momentum[1].squared() + momentum[2].squared()).sqrt();
        let energy = 0.5 * (0..3).map(|i| momentum[i].high * momentum[i].high / self.moments[i]).sum::<f64>();
        if self.is_steady(&momentum) {
            self.steady(angular_velocity, energy, size.high)
        } else {
            self.tumbling(Top::new(self.moments, momentum, size), energy)
        }
    }

    /// The angular momentum along the body's axes.
    fn momentum(&self) -> [DoubleDouble; 3] {
        let rates = body_rates(self.orientation, self.rates);
        let momentum = [0, 1, 2].map(|i| rates[i] * self.moments[i]);
        let largest = momentum.iter().fold(0.0, |largest: f64, component| largest.max(component.high.abs()));
        momentum.map(
            |component| {
                if component.high.abs() < NEGLIGIBLE_MOMENTUM * largest { DoubleDouble::ZERO } else { component }
            },
        )
    }

    /// Whether L × ω is zero exactly: the axis of rotation is then fixed in the body. Next to it, it is not, and near
    /// the middle axis the body turns over, be it ever so late.
    fn is_steady(&self, momentum: &[DoubleDouble; 3]) -> bool {
        [(0, 1), (1, 2), (2, 0)]
            .iter()
            .all(|&(i, j)| self.moments[i] == self.moments[j] || momentum[i].high == 0.0 || momentum[j].high == 0.0)
    }

    fn steady(&self, angular_velocity: DVec3, energy: f64, angular_momentum: f64) -> Rotation {
        let [x, y, z] = self.rates.to_array().map(|w| DoubleDouble::product(w, w));
        let speed = (x + y + z).sqrt();
        let axis = if speed.high > 0.0 { self.rates / speed.high } else { DVec3::ZERO };
        Rotation {
            motion: Motion::Steady(Steady {
                orientation: self.orientation.normalize(),
                angular_velocity,
                axis,
                half_turn: TurnRate::from_radians(speed.scaled(0.5)),
            }),
            energy,
            angular_momentum,
            fastest: speed.high * (1.0 + f64::EPSILON),
            fastest_change: 0.0,
        }
    }

    fn tumbling(&self, top: Top, energy: f64) -> Rotation {
        let means = top.quarter_means();
        let wobble = Wobble::new(&top.elements(means.mean.high));
        let is_open = wobble.is_open();
        let tau = top.tau();
        let frequency = tau * means.mean;
        let mut tumbling = Tumbling {
            axes: top.axes,
            wobble,
            phase: if is_open { TurnRate::open(tau) } else { TurnRate::from_radians(frequency) },
            phase_at_start: top.phase_at_start(is_open, means.mean.high),
            half_turn: TurnRate::from_radians(top.turn_rate(frequency, means.share).scaled(0.5)),
            sense: top.sense,
            rates: top.rates(),
            to_world: DQuat::IDENTITY,
        };
        // Whatever rounding does to the start below, it does to every later instant: L stays where it is put here.
        let to_pole = tumbling.turned_to_pole(0.0).0;
        tumbling.to_world = (self.orientation.normalize() * to_pole.conjugate()).normalize();
        Rotation {
            motion: Motion::Tumbling(tumbling),
            energy,
            angular_momentum: top.size.high,
            fastest: top.fastest(),
            fastest_change: top.fastest_change(),
        }
    }
}

/// The angular velocity along the body's axes with 32 digits: the rates depend on it, and near the separatrix on its
/// small differences.
fn body_rates(orientation: DQuat, angular_velocity: DVec3) -> [DoubleDouble; 3] {
    let DQuat { x, y, z, w } = orientation;
    let of = DoubleDouble::product;
    let (ww, xx, yy, zz) = (of(w, w), of(x, x), of(y, y), of(z, z));
    let inverse = DoubleDouble::ONE / (ww + xx + yy + zz);
    let twice = |a: DoubleDouble, b: DoubleDouble| (a + b).scaled(2.0);
    let columns = [
        [(ww + xx) - (yy + zz), twice(of(x, y), of(w, z)), twice(of(x, z), of(-w, y))],
        [twice(of(x, y), of(-w, z)), (ww + yy) - (xx + zz), twice(of(y, z), of(w, x))],
        [twice(of(x, z), of(w, y)), twice(of(y, z), of(-w, x)), (ww + zz) - (xx + yy)],
    ];
    let [a, b, c] = angular_velocity.to_array();
    columns.map(|[x, y, z]| (x * a + y * b + z * c) * inverse)
}
