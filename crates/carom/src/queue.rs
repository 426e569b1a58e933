//! Future events in order of time, at a cost that does not grow with their number.
//!
//! A calendar: a ring of buckets of equal width, each an unordered chain of small chunks; only the bucket of the present is
//! sorted. Entries are never searched for or unlinked: an entry whose stamp is no longer its ball's is dropped when it
//! surfaces. Width and length adapt to what the run shows, counted in events, never in time measured; they affect the
//! cost alone, not the order.

use crate::frugal::make_room;
use crate::prefetch::prefetch;
use crate::time::Time;

/// One future moment of a ball.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Entry {
    /// When.
    pub time: Time,
    /// Whose.
    pub mark: Mark,
}

/// Whose moment an entry is. When it is stands with the ball, where it has to be looked up anyway to see whether the entry
/// still holds; so eight entries fit a line of the cache.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Mark {
    /// Row of the ball.
    pub ball: u32,
    /// Valid while it is the ball's.
    pub stamp: u32,
}

const CHUNK: usize = 7;
const FEWEST_BUCKETS: usize = 64;
const MOST_BUCKETS: usize = 1 << 22;
/// Widths (s) whose inverses, and products with any number of buckets, are finite. Other widths would cost time, not order.
const NARROWEST: f64 = f64::MIN_POSITIVE * 1e10;
const WIDEST: f64 = f64::MAX * 1e-30;

/// A chunk's row, and how many entries are in it: one number, so that a push reads one line and writes another.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Fill(u32);

impl Fill {
    /// No chunk: as if it were full.
    const NONE: Self = Self(u32::MAX << 3 | CHUNK as u32);

    #[inline(always)]
    fn new(row: usize, len: usize) -> Self {
        Self((row as u32) << 3 | len as u32)
    }

    #[inline(always)]
    fn row(self) -> usize {
        (self.0 >> 3) as usize
    }

    #[inline(always)]
    fn len(self) -> usize {
        (self.0 & 7) as usize
    }
}

#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
struct Chunk {
    marks: [Mark; CHUNK],
    /// The next of the bucket, which is full, or none.
    next: Fill,
}

/// The calendar.
#[derive(Clone, Debug)]
pub struct Queue {
    /// Entries that hold in a bucket when it comes up, about.
    target: f64,
    origin: Time,
    width: f64,
    inverse_width: f64,
    /// The chunk of each bucket that has room.
    buckets: Vec<Fill>,
    chunks: Vec<Chunk>,
    /// Rows of chunks not in use.
    free: Vec<u32>,
    /// Number of the bucket of the present, counted from `origin`.
    present: i64,
    /// Its entries, latest first.
    sorted: Vec<Entry>,
    /// Entries beyond the ring.
    far: Vec<Mark>,
    in_ring: usize,
    delayed: Delayed,
    buckets_passed: u64,
    entries_met: u64,
}

/// So many buckets fit the cache; where there are more, entries wait for the memory that they will be written to.
const CACHED_BUCKETS: usize = 1 << 13;
/// Entries that wait. Half of them for their bucket, the other half for its chunk.
const DELAYED: usize = 16;

/// Entries on their way to their buckets, the number of the bucket with each.
#[derive(Clone, Debug)]
struct Delayed {
    entries: [(i64, Mark); DELAYED],
    /// How many came so far; the last [`DELAYED`] of them wait, unless they were let through.
    came: usize,
    /// No bucket before this one is waited for.
    first: i64,
}

impl Delayed {
    const NOBODY: (i64, Mark) = (i64::MIN, Mark { ball: 0, stamp: 0 });
    const NONE: Self = Self { entries: [Self::NOBODY; DELAYED], came: 0, first: i64::MAX };
}

impl Queue {
    /// An empty calendar from `origin` on, for about `balls` entries some `interval` seconds ahead, about `target` of them in a
    /// bucket.
    pub fn new(origin: Time, balls: usize, interval: f64, target: f64) -> Self {
        let mut queue = Self {
            target,
            origin,
            width: 1.0,
            inverse_width: 1.0,
            buckets: Vec::new(),
            chunks: Vec::new(),
            free: Vec::new(),
            present: 0,
            sorted: Vec::new(),
            far: Vec::new(),
            in_ring: 0,
            delayed: Delayed::NONE,
            buckets_passed: 0,
            entries_met: 0,
        };
        // About so many are in use, where there are many.
        queue.chunks.reserve_exact(balls / 4);
        queue.shape(balls, interval * target / balls.max(1) as f64);
        queue
    }

