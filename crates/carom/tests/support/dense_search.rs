//! An independent check of predictions for bodies that turn, by another method than theirs.
//!
//! Each shape is a convex function f of space, negative inside and with slope at most 1; two bodies share a point exactly if
//! F = min over space of max(f_A, f_B) ≤ 0. F is found by the deep-cut ellipsoid method, which knows points only, no separating
//! directions, and bounds F from both sides.
//!
//! In time the walk skips what a plane proves to be free of contact. A plane with normal d stays between two bodies as long as
//! their supports in a direction that turns with each leave a gap: points move along d by d·v t + d·(ω × r) t, at most ½ M t²
//! more with M the largest acceleration of a point, and d·(ω × r) = r·(d × ω), so that in the time t the support of a body in
//! direction d grows at most to that in direction d + t d × ω, plus ½ M t². Where no plane does, it goes on in short fixed steps
//! of F and looks into each dip. Where the plane comes from does not matter: what it proves is checked with plain supports.

#![allow(dead_code)]

use std::sync::Arc;

use carom::predict::turning::distance::{Pair, Separation};
use carom::predict::turning::motion::{Body, Pose, SteadyRotation, SymmetricRotation, Turning};
use carom::predict::turning::solid::Solid;
use carom::predict::turning::{Certificate, Memory, Search, contact_after, first_impact};
use carom::random::Random;
use carom::shape::{Platonic, Polyhedron, Shape};
use carom::tolerance;
use glam::{DQuat, DVec3};

/// A shape, or the half-space z ≤ 0.
#[derive(Clone)]
pub enum Form {
    Shape(Shape),
    HalfSpace,
}

impl Form {
    pub fn solid(&self) -> Solid {
        match self {
            Form::Shape(shape) => Solid::new(shape).expect("a convex shape"),
            Form::HalfSpace => Solid::half_space(),
        }
    }

    /// The support function of the body's core in a direction of any length, and the radius of the ball around the core.
    fn support(&self, u: DVec3) -> f64 {
        match self {
            Form::HalfSpace => {
                if u.truncate().length() <= 1e-12 * u.z {
                    0.0
                } else {
                    f64::INFINITY
                }
            }
            Form::Shape(Shape::Ball { .. }) => 0.0,
            Form::Shape(Shape::Capsule { half_length, .. }) => half_length * u.z.abs(),
            Form::Shape(Shape::Polyhedron(polyhedron)) => {
                polyhedron.vertices.iter().map(|vertex| vertex.dot(u)).fold(f64::NEG_INFINITY, f64::max)
            }
            Form::Shape(Shape::Cylinder { radius, half_length }) => {
                radius * DVec3::new(u.x, u.y, 0.0).length() + half_length * u.z.abs()
            }
            Form::Shape(Shape::Ellipsoid { semi_axes }) => (*semi_axes * u).length(),
            Form::Shape(Shape::Compound(_)) => f64::INFINITY,
        }
    }

    /// The radius of the ball around each point of the core, and how far the core reaches from the centre (m).
    fn rounding_and_reach(&self, solid: &Solid) -> (f64, f64) {
        match self {
            Form::HalfSpace => (0.0, 0.0),
            Form::Shape(Shape::Ball { radius }) => (*radius, 0.0),
            Form::Shape(Shape::Capsule { radius, half_length }) => (*radius, *half_length),
            _ => (0.0, solid.reach()),
        }
    }

