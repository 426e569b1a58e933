//! Instants that keep their resolution however long a run lasts.
//!
//! A plain 64-bit clock loses digits as it grows: 1e9 s into a run its steps are 1e-7 s. Here an instant is a multiple of
//! a fixed span (a power of two, so that all arithmetic on it is exact) plus an offset within that span.

use std::cmp::Ordering;

/// An instant: `epoch + offset` seconds, with `epoch` a multiple of the clock's span and `0 <= offset < span`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Time {
    /// A multiple of the clock's span (s).
    pub epoch: f64,
    /// Seconds since `epoch`, at least 0 and less than the span.
    pub offset: f64,
}

impl Time {
    /// Later than every instant that can be reached.
    pub const NEVER: Self = Self { epoch: f64::INFINITY, offset: 0.0 };

    /// Seconds from `earlier` to `self`: exact up to one rounding of the result, whatever the size of the clock.
    #[inline(always)]
    pub fn since(self, earlier: Self) -> f64 {
        (self.epoch - earlier.epoch) + (self.offset - earlier.offset)
    }

    /// The instant as `(time, time_low)`: the nearest double, and what it leaves out.
    pub fn to_pair(self) -> (f64, f64) {
        let time = self.epoch + self.offset;
        // epoch >= offset or epoch == 0 or epoch < 0; the two-sum below is exact in every case.
        let part = time - self.epoch;
        let low = (self.epoch - (time - part)) + (self.offset - part);
        (time, low)
    }

    /// Whether the instant can be reached at all.
    #[inline(always)]
    pub fn is_reachable(self) -> bool {
        self.epoch < f64::INFINITY
    }

    /// The total order of instants (they hold no NaN).
    #[inline(always)]
    pub fn order(self, other: Self) -> Ordering {
        self.epoch.total_cmp(&other.epoch).then(self.offset.total_cmp(&other.offset))
    }

    /// Whether `self` comes before `other`.
    #[inline(always)]
    pub fn before(self, other: Self) -> bool {
        self.epoch < other.epoch || (self.epoch == other.epoch && self.offset < other.offset)
    }

    /// The later of two instants.
    #[inline(always)]
    pub fn later(self, other: Self) -> Self {
        if self.before(other) { other } else { self }
    }
}

/// The rule by which seconds become instants.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Clock {
    span: f64,
}

impl Clock {
    /// A clock whose epochs are the smallest power of two of at least `seconds` long.
    pub fn with_span(seconds: f64) -> Self {
        // Powers of two outside this range leave no room for an offset or for epochs.
        let exponent = exponent_of(seconds).clamp(-900, 900) + 1;
        Self { span: power_of_two(exponent) }
    }

    /// The length of an epoch, in seconds: a power of two.
    pub fn span(self) -> f64 {
        self.span
    }

    /// The instant at `seconds` on the absolute scale; [`Time::NEVER`] if that is 2^52 spans or more away.
    pub fn at(self, seconds: f64) -> Time {
        self.normal(Time { epoch: 0.0, offset: seconds })
    }

    /// The instant at `time + time_low` (a pair as [`Time::to_pair`] gives it).
    pub fn at_pair(self, time: f64, time_low: f64) -> Time {
        let coarse = self.at(time);
        self.after(coarse, time_low)
    }

    /// The instant `seconds` after `start`; [`Time::NEVER`] if that is not a finite number.
    #[inline(always)]
    pub fn after(self, start: Time, seconds: f64) -> Time {
        self.normal(Time { epoch: start.epoch, offset: start.offset + seconds })
    }

    #[inline(always)]
    fn normal(self, time: Time) -> Time {
        if time.offset >= 0.0 && time.offset < self.span {
            return time;
        }
        self.carry(time)
    }

    #[cold]
    #[inline(never)]
    fn carry(self, time: Time) -> Time {
        if !time.offset.is_finite() {
            return Time::NEVER;
        }
        let whole = (time.offset / self.span).floor() * self.span;
        let offset = time.offset - whole;
        let epoch = time.epoch + whole;
        // Beyond, a double cannot count the epochs.
        if !(epoch.abs() <= self.span * (1u64 << 52) as f64) {
            return Time::NEVER;
        }
        if offset >= self.span {
            // A negative offset smaller than a rounding of the span.
            return Time { epoch: epoch + self.span, offset: 0.0 };
        }
        Time { epoch, offset }
    }
}

/// The exponent k with 2^k <= x < 2^(k+1) of a positive normal number.
fn exponent_of(x: f64) -> i32 {
    ((x.to_bits() >> 52) & 0x7ff) as i32 - 1023
}

/// 2^k for -1022 <= k <= 1023.
fn power_of_two(k: i32) -> f64 {
    f64::from_bits(((k + 1023) as u64) << 52)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picosecond_stays_a_picosecond() {
        let clock = Clock::with_span(0.3);
        let start = clock.at(1e9);
        let later = clock.after(start, 1e-12);
        // The offset is below 1, so its rounding is below 2^-53 s.
        assert!((later.since(start) - 1e-12).abs() <= 1.2e-16);
        assert_eq!(start.to_pair(), (1e9, 0.0));
        let (time, low) = later.to_pair();
        assert_eq!(clock.at_pair(time, low), later);
    }

    #[test]
    fn instants_are_ordered_across_epochs_and_below_zero() {
        let clock = Clock::with_span(1.0);
        let mut seconds: Vec<f64> = (-50..50).map(|k| f64::from(k) * 0.37).collect();
        seconds.push(-1e-300);
        seconds.sort_by(f64::total_cmp);
        let times: Vec<Time> = seconds.iter().map(|&s| clock.at(s)).collect();
        for pair in times.windows(2) {
            assert!(!pair[1].before(pair[0]));
            assert!(pair[0].offset >= 0.0 && pair[0].offset < clock.span());
        }
        assert_eq!(clock.after(times[3], f64::INFINITY), Time::NEVER);
        assert!(times[0].before(Time::NEVER));
    }
}
