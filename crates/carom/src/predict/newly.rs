//! Many pairs of balls at once that have just come near each other: who of them meets before what is foreseen so far.
//!
//! A ball that passes into another cell meets but few new ones, too few for a row of its own; here a lane is a pair, whoever it
//! belongs to. The arithmetic is that of [`super::row`], so the bits are the same.

use super::lanes::{IN_ORDER, Lanes, Work};
use super::row::{Ask, Soonest};
use super::seeker::Seeker;
use super::{First, Predictor};
use crate::event::Upcoming;
use crate::time::Time;
use crate::world::World;
use crate::world::nearby::Gathered;

/// Pairs of balls that have just come near each other, to be looked at several at a time, whoever they belong to.
#[derive(Clone, Debug, Default)]
pub struct Newly {
    asking: Vec<u32>,
    others: Gathered,
    /// Seconds after the asking ball's own start up to which an impact matters to it.
    limits: Vec<f64>,
    /// Seconds after it before which they certainly do not meet.
    earliest: Vec<f64>,
}

/// An impact of two balls that have just come near each other.
#[derive(Clone, Copy, Debug)]
pub struct Meeting {
    /// Who asked.
    pub ball: u32,
    /// Whom it meets.
    pub other: u32,
    /// Seconds from its own start to the impact.
    pub after_own_start: f64,
    /// Seconds from the later of the two starts.
    pub seconds: f64,
}

impl Newly {
    /// How many.
    pub fn count(&self) -> usize {
        self.others.count()
    }

    /// Where whoever is newly near a ball is gathered, before [`Newly::ask`] tells who asks.
    #[inline(always)]
    pub fn others(&mut self) -> &mut Gathered {
        &mut self.others
    }

    /// Whoever was gathered since there were `before` is near `asking`.
    #[inline(always)]
    pub fn ask(&mut self, before: usize, asking: u32, limit: f64) {
        let after = self.others.count();
        if self.asking.len() < after + CHUNK {
            self.asking.resize(2 * (after + CHUNK), 0);
            self.limits.resize(2 * (after + CHUNK), 0.0);
        }
        // Almost always one chunk: what is too much is written over.
        let mut from = before;
        while from < after {
            self.asking[from..from + CHUNK].fill(asking);
            self.limits[from..from + CHUNK].fill(limit);
            from += CHUNK;
        }
    }

    /// Fills up the last block with the last ball and itself, which it never meets.
    fn fill_up(&mut self) {
        let len = self.others.count();
        let Some(&last) = self.asking[..len].last() else { return };
        let full = self.others.filled_up(last as usize).len();
        self.asking[len..full].fill(last);
        self.limits[len..full].fill(0.0);
        if self.earliest.len() < full {
            self.earliest.resize(full, 0.0);
        }
    }
}

/// Places filled at once.
const CHUNK: usize = 16;

impl Predictor {
    /// Whether the ball's pairs can be looked at many at a time.
    pub fn is_plain(&self, world: &World, ball: usize, now: Time) -> bool {
        Seeker { world, predictor: self, ball, now }.is_plain()
    }

    /// Finds who meets somebody newly near before its limit, and forgets these pairs.
    pub fn meet_newly(&self, world: &World, now: Time, pairs: &mut Newly, found: &mut Vec<Meeting>) {
        self.width.run(NewlySearch { world, predictor: self, now, pairs, found });
    }

    /// The first of a ball's meetings, if it is certainly before what was `foretold` of it.
    #[inline(always)]
    pub fn first_of_meetings(
        &self,
        world: &World,
        now: Time,
        foretold: &Upcoming,
        meetings: &[Meeting],
    ) -> Option<First> {
        let (mut soonest, mut next) = (meetings.first()?, f64::INFINITY);
        for meeting in &meetings[1..] {
            if meeting.after_own_start < soonest.after_own_start {
                (soonest, next) = (meeting, soonest.after_own_start);
            } else {
                next = next.min(meeting.after_own_start);
            }
        }
        let Meeting { ball, other, after_own_start, seconds } = *soonest;
        let seeker = Seeker { world, predictor: self, ball: ball as usize, now };
        let next = next.min(foretold.time.since(seeker.flight().start()));
        // A pair that touches may rest.
        if seconds == 0.0 || next <= after_own_start {
            return None;
        }
        let soonest = Soonest { after_own_start, seconds, place: 0, next };
        let first = seeker.considering(&soonest, &[other], First::NEVER);
        (!first.tied).then_some(first)
    }
}

/// The search through such pairs; forgets them.
struct NewlySearch<'a> {
    world: &'a World,
    predictor: &'a Predictor,
    now: Time,
    pairs: &'a mut Newly,
    /// Whoever meets somebody before its limit is added here.
    found: &'a mut Vec<Meeting>,
}

impl Work for NewlySearch<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self, l: L) {
        match (self.predictor.periods.any, self.predictor.falling) {
            (true, false) => self.search::<L, true, false>(l),
            (false, false) => self.search::<L, false, false>(l),
            (false, true) => self.search::<L, false, true>(l),
            (true, true) => self.search::<L, true, true>(l),
        }
    }
}

impl NewlySearch<'_> {
    #[inline(always)]
    fn search<L: Lanes, const PERIODIC: bool, const FALLING: bool>(self, l: L) {
        let Self { world, predictor, now, pairs, found } = self;
        pairs.fill_up();
        let Newly { asking, others, limits: limits_of, earliest } = pairs;
        let others_of = others.whole_rows();
        for first in (0..others_of.len()).step_by(L::COUNT) {
            let block = first..first + L::COUNT;
            let ask = Ask::of_each(l, world, predictor, now, &asking[block.clone()]);
            let approach = ask.approach::<PERIODIC, FALLING, false>(l, world, &others_of[block.clone()]);
            l.put(approach.earliest::<false>(l), &mut earliest[block]);
        }
        // Apart from the arithmetic, which so never waits for a branch.
        for first in (0..others_of.len()).step_by(L::COUNT) {
            let earliest = l.gather(&earliest[first..first + L::COUNT], &IN_ORDER);
            let limits = l.gather(&limits_of[first..first + L::COUNT], &IN_ORDER);
            let mut hits = l.bits(l.below(earliest, limits));
            while hits != 0 {
                let k = first + hits.trailing_zeros() as usize;
                let (ball, other) = (asking[k], others_of[k]);
                found.extend(meeting_before(world, predictor, now, [ball, other], limits_of[k]));
                hits &= hits - 1;
            }
        }
        others.clear();
    }
}

/// When two balls meet, if that is before a limit, both in seconds from the first one's own start.
#[inline(always)]
fn meeting_before(
    world: &World,
    predictor: &Predictor,
    now: Time,
    [ball, other]: [u32; 2],
    limit: f64,
) -> Option<Meeting> {
    if ball == other {
        return None;
    }
    let seeker = Seeker { world, predictor, ball: ball as usize, now };
    let (after_own_start, seconds) = seeker.meeting_with(other as usize)?;
    (after_own_start < limit).then_some(Meeting { ball, other, after_own_start, seconds })
}
