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
    /// Whom it touches; if it leaves its place before, whom it would touch after. Nobody while it waits ([`Alone::OVER`]).
    pub partner: Partner,
    /// The partner's count of impacts when this was foretold: another count, and the prediction is stale.
    pub partner_impacts: u32,
    /// Tells the entry in the queue that still holds from those that do not.
    pub stamp: u32,
    /// Through which face it leaves its cell, if it does before any impact. (Of a list's sphere, any face.)
    pub leaves: Option<Face>,
    /// How long after that time nobody else is met.
    pub alone: Alone,
}

/// How long a ball meets nobody else after what it foresees, a part of the clock's span: a number in single precision without the
/// lower half of its digits, less by one to three times [`Alone::LESS`] of it than what it was made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Alone(u16);

impl Alone {
    /// What is taken off, before rounding down takes off more (pure number).
    pub const LESS: f64 = 1.0 / 256.0;
    /// Nothing is known.
    pub const UNKNOWN: Self = Self(0);
    /// There is no more to wait after that time: the ball waits until then, and will search.
    pub const OVER: Self = Self(0x8000);

    /// At most so many spans.
    #[inline(always)]
    pub fn at_most(spans: f64) -> Self {
        let single = (spans * (1.0 - Self::LESS)) as f32;
        // What is negative or not a number is not known.
        Self(if single > 0.0 { (single.to_bits() >> 16) as u16 } else { 0 })
    }

    /// In spans.
    #[inline(always)]
    pub fn spans(self) -> f64 {
        f64::from(f32::from_bits(u32::from(self.0) << 16))
    }
}

impl Upcoming {
    /// Nothing ever.
    pub const NOTHING: Self = Self {
        time: Time::NEVER,
        partner: Partner::NONE,
        partner_impacts: 0,
        stamp: 0,
        leaves: None,
        alone: Alone::UNKNOWN,
    };

    /// Whether an impact comes before it leaves its place.
    #[inline(always)]
    pub fn is_impact(&self) -> bool {
        self.leaves.is_none()
    }
}

/// The rank of an impact among those of one instant: kind, then the lower id, then the higher.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Rank {
    /// Ball–ball before ball–plane before whatever turns.
    pub pair: PairKind,
    /// Ids, ascending.
    pub ids: (i64, i64),
}

/// What kind of bodies meet.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum PairKind {
    /// Two balls.
    BallBall,
    /// A ball and a plane or a wall.
    BallPlane,
    /// A body that turns, with anything.
    Turning,
}

/// How the time of an impact was certified.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Certificate {
    /// The first root of a closed form, as of balls among themselves and with planes: certain up to rounding.
    ClosedForm = 0,
    /// Found by a search: the bodies cross the contact so fast that the time is certain up to rounding.
    Transversal = 1,
    /// Found by a search: they come within δ, but so slowly, or with a corner so near a corner or edge, that a touch cannot be
    /// told from a miss by less than δ. The time is when they are within δ.
    WithinTolerance = 2,
}

impl Certificate {
    /// All of them, by number.
    pub const ALL: &[Self] = &[Self::ClosedForm, Self::Transversal, Self::WithinTolerance];

    /// The name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::ClosedForm => "closed-form",
            Self::Transversal => "transversal",
            Self::WithinTolerance => "within-tolerance",
        }
    }
}

/// A part of a surface, by its form.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Form {
    /// A ball's surface.
    Ball,
    /// A corner, or the end of a capsule.
    Vertex,
    /// An edge.
    Edge,
    /// The rim of a cylinder.
    Rim,
    /// The straight side of a cylinder or capsule.
    Side,
    /// The smooth surface of an ellipsoid.
    Surface,
    /// A flat face, or the flat end of a cylinder.
    Face,
    /// A plane or wall.
    Plane,
}