    fn shape(&mut self, entries: usize, width: f64) {
        self.width = width.clamp(NARROWEST, WIDEST);
        self.inverse_width = 1.0 / self.width;
        // Long enough for most of what comes to fall into the ring; where there are many, for the next that comes for half of all:
        // the fuller its chunks, the less memory.
        let (most, fewest) = (entries * 4 / self.target as usize, entries / self.target as usize);
        let buckets = most.min(fewest.max(CACHED_BUCKETS)).next_power_of_two().clamp(FEWEST_BUCKETS, MOST_BUCKETS);
        self.buckets.clear();
        self.buckets.resize(buckets, Fill::NONE);
        self.buckets_passed = 0;
        self.entries_met = 0;
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        self.buckets.capacity() * size_of::<Fill>()
            + self.free.capacity() * 4
            + self.chunks.capacity() * size_of::<Chunk>()
            + self.sorted.capacity() * size_of::<Entry>()
            + self.far.capacity() * size_of::<Mark>()
    }

    /// Which bucket an instant falls into. Rounding is monotonic, so the order of buckets is the order of time.
    #[inline(always)]
    fn bucket_of(&self, time: Time) -> i64 {
        // The cast saturates: what is too far ahead is simply far.
        (((time.epoch - self.origin.epoch) + (time.offset - self.origin.offset)) * self.inverse_width) as i64
    }

    /// Adds an entry.
    #[inline(always)]
    pub fn push(&mut self, entry: Entry) {
        let bucket = self.bucket_of(entry.time);
        let ahead = bucket.saturating_sub(self.present);
        if ahead > 0 && ahead < self.buckets.len() as i64 {
            self.in_ring += 1;
            if self.buckets.len() > CACHED_BUCKETS {
                self.delay(bucket, entry.mark);
            } else {
                self.put_into_ring(bucket, entry.mark);
            }
        } else if ahead > 0 {
            make_room(&mut self.far, 1);
            self.far.push(entry.mark);
        } else {
            self.put_into_present(entry.time, entry.mark);
        }
    }

    /// (Time and mark come in registers: a whole entry would come through memory, written in parts and read at once, which waits.)
    #[inline(never)]
    fn put_into_present(&mut self, time: Time, mark: Mark) {
        let entry = Entry { time, mark };
        // Latest first, so the place is near the end.
        let mut place = self.sorted.len();
        self.sorted.push(entry);
        while place > 0 && earlier(&self.sorted[place - 1], &entry) {
            self.sorted[place] = self.sorted[place - 1];
            place -= 1;
        }
        self.sorted[place] = entry;
    }

    /// Puts an entry into its bucket not before both the bucket and its chunk have come from memory.
    #[inline]
    fn delay(&mut self, bucket: i64, mark: Mark) {
        let mask = self.buckets.len() - 1;
        prefetch(&self.buckets, bucket as usize & mask);
        self.delayed.first = self.delayed.first.min(bucket);
        let came = self.delayed.came;
        self.delayed.came = came.wrapping_add(1);
        let waited = std::mem::replace(&mut self.delayed.entries[came % DELAYED], (bucket, mark));
        let (half_way, _) = self.delayed.entries[came.wrapping_add(DELAYED / 2) % DELAYED];
        prefetch(&self.chunks, self.buckets[half_way as usize & mask].row());
        if waited.0 != i64::MIN {
            self.put_into_ring(waited.0, waited.1);
        }
    }

    /// Lets all through that wait.
    #[cold]
    fn undelay(&mut self) {
        let delayed = std::mem::replace(&mut self.delayed, Delayed::NONE);
        for (bucket, mark) in delayed.entries {
            if bucket != i64::MIN {
                self.put_into_ring(bucket, mark);
            }
        }
    }

    #[inline(always)]
    fn put_into_ring(&mut self, bucket: i64, mark: Mark) {
        let slot = bucket as usize & (self.buckets.len() - 1);
        let fill = self.buckets[slot];
        if fill.len() == CHUNK {
            return self.begin_chunk(slot, mark);
        }
        self.chunks[fill.row()].marks[fill.len()] = mark;
        self.buckets[slot] = Fill(fill.0 + 1);
    }

