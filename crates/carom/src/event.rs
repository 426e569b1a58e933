//! One future moment of a ball.

use crate::time::Time;
use crate::world::Partner;
use crate::world::cells::Face;

/// What comes next for a ball, as far as can be told from the present states.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
pub struct Upcoming {
    /// When; [`Time::NEVER`] if nothing ever.
    pub time: Time,
    /// Whom it touches; if it leaves its place before, whom it would touch after.
    pub partner: Partner,
    /// The partner's count of impacts when this was foretold: another count, and the prediction is stale.
    pub partner_impacts: u32,
    /// Tells the entry in the queue that still holds from those that do not.
    pub stamp: u32,
    /// Through which face it leaves its cell, if it does before any impact. (Of a list's sphere, any face.)
    pub leaves: Option<Face>,
}

impl Upcoming {
    /// Nothing ever.
    pub const NOTHING: Self =
        Self { time: Time::NEVER, partner: Partner::NONE, partner_impacts: 0, stamp: 0, leaves: None };

    /// Whether an impact comes before it leaves its place.
    #[inline(always)]
    pub fn is_impact(&self) -> bool {
        self.leaves.is_none()
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
