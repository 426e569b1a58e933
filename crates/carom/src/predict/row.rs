//! A ball against a whole row of others, several at a time: for each, a time before which it is certainly not met. Whoever could
//! be met first is then met by [`super::ball_ball`], and if that is before all others could be, nobody else has to be.

use glam::DVec3;

use super::lanes::{Lanes, MOST, NEAR, Twice, Work};
use super::seeker::Seeker;
use super::{NO_FRACTION, Predictor, ball_ball};
use crate::time::Time;
use crate::tolerance::{BOUND_MARGIN, LEAST_SQUARE};
use crate::world::World;

/// The first impact of a ball with any of a row.
#[derive(Clone, Copy, Debug)]
pub struct Soonest {
    /// Seconds from the ball's own start to the impact; infinite if it meets nobody.
    pub after_own_start: f64,
    /// Seconds from the later of the two starts.
    pub seconds: f64,
    /// The place in the row of whom it meets.
    pub place: usize,
    /// Seconds from the ball's own start before which there is no other impact.
    pub next: f64,
}

impl Soonest {
    const NEVER: Self = Self { after_own_start: f64::INFINITY, seconds: f64::INFINITY, place: 0, next: f64::INFINITY };
}

/// The search of a ball through a row: a slice whose length is a multiple of [`super::lanes::MOST`], or an array of a known
/// length, for which nothing is kept ready but what that needs.
pub(super) struct Search<'a, R: ?Sized> {
    pub seeker: Seeker<'a>,
    pub row: &'a R,
}

impl<R: AsRef<[u32]> + ?Sized> Work for &Search<'_, R> {
    type Output = Soonest;

    #[inline(always)]
    fn run<L: Lanes>(self, lanes: L) -> Soonest {
        let (seeker, row) = (&self.seeker, self.row.as_ref());
        // Right after an impact of its own, nobody's flight is younger.
        let fresh = seeker.flight().start() == seeker.now;
        match (seeker.predictor.periods.any, seeker.predictor.falling, fresh) {
            (true, false, true) => soonest::<L, true, false, true>(lanes, seeker, row),
            (true, false, false) => soonest::<L, true, false, false>(lanes, seeker, row),
            (false, false, true) => soonest::<L, false, false, true>(lanes, seeker, row),
            (false, false, false) => soonest::<L, false, false, false>(lanes, seeker, row),
            (false, true, _) => soonest::<L, false, true, false>(lanes, seeker, row),
            (true, true, _) => soonest::<L, true, true, false>(lanes, seeker, row),
        }
    }
}

/// The searches of both balls of an impact, right after it: nobody's flight is younger. They go on side by side, so that neither
/// waits for its own roots and quotients alone.
pub(super) struct SearchOfBoth<'a> {
    pub seekers: [Seeker<'a>; 2],
    pub rows: [&'a [u32; 2 * MOST]; 2],
}

impl Work for &SearchOfBoth<'_> {
    type Output = [Soonest; 2];

    #[inline(always)]
    fn run<L: Lanes>(self, lanes: L) -> [Soonest; 2] {
        let SearchOfBoth { seekers: [a, b], rows: [row_a, row_b] } = self;
        if L::COUNT < MOST {
            // Too few registers for both: one after the other.
            let searches = [Search { seeker: *a, row: *row_a }, Search { seeker: *b, row: *row_b }];
            return [(&searches[0]).run(lanes), (&searches[1]).run(lanes)];
        }
        if a.predictor.periods.any {
            soonest_of_both::<L, true>(lanes, [a, b], [row_a, row_b])
        } else {
            soonest_of_both::<L, false>(lanes, [a, b], [row_a, row_b])
        }
    }
}

