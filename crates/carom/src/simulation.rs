//! The loop: take the earliest event, advance the bodies in it, resolve, record, predict anew. Read [`Simulation::run`] first.

mod checkpoint;
mod giant;
mod guard;
mod impact;
mod look_ahead;
mod sweep;
mod together;
mod turning_impact;
mod wait;

use std::cmp::Reverse;
use std::collections::{BinaryHeap, VecDeque};

use crate::error::CollapseError;
use crate::event::{Alone, Rank, Upcoming};
use crate::ledger::{Balance, Ledger};
use crate::predict::lanes::{self, Width};
use crate::predict::turning::patch::Patch;
use crate::predict::{self, First, Predictor};
use crate::prefetch::prefetch;
use crate::queue::{Entry, Mark, Queue};
use crate::record::{Impact, ImpactTable};
use crate::time::Time;
use crate::tolerance::SAME_INSTANT;
use crate::world::cells::Face;
use crate::world::nearby::{Gathered, Nearby};
use crate::world::turning::TurningBodies;
use crate::world::{Boundary, Partner, World};

use giant::Giants;
use guard::CollapseGuard;
pub(crate) use impact::approach_speed;
use look_ahead::LookAhead;
use sweep::Sweeps;
pub(crate) use turning_impact::{arms_of, form_of};

/// How a run ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stop {
    /// The clock reached the time asked for.
    Time,
    /// As many impacts happened as were asked for.
    Impacts,
    /// As many events were worked off as were asked for.
    Events,
}

/// How much was done.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Impacts of two bodies.
    pub ball_ball: u64,
    /// Impacts with a plane or a mesh.
    pub ball_plane: u64,
    /// Impacts of bodies that turn at a time that is certain up to rounding.
    pub transversal: u64,
    /// Impacts of bodies that turn that come within δ so slowly, or so near a corner or edge, that a touch cannot be told from a
    /// miss by less than δ.
    pub within_tolerance: u64,
    /// Searches for impacts of bodies that turn that were cut off, and went on at the time up to which they were certain.
    pub continued: u64,
    /// Contacts that turned out not to approach by the rounding of a grazing root.
    pub grazes: u64,
    /// Passages from cell to cell, or out of the sphere of a list.
    pub crossings: u64,
    /// Predictions that surfaced after their partner had changed its course, and waits after such that came to their end.
    pub stale: u64,
    /// Times the balls were put into another order in memory, and the cells or lists laid out anew.
    pub layouts: u64,
}

impl Counts {
    /// All impacts.
    pub fn impacts(&self) -> u64 {
        self.ball_ball + self.ball_plane
    }
}

enum Event {
    Sweep,
    Leaving { ball: usize, time: Time },
    Stale { ball: usize, time: Time },
    Impact { ball: usize, partner: Partner, time: Time },
}

/// A world in motion.
#[derive(Clone, Debug)]
pub struct Simulation {
    world: World,
    now: Time,
    width: Width,
    nearby: Nearby,
    predictor: Predictor,
    upcoming: Vec<Upcoming>,
    queue: Queue,
    /// Impacts of the present instant, lowest rank first: (rank, ball, stamp).
    instant: BinaryHeap<Reverse<(Rank, u32, u32)>>,
    instant_end: Time,
    guard: CollapseGuard,
    ledger: Ledger,
    counts: Counts,
    crossings_at_layout: u64,
    /// When all balls that are leaving their cells are moved.
    sweeps: Sweeps,
    recorded: Option<ImpactTable>,
    /// Balls so large that thousands are near.
    giants: Giants,
    /// What is fetched into the cache before it is needed.
    look_ahead: LookAhead,
    /// Room to gather those near, so that no prediction allocates.
    room: Gathered,
    /// Balls in whose [`Upcoming::partner_impacts`] the number is not yet, and how many there are.
    uncounted: ([u32; 4], usize),
    /// Where the bodies of an impact touch, and room for triangles; kept, so that no impact allocates.
    patch: Patch,
    triangles_near: Vec<u32>,
    /// Impacts are wanted one by one, recorded or not.
    watched: bool,
    last_impact: Option<Impact>,
    /// Impacts of one instant that were resolved together, and not yet told one by one.
    untold: VecDeque<Impact>,
}

