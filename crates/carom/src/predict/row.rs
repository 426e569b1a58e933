//! A ball against a whole row of others, several at a time: [`super::ball_ball::time_of_impact`] in each lane, operation by
//! operation, so that a pair's root has the same bits as alone.

use super::lanes::{Lanes, Twice, Work};
use super::seeker::Seeker;
use super::{NO_FRACTION, Predictor};
use crate::time::Time;
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
    /// Seconds from the ball's own start to the next impact after this.
    pub next: f64,
}

impl Soonest {
    const NEVER: Self = Self { after_own_start: f64::INFINITY, seconds: f64::INFINITY, place: 0, next: f64::INFINITY };
}

/// The search of a ball through a row, whose length is a multiple of [`super::lanes::MOST`].
pub(super) struct Search<'a> {
    pub seeker: Seeker<'a>,
    pub row: &'a [u32],
}

impl Work for &Search<'_> {
    type Output = Soonest;

    #[inline(always)]
    fn run<L: Lanes>(self, lanes: L) -> Soonest {
        let (seeker, row) = (&self.seeker, self.row);
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

#[inline(always)]
fn dot<L: Lanes>(l: L, a: [L::Numbers; 3], b: [L::Numbers; 3]) -> L::Numbers {
    l.add(l.add(l.mul(a[0], b[0]), l.mul(a[1], b[1])), l.mul(a[2], b[2]))
}

/// a b - c d.
#[inline(always)]
fn minor<L: Lanes>(l: L, a: L::Numbers, b: L::Numbers, c: L::Numbers, d: L::Numbers) -> L::Numbers {
    l.sub(l.mul(a, b), l.mul(c, d))
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
        let meetings = if place + 2 * L::COUNT <= row.len() {
            let others = &row[place..place + 2 * L::COUNT];
            meetings::<Twice<L>, PERIODIC, FALLING, FRESH>(two, seeker.world, seeker.predictor, &asks, others)
        } else {
            let others = &row[place..];
            let (after, seconds) =
                meetings::<L, PERIODIC, FALLING, FRESH>(l, seeker.world, seeker.predictor, &ask, others);
            ([after, l.all(f64::INFINITY)], [seconds; 2])
        };
        firsts.consider::<FRESH>(two, meetings, place);
        place += 2 * L::COUNT;
    }
    firsts.soonest::<FRESH>(two)
}

/// The ball that asks, in all lanes; or one in each.
pub(super) struct Ask<L: Lanes> {
    axes: [Axis<L>; 3],
    epoch: L::Numbers,
    offset: L::Numbers,
    age: L::Numbers,
    radius: L::Numbers,
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
            radius: l.all(seeker.radius()),
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
            // Nobody asks for radii where all are the same.
            radius: if predictor.contact_distance.is_some() { l.all(0.0) } else { l.gather(&world.radii, asking) },
        }
    }

    #[inline(always)]
    fn twice(&self) -> Ask<Twice<L>> {
        Ask {
            axes: [self.axes[0].twice(), self.axes[1].twice(), self.axes[2].twice()],
            epoch: [self.epoch; 2],
            offset: [self.offset; 2],
            age: [self.age; 2],
            radius: [self.radius; 2],
        }
    }
}