    /// f and its gradient, in the frame of the body.
    fn depth(&self, p: DVec3) -> (f64, DVec3) {
        let from = |core: DVec3, radius: f64| {
            let d = p - core;
            let length = d.length();
            (length - radius, if length > 0.0 { d / length } else { DVec3::Z })
        };
        match self {
            Form::HalfSpace => (p.z, DVec3::Z),
            Form::Shape(Shape::Ball { radius }) => from(DVec3::ZERO, *radius),
            Form::Shape(Shape::Capsule { radius, half_length }) => {
                from(DVec3::new(0.0, 0.0, p.z.clamp(-half_length, *half_length)), *radius)
            }
            Form::Shape(Shape::Polyhedron(polyhedron)) => polyhedron
                .faces
                .iter()
                .map(|face| (face.normal.dot(p) - face.offset, face.normal))
                .fold((f64::NEG_INFINITY, DVec3::Z), |most, next| if next.0 > most.0 { next } else { most }),
            Form::Shape(Shape::Cylinder { radius, half_length }) => {
                let axial = DVec3::new(p.x, p.y, 0.0).length();
                let side = axial - radius;
                let end = p.z.abs() - half_length;
                if side > end { (side, DVec3::new(p.x, p.y, 0.0) / axial) } else { (end, DVec3::Z * p.z.signum()) }
            }
            Form::Shape(Shape::Compound(_)) => (f64::NAN, DVec3::NAN),
            Form::Shape(Shape::Ellipsoid { semi_axes }) => {
                let scaled = p / *semi_axes;
                let length = scaled.length();
                let least = semi_axes.min_element();
                let gradient = if length > 0.0 { scaled / *semi_axes * (least / length) } else { DVec3::Z };
                ((length - 1.0) * least, gradient)
            }
        }
    }
}

/// Either kind of rotation.
#[derive(Clone, Copy, Debug)]
pub enum Rotation {
    Steady(SteadyRotation),
    Symmetric(SymmetricRotation),
}

impl Turning for Rotation {
    fn state_after(&self, seconds: f64) -> (DQuat, DVec3) {
        match self {
            Rotation::Steady(r) => r.state_after(seconds),
            Rotation::Symmetric(r) => r.state_after(seconds),
        }
    }
    fn fastest(&self) -> f64 {
        match self {
            Rotation::Steady(r) => r.fastest(),
            Rotation::Symmetric(r) => r.fastest(),
        }
    }
    fn fastest_change(&self) -> f64 {
        match self {
            Rotation::Steady(r) => r.fastest_change(),
            Rotation::Symmetric(r) => r.fastest_change(),
        }
    }
}

/// One body at time 0.
#[derive(Clone)]
pub struct Flyer {
    pub form: Form,
    pub solid: Solid,
    pub position: DVec3,
    pub velocity: DVec3,
    pub acceleration: DVec3,
    pub rotation: Rotation,
    /// I₃/I₁ for a symmetric rotation.
    pub ratio: Option<f64>,
}

impl Flyer {
    pub fn body(&self) -> Body<'_, Rotation> {
        Body {
            solid: &self.solid,
            position: self.position,
            velocity: self.velocity,
            acceleration: self.acceleration,
            rotation: &self.rotation,
            elapsed: 0.0,
        }
    }

    pub fn rotating(orientation: DQuat, angular_velocity: DVec3, ratio: Option<f64>) -> Rotation {
        match ratio {
            Some(ratio) => Rotation::Symmetric(SymmetricRotation::new(orientation, angular_velocity, ratio)),
            None => Rotation::Steady(SteadyRotation { orientation, angular_velocity }),
        }
    }

    /// Position, velocity, and rotation restarted at `seconds`, with changes of both velocities.
    pub fn moved(&self, seconds: f64, push: DVec3, twist: DVec3) -> Self {
        let (orientation, angular_velocity) = self.rotation.state_after(seconds);
        Self {
            position: self.position + self.velocity * seconds + self.acceleration * (0.5 * seconds * seconds),
            velocity: self.velocity + self.acceleration * seconds + push,
            rotation: Self::rotating(orientation, angular_velocity + twist, self.ratio),
            ..self.clone()
        }
    }
}

/// Two bodies.
#[derive(Clone)]
pub struct Couple {
    pub a: Flyer,
    pub b: Flyer,
}

impl Couple {
    pub fn size(&self) -> f64 {
        self.a.solid.reach().max(self.b.solid.reach())
    }

    pub fn search(&self, horizon: f64, memory: &mut Memory) -> Search {
        first_impact(&self.a.body(), &self.b.body(), horizon, memory)
    }

