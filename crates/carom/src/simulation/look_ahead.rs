//! Fetching into the cache what the next events will need, where there is more than the caches hold.
//!
//! The nearer an event, the more of what it leads to is known, and fetched; almost all of it before the calendar's bucket that the
//! event is in comes up. It is done for a whole bucket at once when the calendar turns: so the lines are on their way side by side.

use super::Simulation;
use crate::prefetch::prefetch;
use crate::queue::Mark;
use crate::world::World;
use crate::world::nearby::Nearby;

/// So many buckets ahead, an event is first looked at.
const FARTHEST: usize = 3;

/// How much does not fit the processor's caches, with all that is known of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Depth {
    /// Nothing.
    Nothing,
    /// Some: what is noted of balls and partners is fetched, mostly from one cache into a nearer one.
    Noted,
    /// Most: those near them, too. To find them out is dearer.
    Near,
}

/// What is to be fetched for events of the next few buckets of the calendar.
#[derive(Clone, Debug)]
pub(super) struct LookAhead {
    pub depth: Depth,
    /// The bucket of the calendar in which something was last fetched.
    bucket: i64,
    /// Whose events are in the next bucket, in that after it, and so on; of [`Depth::Near`].
    ahead: [Vec<Mark>; FARTHEST],
}

impl LookAhead {
    /// Nothing fetched. Looking into cells is dearer than looking at lists.
    pub fn new(world: &World, nearby: &Nearby) -> Self {
        const CACHED: usize = 3_000;
        let almost_cached = match nearby {
            Nearby::Lists(_) => 18_000,
            Nearby::Cells(_) => 25_000,
        };
        let depth = match world.len() {
            ..=CACHED => Depth::Nothing,
            len if len <= almost_cached => Depth::Noted,
            _ => Depth::Near,
        };
        Self { depth, bucket: -1, ahead: [const { Vec::new() }; FARTHEST] }
    }
}

/// How many events are best in a bucket of the calendar. What rows from cells need takes longer to fetch than what lists need, so
/// their buckets are longer.
pub(super) fn entries_a_bucket(nearby: &Nearby) -> f64 {
    match nearby {
        Nearby::Lists(_) => 4.0,
        Nearby::Cells(_) => 8.0,
    }
}

impl Simulation {
    /// Fetches for the next events when the calendar has turned.
    #[inline(always)]
    pub(super) fn fetch_ahead(&mut self) {
        if self.look_ahead.depth != Depth::Nothing && self.queue.present() != self.look_ahead.bucket {
            match self.look_ahead.depth {
                Depth::Near => self.fetch_near_buckets(),
                _ => self.fetch_noted(),
            }
            self.look_ahead.bucket = self.queue.present();
        }
    }

    #[inline(never)]
    fn fetch_noted(&mut self) {
        self.queue.prefetch(2);
        self.queue.ahead(1, |mark| self.fetch_ball(mark.ball as usize));
        for entry in self.queue.at_present() {
            self.fetch_partner(entry.mark);
        }
    }

    #[inline(never)]
    fn fetch_near_buckets(&mut self) {
        self.queue.prefetch(FARTHEST + 2);
        // Buckets in which there was nothing are passed over.
        let passed = self.queue.present() - self.look_ahead.bucket;
        let passed = usize::try_from(passed).map_or(FARTHEST, |passed| passed.min(FARTHEST));
        let mut ahead = std::mem::take(&mut self.look_ahead.ahead);
        ahead.rotate_left(passed % FARTHEST);
        for (nearer, marks) in ahead.iter_mut().enumerate().skip(FARTHEST - passed) {
            marks.clear();
            self.queue.ahead(nearer + 1, |mark| marks.push(mark));
        }
        let [next, after, farthest] = &ahead;
        farthest.iter().for_each(|mark| self.fetch_ball(mark.ball as usize));
        after.iter().for_each(|&mark| self.fetch_partner(mark));
        next.iter().for_each(|&mark| self.fetch_near(mark));
        next.iter().for_each(|&mark| self.fetch_near_partner(mark));
        self.look_ahead.ahead = ahead;
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