impl Simulation {
    /// Sets `world`, which has passed its check, in motion. `record`: whether impacts are kept as rows.
    pub fn new(world: World, record: bool) -> Self {
        Self::with_lanes(world, record, lanes::MOST)
    }

    /// As [`Simulation::new`], computing with no more than `lanes` numbers side by side (2, 4 or 8, as far as the machine has
    /// registers so wide). It changes the speed and not a bit of what comes out.
    pub fn with_lanes(world: World, record: bool, lanes: usize) -> Self {
        let now = world.start;
        let ledger = Ledger::open(&world);
        Self::at(world, now, ledger, Counts::default(), record, Width::at_most(lanes))
    }

    fn at(mut world: World, now: Time, ledger: Ledger, counts: Counts, record: bool, width: Width) -> Self {
        if world.growth.is_none() {
            world.arrange(now);
        }
        let nearby = Nearby::lay_out(&world, now, width);
        let guard = CollapseGuard::new(&world);
        let look_ahead = LookAhead::new(&world, &nearby);
        let mut room = Gathered::default();
        let giants = Giants::find(&world, &nearby, &mut room);
        let mut simulation = Self {
            now,
            predictor: Predictor::new(&world, &nearby, width),
            queue: Queue::new(now, world.len(), world.clock.span() / 64.0, look_ahead::entries_a_bucket(&nearby)),
            upcoming: vec![Upcoming::NOTHING; world.len()],
            width,
            nearby,
            world,
            instant: BinaryHeap::new(),
            instant_end: now,
            guard,
            ledger,
            crossings_at_layout: counts.crossings,
            sweeps: Sweeps::never(),
            counts,
            recorded: record.then(ImpactTable::default),
            giants,
            look_ahead,
            room,
            uncounted: ([0; 4], 0),
            patch: Patch::default(),
            triangles_near: Vec::new(),
            watched: false,
            last_impact: None,
            untold: VecDeque::new(),
        };
        simulation.begin_sweeps(now);
        simulation.predict_all();
        simulation
    }

    /// Runs until the clock stands at `until` ([`Time::NEVER`]: until nothing is left to happen), or `impacts` more impacts have happened, or `events` more events of any kind
    /// were worked off.
    ///
    /// # Errors
    /// [`CollapseError`] if impacts that lose energy accumulate or a body comes to rest; the simulation then stands at the
    /// last valid event and can be looked at.
    pub fn run(&mut self, until: Time, impacts: u64, events: u64) -> Result<Stop, CollapseError> {
        self.untold.clear();
        let last_impact = self.counts.impacts().saturating_add(impacts);
        for _ in 0..events {
            if self.counts.impacts() >= last_impact {
                return Ok(Stop::Impacts);
            }
            let Some(event) = self.take_earliest(until) else {
                if until.is_reachable() {
                    self.now = self.now.later(until);
                }
                return Ok(Stop::Time);
            };
            match event {
                Event::Sweep => self.sweep(),
                Event::Leaving { ball, time } => self.look_around(ball, time),
                Event::Stale { ball, time } => {
                    self.counts.stale += 1;
                    self.wait_or_predict(ball, self.now.later(time));
                }
                Event::Impact { ball, partner, time } => {
                    let resolved = match self.resolve_together(ball, partner, time) {
                        Some(resolved) => resolved,
                        None => self.resolve(ball, partner, time),
                    };
                    // Even where the law refuses: the contact is still there, and must be found again.
                    match partner.as_ball() {
                        Some(other) => self.predict_both(ball, other, self.now),
                        None => self.predict(ball, self.now),
                    }
                    resolved?;
                }
            }
        }
        Ok(Stop::Events)
    }

    /// On to the next impact no later than `until`, exactly one; `None` if there is none, and the clock then stands at
    /// `until`.
    ///
    /// # Errors
    /// As [`Simulation::run`].
    pub fn step(&mut self, until: Time) -> Result<Option<Impact>, CollapseError> {
        self.step_within(until, u64::MAX).map(|(_, impact)| impact)
    }

    /// As [`Simulation::step`], working off no more than so many events; also how it ended.
    ///
    /// # Errors
    /// As [`Simulation::run`].
    pub fn step_within(&mut self, until: Time, events: u64) -> Result<(Stop, Option<Impact>), CollapseError> {
        if let Some(impact) = self.untold.pop_front() {
            return Ok((Stop::Impacts, Some(impact)));
        }
        self.watched = true;
        let stop = self.run(until, 1, events);
        self.watched = false;
        let impact = self.last_impact.take();
        Ok((stop?, impact))
    }