/// For registers in two of which a whole row fits. Both find the least of their bounds at once: with a branch between them, a compiler would put all of the second search behind it.
#[inline(always)]
fn soonest_of_both<L: Lanes, const PERIODIC: bool>(
    l: L,
    [a, b]: [&Seeker; 2],
    rows: [&[u32; 2 * MOST]; 2],
) -> [Soonest; 2] {
    let two = Twice(l);
    let (ask_a, ask_b) = (Ask::new(l, a).twice(), Ask::new(l, b).twice());
    let approach_a = ask_a.approach::<PERIODIC, false, true>(two, a.world, rows[0]);
    let approach_b = ask_b.approach::<PERIODIC, false, true>(two, b.world, rows[1]);
    let earliest = approach_a.with(&approach_b).earliest::<true>(Twice(two));
    let (mut firsts_a, mut firsts_b) = (Firsts::none(two), Firsts::none(two));
    firsts_a.consider::<true>(two, earliest[0], &approach_a, 0);
    firsts_b.consider::<true>(two, earliest[1], &approach_b, 0);
    let earliest = two.least_of_each(firsts_a.earliest, firsts_b.earliest);
    [firsts_a.soonest::<true>(two, a, rows[0], earliest[0]), firsts_b.soonest::<true>(two, b, rows[1], earliest[1])]
}

/// One axis of the search: the ball's own place and motion along it, and what bends or repeats space.
#[derive(Clone, Copy)]
struct Axis<L: Lanes> {
    position: L::Numbers,
    velocity: L::Numbers,
    length: L::Numbers,
    inverse: L::Numbers,
    gravity: L::Numbers,
}

impl<L: Lanes> Axis<L> {
    #[inline(always)]
    fn twice(&self) -> Axis<Twice<L>> {
        Axis {
            position: [self.position; 2],
            velocity: [self.velocity; 2],
            length: [self.length; 2],
            inverse: [self.inverse; 2],
            gravity: [self.gravity; 2],
        }
    }

    #[inline(always)]
    fn new(
        l: L,
        world: &World,
        predictor: &Predictor,
        axis: usize,
        position: L::Numbers,
        velocity: L::Numbers,
    ) -> Self {
        Self {
            position,
            velocity,
            length: l.all(predictor.periods.length[axis]),
            inverse: l.all(predictor.periods.inverse[axis]),
            gravity: l.all(world.gravity[axis]),
        }
    }

    /// Relative position and velocity, as [`Seeker::seen_from`]; `flown`: seconds that the ball and the others have flown,
    /// and since then until now.
    #[inline(always)]
    fn seen_from<const PERIODIC: bool, const FALLING: bool, const FRESH: bool>(
        &self,
        l: L,
        position: L::Numbers,
        velocity: L::Numbers,
        [mine_flown, theirs_flown, lag]: [L::Numbers; 3],
    ) -> (L::Numbers, L::Numbers) {
        let mut v = l.sub(self.velocity, velocity);
        let mine = if FRESH { self.position } else { l.add(self.position, l.mul(self.velocity, mine_flown)) };
        let mut r = l.sub(mine, l.add(position, l.mul(velocity, theirs_flown)));
        if FALLING {
            let g = self.gravity;
            let mine = l.mul(g, l.mul(mine_flown, mine_flown));
            let theirs = l.mul(g, l.mul(theirs_flown, theirs_flown));
            r = l.add(r, l.mul(l.sub(mine, theirs), l.all(0.5)));
            v = l.add(v, l.sub(l.mul(g, mine_flown), l.mul(g, theirs_flown)));
        }
        if PERIODIC {
            let present = if FRESH { r } else { l.add(r, l.mul(v, lag)) };
            let images = l.add(l.mul(present, self.inverse), l.all(NO_FRACTION));
            r = l.sub(r, l.mul(l.sub(images, l.all(NO_FRACTION)), self.length));
        }
        (r, v)
    }
}

