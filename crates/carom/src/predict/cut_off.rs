//! Searches that were cut off: until when the pair is certainly free of impacts, to go on from there.
//!
//! Two bodies that rest side by side while one spins, or slide along each other for long, need ever new steps, so a search ends
//! after [`super::turning::STEPS`] of them. The pair is then foreseen to be looked at again, as an event, at the time up to
//! which the search is certain, and the next search begins there. Where these times are follows from the states after the
//! last impacts alone, whoever asks and when: what is kept here is remembered, and would be found again.

use std::collections::BTreeMap;

use glam::DVec3;

use super::turning::{Certificate, Search};
use crate::time::Time;
use crate::world::{Partner, World};

/// What is foreseen of a pair.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Foreseen {
    /// When; [`Time::NEVER`] if nothing.
    pub time: Time,
    /// An impact, certified so; `None`: to be looked at again.
    pub certificate: Option<Certificate>,
}

impl Foreseen {
    /// Nothing.
    pub const NOTHING: Self = Self { time: Time::NEVER, certificate: None };
}

/// A body and whom it may meet, with all that a prediction of theirs depends on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Pair {
    /// The first is a body's id, the other that of a body, a plane or a mesh.
    ids: (i64, i64),
    /// Their counts of impacts.
    impacts: [u32; 2],
    /// From where the one is to the image (m) that counts.
    shift: DVec3,
    /// The later of their last impacts.
    start: Time,
}

impl Pair {
    /// Of two rows.
    pub fn of_bodies(world: &World, a: usize, b: usize, shift: DVec3, start: Time) -> Self {
        Self { ids: (world.id(a), world.id(b)), impacts: [world.impacts[a], world.impacts[b]], shift, start }
    }

    /// Of a row and something in prescribed motion.
    pub fn with_prescribed(world: &World, row: usize, id: i64, start: Time) -> Self {
        Self { ids: (world.id(row), id), impacts: [world.impacts[row], 0], shift: DVec3::ZERO, start }
    }

    fn still_holds(&self, world: &World) -> bool {
        let same = |id: i64, impacts: u32| world.row_of(id).is_none_or(|row| world.impacts[row] == impacts);
        same(self.ids.0, self.impacts[0]) && same(self.ids.1, self.impacts[1])
    }
}

#[derive(Clone, Copy, Debug)]
struct CutOff {
    pair: Pair,
    /// No impact up to here.
    clear_until: Time,
    /// The search from here could not be brought on by as much as the clock resolves.
    stuck: bool,
}

/// All that were cut off and may have to go on.
#[derive(Clone, Debug, Default)]
pub(crate) struct CutOffs(BTreeMap<(i64, i64), CutOff>);

impl CutOffs {
    /// What is foreseen of a pair, if that is not after `limit`. `search` looks for its first impact from a time on, within
    /// so many seconds; what it finds must not depend on these. `now`: a pair cut off earlier is taken up again.
    pub(super) fn foresee(
        &mut self,
        world: &World,
        pair: Pair,
        [now, limit]: [Time; 2],
        same: f64,
        mut search: impl FnMut(Time, f64) -> Search,
    ) -> Foreseen {
        let known = self.0.get(&pair.ids).filter(|cut_off| cut_off.pair == pair);
        let mut from = known.map_or(pair.start, |cut_off| cut_off.clear_until);
        loop {
            if now.before(from) {
                let within = limit.since(from) >= -same;
                return if within { Foreseen { time: from, certificate: None } } else { Foreseen::NOTHING };
            }
            let horizon = limit.since(from) + same;
            let found = search(from, horizon);
            if let Some(impact) = found.impact {
                return Foreseen {
                    time: world.clock.after(from, impact.seconds),
                    certificate: Some(impact.certificate),
                };
            }
            if !(found.clear_until < horizon) {
                return Foreseen::NOTHING;
            }
            let clear_until = world.clock.after(from, found.clear_until);
            let stuck = !from.before(clear_until);
            self.0.retain(|_, cut_off| cut_off.pair.still_holds(world));
            self.0.insert(pair.ids, CutOff { pair, clear_until, stuck });
            if stuck {
                return Foreseen { time: from, certificate: None };
            }
            from = clear_until;
        }
    }

    /// Ids of the pair with this body whose search cannot be brought on, if there is one.
    pub fn stuck(&self, world: &World, row: usize) -> Option<(i64, i64)> {
        let id = world.id(row);
        let mut of_body = self.0.values().filter(|cut_off| cut_off.pair.ids.0 == id || cut_off.pair.ids.1 == id);
        of_body.find(|cut_off| cut_off.stuck && cut_off.pair.still_holds(world)).map(|cut_off| cut_off.pair.ids)
    }
}

/// What the prediction holds for a body that turns, or is near one that does.
#[derive(Clone, Copy, Debug)]
pub(super) struct Next {
    pub time: Time,
    pub partner: Partner,
    pub certificate: Certificate,
}
