//! A hierarchy of boxes: which of many things may be near.

use super::bounds::Bounds;

/// So many things share a leaf (a count).
const LEAF: usize = 4;

/// More levels than a tree has whose halves are equal: 2³² things have 31, and each level leaves one node waiting.
const DEEPEST: usize = 40;

#[derive(Clone, Debug, PartialEq)]
struct Node {
    bounds: Bounds,
    /// Of a leaf: where its things start and how many there are. Else, with a count of 0: its second child; the first
    /// is the next node.
    start: u32,
    count: u32,
}

/// A binary tree of boxes, halved at the median along the longest side. The same boxes give the same tree.
#[derive(Clone, Debug, PartialEq)]
pub struct BoundingTree {
    nodes: Vec<Node>,
    things: Vec<u32>,
}

impl BoundingTree {
    /// A tree over things with these boxes, which are called 0, 1, 2, …
    pub fn new(boxes: &[Bounds]) -> Self {
        let mut tree = Self { nodes: Vec::new(), things: (0..boxes.len() as u32).collect() };
        if !boxes.is_empty() {
            let mut things = std::mem::take(&mut tree.things);
            tree.build(boxes, &mut things, 0);
            tree.things = things;
        }
        tree
    }

    fn build(&mut self, boxes: &[Bounds], things: &mut [u32], start: usize) {
        let bounds = things.iter().map(|&k| boxes[k as usize]).fold(Bounds::EMPTY, Bounds::and);
        let node = self.nodes.len();
        self.nodes.push(Node { bounds, start: start as u32, count: things.len() as u32 });
        if things.len() <= LEAF {
            return;
        }
        let middle = |k: u32| boxes[k as usize].middle();
        let middles = Bounds::around(things.iter().map(|&k| middle(k)));
        let axis = (middles.high - middles.low).max_position();
        let half = things.len() / 2;
        // By index where middles are equal, so that the order is total and the tree always the same.
        things.select_nth_unstable_by(half, |&a, &b| middle(a)[axis].total_cmp(&middle(b)[axis]).then(a.cmp(&b)));
        let (first, second) = things.split_at_mut(half);
        first.sort_unstable();
        second.sort_unstable();
        self.build(boxes, first, start);
        (self.nodes[node].start, self.nodes[node].count) = (self.nodes.len() as u32, 0);
        self.build(boxes, second, start + half);
    }

    /// The box around everything.
    pub fn bounds(&self) -> Bounds {
        self.nodes.first().map_or(Bounds::EMPTY, |node| node.bounds)
    }

    /// Calls `visit` with everything in those leaves whose box overlaps `bounds`, in an order that is always the same.
    pub fn visit(&self, bounds: &Bounds, mut visit: impl FnMut(u32)) {
        let mut waiting = [0_u32; DEEPEST];
        let mut count = usize::from(!self.nodes.is_empty());
        while count > 0 {
            count -= 1;
            let at = waiting[count];
            let node = &self.nodes[at as usize];
            if !node.bounds.overlaps(bounds) {
                continue;
            }
            if node.count == 0 {
                (waiting[count], waiting[count + 1]) = (node.start, at + 1);
                count += 2;
            } else {
                let (start, end) = (node.start as usize, (node.start + node.count) as usize);
                self.things[start..end].iter().for_each(|&thing| visit(thing));
            }
        }
    }
}
