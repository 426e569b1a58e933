//! The radii of all balls: a single number where they are alike, which so never has to come from memory.

use std::ops::Index;

use crate::prefetch::prefetch;

/// Radii (m) by row.
#[derive(Clone, Debug, PartialEq)]
pub struct Radii {
    /// The radius of all, if they have one.
    one: Option<f64>,
    /// Each ball's; empty if they have one.
    each: Vec<f64>,
    len: usize,
}

impl Radii {
    /// The balls' radii by row.
    pub fn new(each: Vec<f64>) -> Self {
        let (one, len) = (each.first().copied().filter(|first| each.iter().all(|radius| radius == first)), each.len());
        Self { one, each: if one.is_some() { Vec::new() } else { each }, len }
    }

    /// The radius of all, if they have one.
    #[inline(always)]
    pub fn one(&self) -> Option<f64> {
        self.one
    }

    /// Each ball's radius, where they differ; nothing where all have one.
    #[inline(always)]
    pub fn each(&self) -> &[f64] {
        &self.each
    }

    /// How many.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// All of them, by row.
    pub fn iter(&self) -> impl Iterator<Item = f64> + Clone {
        (0..self.len).map(|row| self[row])
    }

    /// Fetches a ball's radius into the cache.
    #[inline(always)]
    pub fn prefetch(&self, row: usize) {
        if self.one.is_none() {
            prefetch(&self.each, row);
        }
    }

    /// All of them times a factor.
    pub fn scale(&mut self, factor: f64) {
        self.one.iter_mut().chain(&mut self.each).for_each(|radius| *radius *= factor);
    }

    /// Moves into each row what was in the row `from` it.
    pub fn rearrange(&mut self, from: &[u32]) {
        if self.one.is_none() {
            self.each = from.iter().map(|&row| self.each[row as usize]).collect();
        }
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        self.each.capacity() * size_of::<f64>()
    }
}

impl Index<usize> for Radii {
    type Output = f64;

    #[inline(always)]
    fn index(&self, row: usize) -> &f64 {
        match &self.one {
            Some(radius) => radius,
            None => &self.each[row],
        }
    }
}
