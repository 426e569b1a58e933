//! Two bodies that fly freely and turn: when they first touch.
//!
//! The guarantee, with δ the tolerance [`crate::tolerance::contact`]: no impact deeper than δ is missed, whatever the spin and
//! however grazing, and whatever is reported is within δ of contact. The search walks in time from one separating direction to
//! the next ([`distance`]); each is proved to separate the bodies up to a later instant ([`bound`]), where the next is sought.
//! What lies between is thereby free of impacts, and nothing depends on how good the directions are but the number of steps.
//! As steps end where a bound falls to zero, and the bound is of second order in a direction that turns with what is about to
//! touch, the gap left is squared from step to step and soon below δ: there the features in contact say whether they approach
//! ([`contact`]). Bodies that touch and part are followed until the bound shows them to have left.

pub mod bound;
pub mod climb;
pub mod contact;
mod depth;
pub mod distance;
pub mod motion;
pub(crate) mod patch;
pub mod solid;
pub mod window;

use glam::DVec3;

use self::bound::{GapBound, Motion, turning_of_normal};
use self::contact::{Contact, Feature};
use self::distance::{Pair, Separation};
use self::motion::{Body, Pose, Turning};
use self::window::Window;
pub use crate::event::Certificate;
use crate::tolerance;

/// The first impact of two bodies.
#[derive(Clone, Copy, Debug)]
pub struct Impact {
    /// Seconds to it.
    pub seconds: f64,
    /// How certain it is.
    pub certificate: Certificate,
    /// Unit vector from B to A, world axes.
    pub normal: DVec3,
    /// What touches, of A and of B.
    pub features: [Feature; 2],
    /// The largest approach speed of points in contact (m/s).
    pub approach_speed: f64,
}

/// What a search found.
#[derive(Clone, Copy, Debug)]
pub struct Search {
    /// The first impact before the horizon.
    pub impact: Option<Impact>,
    /// Seconds up to which there certainly is none (or that of the impact). Less than the horizon without an impact only if
    /// the search was cut off, so that it has to be taken up there again.
    pub clear_until: f64,
    /// Steps taken, each at an instant of its own.
    pub steps: u32,
}

impl Search {
    /// Nothing found within `horizon` seconds.
    pub fn clear(horizon: f64) -> Self {
        Self { impact: None, clear_until: horizon, steps: 0 }
    }
}

/// The separating direction last known of a pair, to start the next search from.
#[derive(Clone, Copy, Debug, Default)]
pub struct Memory(Option<Separation>);

impl Memory {
    /// The direction known, or where to look first.
    #[inline(always)]
    fn known(&self, pair: &Pair) -> Separation {
        self.0.unwrap_or_else(|| Separation::along(unit_or_z(pair.first_guess())))
    }

    /// The same pair in the other order.
    pub fn swapped(self) -> Self {
        Self(self.0.map(|known| Separation {
            normal: -known.normal,
            links: known.links.map(|link| distance::Link { a: link.b, b: link.a }),
            ..known
        }))
    }
}

/// Steps after which a search is cut off (a count); a hundred is much, and grazing passes need some thousand at worst.
pub const STEPS: u32 = 20_000;

/// Seconds that stand for ever, so that no product with them is infinite.
const FOREVER: f64 = 1e30;

/// Bodies that turn about changing axes are followed for at most this part of a radian at a time in a direction that turns (pure
/// number), so that the bound of how their axes drift stays small. It limits a step, not what is found.
const DRIFT: f64 = 0.25;

/// When A and B first touch, within `horizon` seconds; an impact found is the same for every later horizon. One of them may be a
/// half-space. Swapping A and B turns the normal around. B, and only B, may be a triangle of a mesh.
pub fn first_impact<R: Turning>(a: &Body<R>, b: &Body<R>, horizon: f64, memory: &mut Memory) -> Search {
    if a.solid.is_half_space() {
        let mut search = first_impact(b, a, horizon, memory);
        if let Some(impact) = &mut search.impact {
            impact.normal = -impact.normal;
            impact.features.reverse();
        }
        return search;
    }
    let flight = RelativeFlight::of(a, b);
    let mut search = Search::clear(horizon);
    let mut after = 0.0;
    while let Some((entry, exit)) = flight.window(after) {
        if !(entry < horizon) {
            break;
        }
        let ended = walk(a, b, &flight, (entry, exit.min(FOREVER)), horizon, memory, &mut search);
        if ended || flight.straight || !(exit < horizon) || exit <= after {
            break;
        }
        after = exit;
    }
    search
}