    #[inline(never)]
    fn begin_chunk(&mut self, slot: usize, mark: Mark) {
        let next = self.buckets[slot];
        let row = match self.free.pop() {
            Some(row) => {
                let chunk = &mut self.chunks[row as usize];
                chunk.marks[0] = mark;
                chunk.next = next;
                row as usize
            }
            None => {
                make_room(&mut self.chunks, 1);
                // There are fewer than 2^30 balls, each with one entry that holds and one or two that no longer do, seven a chunk.
                assert!(self.chunks.len() < Fill::NONE.row(), "more entries than can be counted");
                self.chunks.push(Chunk { marks: [mark; CHUNK], next });
                self.chunks.len() - 1
            }
        };
        self.buckets[slot] = Fill::new(row, 1);
    }

    /// The earliest entry that still holds. `time_of` tells when an entry is, if it holds; those that do not are dropped.
    #[inline]
    pub fn earliest(&mut self, time_of: impl Fn(Mark) -> Option<Time>) -> Option<Entry> {
        loop {
            while let Some(&entry) = self.sorted.last() {
                if time_of(entry.mark).is_some() {
                    return Some(entry);
                }
                self.sorted.pop();
            }
            if !self.turn(&time_of) {
                return None;
            }
        }
    }

    /// Removes the entry that [`Queue::earliest`] just returned.
    #[inline]
    pub fn remove_earliest(&mut self) {
        self.sorted.pop();
    }

    /// Number of the bucket of the present: changes when the calendar turns.
    #[inline(always)]
    pub fn present(&self) -> i64 {
        self.present
    }

    /// Calls `visit` with the entries of the bucket `ahead` of the present one.
    #[inline(always)]
    pub fn ahead(&self, ahead: usize, mut visit: impl FnMut(Mark)) {
        let mut fill = self.fill_ahead(ahead);
        while fill != Fill::NONE {
            let chunk = &self.chunks[fill.row()];
            chunk.marks[..fill.len()].iter().for_each(|&mark| visit(mark));
            fill = chunk.next;
        }
    }

    #[inline(always)]
    fn fill_ahead(&self, ahead: usize) -> Fill {
        self.buckets[(self.present as usize).wrapping_add(ahead) & (self.buckets.len() - 1)]
    }

    /// Fetches what [`Queue::ahead`] will read of the bucket one nearer than `ahead`.
    #[inline(always)]
    pub fn prefetch(&self, ahead: usize) {
        prefetch(&self.chunks, self.fill_ahead(ahead).row());
        let nearer = self.fill_ahead(ahead - 1);
        if nearer != Fill::NONE {
            prefetch(&self.chunks, self.chunks[nearer.row()].next.row());
        }
    }

    /// The entries of the present.
    pub fn at_present(&self) -> &[Entry] {
        &self.sorted
    }

    /// Goes on to the next bucket that holds anything; false if nothing is left.
    fn turn(&mut self, time_of: &impl Fn(Mark) -> Option<Time>) -> bool {
        if self.in_ring == 0 {
            self.far.retain(|&mark| time_of(mark).is_some());
            let times = || self.far.iter().filter_map(|&mark| time_of(mark));
            let Some(next) = times().map(|time| self.bucket_of(time)).min() else {
                return false;
            };
            if next == i64::MAX {
                // Too far for this width: start anew from the earliest.
                self.origin = times().reduce(|a, b| if b.before(a) { b } else { a }).unwrap_or(self.origin);
                self.present = -1;
            } else {
                self.present = next - 1;
            }
            self.recall_far(time_of);
        }
        let mask = self.buckets.len() - 1;
        loop {
            self.present += 1;
            self.buckets_passed += 1;
            if self.present >= self.delayed.first {
                self.undelay();
            }
            if self.present as usize & mask == 0 {
                self.recall_far(time_of);
            }
            let slot = self.present as usize & mask;
            if self.buckets[slot] != Fill::NONE {
                self.open(slot, time_of);
                if !self.sorted.is_empty() {
                    break;
                }
            }
            if self.in_ring == 0 {
                return !self.far.is_empty() && self.turn(time_of);
            }
        }
        if self.buckets_passed as usize > 4 * self.buckets.len() + 256 {
            self.adapt(time_of);
        }
        true
    }