    /// The present instant.
    pub fn now(&self) -> Time {
        self.now
    }

    /// The bodies. Their flights hold the states after their last impacts; [`World::position`] tells where they are.
    pub fn world(&self) -> &World {
        &self.world
    }

    /// How much was done so far.
    pub fn counts(&self) -> Counts {
        self.counts
    }

    /// Energy and momentum at the present instant.
    pub fn balance(&mut self) -> Balance {
        self.ledger.balance(&self.world, self.now)
    }

    /// Hands over the rows recorded since the last call.
    pub fn take_impacts(&mut self) -> ImpactTable {
        self.recorded.as_mut().map(std::mem::take).unwrap_or_default()
    }

    /// Bytes held for each ball, recorded impacts aside.
    pub fn bytes_per_ball(&self) -> usize {
        let balls = self.world.len().max(1);
        let of_ball = size_of::<crate::flight::Flight>() + size_of::<crate::world::Body>() + size_of::<Upcoming>() + 8; // its place in the order of ids, impacts
        let turning = self.world.turning.as_ref().map_or(0, TurningBodies::bytes);
        let of_world = self.world.ids.bytes() + self.world.radii.bytes() + self.world.images.bytes();
        of_ball + (of_world + self.nearby.bytes() + self.queue.bytes() + self.giants.bytes() + turning) / balls
    }

    /// The earliest event no later than `until`. Impacts of one instant come in the order of their ranks; whatever only
    /// brings predictions up to date comes before them.
    #[inline]
    fn take_earliest(&mut self, until: Time) -> Option<Event> {
        self.count_partners();
        loop {
            let upcoming = &self.upcoming[..];
            let entry = self.queue.earliest(|mark| time_of(upcoming, mark));
            self.fetch_ahead();
            let in_instant = !self.instant.is_empty();
            let limit = if in_instant { self.instant_end } else { until };
            let entry = entry.filter(|entry| !limit.before(entry.time));
            if self.sweeps_by(entry.map_or(limit, |entry| entry.time)) {
                return Some(Event::Sweep);
            }
            let Some(entry) = entry else {
                if in_instant && !until.before(self.now) {
                    match self.take_lowest_of_instant() {
                        Some(event) => return Some(event),
                        None => continue,
                    }
                }
                return None;
            };
            self.queue.remove_earliest();
            let ball = entry.mark.ball as usize;
            if !self.upcoming[ball].is_impact() {
                return Some(Event::Leaving { ball, time: entry.time });
            }
            if self.is_stale(ball) {
                return Some(Event::Stale { ball, time: entry.time });
            }
            let partner = self.upcoming[ball].partner;
            if !in_instant {
                if self.is_alone(ball, partner, entry.time) {
                    return Some(Event::Impact { ball, partner, time: entry.time });
                }
                self.instant_end = self.world.clock.after(entry.time, SAME_INSTANT * self.world.clock.span());
            }
            let rank = predict::rank(&self.world, ball, partner);
            self.instant.push(Reverse((rank, entry.mark.ball, entry.mark.stamp)));
        }
    }

    /// Whether no other event than the pair's own belongs to the instant of this impact.
    #[inline]
    fn is_alone(&mut self, ball: usize, partner: Partner, time: Time) -> bool {
        let end = self.world.clock.after(time, SAME_INSTANT * self.world.clock.span());
        let mut mirror = None;
        loop {
            let upcoming = &self.upcoming[..];
            let next = self.queue.earliest(|mark| time_of(upcoming, mark));
            match next {
                Some(next) if !end.before(next.time) => {
                    let other = &self.upcoming[next.mark.ball as usize];
                    let mirrored = partner == Partner::ball(next.mark.ball)
                        && other.partner == Partner::ball(ball as u32)
                        && other.is_impact();
                    if !mirrored {
                        // Another impact may come first and leave the partner with what it foresaw.
                        if let Some(mirror) = mirror {
                            self.queue.push(mirror);
                        }
                        return false;
                    }
                    // The same impact as the partner foresaw it; the partner is predicted anew right after it.
                    mirror = Some(next);
                    self.queue.remove_earliest();
                }
                _ => return true,
            }
        }
    }

