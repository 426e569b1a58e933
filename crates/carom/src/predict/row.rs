//! A ball against a whole row of others, several at a time: [`super::ball_ball::time_of_impact`] in each lane, operation by
//! operation, so that a pair's root has the same bits as alone.

use super::NO_FRACTION;
use super::lanes::{Lanes, MOST, Work};
use super::seeker::Seeker;

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

/// The search of some balls through a row each, whose length is a multiple of [`MOST`]. Both balls of an impact search at
/// once, so that the processor can work on one row while it waits for the other.
pub(super) struct Search<'a, const N: usize> {
    pub seekers: [Seeker<'a>; N],
    pub rows: [&'a [u32]; N],
}

impl<const N: usize> Work for Search<'_, N> {
    type Output = [Soonest; N];

    #[inline(always)]
    fn run<L: Lanes>(self, lanes: L) -> [Soonest; N] {
        let Self { seekers, rows } = self;
        let mut found = [Soonest::NEVER; N];
        for k in 0..N {
            let (seeker, row) = (&seekers[k], rows[k]);
            // Right after an impact of its own, nobody's flight is younger.
            let fresh = seeker.flight().start() == seeker.now;
            found[k] = match (seeker.predictor.periods.any, seeker.predictor.falling, fresh) {
                (true, false, true) => soonest::<L, true, false, true>(lanes, seeker, row),
                (true, false, false) => soonest::<L, true, false, false>(lanes, seeker, row),
                (false, false, true) => soonest::<L, false, false, true>(lanes, seeker, row),
                (false, false, false) => soonest::<L, false, false, false>(lanes, seeker, row),
                (false, true, _) => soonest::<L, false, true, false>(lanes, seeker, row),
                (true, true, _) => soonest::<L, true, true, false>(lanes, seeker, row),
            };
        }
        found
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
    fn new(l: L, seeker: &Seeker, axis: usize) -> Self {
        Self {
            position: l.all(seeker.flight().position()[axis]),
            velocity: l.all(seeker.flight().velocity()[axis]),
            length: l.all(seeker.predictor.periods.length[axis]),
            inverse: l.all(seeker.predictor.periods.inverse[axis]),
            gravity: l.all(seeker.world.gravity[axis]),
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
/// acceleration; `FRESH`: the seeker's flight begins now, and nobody's later. (No closures in here: they would not be compiled for `L`.)
#[inline(always)]
fn soonest<L: Lanes, const PERIODIC: bool, const FALLING: bool, const FRESH: bool>(
    l: L,
    seeker: &Seeker,
    row: &[u32],
) -> Soonest {
    let flights = &seeker.world.flights[..];
    let zero = l.all(0.0);
    let never = l.all(f64::INFINITY);
    let start = seeker.flight().start();
    let (epoch, offset) = (l.all(start.epoch), l.all(start.offset));
    let age = l.all(seeker.now.since(start));
    let axes = [Axis::new(l, seeker, 0), Axis::new(l, seeker, 1), Axis::new(l, seeker, 2)];
    let (mut best, mut best_seconds, mut best_block, mut second) = (never, never, zero, never);
    for (block, others) in row.chunks_exact(L::COUNT).enumerate() {
        let [x, y, z, vx, vy, vz, their_epoch, their_offset] = l.columns(flights, others);
        let ahead = l.add(l.sub(epoch, their_epoch), l.sub(offset, their_offset));
        let mine_flown = if FRESH { zero } else { l.max(l.sub(zero, ahead), zero) };
        let theirs_flown = if FRESH { ahead } else { l.max(ahead, zero) };
        let flown = [mine_flown, theirs_flown, l.sub(age, mine_flown)];
        let (rx, vx) = axes[0].seen_from::<PERIODIC, FALLING, FRESH>(l, x, vx, flown);
        let (ry, vy) = axes[1].seen_from::<PERIODIC, FALLING, FRESH>(l, y, vy, flown);
        let (rz, vz) = axes[2].seen_from::<PERIODIC, FALLING, FRESH>(l, z, vz, flown);
        let (r, v) = ([rx, ry, rz], [vx, vy, vz]);
        let distance = match seeker.predictor.contact_distance {
            Some(same) => l.all(same),
            None => l.add(l.all(seeker.radius()), l.gather(&seeker.world.radii, others)),
        };
        let b = dot(l, r, v);
        let squared = dot(l, r, r);
        let cross = [minor(l, ry, vz, rz, vy), minor(l, rz, vx, rx, vz), minor(l, rx, vy, ry, vx)];
        let reach = l.mul(distance, distance);
        let (sweep, miss) = (l.mul(reach, dot(l, v, v)), dot(l, cross, cross));
        // A square errs by a few ulps: which of those in doubt overlap is told by the distance itself.
        let doubtful = l.below(squared, l.mul(reach, l.all(1.0 + 8.0 * f64::EPSILON)));
        let approaching = l.below(b, zero);
        let hitting = l.below(miss, sweep);
        if l.bits(l.both(approaching, l.either(hitting, doubtful))) == 0 {
            continue;
        }
        let apart = l.sqrt(squared);
        let c = l.mul(l.sub(apart, distance), l.add(apart, distance));
        let discriminant = l.sub(sweep, miss);
        let flight = l.div(c, l.sub(l.sqrt(l.max(discriminant, zero)), b));
        // Overlapping and approaching: now.
        let seconds = l.select(l.below(zero, c), flight, zero);
        let meets = l.both(approaching, l.either(hitting, l.below(apart, distance)));
        let after_own_start = l.select(meets, if FRESH { seconds } else { l.add(seconds, mine_flown) }, never);
        let sooner = l.below(after_own_start, best);
        second = l.min(second, l.max(best, after_own_start));
        best = l.select(sooner, after_own_start, best);
        if !FRESH {
            best_seconds = l.select(sooner, seconds, best_seconds);
        }
        best_block = l.select(sooner, l.all(block as f64), best_block);
    }
    reduce(l, best, if FRESH { best } else { best_seconds }, best_block, second)
}

/// The first over all lanes.
#[inline(always)]
fn reduce<L: Lanes>(l: L, best: L::Numbers, seconds: L::Numbers, block: L::Numbers, second: L::Numbers) -> Soonest {
    let after_own_start = l.least(best);
    let firsts = l.equal(best, l.all(after_own_start));
    let lane = l.bits(firsts).trailing_zeros() as usize % MOST;
    // The next after the first of one lane, unless several lanes have it.
    let next = l.least(l.select(firsts, second, best));
    let tied = l.bits(firsts).count_ones() > 1;
    let [mut all_seconds, mut blocks] = [[0.0; MOST]; 2];
    l.store(seconds, &mut all_seconds);
    l.store(block, &mut blocks);
    Soonest {
        after_own_start,
        seconds: all_seconds[lane],
        place: blocks[lane] as usize * L::COUNT + lane,
        next: if tied { after_own_start } else { next },
    }
}