    /// δ (m).
    pub fn tolerance(&self) -> f64 {
        tolerance::contact(self.size(), (self.a.position - self.b.position).length())
    }

    /// The largest relative acceleration (m/s²) of a point of A's core and one of B's.
    fn acceleration(&self) -> f64 {
        let turning = |f: &Flyer| {
            let (fastest, (_, reach)) = (f.rotation.fastest(), f.form.rounding_and_reach(&f.solid));
            reach * (fastest * fastest + f.rotation.fastest_change())
        };
        (self.a.acceleration - self.b.acceleration).length() + turning(&self.a) + turning(&self.b)
    }

    /// Centre of A from that of B, and its velocity.
    fn offset(&self, seconds: f64) -> (DVec3, DVec3) {
        let acceleration = self.a.acceleration - self.b.acceleration;
        let velocity = self.a.velocity - self.b.velocity;
        let position = self.a.position - self.b.position;
        (position + (velocity + acceleration * (0.5 * seconds)) * seconds, velocity + acceleration * seconds)
    }

    /// A time from `seconds` on, above `shortest`, in which a plane proves the bodies apart by more than `gap`; 0 if none does.
    fn clear_for(&self, seconds: f64, gap: f64, shortest: f64, longest: f64, separation: &mut Separation) -> f64 {
        let (a, b) = (self.a.body(), self.b.body());
        let (pose_a, pose_b) = (Pose::of(&a, seconds), Pose::of(&b, seconds));
        let (offset, velocity) = self.offset(seconds);
        let round = self.a.form.rounding_and_reach(&self.a.solid).0 + self.b.form.rounding_and_reach(&self.b.solid).0;
        let supported = |f: &Flyer, pose: &Pose, d: DVec3, t: f64| {
            f.form.support(pose.to_body(d + d.cross(pose.angular_velocity) * t))
        };
        let leaves = |d: DVec3, t: f64| {
            let along = d.dot(offset + velocity * t);
            along - supported(&self.a, &pose_a, -d, t) - supported(&self.b, &pose_b, d, t) - round - gap
        };
        let acceleration = self.acceleration();
        let clear = |d: DVec3, shortest: f64| {
            // Of the two ends the smaller counts between them, as supports are convex in t.
            let mut t = if leaves(d, 0.0) > 0.0 { longest } else { 0.0 };
            while t > shortest {
                if leaves(d, t) > 0.5 * acceleration * t * t {
                    return t;
                }
                t *= 0.5;
            }
            0.0
        };
        // The last plane may do for as long again.
        let again = clear(separation.normal, 0.1 * longest);
        if again > 0.0 {
            return again;
        }
        *separation = Pair { a: pose_a, b: pose_b, offset }.separate(separation, 1e-9 * self.size());
        clear(separation.normal, shortest)
    }

    /// Bounds of F (m) at an instant, within `width` of each other, or only so near that the sign and a third of it are sure.
    pub fn depth(&self, seconds: f64, width: f64, rough: bool) -> (f64, f64) {
        let (a, b) = (self.a.body(), self.b.body());
        let (pose_a, pose_b) = (Pose::of(&a, seconds), Pose::of(&b, seconds));
        let (offset, _) = self.offset(seconds);
        let value = |x: DVec3| {
            let (fa, ga) = self.a.form.depth(pose_a.to_body(x - offset));
            let (fb, gb) = self.b.form.depth(pose_b.to_body(x));
            if fa > fb { (fa, pose_a.to_world(ga)) } else { (fb, pose_b.to_world(gb)) }
        };
        // The best point lies within both reaches of A's centre.
        let radius = self.a.solid.reach() * 2.0 + 2.0 * value(offset).0.max(0.0);
        let found = minimum(value, offset, radius, width, rough);
        // On ridges hit exactly rounding may cut off the best point; from elsewhere it does not.
        if found.0 <= found.1 + 1e-13 {
            return found;
        }
        let aside = DVec3::new(0.013, -0.007, 0.021) * radius;
        minimum(value, offset + aside, 1.1 * radius, width, rough)
    }
}