/// When the seeker meets each of `others`: seconds from its own start, infinite where it does not, and from the later start. (No
/// closures in here: they would not be compiled for `L`.)
#[inline(always)]
pub(super) fn meetings<L: Lanes, const PERIODIC: bool, const FALLING: bool, const FRESH: bool>(
    l: L,
    world: &World,
    predictor: &Predictor,
    ask: &Ask<L>,
    others: &[u32],
) -> (L::Numbers, L::Numbers) {
    let zero = l.all(0.0);
    let never = l.all(f64::INFINITY);
    let [x, y, z, vx, vy, vz, their_epoch, their_offset] = l.columns(&world.flights, others);
    let ahead = l.add(l.sub(ask.epoch, their_epoch), l.sub(ask.offset, their_offset));
    let mine_flown = if FRESH { zero } else { l.max(l.sub(zero, ahead), zero) };
    let theirs_flown = if FRESH { ahead } else { l.max(ahead, zero) };
    let flown = [mine_flown, theirs_flown, l.sub(ask.age, mine_flown)];
    let (rx, vx) = ask.axes[0].seen_from::<PERIODIC, FALLING, FRESH>(l, x, vx, flown);
    let (ry, vy) = ask.axes[1].seen_from::<PERIODIC, FALLING, FRESH>(l, y, vy, flown);
    let (rz, vz) = ask.axes[2].seen_from::<PERIODIC, FALLING, FRESH>(l, z, vz, flown);
    let (r, v) = ([rx, ry, rz], [vx, vy, vz]);
    let distance = match predictor.contact_distance {
        Some(same) => l.all(same),
        None => l.add(ask.radius, l.gather(&world.radii, others)),
    };
    let b = dot(l, r, v);
    let squared = dot(l, r, r);
    let cross = [minor(l, ry, vz, rz, vy), minor(l, rz, vx, rx, vz), minor(l, rx, vy, ry, vx)];
    let reach = l.mul(distance, distance);
    let (sweep, miss) = (l.mul(reach, dot(l, v, v)), dot(l, cross, cross));
    let approaching = l.below(b, zero);
    let hitting = l.below(miss, sweep);
    let apart = l.sqrt(squared);
    let c = l.mul(l.sub(apart, distance), l.add(apart, distance));
    let discriminant = l.sub(sweep, miss);
    let flight = l.div(c, l.sub(l.sqrt(l.max(discriminant, zero)), b));
    // Overlapping and approaching: now.
    let seconds = l.select(l.below(zero, c), flight, zero);
    let meets = l.both(approaching, l.either(hitting, l.below(apart, distance)));
    (l.select(meets, if FRESH { seconds } else { l.add(seconds, mine_flown) }, never), seconds)
}

/// In each lane, the first meeting so far, where in the row its block begins, and the next after it.
struct Firsts<L: Lanes> {
    after_own_start: L::Numbers,
    seconds: L::Numbers,
    next: L::Numbers,
    place: L::Numbers,
    blocks: usize,
}

impl<L: Lanes> Firsts<L> {
    #[inline(always)]
    fn none(l: L) -> Self {
        let never = l.all(f64::INFINITY);
        Self { after_own_start: never, seconds: never, next: never, place: l.all(0.0), blocks: 0 }
    }

    /// With one more block, which begins at `place` in the row.
    #[inline(always)]
    fn consider<const FRESH: bool>(&mut self, l: L, (after, seconds): (L::Numbers, L::Numbers), place: usize) {
        self.blocks += 1;
        if self.blocks == 1 {
            (self.after_own_start, self.seconds) = (after, seconds);
            return;
        }
        let sooner = l.below(after, self.after_own_start);
        self.next = l.min(self.next, l.max(self.after_own_start, after));
        self.after_own_start = l.select(sooner, after, self.after_own_start);
        if !FRESH {
            self.seconds = l.select(sooner, seconds, self.seconds);
        }
        self.place = l.select(sooner, l.all(place as f64), self.place);
    }

    /// The first of all lanes.
    #[inline(always)]
    fn soonest<const FRESH: bool>(self, l: L) -> Soonest {
        let after_own_start = l.least(self.after_own_start);
        let firsts = l.equal(self.after_own_start, l.all(after_own_start));
        let bits = l.bits(firsts);
        let lane = bits.trailing_zeros() as usize % L::COUNT;
        // The next after the first of one lane, unless several lanes have it.
        let next = l.least(l.select(firsts, self.next, self.after_own_start));
        Soonest {
            after_own_start,
            seconds: if FRESH { after_own_start } else { l.nth(self.seconds, lane) },
            place: lane + if self.blocks == 1 { 0 } else { l.nth(self.place, lane) as usize },
            next: if bits.count_ones() > 1 { after_own_start } else { next },
        }
    }
}
