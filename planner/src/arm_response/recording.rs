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
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{0}")]
pub struct ResponseError(String);

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
        let setpoints = &self.setpoints;
        let sent_s = setpoints[0].sent_s..=setpoints[setpoints.len() - 1].sent_s;
        let shared = self.samples.iter().filter(|s| sent_s.contains(&s.at_s));
        if shared.count() < SAMPLES_MIN {
            return Err(ResponseError(
                "the joint reports begin or end when no setpoint was sent: they are of another run or another clock".to_owned(),
            ));
        }
        Ok(())
    }
}

fn check_rows(
    one: &str,
    many: &str,
    rows: impl ExactSizeIterator<Item = (f64, JointVector)>,
) -> Result<(), ResponseError> {
    let found = rows.len();
    if found < SAMPLES_MIN {
        return Err(ResponseError(format!(
            "the recording holds {found} {many}, at least {SAMPLES_MIN} are needed: record a whole motion"
        )));
    }
    let mut before_s = f64::NEG_INFINITY;
    for (index, (time_s, q)) in rows.enumerate() {
        let wrong = |what| {
            Err(ResponseError(format!(
                "{one} {index} of the recording {what}"
            )))
        };
        if !time_s.is_finite() || !q.is_finite() {
            return wrong("holds a number that is not finite".to_owned());
        }
        if time_s <= before_s {
            return wrong(format!("does not come after the one before, at {time_s} s"));
        }
        before_s = time_s;
    }
    Ok(())
}
