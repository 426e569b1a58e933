//! From contact to impulse: two surfaces touch, Newton's law of restitution says what they do next.

pub mod newton;
pub mod reflections;
pub mod turning;
