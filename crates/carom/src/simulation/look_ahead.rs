//! Fetching into the cache what the next events will need, where there is more than the caches hold.
//!
//! The nearer an event, the more of what it leads to is known, and fetched; all of it before the calendar's bucket that the event
//! is in comes up. It is done a little at a time between the steps of the loop: a processor has room for so many lines on their way,
//! and whatever is asked for beyond that waits.

use super::Simulation;
use crate::prefetch::prefetch;
use crate::queue::Mark;
use crate::world::World;
use crate::world::nearby::Nearby;

/// So many buckets ahead, an event is first looked at.
const FARTHEST: usize = 3;
/// How often between two events something is fetched, about.
const TIMES_AN_EVENT: usize = 3;

/// What is to be fetched for events of the next few buckets of the calendar.
#[derive(Clone, Debug)]
pub(super) struct LookAhead {
    /// Whether there are so many balls that what an event needs is not in the cache.
    pub wanted: bool,
    /// The bucket of the calendar for which it was planned.
    bucket: i64,
    /// Whose events are in the next bucket, in that after it, and so on.
    ahead: [Vec<Mark>; FARTHEST],
    /// The first so many of each have been looked at, out of how many at most.
    done: usize,
    most: usize,
    at_once: usize,
}

impl LookAhead {
    /// Nothing planned. Fewer balls, with all that is known of them, are near enough in the processor's caches; and looking into
    /// cells is dearer than looking at lists.
    pub fn new(world: &World, nearby: &Nearby) -> Self {
        let cached = match nearby {
            Nearby::Lists(_) => 13_000,
            Nearby::Cells(_) => 25_000,
        };
        let ahead = [const { Vec::new() }; FARTHEST];
        Self { wanted: world.len() > cached, bucket: -1, ahead, done: 0, most: 0, at_once: 1 }
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
        while self.look_ahead.done < self.look_ahead.most {
            self.fetch_some();
        }
        let (queue, LookAhead { bucket, ahead, done, most, at_once, .. }) = (&self.queue, &mut self.look_ahead);
        // Buckets in which there was nothing are passed over.
        let passed = usize::try_from(queue.present() - *bucket).map_or(FARTHEST, |passed| passed.min(FARTHEST));
        (*bucket, *done) = (queue.present(), 0);
        queue.prefetch(FARTHEST + 2);
        ahead.rotate_left(passed % FARTHEST);
        for (nearer, marks) in ahead.iter_mut().enumerate().skip(FARTHEST - passed) {
            marks.clear();
            queue.ahead(nearer + 1, |mark| marks.push(mark));
        }
        // One more, for what is fetched a little after something else.
        *most = 1 + ahead.iter().map(Vec::len).max().unwrap_or(0);
        *at_once = most.div_ceil(TIMES_AN_EVENT * queue.at_present().len().max(1));
    }

    /// Fetches a little of what was planned.
    #[inline(always)]
    pub(super) fn fetch_some(&mut self) {
        if self.look_ahead.done < self.look_ahead.most {
            self.fetch_next();
        }
    }

    /// The nearer an event, the later the step that is taken for it.
    #[inline(never)]
    fn fetch_next(&mut self) {
        for _ in 0..self.look_ahead.at_once {
            let LookAhead { ahead: [next, after, farthest], done, .. } = &mut self.look_ahead;
            let k = *done;
            *done += 1;
            let of = |marks: &[Mark], k: usize| marks.get(k).copied();
            let steps = (of(farthest, k), of(after, k), of(next, k), of(next, k.wrapping_sub(1)));
            if let Some(mark) = steps.0 {
                self.fetch_ball(mark.ball as usize);
            }
            if let Some(mark) = steps.1 {
                self.fetch_partner(mark);
            }
            if let Some(mark) = steps.2 {
                self.fetch_near(mark);
            }
            if let Some(mark) = steps.3 {
                self.fetch_near_partner(mark);
            }
        }
    }

    /// What is noted of a ball.
    #[inline(always)]
    fn fetch_ball(&self, ball: usize) {
        prefetch(&self.upcoming, ball);
        prefetch(&self.world.flights, ball);
        prefetch(&self.world.bodies, ball);
        prefetch(&self.world.impacts, ball);
        self.nearby.prefetch(ball);
    }

    /// Where those near the ball are, and what is noted of its partner. (Of few balls something else comes next by now; to find that
    /// out is dearer.)
    #[inline(always)]
    fn fetch_partner(&self, mark: Mark) {
        let (ball, next) = (mark.ball as usize, &self.upcoming[mark.ball as usize]);
        self.nearby.prefetch_row(ball, next.leaves);
        if let Some(other) = next.partner.as_ball() {
            self.fetch_ball(other);
        }
    }

    /// Those near the ball, and where those near its partner are.
    #[inline(always)]
    fn fetch_near(&mut self, mark: Mark) {
        let (ball, next) = (mark.ball as usize, &self.upcoming[mark.ball as usize]);
        if next.stamp != mark.stamp {
            return;
        }
        self.nearby.prefetch_near(&self.world, ball, next, &mut self.room);
        if let Some(other) = next.partner.as_ball() {
            self.nearby.prefetch_row(other, None);
        }
    }

    /// Those near its partner.
    #[inline(always)]
    fn fetch_near_partner(&mut self, mark: Mark) {
        let (ball, next) = (mark.ball as usize, &self.upcoming[mark.ball as usize]);
        if next.stamp == mark.stamp {
            self.nearby.prefetch_last(&self.world, ball, next, &mut self.room);
        }
    }
}