/// Lower and upper bounds of the minimum of a convex function in a ball: the deep-cut ellipsoid method, on a factor of the
/// ellipsoid's matrix P = B Bᵀ, which stays exact however flat it gets.
fn minimum(value: impl Fn(DVec3) -> (f64, DVec3), start: DVec3, radius: f64, width: f64, rough: bool) -> (f64, f64) {
    let mut centre = start;
    let mut columns = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| axis * radius);
    let (mut lower, mut upper) = (f64::NEG_INFINITY, f64::INFINITY);
    for _ in 0..4000 {
        let (f, g) = value(centre);
        let inner = DVec3::from(columns.map(|column| column.dot(g)));
        let spread = inner.length();
        upper = upper.min(f);
        lower = lower.max(f - spread);
        if upper - lower <= width || spread == 0.0 || (rough && (upper < 0.0 || lower > upper / 3.0)) {
            break;
        }
        let alpha = ((f - upper) / spread).min(0.999);
        let inner = inner / spread;
        let step = columns[0] * inner.x + columns[1] * inner.y + columns[2] * inner.z;
        centre -= step * ((1.0 + 3.0 * alpha) / 4.0);
        let scale = (9.0 / 8.0 * (1.0 - alpha * alpha)).sqrt();
        let share = 1.0 - (1.0 - (1.0 + 3.0 * alpha) / (2.0 * (1.0 + alpha))).max(0.0).sqrt();
        for (column, component) in columns.iter_mut().zip([inner.x, inner.y, inner.z]) {
            *column = (*column - step * (component * share)) * scale;
        }
    }
    (lower, upper)
}

/// What a check found.
#[derive(Clone, Copy, Debug, Default)]
pub struct Verdict {
    pub pairs: usize,
    pub impacts: usize,
    pub transversal: usize,
    pub within: usize,
    pub missed: usize,
    pub invented: usize,
    pub unfinished: usize,
    pub wrong_time: usize,
    /// Largest error of a transversal time, in units of size over approach speed.
    pub worst_time: f64,
    /// Deepest overlap before the impact reported, in units of δ.
    pub deepest: f64,
    pub steps: u64,
    pub most_steps: u32,
}

impl Verdict {
    pub fn add(&mut self, other: &Verdict) {
        self.pairs += other.pairs;
        self.impacts += other.impacts;
        self.transversal += other.transversal;
        self.within += other.within;
        self.missed += other.missed;
        self.invented += other.invented;
        self.unfinished += other.unfinished;
        self.wrong_time += other.wrong_time;
        self.worst_time = self.worst_time.max(other.worst_time);
        self.deepest = self.deepest.max(other.deepest);
        self.steps += other.steps;
        self.most_steps = self.most_steps.max(other.most_steps);
    }

    /// Whether all predictions were right.
    pub fn is_right(&self) -> bool {
        self.missed + self.invented + self.unfinished + self.wrong_time == 0
    }

    pub fn assert_right(&self, name: &str) {
        assert!(self.is_right(), "{name}: {self:?}");
    }
}

/// Digits to which F can be had (fraction of the size).
const RESOLUTION: f64 = 2e-14;

/// Gap from which the walk takes short steps (fraction of the size).
const NEAR: f64 = 1e-6;

