//! Which periodic image of each ball is meant: how many sizes of the box it has travelled beyond where it is stored.

/// Three counts a ball, a byte each until somebody has gone farther than a byte can tell.
#[derive(Clone, Debug, PartialEq)]
pub enum Images {
    /// Nobody is beyond 127.
    Near(Vec<[i8; 3]>),
    /// Somebody is, or was.
    Far(Vec<[i32; 3]>),
}

impl Images {
    /// All zero; none at all if space is not periodic.
    pub fn new(balls: usize, periodic: bool) -> Self {
        Self::Near(if periodic { vec![[0; 3]; balls] } else { Vec::new() })
    }

    /// Whether there are none: space is not periodic.
    pub fn is_empty(&self) -> bool {
        match self {
            Self::Near(images) => images.is_empty(),
            Self::Far(images) => images.is_empty(),
        }
    }

    /// A ball's; `None` where space is not periodic.
    #[inline(always)]
    pub fn get(&self, row: usize) -> Option<[i32; 3]> {
        match self {
            Self::Near(images) => images.get(row).map(|image| image.map(i32::from)),
            Self::Far(images) => images.get(row).copied(),
        }
    }

    /// Another image of a ball.
    pub fn set(&mut self, row: usize, image: [i32; 3]) {
        if let Self::Near(images) = self {
            if let [Ok(x), Ok(y), Ok(z)] = image.map(i8::try_from) {
                images[row] = [x, y, z];
                return;
            }
            *self = Self::Far(images.iter().map(|image| image.map(i32::from)).collect());
        }
        if let Self::Far(images) = self {
            images[row] = image;
        }
    }

    /// Moves into each row what was in the row `from` it.
    pub fn rearrange(&mut self, from: &[u32]) {
        match self {
            Self::Near(images) => super::arrangement::permute(images, from),
            Self::Far(images) => super::arrangement::permute(images, from),
        }
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        match self {
            Self::Near(images) => images.capacity() * size_of::<[i8; 3]>(),
            Self::Far(images) => images.capacity() * size_of::<[i32; 3]>(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Images;

    #[test]
    fn whoever_goes_far_is_followed_and_nobody_else_forgotten() {
        let mut images = Images::new(3, true);
        images.set(0, [127, -128, 1]);
        images.set(2, [0, 5, 0]);
        assert_eq!(images.bytes(), 9);
        images.set(1, [0, 128, i32::MIN]);
        images.set(2, [0, 6, 0]);
        images.rearrange(&[2, 0, 1]);
        let expected = [[0, 6, 0], [127, -128, 1], [0, 128, i32::MIN]];
        assert_eq!([0, 1, 2].map(|row| images.get(row)), expected.map(Some));
        assert_eq!((Images::new(3, false).get(0), Images::new(3, false).bytes()), (None, 0));
    }
}
