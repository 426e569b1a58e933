//! How long a separating direction certainly keeps two bodies apart.
//!
//! The direction may turn: n(s) = exp(Ω s) n, since whatever separates at each instant will do. For a point of A at y(s) from
//! its centre, G(s) = n(s)·y(s), and with Δ = ω − Ω
//!
//! ```text
//! G'(0) = (n × Δ)·y,    G'' = n·[Δ × (Δ × y) + (ω × Ω) × y + ω' × y],    |G''| ≤ (|Δ|² + |ω × Ω| + |ω'|) |y|.
//! ```
//!
//! (For Ω = 0 and constant ω: G'' = y·[ω × (ω × n)], so that |G''| ≤ |ω| |ω × n| |y|: nothing bends about its own axis.)
//! The offset x of the centres has C(s) = n(s)·x(s), C' = n·v + (Ω × n)·x and
//! |C'' − n·g| ≤ Ω²|x| + 2 |Ω||v| + |g| |n(s) − n|. So for all s of a step
//!
//! ```text
//! gap(s) ≥ C(0) + C'(0) s − h_A(−n − s n × Δ_A) − h_B(n + s n × Δ_B) − r_A − r_B − k s²,
//! ```
//!
//! where h are the support functions of the cores at s = 0, of *any* convex shape, and k collects half the bounds of the second
//! derivatives. The right side is concave in s (a support function is convex, its argument is linear in s), so that it has one
//! root beyond its start, which Newton's method finds from above; each of its steps needs one support point of each body.
//!
//! A direction that does not turn converges but linearly where a face turns: its far corners sweep toward the other body.
//! With Ω the rate at which the closest features themselves turn, an impact that is not grazing is approached quadratically.

use glam::DVec3;

use super::distance::{Link, Pair, Separation};
use super::motion::Pose;

/// Bounds of the motion of two bodies during a prediction.
#[derive(Clone, Copy, Debug)]
pub struct Motion {
    /// Velocity of A seen from B (m/s), at the instant of the bound.
    pub velocity: DVec3,
    /// Acceleration of A seen from B (m/s²).
    pub acceleration: DVec3,
    /// Bounds of |ω| (rad/s), A and B.
    pub fastest: [f64; 2],
    /// Bounds of |dω/dt| (rad/s²), A and B.
    pub fastest_change: [f64; 2],
    /// A bound of the distance (m) of the centres, if the bodies are so close only that they may touch.
    pub distance: f64,
}

/// A lower bound of the gap during a step, from its start.
#[derive(Clone, Copy, Debug)]
pub struct GapBound<'a> {
    pair: &'a Pair<'a>,
    /// C(0) less the roundings (m), and C'(0) (m/s).
    start: f64,
    rate: f64,
    /// Directions and their rates of change (1/s), each in the frame of its body; signs as for support points.
    a: [DVec3; 2],
    b: [DVec3; 2],
    /// k (m/s²).
    bend: f64,
}

impl<'a> GapBound<'a> {
    /// In the direction `normal`, which turns at `turning` (rad/s), for at most `longest` seconds.
    #[inline(always)]
    pub fn new(pair: &'a Pair<'a>, motion: &Motion, normal: DVec3, turning: DVec3, longest: f64) -> Self {
        let (a, b) = (&pair.a, &pair.b);
        let relative = [a.angular_velocity - turning, b.angular_velocity - turning];
        let still = turning == DVec3::ZERO;
        let bends = if still {
            still_bends(pair, motion, normal)
        } else {
            turning_bends(pair, motion, turning, relative, longest)
        };
        let normal_rate = turning.cross(normal);
        let centres = -normal.dot(motion.acceleration)
            + if still { 0.0 } else { bend_of_centres(pair, motion, turning.length(), longest) };
        let twice = bends[0] * a.solid.core_reach + bends[1] * b.solid.core_reach + centres;
        Self {
            pair,
            start: normal.dot(pair.offset) - a.solid.rounding - b.solid.rounding,
            rate: normal.dot(motion.velocity) + normal_rate.dot(pair.offset),
            a: [-a.to_body(normal), -a.to_body(normal.cross(relative[0]))],
            b: [b.to_body(normal), b.to_body(normal.cross(relative[1]))],
            bend: 0.5 * twice.max(0.0),
        }
    }

    /// k (m/s²): the bound is the linear motion of support points less k s².
    pub fn bend(&self) -> f64 {
        self.bend
    }

    /// The bound's linear piece at `seconds`: value (m) at the start and rate (m/s).
    #[inline(always)]
    fn piece(&self, seconds: f64) -> (f64, f64) {
        let a = self.pair.a.solid.support(self.a[0] + self.a[1] * seconds).point;
        let b = self.pair.b.solid.support(self.b[0] + self.b[1] * seconds).point;
        (self.start - self.a[0].dot(a) - self.b[0].dot(b), self.rate - self.a[1].dot(a) - self.b[1].dot(b))
    }

    /// Whether the bound is at or above `level` (m) at `seconds`; it is between any two instants where it is at both.
    #[inline(always)]
    pub fn is_above(&self, level: f64, seconds: f64) -> bool {
        let (start, rate) = self.piece(seconds);
        start + (rate - self.bend * seconds) * seconds >= level
    }

    /// Not less than what [`Self::stays_above`] will find, from the links that support the bodies now at a gap of `gap` (m).
    #[inline(always)]
    pub fn stays_at_most(&self, gap: f64, links: &[Link], level: f64) -> f64 {
        let mut rate = f64::INFINITY;
        for link in links {
            rate = rate.min(-self.a[1].dot(link.a.point) - self.b[1].dot(link.b.point));
        }
        fall(gap - level, self.rate + rate, self.bend)
    }