/// The gap (m) of two bodies as they stand; negative, by how deep, if they overlap.
pub fn gap<R: Turning>(a: &Body<R>, b: &Body<R>) -> f64 {
    gap_beyond(a, b, 0.0)
}

/// As [`gap`], for bodies that may touch: by how little they overlap within δ/2 is told by the direction of the contact alone,
/// without a search for a better one, which takes thousands of directions.
pub fn contact_gap<R: Turning>(a: &Body<R>, b: &Body<R>) -> f64 {
    gap_beyond(a, b, 1.0)
}

/// The gap (m), searched for in all directions where it is not above -`share` times δ/2.
fn gap_beyond<R: Turning>(a: &Body<R>, b: &Body<R>, share: f64) -> f64 {
    if a.solid.is_half_space() {
        return gap_beyond(b, a, share);
    }
    let flight = RelativeFlight::of(a, b);
    let (pair, _) = flight.pair(a, b, 0.0);
    let close = flight.close(a, b);
    let gap = pair.separate(&Memory::default().known(&pair), close).gap;
    // Where they overlap, the search for a separating direction ends in any: of no direction is the gap larger than the gap.
    if gap >= -share * close || b.solid.is_half_space() { gap } else { pair.largest_gap().max(gap) }
}

/// The contact of two bodies `seconds` on, at an impact that was found: all points that touch then.
pub fn contact_after<R: Turning>(a: &Body<R>, b: &Body<R>, seconds: f64, memory: &Memory) -> Contact {
    if a.solid.is_half_space() {
        return contact_after(b, a, seconds, memory).swapped();
    }
    let flight = RelativeFlight::of(a, b);
    let (pair, motion) = flight.pair(a, b, seconds);
    let close = flight.close(a, b);
    let separation = pair.separate(&memory.known(&pair), close);
    Contact::of(&pair, &motion, &separation, close)
}

/// The gap (m) of two bodies as they stand and their contact, if that is within `tolerance` (m). B may be a triangle of a mesh.
pub fn touch<R: Turning>(a: &Body<R>, b: &Body<R>, tolerance: f64) -> Option<(f64, Contact)> {
    let flight = RelativeFlight::of(a, b);
    let (pair, motion) = flight.pair(a, b, 0.0);
    let close = flight.close(a, b);
    let separation = pair.separate(&Memory::default().known(&pair), close);
    (separation.gap <= tolerance).then(|| (separation.gap, Contact::of(&pair, &motion, &separation, close)))
}

/// The flight of A's centre seen from B's, and what bounds the motion of both.
struct RelativeFlight {
    position: DVec3,
    velocity: DVec3,
    acceleration: DVec3,
    straight: bool,
    /// Distance (m) of centres beyond which bodies do not touch; infinite for a half-space that turns.
    reach: f64,
    /// Normal of B's plane if it is a half-space that does not turn.
    plane: Option<DVec3>,
    fastest: [f64; 2],
    fastest_change: [f64; 2],
    /// The longest step (s) in a direction that turns.
    longest: f64,
}

/// Windows are this fraction wider than the spheres around the bodies (pure number, 2⁻²⁰), so that their rounding hides nothing.
const WINDOW_MARGIN: f64 = 1.0 / (1u64 << 20) as f64;

impl RelativeFlight {
    #[inline(always)]
    fn of<R: Turning>(a: &Body<R>, b: &Body<R>) -> Self {
        let acceleration = a.acceleration - b.acceleration;
        let fastest = [a.rotation.fastest(), b.rotation.fastest()];
        let fastest_change = [a.rotation.fastest_change(), b.rotation.fastest_change()];
        let longest = |k: usize| {
            if fastest_change[k] == 0.0 { f64::INFINITY } else { DRIFT * fastest[k] / fastest_change[k] }
        };
        let is_plane = b.solid.is_half_space();
        Self {
            position: a.position - b.position,
            velocity: a.velocity - b.velocity,
            acceleration,
            straight: acceleration == DVec3::ZERO,
            reach: if is_plane && fastest[1] > 0.0 {
                f64::INFINITY
            } else {
                (a.solid.reach() + b.solid.reach()) * (1.0 + WINDOW_MARGIN)
            },
            plane: (is_plane && fastest[1] == 0.0).then(|| b.rotation.state_after(b.elapsed).0 * DVec3::Z),
            fastest,
            fastest_change,
            longest: longest(0).min(longest(1)),
        }
    }

