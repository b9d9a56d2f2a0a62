//! Arming on somebody's word: who asks to arm says when the operator confirmed that the area is
//! clear, and where the laboratory has an enabling switch, the arm's own input says that it is
//! held.

use super::answers::{ControllerCall, refuse};
use super::requests::SETTLES;
use super::{Awaited, Bridge, QUESTION_TIMEOUT};
use crate::armed_speed::ArmedSpeed;
use crate::config::EnablingInput;
use crate::control::ControlCommand;
use crate::control::arming::THROW_WITHIN_NS;
use crate::os::now_ns;
use crate::session::ArmSession;
use shared_types::ipc::ControllerMode;
use shared_types::{Arming, FaultCode, OperatingMode};

/// Longest time that an arming for setting up lasts (ns): ten minutes.
const SET_UP_FOR_NS: u64 = 600_000_000_000;
/// Longest time from a confirmation to the begin of what it is for (ns).
const CONFIRMED_WITHIN_NS: u64 = THROW_WITHIN_NS;
const ARMING: &str = "an arming is under way; ask again";

impl Bridge {
    /// Checks what an arming stands on and hands it to the loop, which answers.
    pub(super) fn serve_arming(
        &mut self,
        call: ControllerCall,
        operating_mode: OperatingMode,
        (confirmed_ns, begins_by_ns): (Option<u64>, Option<u64>),
    ) {
        if self.mode() != ControllerMode::Idle || self.moves() {
            return self.wrong_mode(&call, "it is armed when it is Idle");
        }
        if self.settles() {
            return self.wrong_mode(&call, SETTLES);
        }
        if self.is_arming() {
            return self.wrong_mode(&call, ARMING);
        }
        let rests = self.at_rest_ns;
        let check = || confirmation(operating_mode, confirmed_ns, rests, now_ns());
        // The input takes its time: what was fresh before must be after it.
        let checked = check()
            .and_then(|_| self.switch_held())
            .and_then(|()| check());
        let expires_ns = match checked {
            Ok(expires_ns) => expires_ns,
            Err(why) => return refuse(&call, FaultCode::NotArmed, &why),
        };
        self.confirmed_ns = confirmed_ns;
        self.begins_by_ns = begins_by_ns;
        let arming = Arming {
            operating_mode,
            // The loop itself refuses what begins later, in whatever cycle it would.
            expires_ns: begins_by_ns.map_or(expires_ns, |by| by.min(expires_ns)),
            area_clear: confirmed_ns.is_some(),
        };
        self.pass_on(call, ControlCommand::Arm(arming), None, Awaited::Armed);
    }

    fn is_arming(&self) -> bool {
        let armed = |awaits: &Awaited| matches!(awaits, Awaited::Armed);
        self.open.iter().any(|open| armed(&open.awaits))
    }

    /// What is armed, with the enabling switch held; refuses the call where nothing is.
    pub(super) fn require_armed(&self, call: &ControllerCall) -> Option<OperatingMode> {
        if !self.settings.arming_required {
            return Some(OperatingMode::Throw);
        }
        if self.is_arming() {
            self.wrong_mode(call, ARMING);
            return None;
        }
        let refused = match self.armed {
            Ok(armed) => match self.switch_held() {
                Ok(()) => return Some(armed),
                Err(why) => (FaultCode::NotArmed, why),
            },
            Err(fault) => (fault, String::new()),
        };
        refuse(call, refused.0, &refused.1);
        None
    }

    /// Refuses a wiggle or a throw of an arm that has moved since the area was confirmed clear.
    pub(super) fn still_confirmed(&self, armed: OperatingMode) -> Result<(), (FaultCode, String)> {
        if armed == OperatingMode::SetUp || !self.settings.arming_required {
            return Ok(());
        }
        let confirmed = confirmation(armed, self.confirmed_ns, self.at_rest_ns, now_ns());
        confirmed
            .map(drop)
            .map_err(|why| (FaultCode::NotArmed, why))
    }

