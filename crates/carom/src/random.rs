//! The one seeded generator: the same numbers on every platform.

use glam::DVec3;
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64;

/// Draws everything that is drawn at random.
#[derive(Clone, Debug)]
pub struct Random(Pcg64);

impl Random {
    /// The sequence of `stream` under `seed`.
    pub fn new(seed: u64, stream: u64) -> Self {
        let mut bytes = [0; 32];
        bytes[..8].copy_from_slice(&seed.to_le_bytes());
        // The generator's increment is odd: its lowest bit would be lost.
        let increment = (u128::from(stream) << 1) | 1;
        bytes[16..].copy_from_slice(&increment.to_le_bytes());
        let mut generator = Pcg64::from_seed(bytes);
        // Seeds differ in few bits; so would the first draws.
        for _ in 0..16 {
            generator.next_u64();
        }
        Self(generator)
    }

    /// Uniform in [0, 1), a multiple of 2^-53.
    pub fn uniform(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
    }

    /// Normal with mean 0 and deviation 1 (Marsaglia's polar method).
    pub fn normal(&mut self) -> f64 {
        loop {
            let x = 2.0 * self.uniform() - 1.0;
            let y = 2.0 * self.uniform() - 1.0;
            let s = x * x + y * y;
            if s > 0.0 && s < 1.0 {
                return x * (-2.0 * libm::log(s) / s).sqrt();
            }
        }
    }

    /// Three normals; the third is 0 in two dimensions.
    pub fn normal_vector(&mut self, dimensions: u8) -> DVec3 {
        let (x, y) = (self.normal(), self.normal());
        DVec3::new(x, y, if dimensions == 3 { self.normal() } else { 0.0 })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_stream_is_a_sequence_of_its_own() {
        let first = |stream| Random::new(1, stream).uniform();
        let streams = [0, 1, 2, 3, u64::MAX - 1, u64::MAX];
        for (i, &a) in streams.iter().enumerate() {
            for &b in &streams[i + 1..] {
                assert_ne!(first(a), first(b), "streams {a} and {b}");
            }
        }
    }
}