/// The first impact of the seeker with any of `row`. `PERIODIC`: some axis is; `FALLING`: all balls fall with the same
/// acceleration; `FRESH`: the seeker's flight begins now, and nobody's later.
#[inline(always)]
fn soonest<L: Lanes, const PERIODIC: bool, const FALLING: bool, const FRESH: bool>(
    l: L,
    seeker: &Seeker,
    row: &[u32],
) -> Soonest {
    if row.is_empty() {
        return Soonest::NEVER;
    }
    let (two, ask) = (Twice(l), Ask::new(l, seeker));
    let asks = ask.twice();
    let mut firsts = Firsts::none(two);
    let mut place = 0;
    while place < row.len() {
        if place + 2 * L::COUNT <= row.len() {
            let others = &row[place..place + 2 * L::COUNT];
            let approach = asks.approach::<PERIODIC, FALLING, FRESH>(two, seeker.world, others);
            firsts.consider::<FRESH>(two, approach.earliest::<FRESH>(two), &approach, place);
        } else {
            let approach = ask.approach::<PERIODIC, FALLING, FRESH>(l, seeker.world, &row[place..]);
            let earliest = approach.earliest::<FRESH>(l);
            firsts.consider::<FRESH>(two, [earliest, l.all(f64::INFINITY)], &approach.twice(), place);
        }
        place += 2 * L::COUNT;
    }
    let earliest = two.least(firsts.earliest);
    firsts.soonest::<FRESH>(two, seeker, row, earliest)
}

/// The ball that asks, in all lanes; or one in each.
pub(super) struct Ask<L: Lanes> {
    axes: [Axis<L>; 3],
    epoch: L::Numbers,
    offset: L::Numbers,
    age: L::Numbers,
    /// The contact distance (m) where all balls are of one size; elsewhere the ball's radius.
    distance: L::Numbers,
    of_one_size: bool,
}

impl<L: Lanes> Ask<L> {
    #[inline(always)]
    fn new(l: L, seeker: &Seeker) -> Self {
        let (flight, world, predictor) = (seeker.flight(), seeker.world, seeker.predictor);
        let (start, position, velocity) = (flight.start(), flight.position(), flight.velocity());
        Self {
            axes: [
                Axis::new(l, world, predictor, 0, l.all(position.x), l.all(velocity.x)),
                Axis::new(l, world, predictor, 1, l.all(position.y), l.all(velocity.y)),
                Axis::new(l, world, predictor, 2, l.all(position.z), l.all(velocity.z)),
            ],
            epoch: l.all(start.epoch),
            offset: l.all(start.offset),
            age: l.all(seeker.now.since(start)),
            // Not read where all are alike: it would have to come from memory.
            distance: l.all(predictor.contact_distance.unwrap_or_else(|| seeker.radius())),
            of_one_size: predictor.contact_distance.is_some(),
        }
    }

    /// Another in each lane.
    #[inline(always)]
    pub fn of_each(l: L, world: &World, predictor: &Predictor, now: Time, asking: &[u32]) -> Self {
        let [x, y, z, vx, vy, vz, epoch, offset] = l.columns(&world.flights, asking);
        Self {
            axes: [
                Axis::new(l, world, predictor, 0, x, vx),
                Axis::new(l, world, predictor, 1, y, vy),
                Axis::new(l, world, predictor, 2, z, vz),
            ],
            epoch,
            offset,
            age: l.add(l.sub(l.all(now.epoch), epoch), l.sub(l.all(now.offset), offset)),
            distance: match predictor.contact_distance {
                Some(same) => l.all(same),
                None => l.gather(world.radii.each(), asking),
            },
            of_one_size: predictor.contact_distance.is_some(),
        }
    }

    #[inline(always)]
    fn twice(&self) -> Ask<Twice<L>> {
        Ask {
            axes: [self.axes[0].twice(), self.axes[1].twice(), self.axes[2].twice()],
            epoch: [self.epoch; 2],
            offset: [self.offset; 2],
            age: [self.age; 2],
            distance: [self.distance; 2],
            of_one_size: self.of_one_size,
        }
    }

