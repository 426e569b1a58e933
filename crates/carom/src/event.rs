//! One future moment of a ball.

use crate::time::Time;
use crate::world::Partner;
use crate::world::cells::Face;

/// What comes next for a ball, as far as can be told from the present states.
#[derive(Clone, Copy, Debug)]
pub struct Upcoming {
    /// When it next touches somebody; [`Time::NEVER`] if nobody near can be met.
    pub impact: Time,
    /// Whom.
    pub partner: Partner,
    /// The partner's count of impacts when this was foretold: another count, and the prediction is stale.
    pub partner_impacts: u32,
    /// Tells the entry in the queue that still holds from those that do not.
    pub stamp: u32,
    /// When it leaves its cell, or the sphere of its list.
    pub leaving: Time,
    /// Through which face.
    pub face: Face,
}

impl Upcoming {
    /// Nothing ever.
    pub const NOTHING: Self = Self {
        impact: Time::NEVER,
        partner: Partner::NONE,
        partner_impacts: 0,
        stamp: 0,
        leaving: Time::NEVER,
        face: Face::NONE,
    };

    /// The earlier of the two; at one instant bookkeeping goes first.
    #[inline(always)]
    pub fn time(&self) -> Time {
        if self.impact.before(self.leaving) { self.impact } else { self.leaving }
    }

    /// Whether the impact comes before that.
    #[inline(always)]
    pub fn is_impact(&self) -> bool {
        self.impact.before(self.leaving)
    }
}

/// The rank of an impact among those of one instant: kind, then the lower id, then the higher.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Rank {
    /// Ball–ball before ball–plane.
    pub kind: Kind,
    /// Ids, ascending.
    pub ids: (i64, i64),
}

/// What kind of surfaces meet.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(u8)]
pub enum Kind {
    /// Two balls.
    BallBall = 0,
    /// A ball and a plane or a wall.
    BallPlane = 1,
}

impl Kind {
    /// The name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::BallBall => "ball-ball",
            Self::BallPlane => "ball-plane",
        }
    }
}
