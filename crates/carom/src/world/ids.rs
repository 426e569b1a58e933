//! The identities of all balls. Most scenes count their balls through: then there is nothing to remember but the first.

/// Ids by rank, their place in ascending order.
#[derive(Clone, Debug, PartialEq)]
pub struct Ids {
    /// The lowest.
    first: i64,
    /// All of them, unless each is one more than the one before.
    listed: Vec<i64>,
}

impl Ids {
    /// The ids in ascending order.
    pub fn new(ascending: Vec<i64>) -> Self {
        let first = ascending.first().copied().unwrap_or(0);
        let counted = ascending.iter().zip(0..).all(|(&id, rank)| Some(id) == first.checked_add(rank));
        Self { first, listed: if counted { Vec::new() } else { ascending } }
    }

    /// The id that is `rank`-th.
    #[inline(always)]
    pub fn of_rank(&self, rank: usize) -> i64 {
        // There is a row for each rank, and an id for each row: the sum was found to be one.
        if self.listed.is_empty() { self.first + rank as i64 } else { self.listed[rank] }
    }

    /// The rank of an id among so many; `None` if nobody has it.
    pub fn rank_of(&self, id: i64, count: usize) -> Option<usize> {
        if self.listed.is_empty() {
            let rank = usize::try_from(id.checked_sub(self.first)?).ok()?;
            (rank < count).then_some(rank)
        } else {
            self.listed.binary_search(&id).ok()
        }
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        self.listed.capacity() * size_of::<i64>()
    }
}

#[cfg(test)]
mod tests {
    use super::Ids;

    #[test]
    fn each_id_has_its_rank_and_no_other_has_one() {
        for ids in
            [vec![], vec![7], vec![5, 6, 7], vec![-1, 0, 2], vec![i64::MAX - 1, i64::MAX], vec![i64::MIN, i64::MAX]]
        {
            let known = Ids::new(ids.clone());
            for (rank, &id) in ids.iter().enumerate() {
                assert_eq!((known.of_rank(rank), known.rank_of(id, ids.len())), (id, Some(rank)));
            }
            for other in [i64::MIN + 1, -2, 1, 4, 8, i64::MAX - 2] {
                assert_eq!(known.rank_of(other, ids.len()), ids.iter().position(|&id| id == other), "{ids:?} {other}");
            }
            assert_eq!(known.bytes() > 0, [vec![-1, 0, 2], vec![i64::MIN, i64::MAX]].contains(&ids));
        }
    }
}