    #[inline(never)]
    fn take_lowest_of_instant(&mut self) -> Option<Event> {
        let Reverse((_, ball, stamp)) = self.instant.pop()?;
        let ball = ball as usize;
        let upcoming = &self.upcoming[ball];
        if upcoming.stamp != stamp {
            return None;
        }
        let time = upcoming.time;
        Some(if self.is_stale(ball) {
            Event::Stale { ball, time }
        } else {
            Event::Impact { ball, partner: upcoming.partner, time }
        })
    }

    /// Goes on in the middle of an instant: what belongs to it up to `end` is taken from the queue before its impacts are
    /// taken in the order of their ranks.
    fn resume_instant(&mut self, end: Time) {
        loop {
            let upcoming = &self.upcoming[..];
            let entry = self.queue.earliest(|mark| time_of(upcoming, mark));
            let Some(entry) = entry.filter(|entry| !end.before(entry.time)) else { return };
            self.count_partners();
            let ball = entry.mark.ball as usize;
            if self.upcoming[ball].is_impact() {
                self.queue.remove_earliest();
                self.instant_end = end;
                let rank = predict::rank(&self.world, ball, self.upcoming[ball].partner);
                self.instant.push(Reverse((rank, entry.mark.ball, entry.mark.stamp)));
                return;
            }
            self.queue.remove_earliest();
            self.look_around(ball, entry.time);
        }
    }

    /// Whether a ball's foreseen partner has had an impact since, or the ball has waited after that for as long as it could.
    #[inline(always)]
    fn is_stale(&self, ball: usize) -> bool {
        let upcoming = &self.upcoming[ball];
        match upcoming.partner.as_ball() {
            Some(other) => self.world.impacts[other] != upcoming.partner_impacts,
            None => upcoming.alone == Alone::OVER,
        }
    }

    /// Whether somebody wants to see the impacts themselves.
    #[inline(always)]
    fn is_recorded(&self) -> bool {
        self.watched || self.recorded.is_some()
    }

    /// Of several impacts of one instant, told one after the other.
    fn record_one_of_several(&mut self, impact: Impact) {
        let told = self.last_impact.take();
        self.record(impact);
        if let Some(told) = told
            && let Some(impact) = self.last_impact.replace(told)
        {
            self.untold.push_back(impact);
        }
    }

    fn record(&mut self, impact: Impact) {
        if let Some(table) = &mut self.recorded {
            table.push(&impact);
            if self.world.turning.is_some() {
                let turns = [impact.a, impact.b].map(|id| self.world.turns_of(id, impact.time));
                table.push_turns(impact.certificate, turns);
            }
        }
        if self.watched {
            self.last_impact = Some(impact);
        }
    }

    /// Looks anew at everybody near.
    fn predict(&mut self, ball: usize, now: Time) {
        if self.giants.any() && self.predict_giant(ball, now, false) {
            return;
        }
        let first = self.predictor.first_impact(&self.world, &self.nearby, ball, now, &mut self.room);
        self.schedule(ball, first, now);
    }

    fn predict_both(&mut self, ball: usize, other: usize, now: Time) {
        if self.giants.any() {
            self.predict(ball, now);
            return self.predict(other, now);
        }
        let firsts = self.predictor.first_impacts(&self.world, &self.nearby, [ball, other], now, &mut self.room);
        self.schedule(ball, firsts[0], now);
        self.schedule(other, firsts[1], now);
    }

    fn predict_all(&mut self) {
        for ball in 0..self.world.len() {
            self.predict(ball, self.now);
        }
    }

    #[inline]
    fn schedule(&mut self, ball: usize, first: First, now: Time) {
        let leaving = self.nearby.leaves_before(&self.world, ball, now, first.time);
        let time = leaving.map_or(first.time, |(time, _)| time);
        let stamp = self.upcoming[ball].stamp.wrapping_add(1);
        let leaves = leaving.map(|(_, face)| face);
        let alone = Alone::at_most(first.alone / self.world.clock.span());
        self.upcoming[ball] = Upcoming { time, partner: first.partner, partner_impacts: 0, stamp, leaves, alone };
        if self.giants.any() {
            self.giants.note(&self.world, &self.nearby, ball, now, time);
        }
        if let Some(other) = first.partner.as_ball() {
            prefetch(&self.world.impacts, other);
            if self.uncounted.1 == self.uncounted.0.len() {
                self.count_partners();
            }
            self.uncounted.0[self.uncounted.1] = ball as u32;
            self.uncounted.1 += 1;
        }
        if time.is_reachable() {
            self.queue.push(Entry { time, mark: Mark { ball: ball as u32, stamp } });
        }
    }