/// Checks one prediction up to `horizon`. `touching`: the bodies start in contact.
pub fn check(couple: &Couple, horizon: f64, touching: bool, memory: &mut Memory) -> (Search, Verdict) {
    let search = couple.search(horizon, memory);
    let mut verdict = Verdict {
        pairs: 1,
        steps: u64::from(search.steps),
        most_steps: search.steps,
        unfinished: usize::from(search.impact.is_none() && search.clear_until < horizon),
        ..Verdict::default()
    };
    let delta = couple.tolerance();
    let width = RESOLUTION * couple.size();
    let end = search.impact.map_or(horizon, |impact| impact.seconds);
    // F is half the depth.
    let deepest = deepest_before(couple, end, touching);
    verdict.deepest = (-2.0 * deepest / delta).max(0.0);
    verdict.missed = usize::from(2.0 * deepest < -(delta + 4.0 * width));
    let Some(impact) = search.impact else { return (search, verdict) };
    verdict.impacts = 1;
    let (low, high) = couple.depth(impact.seconds, width, false);
    let approach = impact.approach_speed;
    let far = 2.0 * low > delta + 4.0 * width || 2.0 * high < -(delta + 4.0 * width);
    verdict.invented = usize::from(far || !(approach > 0.0));
    match impact.certificate {
        Certificate::WithinTolerance => verdict.within = 1,
        Certificate::ClosedForm | Certificate::Transversal => {
            verdict.transversal = 1;
            // What touches from the start has crossed nothing.
            if touching && impact.seconds < 1e-5 {
                return (search, verdict);
            }
            let root = crossing(couple, impact.seconds, approach);
            let error = match root {
                Some(root) => (root - impact.seconds).abs() * approach / couple.size(),
                None => f64::INFINITY,
            };
            verdict.worst_time = error;
            verdict.wrong_time = usize::from(!(error <= 1e-12));
        }
    }
    (search, verdict)
}

/// The instant near `seconds` at which F changes sign, by bisection. It is certain to be negative while the bodies get deeper by
/// up to δ, and may be positive again soon after, where they touch beside a corner.
fn crossing(couple: &Couple, seconds: f64, approach: f64) -> Option<f64> {
    let width = 0.1 * RESOLUTION * couple.size();
    let rounding = 4.0 * f64::EPSILON * seconds;
    let within = couple.tolerance() / approach;
    let mean = |t: f64| {
        let (low, high) = couple.depth(t, width, false);
        0.5 * (low + high)
    };
    let (mut early, mut late) = (seconds - 4.0 * within - rounding, seconds + 0.5 * within + rounding);
    if !(mean(early) > 0.0 && mean(late) < 0.0) {
        return None;
    }
    while late - early > 1e-3 * within {
        let middle = 0.5 * (early + late);
        if middle <= early || middle >= late {
            break;
        }
        if mean(middle) > 0.0 { early = middle } else { late = middle }
    }
    Some(0.5 * (early + late))
}

/// The smallest F found in [0, end): nothing deeper than its walk resolves is left out.
fn deepest_before(couple: &Couple, end: f64, touching: bool) -> f64 {
    let size = couple.size();
    let near = NEAR * size;
    let width = RESOLUTION * size;
    let sharp = |t: f64| couple.depth(t, width, false).1;
    // Between two such steps F departs from a straight line by at most a 64th of `near`, and by its corners.
    let step = (0.25 * (near / couple.acceleration()).sqrt()).min(1e-3 * size);
    let mut deepest = f64::INFINITY;
    let mut t = 0.0;
    if touching {
        // Out of contact in steps that double.
        t = 1e-8 * step;
        while t < step && t < end {
            deepest = deepest.min(sharp(t));
            t *= 1.5;
        }
    }
    let mut separation = Separation::along(couple.offset(0.0).0.normalize());
    let mut longest = size;
    let mut before: [(f64, f64); 2] = [(0.0, f64::INFINITY); 2];
    while t < end {
        let clear = couple.clear_for(t, near, step, longest, &mut separation);
        if clear > 0.0 {
            before = [(0.0, f64::INFINITY); 2];
            t += clear;
            longest = 4.0 * clear;
            continue;
        }
        let (_, high) = couple.depth(t, width, true);
        if high < 0.0 {
            let value = sharp(t);
            if value < 0.0 {
                return deepest.min(value);
            }
        }
        // A dip between three samples.
        let now = (t, couple.depth(t, 1e-3 * near, false).1);
        deepest = deepest.min(now.1);
        if before[1].1 <= now.1 && before[1].1 <= before[0].1 && before[0].1.is_finite() {
            deepest = deepest.min(dip(&sharp, before[0].0, now.0));
        }
        before = [before[1], now];
        t += step;
        longest = 4.0 * step;
    }
    if end.is_finite() {
        let last = sharp(end);
        deepest = deepest.min(last);
        if before[0].1.is_finite() && before[1].1 < last {
            deepest = deepest.min(dip(&sharp, before[0].0, end));
        }
    }
    deepest
}