macro_rules! kinds {
    ($($kind:ident = $number:literal, $first:ident, $second:ident, $name:literal;)*) => {
        /// What kind of surfaces meet.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        #[repr(u8)]
        pub enum Kind {
            $(#[doc = $name] $kind = $number,)*
        }

        impl Kind {
            /// All of them, by number.
            pub const ALL: &[Self] = &[$(Self::$kind),*];

            /// The name in tables.
            pub fn name(self) -> &'static str {
                match self {
                    $(Self::$kind => $name,)*
                }
            }

            /// Of two forms that meet, in any order; `None` of two planes.
            pub fn of(a: Form, b: Form) -> Option<Self> {
                match (a.min(b), a.max(b)) {
                    $((Form::$first, Form::$second) => Some(Self::$kind),)*
                    _ => None,
                }
            }
        }
    };
}

kinds! {
    BallBall = 0, Ball, Ball, "ball-ball";
    BallPlane = 1, Ball, Plane, "ball-plane";
    BallVertex = 2, Ball, Vertex, "ball-vertex";
    BallEdge = 3, Ball, Edge, "ball-edge";
    BallRim = 4, Ball, Rim, "ball-rim";
    BallSide = 5, Ball, Side, "ball-side";
    BallSurface = 6, Ball, Surface, "ball-surface";
    BallFace = 7, Ball, Face, "ball-face";
    VertexVertex = 8, Vertex, Vertex, "vertex-vertex";
    VertexEdge = 9, Vertex, Edge, "vertex-edge";
    VertexRim = 10, Vertex, Rim, "vertex-rim";
    VertexSide = 11, Vertex, Side, "vertex-side";
    VertexSurface = 12, Vertex, Surface, "vertex-surface";
    VertexFace = 13, Vertex, Face, "vertex-face";
    VertexPlane = 14, Vertex, Plane, "vertex-plane";
    EdgeEdge = 15, Edge, Edge, "edge-edge";
    EdgeRim = 16, Edge, Rim, "edge-rim";
    EdgeSide = 17, Edge, Side, "edge-side";
    EdgeSurface = 18, Edge, Surface, "edge-surface";
    EdgeFace = 19, Edge, Face, "edge-face";
    EdgePlane = 20, Edge, Plane, "edge-plane";
    RimRim = 21, Rim, Rim, "rim-rim";
    RimSide = 22, Rim, Side, "rim-side";
    RimSurface = 23, Rim, Surface, "rim-surface";
    RimFace = 24, Rim, Face, "rim-face";
    RimPlane = 25, Rim, Plane, "rim-plane";
    SideSide = 26, Side, Side, "side-side";
    SideSurface = 27, Side, Surface, "side-surface";
    SideFace = 28, Side, Face, "side-face";
    SidePlane = 29, Side, Plane, "side-plane";
    SurfaceSurface = 30, Surface, Surface, "surface-surface";
    SurfaceFace = 31, Surface, Face, "surface-face";
    SurfacePlane = 32, Surface, Plane, "surface-plane";
    FaceFace = 33, Face, Face, "face-face";
    FacePlane = 34, Face, Plane, "face-plane";
}

#[cfg(test)]
mod tests {
    use super::Alone;

    #[test]
    fn a_wait_is_a_little_less_than_what_it_was_made_of() {
        for exponent in -120..=120 {
            for part in 0..1000 {
                let spans = 2f64.powi(exponent) * (1.0 + f64::from(part) / 1000.0);
                let less = 1.0 - Alone::at_most(spans).spans() / spans;
                // 2^-24 is what rounding to single precision may give back.
                assert!((0.999 * Alone::LESS..3.0 * Alone::LESS).contains(&less), "{spans}: {less}");
            }
        }
        for nothing in [0.0, -0.0, -1.0, f64::NEG_INFINITY, f64::NAN, 1e-300] {
            assert_eq!(Alone::at_most(nothing), Alone::UNKNOWN);
        }
        assert_eq!(Alone::at_most(f64::INFINITY).spans(), f64::INFINITY);
        assert_eq!(Alone::OVER.spans(), 0.0);
    }
}
