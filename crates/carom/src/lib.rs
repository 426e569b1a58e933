//! Carom: rigid bodies that fly freely and collide, each collision found at its own instant, resolved by the stated impact
//! law to round-off, recorded, and accounted for in a ledger of energy and momentum.
//!
//! The way of the data, which is also the order to read in:
//!
//! 1. [`scene`]: what the user describes; checked and built into a world, or refused with all that is wrong.
//! 2. [`world`]: what is true now: bodies, each with its own clock, cells of neighbours.
//! 3. [`flight`], [`rotation`]: where a body is and how it is turned at any time after its last impact, in closed form.
//! 4. [`predict`]: when two bodies next touch; the table of shape pairs.
//! 5. [`queue`]: future events in order.
//! 6. [`resolve`]: from contact to impulse.
//! 7. [`record`], [`ledger`]: every impact as a row, energy and momentum accounted for.
//! 8. [`simulation`]: the loop through all of these.
//!
//! [`shape`] has the geometry of bodies that turn, [`contact`] answers questions about two bodies alone. SI units by
//! convention; any consistent set works, and nothing here has a length scale. Vectors are (x, y, z), quaternions
//! (w, x, y, z). The contact normal points from B to A.

#![forbid(unsafe_code)]

pub mod contact;
pub mod error;
pub mod event;
pub mod flight;
mod frugal;
pub mod ledger;
pub mod predict;
mod prefetch;
pub mod queue;
pub mod random;
pub mod record;
pub mod resolve;
pub mod rotation;
pub mod scene;
pub mod shape;
pub mod simulation;
pub mod time;
pub mod tolerance;
pub mod world;

pub use glam::{DQuat, DVec3};