    /// How fast what is armed may be; `None` where motions need no arming.
    pub(super) fn armed_speed(&self, armed: OperatingMode) -> Option<ArmedSpeed<'_>> {
        self.settings.arming_required.then_some(ArmedSpeed {
            armed,
            limits: &self.limits,
            pole: &self.config.pole,
            speeds: self.settings.speeds,
        })
    }

    /// Whether the enabling switch is held, where there is one.
    ///
    /// # Errors
    /// It is not, or the arm does not say.
    fn switch_held(&self) -> Result<(), String> {
        let Some(input) = self.config.enabling_input else {
            return Ok(());
        };
        let levels = ArmSession::connect(self.command_port(), QUESTION_TIMEOUT)
            .and_then(|mut arm| arm.digital_inputs())
            .map_err(|reason| {
                format!("whether the enabling switch is held is unknown: {reason}")
            })?;
        if input.is_held(levels) {
            return Ok(());
        }
        let EnablingInput { number, .. } = input;
        Err(format!(
            "the enabling switch is not held (digital input {number} of the arm's control box, `enabling_input`): hold it and arm again"
        ))
    }
}

/// Until when an arming lasts whose area was confirmed clear at `confirmed_ns`, for an arm that
/// rests since `at_rest_ns` (CLOCK_MONOTONIC, ns).
///
/// # Errors
/// Why the confirmation confirms nothing, and what to do.
fn confirmation(
    operating_mode: OperatingMode,
    confirmed_ns: Option<u64>,
    at_rest_ns: u64,
    now_ns: u64,
) -> Result<u64, String> {
    if operating_mode == OperatingMode::SetUp {
        return Ok(now_ns.saturating_add(SET_UP_FOR_NS));
    }
    let again = "look whether the area is clear, and confirm it again";
    let Some(confirmed_ns) = confirmed_ns else {
        return Err(format!(
            "nobody confirmed that the area is clear, which a {operating_mode:?} needs: {again}"
        ));
    };
    let age_s = (now_ns as f64 - confirmed_ns as f64) * 1e-9;
    if confirmed_ns > now_ns {
        let ahead_s = -age_s;
        return Err(format!(
            "the confirmation lies {ahead_s:.3} s in the future: give the machine's CLOCK_MONOTONIC"
        ));
    }
    let expires_ns = confirmed_ns.saturating_add(CONFIRMED_WITHIN_NS);
    if expires_ns < now_ns {
        let within_s = CONFIRMED_WITHIN_NS as f64 * 1e-9;
        return Err(format!(
            "the area was confirmed clear {age_s:.1} s ago, it must be within {within_s:.0} s: {again}"
        ));
    }
    if confirmed_ns < at_rest_ns {
        return Err(format!(
            "the area was confirmed clear before the arm came to rest, which confirms nothing of where it stands now: {again}"
        ));
    }
    Ok(expires_ns)
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOW_NS: u64 = 100_000_000_000;
    const S: u64 = 1_000_000_000;

    #[test]
    fn a_confirmation_is_fresh_and_given_to_an_arm_at_rest() {
        use OperatingMode::{SetUp, Throw, Wiggle};
        let at_rest_ns = NOW_NS - 20 * S;
        let arm = |mode, confirmed_ns| confirmation(mode, confirmed_ns, at_rest_ns, NOW_NS);
        assert_eq!(arm(SetUp, None), Ok(NOW_NS + SET_UP_FOR_NS));
        for mode in [Wiggle, Throw] {
            // The ten seconds count from the confirmation.
            assert_eq!(arm(mode, Some(NOW_NS - 3 * S)), Ok(NOW_NS + 7 * S));
            for (confirmed_ns, why) in [
                (None, "nobody confirmed"),
                (Some(NOW_NS + 1), "in the future"),
                (Some(NOW_NS - 10 * S - 1), "10.0 s ago"),
            ] {
                let said = arm(mode, confirmed_ns).unwrap_err();
                assert!(said.contains(why), "{said}");
            }
            let moved_since = confirmation(mode, Some(NOW_NS - 2 * S), NOW_NS - S, NOW_NS);
            let said = moved_since.unwrap_err();
            assert!(said.contains("came to rest"), "{said}");
        }
    }
}