    /// The seconds, at most `longest`, for which the gap certainly stays at or above `level` (m), where it is at the start.
    #[inline(always)]
    pub fn stays_above(&self, level: f64, longest: f64) -> f64 {
        let mut seconds = longest;
        for _ in 0..PIECES {
            let (start, rate) = self.piece(seconds);
            let height = start - level;
            let value = height + (rate - self.bend * seconds) * seconds;
            if value >= 0.0 {
                return seconds;
            }
            let root = fall(height, rate, self.bend);
            if !(root < seconds) {
                return seconds.min(root);
            }
            seconds = root;
        }
        // Curved surfaces approach their root from above without end. A concave function lies above its chord.
        let at_start = self.piece(0.0).0 - level;
        let (last, slope) = self.piece(seconds);
        let at_end = last - level + (slope - self.bend * seconds) * seconds;
        if at_end >= 0.0 { seconds } else { seconds * (at_start / (at_start - at_end)).max(0.0) }
    }
}

/// Pieces of the bound looked at in a step; corners need fewer, curved surfaces double their digits with each.
const PIECES: usize = 12;

/// The first s > 0 at which `height` + `rate` s − `bend` s² falls to zero; `height` ≥ 0.
#[inline(always)]
fn fall(height: f64, rate: f64, bend: f64) -> f64 {
    if height <= 0.0 && rate <= 0.0 {
        return 0.0;
    }
    let root = (rate * rate + 4.0 * bend * height.max(0.0)).sqrt();
    if rate < 0.0 { 2.0 * height / (root - rate) } else { (rate + root) / (2.0 * bend) }
}

/// Bounds of |G''|/|y| (1/s²) in a direction that stands still.
#[inline(always)]
fn still_bends(pair: &Pair, motion: &Motion, normal: DVec3) -> [f64; 2] {
    let of = |pose: &Pose, fastest: f64, change: f64| {
        if change != 0.0 {
            return fastest * fastest + change;
        }
        let bend = fastest * pose.angular_velocity.cross(normal).length();
        if pose.solid.is_round_about_z() { bend.min(bend_of_axis(pose)) } else { bend }
    };
    [of(&pair.a, motion.fastest[0], motion.fastest_change[0]), of(&pair.b, motion.fastest[1], motion.fastest_change[1])]
}

/// The same bound for a shape round about its axis a: how fast it turns about that does not matter, so that it moves as one
/// that turns at ω − (ω·a) a, whose square is |ω × a|² and whose change is |ω·a| |ω × a| where ω is constant.
fn bend_of_axis(pose: &Pose) -> f64 {
    let axis = pose.to_world.z_axis;
    let across = pose.angular_velocity.cross(axis).length();
    across * (across + pose.angular_velocity.dot(axis).abs())
}

/// The same in a direction that turns at `turning`, for at most `longest` seconds.
#[inline(always)]
fn turning_bends(pair: &Pair, motion: &Motion, turning: DVec3, relative: [DVec3; 2], longest: f64) -> [f64; 2] {
    let of = |rate: DVec3, relative: DVec3, change: f64| {
        let drift = if change == 0.0 { 0.0 } else { change * longest };
        let relative = relative.length() + drift;
        relative * relative + rate.cross(turning).length() + drift * turning.length() + change
    };
    [
        of(pair.a.angular_velocity, relative[0], motion.fastest_change[0]),
        of(pair.b.angular_velocity, relative[1], motion.fastest_change[1]),
    ]
}

/// A bound of |C'' − n·g| (m/s²) in a direction that turns at `rate` (rad/s).
#[inline(always)]
fn bend_of_centres(pair: &Pair, motion: &Motion, rate: f64, longest: f64) -> f64 {
    let g = motion.acceleration.length();
    let speed = motion.velocity.length() + if g == 0.0 { 0.0 } else { g * longest };
    let distance = motion.distance.min(pair.offset.length() + speed * longest);
    let tilt = if g == 0.0 { 0.0 } else { (rate * longest).min(2.0) };
    rate * rate * distance + 2.0 * rate * speed + g * tilt
}

/// The angular velocity (rad/s), perpendicular to the normal, with which the normal must turn for its links to stay tied.
#[inline]
pub fn turning_of_normal(pair: &Pair, separation: &Separation) -> DVec3 {
    if pair.b.solid.is_half_space() {
        return pair.b.angular_velocity;
    }
    let n = separation.normal;
    let side = |link: &Link, base: &Link| {
        let a = pair.a.to_world(link.a.point - base.a.point);
        let b = pair.b.to_world(link.b.point - base.b.point);
        (a - b, n.dot(pair.a.angular_velocity.cross(a) - pair.b.angular_velocity.cross(b)))
    };
    match separation.links() {
        [base, second, third] => {
            let ((e, e_rate), (f, f_rate)) = (side(second, base), side(third, base));
            let volume = n.dot(e.cross(f));
            let rate = (f.cross(n) * e_rate + n.cross(e) * f_rate) / -volume;
            if volume != 0.0 { n.cross(rate) } else { DVec3::ZERO }
        }
        [base, second] => {
            let (e, e_rate) = side(second, base);
            let square = e.length_squared();
            if square > 0.0 { n.cross(e) * (-e_rate / square) } else { DVec3::ZERO }
        }
        _ => DVec3::ZERO,
    }
}