    /// How each of `others` is approached. (No closures in here: they would not be compiled for `L`.)
    #[inline(always)]
    pub fn approach<const PERIODIC: bool, const FALLING: bool, const FRESH: bool>(
        &self,
        l: L,
        world: &World,
        others: &[u32],
    ) -> Approach<L> {
        let zero = l.all(0.0);
        let [x, y, z, vx, vy, vz, their_epoch, their_offset] = l.columns(&world.flights, others);
        let ahead = l.add(l.sub(self.epoch, their_epoch), l.sub(self.offset, their_offset));
        let mine_flown = if FRESH { zero } else { l.max(l.sub(zero, ahead), zero) };
        let theirs_flown = if FRESH { ahead } else { l.max(ahead, zero) };
        let flown = [mine_flown, theirs_flown, l.sub(self.age, mine_flown)];
        let (rx, vx) = self.axes[0].seen_from::<PERIODIC, FALLING, FRESH>(l, x, vx, flown);
        let (ry, vy) = self.axes[1].seen_from::<PERIODIC, FALLING, FRESH>(l, y, vy, flown);
        let (rz, vz) = self.axes[2].seen_from::<PERIODIC, FALLING, FRESH>(l, z, vz, flown);
        let distance =
            if self.of_one_size { self.distance } else { l.add(self.distance, l.gather(world.radii.each(), others)) };
        Approach { r: [rx, ry, rz], v: [vx, vy, vz], mine_flown, distance }
    }
}

/// Balls as seen from others: position (m) and velocity (m/s) at the later of their starts, the seconds flown until then, and the
/// contact distance (m); the bits are those of [`Seeker::meeting_with`].
#[derive(Clone, Copy)]
pub(super) struct Approach<L: Lanes> {
    r: [L::Numbers; 3],
    v: [L::Numbers; 3],
    mine_flown: L::Numbers,
    distance: L::Numbers,
}

impl<L: Lanes> Approach<L> {
    /// Twice the same.
    #[inline(always)]
    fn twice(&self) -> Approach<Twice<L>> {
        let ([x, y, z], [vx, vy, vz]) = (self.r, self.v);
        Approach {
            r: [[x; 2], [y; 2], [z; 2]],
            v: [[vx; 2], [vy; 2], [vz; 2]],
            mine_flown: [self.mine_flown; 2],
            distance: [self.distance; 2],
        }
    }

    /// These and others side by side.
    #[inline(always)]
    fn with(&self, other: &Self) -> Approach<Twice<L>> {
        let ([x, y, z], [vx, vy, vz]) = (self.r, self.v);
        let ([x2, y2, z2], [vx2, vy2, vz2]) = (other.r, other.v);
        Approach {
            r: [[x, x2], [y, y2], [z, z2]],
            v: [[vx, vx2], [vy, vy2], [vz, vz2]],
            mine_flown: [self.mine_flown, other.mine_flown],
            distance: [self.distance, other.distance],
        }
    }

    /// Seconds from the ball's own start before which each pair certainly does not meet; infinite if it never does.
    ///
    /// [`ball_ball::time_of_impact`] gives c / (√D - b) with c, D and b rounded, and 0 for those that overlap. Here
    ///
    ///   c' = r² - s² - K (r² + s²),  D' = b² - v² c',  K = 2^-46,
    ///
    /// with the very b of there. With ε = 2^-53, all sums of both are exact to 10 ε (r² + s²), 10 ε v² (r² + s²) for D, while K is
    /// 128 ε: so c' is less than its c, and D' more than its D. (Without K, both D are the same number by Lagrange's identity.)
    /// So c' / (√D' - b) is no later, and a pair that it finds to meet has D' > 0. What the near root and the near quotient err by
    /// is taken off twice.
    #[inline(always)]
    pub fn earliest<const FRESH: bool>(&self, l: L) -> L::Numbers {
        let (zero, tiny) = (l.all(0.0), l.all(LEAST_SQUARE));
        let (r, v) = (self.r, self.v);
        let b = l.add(l.add(l.mul(r[0], v[0]), l.mul(r[1], v[1])), l.mul(r[2], v[2]));
        let (squared, speed_squared) = (near_square(l, r), near_square(l, v));
        let reach = l.mul(self.distance, self.distance);
        let c = l.near_sub_product(l.sub(squared, reach), l.all(BOUND_MARGIN), l.add(squared, reach));
        let discriminant = l.near_sub_product(l.near_add_product(tiny, b, b), speed_squared, c);
        let approach_rate = l.sub(l.near_sqrt(l.max(discriminant, tiny)), b);
        let seconds = l.mul(l.near_quotient(c, approach_rate), l.all(1.0 - 4.0 / NEAR));
        let meets = l.both(l.below(b, zero), l.below(zero, discriminant));
        l.select(meets, if FRESH { seconds } else { l.add(seconds, self.mine_flown) }, l.all(f64::INFINITY))
    }
}

