//! What was sent to an arm and what came back.

use arm_model::JointVector;

/// Fewest setpoints, reports, and reports of a joint in motion.
pub(super) const SAMPLES_MIN: usize = 100;

/// A setpoint as it left for the arm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Setpoint {
    /// When it was sent (s).
    pub sent_s: f64,
    /// Joints (rad).
    pub q: JointVector,
}

/// A joint report.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// When the joints were measured, on the clock of the setpoints (s).
    pub at_s: f64,
    /// Measured joints (rad).
    pub q: JointVector,
    /// What the arm said it was told to take (rad), if it was recorded.
    pub q_target: Option<JointVector>,
}

/// What was sent to an arm and what came back, in order of time.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Recording {
    /// Setpoints; each holds until the next.
    pub setpoints: Vec<Setpoint>,
    /// Joint reports.
    pub samples: Vec<Sample>,
    /// Typical round trip of a setpoint and its reply (s): what time on the wire
    /// may add to a dead time. 0 when unknown.
    pub round_trip_s: f64,
}

/// Why a recording is refused.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum ResponseError {
    /// Too little of something.
    #[error(
        "the recording holds {found} {what}, at least {needed} are needed: record a whole motion"
    )]
    TooFew {
        /// Of what.
        what: &'static str,
        /// Number found.
        found: usize,
        /// Number needed.
        needed: usize,
    },
    /// Times do not increase.
    #[error("{what} {index} of the recording does not come after the one before, at {time_s} s")]
    Order {
        /// Of what.
        what: &'static str,
        /// Place in the list, 0-based.
        index: usize,
        /// Time found (s).
        time_s: f64,
    },
    /// A number is NaN or infinite.
    #[error("{what} {index} of the recording holds a number that is not finite")]
    NotFinite {
        /// Of what.
        what: &'static str,
        /// Place in the list, 0-based.
        index: usize,
    },
    /// Setpoints and reports are of different times.
    #[error(
        "the joint reports begin or end when no setpoint was sent: they are of another run or another clock"
    )]
    Apart,
}

impl Recording {
    /// Refuses recordings that nothing can be learnt from.
    ///
    /// # Errors
    /// [`ResponseError`].
    pub fn check(&self) -> Result<(), ResponseError> {
        let setpoints = self.setpoints.iter().map(|s| (s.sent_s, s.q));
        let samples = self.samples.iter().map(|s| (s.at_s, s.q));
        check_rows("setpoint", "setpoints", setpoints)?;
        check_rows("joint report", "joint reports", samples)?;
        let (Some(first), Some(last)) = (self.setpoints.first(), self.setpoints.last()) else {
            return Err(ResponseError::Apart);
        };
        let shared = self
            .samples
            .iter()
            .filter(|s| (first.sent_s..=last.sent_s).contains(&s.at_s))
            .count();
        if shared < SAMPLES_MIN {
            return Err(ResponseError::Apart);
        }
        Ok(())
    }
}

fn check_rows(
    one: &'static str,
    many: &'static str,
    rows: impl ExactSizeIterator<Item = (f64, JointVector)>,
) -> Result<(), ResponseError> {
    let found = rows.len();
    if found < SAMPLES_MIN {
        return Err(ResponseError::TooFew {
            what: many,
            found,
            needed: SAMPLES_MIN,
        });
    }
    let mut before_s = f64::NEG_INFINITY;
    for (index, (time_s, q)) in rows.enumerate() {
        if !time_s.is_finite() || !q.is_finite() {
            return Err(ResponseError::NotFinite { what: one, index });
        }
        if time_s <= before_s {
            return Err(ResponseError::Order {
                what: one,
                index,
                time_s,
            });
        }
        before_s = time_s;
    }
    Ok(())
}