    /// When the bodies are first near each other after `after` (s).
    #[inline(always)]
    fn window(&self, after: f64) -> Option<Window> {
        if let Some(normal) = self.plane {
            let along = |v: DVec3| normal.dot(v);
            let heights = [along(self.position) - self.reach, along(self.velocity), 0.5 * along(self.acceleration)];
            return window::below_zero(heights, after);
        }
        if self.reach.is_infinite() {
            return Some((after, f64::INFINITY));
        }
        if self.straight {
            return window::of_straight_flight(self.position, self.velocity, self.reach);
        }
        let (x, v, g) = (self.position, self.velocity, self.acceleration);
        let distance = x.length();
        let c = [
            (distance - self.reach) * (distance + self.reach),
            2.0 * x.dot(v),
            v.length_squared() + x.dot(g),
            v.dot(g),
            0.25 * g.length_squared(),
        ];
        window::below_zero(c, after)
    }

    /// Both bodies and the bounds of their motion, `seconds` later.
    #[inline(always)]
    fn pair<'a, R: Turning>(&self, a: &Body<'a, R>, b: &Body<'a, R>, seconds: f64) -> (Pair<'a>, Motion) {
        let offset = self.position + (self.velocity + self.acceleration * (0.5 * seconds)) * seconds;
        let motion = Motion {
            velocity: self.velocity + self.acceleration * seconds,
            acceleration: self.acceleration,
            fastest: self.fastest,
            fastest_change: self.fastest_change,
            distance: if self.plane.is_some() { f64::INFINITY } else { self.reach },
        };
        (Pair { a: Pose::of(a, seconds), b: Pose::of(b, seconds), offset }, motion)
    }

    /// Half of δ (m), so that nothing within it is farther away than δ, whatever the direction found.
    #[inline(always)]
    fn close<R>(&self, a: &Body<R>, b: &Body<R>) -> f64 {
        0.5 * tolerance::contact(a.solid.reach().max(b.solid.reach()), self.position.length())
    }
}

/// Of a triangle that is touched where its neighbour is: so many halves of δ deep, the neighbour has certainly been met (a count).
const BEYOND: f64 = 8.0;

/// Follows a pair through a window. True if there is no more to search: an impact, or too many steps.
fn walk<R: Turning>(
    a: &Body<R>,
    b: &Body<R>,
    flight: &RelativeFlight,
    (entry, exit): Window,
    horizon: f64,
    memory: &mut Memory,
    search: &mut Search,
) -> bool {
    let close = flight.close(a, b);
    let mut seconds = entry;
    loop {
        // The horizon ends the walk and does not shape it: what is found is the same for every horizon beyond it.
        if seconds > horizon {
            search.clear_until = horizon;
            return true;
        }
        search.steps += 1;
        let (pair, motion) = flight.pair(a, b, seconds);
        let left = exit - seconds;
        let known = memory.known(&pair);
        if search.steps == 1 && clears(&pair, &motion, known.normal, close, left) {
            return false;
        }
        let separation = pair.separate(&known, close);
        memory.0 = Some(separation);
        let step = if separation.gap > close {
            certain_step(&pair, flight, &motion, &separation, turning_of_normal(&pair, &separation), 0.0, left)
        } else {
            let contact = Contact::of(&pair, &motion, &separation, close);
            let size = a.solid.reach().max(b.solid.reach());
            // Of each by itself: of bodies that fly side by side, what is left between them is rounding of both.
            let speed = |body: &Body<R>| (body.velocity + body.acceleration * seconds).length();
            let speeds = speed(a) + speed(b) + flight.fastest[0] * size + flight.fastest[1] * size;
            if contact.approach_speed() > tolerance::RESTING * speeds {
                search.impact = Some(impact(&pair, flight, &motion, &contact, separation.gap, seconds, close));
                search.clear_until = seconds;
                return true;
            }
            let touching = Separation { normal: contact.normal, ..separation };
            let depth = pair.gap(contact.normal).0.max(separation.gap);
            if contact.is_beside && depth < -BEYOND * close {
                // A segment of A from the triangle's edge to its deepest point crosses the neighbour: that was met before.
                return true;
            }
            let level = -close + depth.min(0.0);
            certain_step(&pair, flight, &motion, &touching, contact.turning, level, left)
        };
        if step >= left {
            return false;
        }
        let next = seconds + step;
        if search.steps >= STEPS || !(next > seconds) {
            search.clear_until = seconds;
            return true;
        }
        seconds = next;
    }
}