#[inline(always)]
fn near_square<L: Lanes>(l: L, a: [L::Numbers; 3]) -> L::Numbers {
    l.near_add_product(l.near_add_product(l.mul(a[0], a[0]), a[1], a[1]), a[2], a[2])
}

/// In each lane, who could be met first so far, where in the row its block begins, and when the next could be.
struct Firsts<L: Lanes> {
    earliest: L::Numbers,
    next: L::Numbers,
    approach: Approach<L>,
    place: L::Numbers,
    blocks: usize,
}

impl<L: Lanes> Firsts<L> {
    #[inline(always)]
    fn none(l: L) -> Self {
        let (never, zero) = (l.all(f64::INFINITY), l.all(0.0));
        let approach = Approach { r: [zero; 3], v: [zero; 3], mine_flown: zero, distance: zero };
        Self { earliest: never, next: never, approach, place: zero, blocks: 0 }
    }

    /// With one more block, which begins at `place` in the row.
    #[inline(always)]
    fn consider<const FRESH: bool>(&mut self, l: L, earliest: L::Numbers, approach: &Approach<L>, place: usize) {
        self.blocks += 1;
        if self.blocks == 1 {
            self.earliest = earliest;
            self.approach = *approach;
            return;
        }
        let sooner = l.below(earliest, self.earliest);
        self.next = l.min(self.next, l.max(self.earliest, earliest));
        self.earliest = l.select(sooner, earliest, self.earliest);
        for axis in 0..3 {
            self.approach.r[axis] = l.select(sooner, approach.r[axis], self.approach.r[axis]);
            self.approach.v[axis] = l.select(sooner, approach.v[axis], self.approach.v[axis]);
        }
        if !FRESH {
            self.approach.mine_flown = l.select(sooner, approach.mine_flown, self.approach.mine_flown);
        }
        self.place = l.select(sooner, l.all(place as f64), self.place);
    }

    /// The first of all lanes, whose least is `earliest`.
    #[inline(always)]
    fn soonest<const FRESH: bool>(self, l: L, seeker: &Seeker, row: &[u32], earliest: f64) -> Soonest {
        if earliest == f64::INFINITY {
            return Soonest::NEVER;
        }
        let firsts = l.equal(self.earliest, l.all(earliest));
        let bits = l.bits(firsts);
        let lane = bits.trailing_zeros() as usize % L::COUNT;
        let place = lane + if self.blocks == 1 { 0 } else { l.nth(self.place, lane) as usize };
        // The next after the first of one lane, unless several lanes have it.
        let next = l.least(l.select(firsts, self.next, self.earliest));
        let next = if bits.count_ones() > 1 { earliest } else { next };
        let Approach { r: [x, y, z], v: [vx, vy, vz], mine_flown, .. } = self.approach;
        let r = DVec3::new(l.nth(x, lane), l.nth(y, lane), l.nth(z, lane));
        let v = DVec3::new(l.nth(vx, lane), l.nth(vy, lane), l.nth(vz, lane));
        let seconds = ball_ball::time_of_impact(r, v, seeker.contact_distance(row[place] as usize));
        let seconds = seconds.unwrap_or(f64::INFINITY);
        let after_own_start = if FRESH { seconds } else { seconds + l.nth(mine_flown, lane) };
        if after_own_start < next {
            return Soonest { after_own_start, seconds, place, next };
        }
        soonest_one_by_one(seeker, row)
    }
}

