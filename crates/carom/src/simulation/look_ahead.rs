//! Fetching into the cache what the next events will need, where there is more than the caches hold.
//!
//! The nearer an event, the more of what it leads to is known, and fetched; all of it before the calendar's bucket that the event
//! is in comes up. It is done a little at a time between the steps of the loop: a processor has room for so many lines on their way,
//! and whatever is asked for beyond that waits.

use super::Simulation;
use crate::event::Upcoming;
use crate::prefetch::prefetch;
use crate::queue::Mark;
use crate::world::nearby::Nearby;
use crate::world::{Partner, World};

/// What is fetched for an event, in this order.
#[derive(Clone, Copy, Debug)]
enum Step {
    /// What is noted of the ball whose event it is, and no more.
    Ball,
    /// Where those near it are, and what is noted of its partner.
    Partner,
    /// Those near; and where those near the partner are, if what it foresees is not this.
    Near,
    /// Those near such a partner.
    NearPartner,
}

/// The steps in the order in which they are taken while the calendar stands at one bucket, and how many buckets ahead the events are.
/// Between the two for the next bucket, what the first asked for comes.
const STEPS: [(Step, usize); 4] = [(Step::Near, 1), (Step::Partner, 2), (Step::Ball, 3), (Step::NearPartner, 1)];
/// The farthest of these buckets.
const FARTHEST: usize = 3;
/// How often between two events something is fetched, about.
const TIMES_AN_EVENT: usize = 3;

/// What is to be fetched for events of the present bucket of the calendar and the next few.
#[derive(Clone, Debug)]
pub(super) struct LookAhead {
    /// Whether there are so many balls that what an event needs is not in the cache.
    pub wanted: bool,
    /// The bucket of the calendar for which it was planned.
    bucket: i64,
    /// What comes next, and for whose event.
    plan: Vec<(Step, Mark)>,
    done: usize,
    at_once: usize,
}

impl LookAhead {
    /// Nothing planned. Fewer balls, with all that is known of them, are near enough in the processor's caches; and looking into
    /// cells is dearer than looking at lists.
    pub fn new(world: &World, nearby: &Nearby) -> Self {
        let cached = match nearby {
            Nearby::Lists(_) => 20_000,
            Nearby::Cells(_) => 60_000,
        };
        Self { wanted: world.len() > cached, bucket: -1, plan: Vec::new(), done: 0, at_once: 1 }
    }
}

impl Simulation {
    /// Plans anew when the calendar has turned.
    #[inline(always)]
    pub(super) fn plan_fetches(&mut self) {
        if self.look_ahead.wanted && self.queue.present() != self.look_ahead.bucket {
            self.plan_for_bucket();
        }
    }

    #[inline(never)]
    fn plan_for_bucket(&mut self) {
        while self.look_ahead.done < self.look_ahead.plan.len() {
            self.fetch_some();
        }
        let (queue, LookAhead { bucket, plan, done, at_once, .. }) = (&self.queue, &mut self.look_ahead);
        (*bucket, *done) = (queue.present(), 0);
        queue.prefetch(FARTHEST + 2);
        plan.clear();
        for (step, ahead) in STEPS {
            queue.ahead(ahead, |mark| plan.push((step, mark)));
        }
        *at_once = plan.len().div_ceil(TIMES_AN_EVENT * queue.at_present().len().max(1)).max(1);
    }

    /// Fetches a little of what was planned.
    #[inline(always)]
    pub(super) fn fetch_some(&mut self) {
        if self.look_ahead.done < self.look_ahead.plan.len() {
            self.fetch_next();
        }
    }

    #[inline(never)]
    fn fetch_next(&mut self) {
        let begin = self.look_ahead.done;
        let end = self.look_ahead.plan.len().min(begin + self.look_ahead.at_once);
        for k in begin..end {
            let (step, mark) = self.look_ahead.plan[k];
            self.fetch(step, mark);
        }
        self.look_ahead.done = end;
    }

    /// Fetches what is known to be needed of an event.
    #[inline(always)]
    fn fetch(&mut self, step: Step, mark: Mark) {
        let (world, upcoming, nearby, room) = (&self.world, &self.upcoming[..], &mut self.nearby, &mut self.room);
        let ball = mark.ball as usize;
        if let Step::Ball = step {
            return prefetch_ball(world, upcoming, nearby, ball);
        }
        let next = &upcoming[ball];
        if next.stamp != mark.stamp {
            return;
        }
        // The partner's own event is the same impact, unless what the partner foresaw is older.
        let surprised = || {
            let other = next.partner.as_ball().filter(|_| next.is_impact())?;
            let theirs = &upcoming[other];
            let same = theirs.is_impact() && theirs.partner == Partner::ball(mark.ball) && theirs.time == next.time;
            (!same).then_some(other)
        };
        match step {
            Step::Ball => {}
            Step::Partner => {
                nearby.prefetch_row(ball, next.leaves);
                if let Some(other) = next.partner.as_ball() {
                    prefetch_ball(world, upcoming, nearby, other);
                }
            }
            Step::Near => {
                nearby.prefetch_near(world, ball, next, room);
                if let Some(other) = surprised() {
                    nearby.prefetch_row(other, None);
                }
            }
            Step::NearPartner => nearby.prefetch_last(world, ball, next, surprised(), room),
        }
    }
}

/// Fetches what is noted of a ball.
#[inline(always)]
fn prefetch_ball(world: &World, upcoming: &[Upcoming], nearby: &Nearby, ball: usize) {
    prefetch(upcoming, ball);
    prefetch(&world.flights, ball);
    prefetch(&world.bodies, ball);
    prefetch(&world.impacts, ball);
    nearby.prefetch(ball);
}