    /// Notes with each new prediction how many impacts its partner has had: not when it was made, but before anybody's next
    /// impact, when that number has come from memory.
    #[inline(always)]
    fn count_partners(&mut self) {
        for k in 0..self.uncounted.1 {
            let upcoming = &mut self.upcoming[self.uncounted.0[k] as usize];
            if let Some(other) = upcoming.partner.as_ball() {
                upcoming.partner_impacts = self.world.impacts[other];
            }
        }
        self.uncounted.1 = 0;
    }

    /// A ball leaves its cell, or the sphere of its list: no state is written, but there are others near now.
    fn look_around(&mut self, ball: usize, time: Time) {
        let now = self.now.later(time);
        self.counts.crossings += 1;
        self.note_leaver(now);
        let upcoming = self.upcoming[ball];
        let face = upcoming.leaves.unwrap_or(Face::NONE);
        match &mut self.nearby {
            Nearby::Cells(cells) => {
                cells.cross(ball, face);
                cells.note_planes(&self.world, ball);
            }
            Nearby::Lists(lists) => lists.renew(&self.world, ball, now),
        }
        if self.is_out_of_order() {
            self.lay_out_anew(now);
            return;
        }
        if self.giants.any() && self.predict_giant(ball, now, true) {
            return;
        }
        if self.is_stale(ball) {
            self.predict(ball, now);
        } else {
            let (world, nearby, room) = (&self.world, &self.nearby, &mut self.room);
            let first = self.predictor.first_impact_after_crossing(world, nearby, ball, now, &upcoming, room);
            self.schedule(ball, first, now);
        }
    }

    /// Balls that fly apart in open space cross ever more cells of the old size in vain; and elsewhere, too, those who were
    /// beside each other in space, and are so in memory, mix.
    fn is_out_of_order(&self) -> bool {
        const CROSSINGS_PER_BALL: u64 = 64;
        const FEW: usize = 2000;
        let axes = &self.world.domain.boundary[..usize::from(self.world.dimensions)];
        let matters = self.world.len() > FEW || axes.contains(&Boundary::Open);
        matters && self.counts.crossings - self.crossings_at_layout > CROSSINGS_PER_BALL * self.world.len() as u64
    }

    fn lay_out_anew(&mut self, now: Time) {
        self.crossings_at_layout = self.counts.crossings;
        self.counts.layouts += 1;
        self.world.arrange(now);
        self.nearby = Nearby::lay_out(&self.world, now, self.width);
        self.look_ahead = LookAhead::new(&self.world, &self.nearby);
        self.giants = Giants::find(&self.world, &self.nearby, &mut self.room);
        self.predictor = self.predictor.anew(&self.world, &self.nearby);
        self.instant.clear();
        self.begin_sweeps(now);
        for ball in 0..self.world.len() {
            self.predict(ball, now);
        }
    }
}

#[cfg(test)]
impl Simulation {
    /// The next so many impacts, all that is recorded of them.
    fn impacts_to_the_bit(&mut self, count: u64) -> Vec<u64> {
        let far = self.world.clock.at(1e300);
        self.run(far, count, u64::MAX).expect("a run");
        let table = self.take_impacts();
        let numbers = [&table.time, &table.time_low, &table.impulse, &table.normal, &table.point];
        let bits = numbers.iter().flat_map(|column| column.iter().map(|x| x.to_bits()));
        bits.chain(table.a.iter().chain(&table.b).map(|&id| id as u64)).collect()
    }
}

/// When an entry of the queue is, if it still holds.
#[inline(always)]
fn time_of(upcoming: &[Upcoming], mark: Mark) -> Option<Time> {
    let upcoming = &upcoming[mark.ball as usize];
    (upcoming.stamp == mark.stamp).then_some(upcoming.time)
}