    /// Moves what has come within the ring's length into the ring.
    fn recall_far(&mut self, time_of: &impl Fn(Mark) -> Option<Time>) {
        let mut kept = 0;
        for k in 0..self.far.len() {
            let mark = self.far[k];
            let Some(time) = time_of(mark) else { continue };
            let bucket = self.bucket_of(time);
            if bucket.saturating_sub(self.present) >= self.buckets.len() as i64 {
                self.far[kept] = mark;
                kept += 1;
            } else {
                self.in_ring += 1;
                self.put_into_ring(bucket.max(self.present), mark);
            }
        }
        self.far.truncate(kept);
    }

    /// Sorts the bucket of the present.
    fn open(&mut self, slot: usize, time_of: &impl Fn(Mark) -> Option<Time>) {
        let mut fill = self.buckets[slot];
        self.buckets[slot] = Fill::NONE;
        while fill != Fill::NONE {
            let (row, len) = (fill.row(), fill.len());
            for place in 0..len {
                let mark = self.chunks[row].marks[place];
                if let Some(time) = time_of(mark) {
                    self.put_into_present(time, mark);
                }
            }
            self.in_ring -= len;
            make_room(&mut self.free, 1);
            self.free.push(row as u32);
            fill = self.chunks[row].next;
        }
        self.entries_met += self.sorted.len() as u64;
    }

    /// After some laps: if the buckets turned out too full or too empty, builds the calendar anew with another width.
    #[cold]
    #[inline(never)]
    fn adapt(&mut self, time_of: &impl Fn(Mark) -> Option<Time>) {
        let occupancy = self.entries_met as f64 / self.buckets_passed as f64;
        self.entries_met = 0;
        self.buckets_passed = 0;
        if (0.5 * self.target..=2.0 * self.target).contains(&occupancy) {
            return;
        }
        self.undelay();
        let marks = std::mem::take(&mut self.far);
        let mut all: Vec<Entry> =
            marks.into_iter().filter_map(|mark| time_of(mark).map(|time| Entry { time, mark })).collect();
        all.append(&mut self.sorted);
        for slot in 0..self.buckets.len() {
            self.open(slot, time_of);
            all.append(&mut self.sorted);
        }
        all.retain(|entry| time_of(entry.mark).is_some());
        let Some(earliest) = all.iter().copied().reduce(|a, b| if earlier(&a, &b) { a } else { b }) else {
            return;
        };
        // An empty stretch says little about how much wider is right.
        let factor = (self.target / occupancy).clamp(0.0625, 16.0);
        self.origin = earliest.time;
        self.present = 0;
        self.entries_met = 0;
        self.shape(all.len(), self.width * factor);
        self.chunks.clear();
        self.free.clear();
        self.in_ring = 0;
        for entry in all {
            self.push(entry);
        }
    }
}

/// Whether `a` comes before `b`: by time, then (to be definite) by ball and stamp.
#[inline(always)]
fn earlier(a: &Entry, b: &Entry) -> bool {
    a.time.before(b.time) || (a.time == b.time && a.mark < b.mark)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::time::Clock;

    #[test]
    fn comes_out_sorted_at_any_scale() {
        let clock = Clock::with_span(1.0);
        for scale in [1e-12, 1e-3, 1.0, 1e6, 1e15] {
            let mut queue = Queue::new(clock.at(0.0), 100, 1.0, 4.0);
            let mut state = 1u64;
            let mut now = clock.at(0.0);
            let mut times: Vec<Time> = (0..200).map(|ball| clock.after(now, scale * f64::from(ball))).collect();
            for (ball, &time) in times.iter().enumerate() {
                queue.push(Entry { time, mark: Mark { ball: ball as u32, stamp: 0 } });
            }
            for _ in 0..20_000 {
                let holds = |mark: Mark| (mark.stamp == 0).then(|| times[mark.ball as usize]);
                let entry = queue.earliest(holds).expect("never empty");
                queue.remove_earliest();
                assert!(!entry.time.before(now), "out of order at scale {scale}");
                now = entry.time;
                state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
                let ahead = scale * ((state >> 40) as f64) / 65536.0;
                let ball = entry.mark.ball;
                times[ball as usize] = clock.after(now, ahead);
                queue.push(Entry { time: clock.after(now, ahead * 0.3), mark: Mark { ball, stamp: 1 } });
                queue.push(Entry { time: times[ball as usize], mark: Mark { ball, stamp: 0 } });
            }
        }
    }
}
