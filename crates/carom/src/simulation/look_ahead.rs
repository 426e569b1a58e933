//! Fetching into the cache what the next events will need, where there is more than the caches hold.
//!
//! The nearer an event, the more of what it leads to is known, and fetched. It is done a little at a time between the steps of
//! the loop: a processor has room for some twenty lines on their way, and whatever is asked for beyond that waits, or is lost.

use prefetch_index::prefetch_index;

use super::Simulation;
use crate::event::Upcoming;
use crate::queue::Mark;
use crate::world::nearby::Nearby;
use crate::world::{Partner, World};

/// Buckets of the calendar, from the present one on, whose events something is fetched for.
const BUCKETS: usize = 4;
/// How often between two events something is fetched, about.
const TIMES_AN_EVENT: usize = 3;

/// What is to be fetched for events of the present bucket of the calendar and the next few.
#[derive(Clone, Debug)]
pub(super) struct LookAhead {
    /// Whether there are so many balls that what an event needs is not in the cache.
    pub wanted: bool,
    /// The bucket of the calendar for which it was planned.
    bucket: i64,
    /// How many buckets ahead an event is, and whose it is.
    plan: Vec<(u8, Mark)>,
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
        queue.prefetch(BUCKETS + 1);
        plan.clear();
        plan.extend(queue.at_present().iter().map(|entry| (0, entry.mark)));
        for ahead in 1..BUCKETS {
            queue.ahead(ahead, |mark| plan.push((ahead as u8, mark)));
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
            let (ahead, mark) = self.look_ahead.plan[k];
            self.fetch(ahead, mark);
        }
        self.look_ahead.done = end;
    }

    /// Fetches what is known to be needed of an event so many buckets ahead.
    #[inline(always)]
    fn fetch(&mut self, ahead: u8, mark: Mark) {
        let (world, upcoming, nearby, room) = (&self.world, &self.upcoming[..], &mut self.nearby, &mut self.room);
        let ball = mark.ball as usize;
        if usize::from(ahead) == BUCKETS - 1 {
            // Whose event it is, and no more.
            prefetch_index(upcoming, ball);
            prefetch_index(&world.flights, ball);
            prefetch_index(&world.bodies, ball);
            prefetch_index(&world.impacts, ball);
            nearby.prefetch(ball);
            return;
        }
        let next = &upcoming[ball];
        if next.stamp != mark.stamp {
            return;
        }
        // The partner's own event is the same impact, unless what the partner foresaw is older.
        let surprised = |next: &Upcoming| {
            let other = next.partner.as_ball().filter(|_| next.is_impact());
            other.filter(|&other| upcoming[other].partner != Partner::ball(mark.ball))
        };
        match ahead {
            2 => {
                nearby.prefetch_row(ball, next.leaves);
                if let Some(other) = next.partner.as_ball() {
                    prefetch_index(&world.impacts, other);
                    prefetch_index(upcoming, other);
                    prefetch_index(&world.flights, other);
                    prefetch_index(&world.bodies, other);
                    nearby.prefetch(other);
                }
            }
            1 => {
                nearby.prefetch_near(world, ball, next, room);
                if let Some(other) = surprised(next) {
                    nearby.prefetch_row(other, None);
                }
            }
            _ => nearby.prefetch_last(world, ball, next, surprised(next), room),
        }
    }
}
