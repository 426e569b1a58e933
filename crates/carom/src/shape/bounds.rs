//! Boxes along the axes.

use glam::DVec3;

/// The points with low <= x <= high, by coordinate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Lowest corner (m).
    pub low: DVec3,
    /// Highest corner (m).
    pub high: DVec3,
}

impl Bounds {
    /// No points.
    pub const EMPTY: Self = Self { low: DVec3::INFINITY, high: DVec3::NEG_INFINITY };

    /// The smallest box around points.
    pub fn around(points: impl IntoIterator<Item = DVec3>) -> Self {
        points.into_iter().fold(Self::EMPTY, |bounds, x| Self { low: bounds.low.min(x), high: bounds.high.max(x) })
    }

    /// The smallest box around both.
    pub fn and(self, other: Self) -> Self {
        Self { low: self.low.min(other.low), high: self.high.max(other.high) }
    }

    /// Whether they have a point in common.
    pub fn overlaps(&self, other: &Self) -> bool {
        self.low.cmple(other.high).all() && other.low.cmple(self.high).all()
    }

    /// The box shifted by a vector (m).
    pub fn shifted(self, by: DVec3) -> Self {
        Self { low: self.low + by, high: self.high + by }
    }

    /// The box with a margin (m) added on each side.
    pub fn grown(self, margin: f64) -> Self {
        Self { low: self.low - DVec3::splat(margin), high: self.high + DVec3::splat(margin) }
    }

    /// Its middle (m).
    pub fn middle(&self) -> DVec3 {
        self.low + 0.5 * (self.high - self.low)
    }

    /// Half its diagonal (m).
    pub fn half_diagonal(&self) -> f64 {
        0.5 * (self.high - self.low).length()
    }
}