/// The least value in a dip, by the golden section.
fn dip(value: &impl Fn(f64) -> f64, mut low: f64, mut high: f64) -> f64 {
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    let (mut p, mut q) = (high - GOLDEN * (high - low), low + GOLDEN * (high - low));
    let (mut at_p, mut at_q) = (value(p), value(q));
    for _ in 0..45 {
        if at_p < at_q {
            (high, q, at_q) = (q, p, at_p);
            p = high - GOLDEN * (high - low);
            at_p = value(p);
        } else {
            (low, p, at_p) = (p, q, at_q);
            q = low + GOLDEN * (high - low);
            at_q = value(q);
        }
    }
    at_p.min(at_q)
}

/// A box with edges `size` (m).
pub fn cuboid(size: DVec3) -> Polyhedron {
    Polyhedron::cuboid(size).expect("sizes are positive")
}

/// A regular tetrahedron with edges of `edge` (m).
pub fn tetrahedron(edge: f64) -> Polyhedron {
    Platonic::Tetrahedron.with_edge(edge).expect("edges are positive")
}

/// A form of about unit size, of a kind: 0 ball, 1 box, 2 tetrahedron, 3 capsule, 4 cylinder, 5 ellipsoid, 6 half-space.
pub fn form(kind: usize, random: &mut Random) -> Form {
    let mut between = |low: f64, high: f64| low + (high - low) * random.uniform();
    Form::Shape(match kind {
        0 => Shape::Ball { radius: between(0.2, 1.0) },
        1 => {
            let size = DVec3::new(between(0.3, 2.0), between(0.3, 2.0), between(0.3, 2.0));
            Shape::cuboid(size).expect("sizes are positive")
        }
        2 => Platonic::Tetrahedron.with_edge(between(0.7, 1.7)).expect("edges are positive").into(),
        3 => Shape::Capsule { radius: between(0.05, 0.5), half_length: between(0.2, 1.0) },
        4 => Shape::Cylinder { radius: between(0.2, 1.0), half_length: between(0.2, 1.0) },
        5 => Shape::Ellipsoid { semi_axes: DVec3::new(between(0.3, 1.0), between(0.3, 1.0), between(0.3, 1.0)) },
        _ => return Form::HalfSpace,
    })
}

/// Names of the kinds.
pub const KINDS: [&str; 7] = ["ball", "box", "tetrahedron", "capsule", "cylinder", "ellipsoid", "plane"];

fn direction(random: &mut Random) -> DVec3 {
    random.normal_vector(3).normalize()
}

fn orientation(random: &mut Random) -> DQuat {
    let q = [0; 4].map(|_| random.normal());
    DQuat::from_xyzw(q[0], q[1], q[2], q[3]).normalize()
}