/// The same, where it takes more than bounds to tell.
#[cold]
fn soonest_one_by_one(seeker: &Seeker, row: &[u32]) -> Soonest {
    let mut soonest = Soonest::NEVER;
    for (place, &other) in row.iter().enumerate() {
        if other as usize == seeker.ball {
            continue;
        }
        let Some((after_own_start, seconds)) = seeker.meeting_with(other as usize) else { continue };
        if after_own_start < soonest.after_own_start {
            soonest = Soonest { after_own_start, seconds, place, next: soonest.after_own_start };
        } else {
            soonest.next = soonest.next.min(after_own_start);
        }
    }
    soonest
}

#[cfg(test)]
mod tests {
    use super::super::lanes::{IN_ORDER, Width};
    use super::*;
    use crate::random::Random;

    /// Pairs by columns: r, v and the contact distance.
    struct Bounds<'a> {
        columns: [&'a [f64; MOST]; 7],
    }

    impl Work for Bounds<'_> {
        type Output = [f64; MOST];

        #[inline(always)]
        fn run<L: Lanes>(self, l: L) -> [f64; MOST] {
            let mut bounds = [0.0; MOST];
            for first in (0..MOST).step_by(L::COUNT) {
                let places = &IN_ORDER[first..first + L::COUNT];
                let [x, y, z, vx, vy, vz, s] = self.columns;
                let approach = Approach {
                    r: [l.gather(x, places), l.gather(y, places), l.gather(z, places)],
                    v: [l.gather(vx, places), l.gather(vy, places), l.gather(vz, places)],
                    mine_flown: l.all(0.0),
                    distance: l.gather(s, places),
                };
                l.put(approach.earliest::<true>(l), &mut bounds[first..]);
            }
            bounds
        }
    }

    /// Two balls at unit distance in contact: far apart, about to touch, or overlapping by less than rounding to a fifth.
    fn pair(random: &mut Random) -> (DVec3, DVec3) {
        let (along, across) = (random.normal_vector(3).normalize(), random.normal_vector(3));
        let across = (across - along * across.dot(along)).normalize();
        let spread = [1e-16, 1e-12, 1e-6, 1e-2, 3.0][(5.0 * random.uniform()) as usize];
        let distance = 1.0 + spread * (random.uniform() - 0.2);
        // Straight at it, past it by a hair, or any way.
        let velocity = match (3.0 * random.uniform()) as u32 {
            0 => -along,
            1 => {
                let sine = ((1.0 + 1e-13 * random.normal()) / distance).min(1.0);
                across * sine - along * (1.0 - sine * sine).sqrt()
            }
            _ => across * random.normal() - along * random.normal(),
        };
        (along * distance, velocity)
    }

    /// No pair meets before its bound, and bounds are near: of pairs that graze, touch, overlap or hardly move, too, and at all
    /// scales that a scene may have.
    #[test]
    fn nobody_is_met_before_the_bound() {
        let mut random = Random::new(20, 26);
        let mut met = 0;
        for block in 0..100_000 {
            let scale = |random: &mut Random, most: f64| 10f64.powf(most * (2.0 * random.uniform() - 1.0));
            let (length, speed) =
                if block % 2 == 0 { (1.0, 1.0) } else { (scale(&mut random, 75.0), scale(&mut random, 75.0)) };
            let pairs = [0; MOST].map(|_| {
                let (r, v) = pair(&mut random);
                (r * length, v * speed)
            });
            let column = |axis: usize| pairs.map(|(r, v)| if axis < 3 { r[axis] } else { v[axis - 3] });
            let columns = [column(0), column(1), column(2), column(3), column(4), column(5), [length; MOST]];
            for most in [2, 4, 8] {
                let bounds = Width::at_most(most).run(Bounds { columns: columns.each_ref() });
                for ((r, v), bound) in pairs.into_iter().zip(bounds) {
                    let Some(time) = ball_ball::time_of_impact(r, v, length) else { continue };
                    assert!(bound <= time, "{r:?} {v:?} {length}: {time} before {bound}");
                    // Nearer, what rounding may do is more than what the near root and quotient err by.
                    if time * v.length() > 1e-3 * length {
                        assert!(bound > 0.998 * time, "{r:?} {v:?} {length}: {time}, but {bound}");
                        met += 1;
                    }
                }
            }
        }
        assert!(met > 300_000, "{met}");
    }
}