/// Whether the direction known by itself keeps the bodies apart for all the seconds `left`, as it does for most pairs.
#[inline(always)]
fn clears(pair: &Pair, motion: &Motion, normal: DVec3, close: f64, left: f64) -> bool {
    if pair.b.solid.is_half_space() {
        return false;
    }
    let bound = GapBound::new(pair, motion, normal, DVec3::ZERO, left);
    bound.is_above(close, left) && bound.is_above(close, 0.0)
}

/// The seconds, at most `left`, for which the gap certainly stays above `level` (m): in a direction that stands still, or in
/// one that turns with what is nearest, whichever shows it for longer.
#[inline(always)]
fn certain_step(
    pair: &Pair,
    flight: &RelativeFlight,
    motion: &Motion,
    separation: &Separation,
    turning: DVec3,
    level: f64,
    left: f64,
) -> f64 {
    let normal = separation.normal;
    let most = |bound: &GapBound| bound.stays_at_most(separation.gap, separation.links(), level);
    let still = GapBound::new(pair, motion, normal, DVec3::ZERO, left);
    let most_still = most(&still).min(left);
    if turning == DVec3::ZERO {
        return still.stays_above(level, most_still);
    }
    let longest = left.min(flight.longest);
    let turned = GapBound::new(pair, motion, normal, turning, longest);
    let most_turned = most(&turned).min(longest);
    if pair.b.solid.is_half_space() {
        // Of a half-space no direction but that of its plane separates.
        return turned.stays_above(level, most_turned);
    }
    let (first, most_first, second, most_second) = if most_turned > most_still {
        (turned, most_turned, still, most_still)
    } else {
        (still, most_still, turned, most_turned)
    };
    let step = first.stays_above(level, most_first);
    if step >= most_second { step } else { step.max(second.stays_above(level, most_second)) }
}

/// The impact of bodies within δ of contact that approach. The last step, linear, is as good as exact where it is short.
fn impact(
    pair: &Pair,
    flight: &RelativeFlight,
    motion: &Motion,
    contact: &Contact,
    gap: f64,
    seconds: f64,
    close: f64,
) -> Impact {
    let speed = contact.approach_speed();
    let bend = GapBound::new(pair, motion, contact.normal, contact.turning, flight.longest.min(close / speed)).bend();
    // What slides over a curved surface leaves it again: v²/R.
    let sliding = contact.sliding_speed(pair, motion);
    let bend = bend + 0.5 * sliding * sliding / contact.curvature_radius;
    // The bound counts an acceleration apart as a gain; here it is what may end the approach.
    let bend = bend + contact.normal.dot(motion.acceleration).max(0.0);
    // Within δ the speed changes by less than a quarter of itself, and what touches still does: the crossing is certain.
    let transversal = 32.0 * bend * close <= speed * speed && contact.margin * speed > 16.0 * close * (speed + sliding);
    let last = if transversal { gap.max(0.0) / speed } else { 0.0 };
    let certificate = if transversal { Certificate::Transversal } else { Certificate::WithinTolerance };
    Impact {
        seconds: seconds + last,
        certificate,
        normal: contact.normal,
        features: contact.features,
        approach_speed: speed,
    }
}

/// The direction of `v`, or z if it has none.
#[inline(always)]
fn unit_or_z(v: DVec3) -> DVec3 {
    let length = v.length();
    if length > 0.0 { v / length } else { DVec3::Z }
}