/// Two bodies apart whose spheres will meet; spins up to 100 rad while they cross a radius.
pub fn couple(kinds: [usize; 2], random: &mut Random) -> Couple {
    let gravity = if random.uniform() < 0.3 { direction(random) * random.uniform() } else { DVec3::ZERO };
    let mut flyer = |kind: usize, falls: bool| {
        let form = form(kind, random);
        let solid = form.solid();
        let fastest = libm::pow(10.0, -2.0 + 4.0 * random.uniform());
        let spin = if kind == 6 { DVec3::ZERO } else { direction(random) * fastest };
        let ratio = (random.uniform() < 0.5 && kind != 6).then(|| 0.2 + 1.8 * random.uniform());
        let rotation = Flyer::rotating(orientation(random), spin, ratio);
        let acceleration = if falls { gravity } else { DVec3::ZERO };
        Flyer { form, solid, position: DVec3::ZERO, velocity: DVec3::ZERO, acceleration, rotation, ratio }
    };
    let mut a = flyer(kinds[0], true);
    let b = flyer(kinds[1], kinds[1] != 6 && gravity.x < 0.0);
    let reach = a.solid.reach() + b.solid.reach();
    let away = direction(random);
    if kinds[1] == 6 {
        let normal = b.rotation.state_after(0.0).0 * DVec3::Z;
        let sideways = away - normal * normal.dot(away);
        a.position = normal * (reach * (1.05 + random.uniform())) + sideways * 3.0;
        a.velocity = sideways * random.uniform() - normal;
        if a.acceleration.dot(normal) > 0.0 {
            a.acceleration = -a.acceleration;
        }
    } else {
        let aim = direction(random) * (reach * libm::cbrt(random.uniform()));
        a.position = away * (reach * (1.05 + random.uniform()));
        a.velocity = (aim - a.position).normalize();
    }
    Couple { a, b }
}

/// How long a check follows a pair (s): speeds and sizes are about 1.
pub const HORIZON: f64 = 8.0;

/// Moves A sideways until the pair hardly touches or hardly misses, by 10⁻² to 10⁻¹³ sizes. None if they overlap from the start.
pub fn grazing(mut couple: Couple, random: &mut Random) -> Option<Couple> {
    let sideways = couple.a.velocity.cross(direction(random)).normalize();
    let start = couple.a.position;
    let mut at = |shift: f64| {
        couple.a.position = start + sideways * shift;
        couple.search(HORIZON, &mut Memory::default()).impact.is_some()
    };
    let size = 4.0;
    let (mut hit, mut miss) = (0.0, size);
    if at(hit) && !at(miss) {
        let width = libm::pow(10.0, -2.0 - 11.0 * random.uniform());
        while miss - hit > width {
            let middle = 0.5 * (hit + miss);
            if at(middle) { hit = middle } else { miss = middle }
        }
        at(if random.uniform() < 0.5 { hit } else { miss });
    }
    (couple.depth(0.0, 1e-9, false).0 > 0.0).then_some(couple)
}

/// The bodies after an elastic impact without friction at all points of the contact in turn, with masses and inertias of 1.
pub fn rebound(couple: &Couple, search: &Search, memory: &Memory) -> Option<Couple> {
    let impact = search.impact?;
    let contact = contact_after(&couple.a.body(), &couple.b.body(), impact.seconds, memory);
    let n = contact.normal;
    let fixed = matches!(couple.b.form, Form::HalfSpace);
    let mass = if fixed { 0.0 } else { 1.0 };
    let (mut push, mut twist_a, mut twist_b) = (0.0, DVec3::ZERO, DVec3::ZERO);
    for _ in 0..100 {
        let mut any = false;
        for point in contact.points() {
            let (arm_a, arm_b) = (point.from_a.cross(n), point.from_b.cross(n));
            let speed = point.approach_speed - push * (1.0 + mass) - twist_a.dot(arm_a) - twist_b.dot(arm_b);
            if speed > 1e-12 {
                any = true;
                let j = 2.0 * speed / (1.0 + mass + arm_a.length_squared() + mass * arm_b.length_squared());
                push += j;
                twist_a += arm_a * j;
                twist_b += arm_b * (j * mass);
            }
        }
        if !any {
            let a = couple.a.moved(impact.seconds, n * push, twist_a);
            let b = couple.b.moved(impact.seconds, n * (-push * mass), -twist_b);
            return Some(Couple { a, b });
        }
    }
    None
}

