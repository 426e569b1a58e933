//! What can be wrong, said with ids and values.

use std::fmt;

/// One thing that is wrong with a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Problem {
    /// "ball", "body" (that turns), "mesh", "plane", "fill", "domain", "pair" or "scene".
    pub what: &'static str,
    /// Id of the body (or index of the fill or pair).
    pub id: Option<i64>,
    /// The field.
    pub field: &'static str,
    /// Its value.
    pub value: String,
    /// What is wrong with it.
    pub reason: String,
    /// The other body, of an overlap.
    pub other: Option<i64>,
    /// How deep an overlap is (m).
    pub depth: Option<f64>,
}

impl Problem {
    /// A problem of one field of one thing.
    pub fn new(
        what: &'static str,
        id: Option<i64>,
        field: &'static str,
        value: impl fmt::Display,
        reason: impl Into<String>,
    ) -> Self {
        Self { what, id, field, value: value.to_string(), reason: reason.into(), other: None, depth: None }
    }
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.id {
            Some(id) => write!(f, "{} {}: ", self.what, id)?,
            None => write!(f, "{}: ", self.what)?,
        }
        if self.field.is_empty() {
            write!(f, "{}", self.reason)
        } else {
            write!(f, "{} = {}: {}", self.field, self.value, self.reason)
        }
    }
}

/// A scene that cannot be simulated.
#[derive(Clone, Debug, PartialEq)]
pub struct CheckError {
    /// All that is wrong, in the order of the scene.
    pub problems: Vec<Problem>,
}

impl fmt::Display for CheckError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        const SHOWN: usize = 20;
        for (k, problem) in self.problems.iter().take(SHOWN).enumerate() {
            if k > 0 {
                writeln!(f)?;
            }
            write!(f, "{problem}")?;
        }
        if self.problems.len() > SHOWN {
            write!(f, "\n… and {} more", self.problems.len() - SHOWN)?;
        }
        Ok(())
    }
}

impl std::error::Error for CheckError {}

impl From<Problem> for CheckError {
    fn from(problem: Problem) -> Self {
        Self { problems: vec![problem] }
    }
}

/// Why impacts cannot go on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cause {
    /// A body came to rest on another: a lasting contact, not an impact.
    Resting,
    /// Impacts that lose energy accumulate: infinitely many in a finite time.
    Accumulation,
    /// Impacts follow each other faster than the clock can tell.
    Resolution,
    /// Contacts of several pairs at one instant are reflected again and again.
    Reflections,
    /// Whether and when bodies that turn meet cannot be told in steps of time that the clock can tell.
    Search,
}

/// The run cannot go on by impacts alone. The simulation stands at the last valid event.
#[derive(Clone, Debug, PartialEq)]
pub struct CollapseError {
    /// Ids of the bodies in contact.
    pub bodies: Vec<i64>,
    /// When (s), rounded.
    pub time: f64,
    /// Why.
    pub cause: Cause,
}

impl CollapseError {
    /// The cause in words.
    pub fn cause_text(&self) -> &'static str {
        match self.cause {
            Cause::Resting => {
                "they rest on each other: a lasting contact under gravity, which a sequence of impacts cannot describe"
            }
            Cause::Accumulation => {
                "impacts that lose energy accumulate (inelastic collapse): infinitely many of them in a finite time"
            }
            Cause::Reflections => "the reflections of all that touch at this instant do not come to an end",
            Cause::Search => {
                "they turn so fast, and so near each other, that the search for their next impact cannot go on by as much \
                 time as the clock can resolve"
            }
            Cause::Resolution => {
                "they meet faster, or more often, than the clock can resolve, as a body does that others squeeze"
            }
        }
    }

    /// What can be done.
    pub fn advice(&self) -> &'static str {
        match self.cause {
            Cause::Resting => {
                "end the run before this time (duration), start the bodies apart or moving, or leave out gravity"
            }
            Cause::Reflections => {
                "leave gaps between the bodies, or resolve them pair by pair (simultaneous = \"pairwise\")"
            }
            Cause::Search => {
                "end the run before this time (duration), or start the bodies apart or turning more slowly"
            }
            Cause::Resolution => "end the run before this time (duration), or leave the bodies room",
            Cause::Accumulation => "end the run before this time (duration), or raise the restitution of this pair",
        }
    }
}

impl fmt::Display for CollapseError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ids: Vec<String> = self.bodies.iter().map(i64::to_string).collect();
        write!(
            f,
            "bodies {} at t = {} s: {}. What can be done: {}.",
            ids.join(" and "),
            self.time,
            self.cause_text(),
            self.advice()
        )
    }
}

impl std::error::Error for CollapseError {}