/// Checks `pairs` random pairs of two kinds, half of them grazing, each on through up to three impacts.
pub fn check_pairs(kinds: [usize; 2], pairs: usize, seed: u64) -> Verdict {
    let mut random = Random::new(seed, (kinds[0] * 10 + kinds[1]) as u64);
    let mut total = Verdict::default();
    for k in 0..pairs {
        let mut now = couple(kinds, &mut random);
        if k % 2 == 1 && kinds[1] != 6 {
            let Some(grazing) = grazing(now, &mut random) else { continue };
            now = grazing;
        }
        let mut memory = Memory::default();
        let mut touching = false;
        for _ in 0..3 {
            let (search, verdict) = check(&now, HORIZON, touching, &mut memory);
            total.add(&verdict);
            let Some(next) = rebound(&now, &search, &memory) else { break };
            now = next;
            touching = true;
        }
    }
    total
}

/// Checks `pairs` pairs of a kind that stand square to each other, move along axes and diagonals and turn about axes: faces
/// meet faces, edges meet edges, corners meet corners, and many touch from the start.
pub fn check_aligned(kinds: [usize; 2], pairs: usize, seed: u64) -> Verdict {
    let mut random = Random::new(seed, (100 + kinds[0] * 10 + kinds[1]) as u64);
    let mut total = Verdict::default();
    while total.pairs < pairs {
        let now = aligned(kinds, &mut random);
        let (low, high) = now.depth(0.0, 1e-15, false);
        if high < -1e-13 {
            continue;
        }
        let (_, verdict) = check(&now, HORIZON, low < 1e-13, &mut Memory::default());
        total.add(&verdict);
    }
    total
}

/// A pair of [`check_aligned`].
pub fn aligned(kinds: [usize; 2], random: &mut Random) -> Couple {
    let mut pick = |choices: &[f64]| choices[(random.uniform() * choices.len() as f64) as usize];
    let axes = [DVec3::X, DVec3::Y, DVec3::Z, (DVec3::X + DVec3::Y).normalize()];
    let mut flyer = |kind: usize, apart: f64| {
        let form = match kind {
            1 => Form::Shape(Shape::Polyhedron(Arc::new(cuboid(DVec3::ONE)))),
            3 => Form::Shape(Shape::Capsule { radius: 0.25, half_length: 0.5 }),
            4 => Form::Shape(Shape::Cylinder { radius: 0.5, half_length: 0.5 }),
            5 => Form::Shape(Shape::Ellipsoid { semi_axes: DVec3::new(0.5, 0.5, 1.0) }),
            _ => Form::HalfSpace,
        };
        let solid = form.solid();
        let turned = |axis: DVec3, eighths: f64| DQuat::from_axis_angle(axis, eighths * std::f64::consts::FRAC_PI_4);
        let mut orientation = turned(DVec3::X, pick(&[0.0, 0.0, 1.0, 2.0])) * turned(DVec3::Z, pick(&[0.0, 0.0, 1.0]));
        let mut spin = axes[pick(&[0.0, 1.0, 2.0, 3.0]) as usize] * pick(&[0.0, 0.0, 1.0, -1.0, 10.0]);
        if kind == 6 {
            (orientation, spin) = (DQuat::IDENTITY, DVec3::ZERO);
        }
        let mut vector = |choices: &[f64]| DVec3::new(pick(choices), pick(choices), pick(choices));
        let position = vector(&[-0.5, 0.0, 0.0, 0.5]) + DVec3::Z * apart;
        let velocity =
            vector(&[-0.5, 0.0, 0.0, 0.5]) - DVec3::Z * if apart > 0.0 { vector(&[0.0, 1.0, 1.0]).x } else { 0.0 };
        let rotation = Flyer::rotating(orientation, spin, None);
        let position = if kind == 6 { DVec3::ZERO } else { position };
        let velocity = if kind == 6 { DVec3::ZERO } else { velocity };
        Flyer { form, solid, position, velocity, acceleration: DVec3::ZERO, rotation, ratio: None }
    };
    let b = flyer(kinds[1], 0.0);
    let mut a = flyer(kinds[0], 1.0);
    a.position += DVec3::Z * pick(&[0.0, 0.0, 0.5, 1.0]);
    a.acceleration = DVec3::Z * pick(&[0.0, 0.0, -1.0]);
    Couple { a, b }
}
