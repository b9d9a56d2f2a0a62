//! What a page may ask of the controller, and when.

use super::attached::Seen;
use anyhow::Context;
use serde::Serialize;
use shared_types::ipc::message::{ControllerEvent, ControllerRequest, ControllerRpc};
use shared_types::ipc::rpc::{Pending, RpcClient};
use std::sync::mpsc;
use std::time::{Duration, Instant};

/// Longest wait for the controller's answer.
const PATIENCE: Duration = Duration::from_secs(6);

/// A request. None of them can make the arm move, or enable it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Ask {
    /// Brake and latch.
    Stop,
    /// Withdraw the arming.
    Disarm,
}

impl Ask {
    /// All of them, in the order of the page's buttons.
    pub(crate) const ALL: [Self; 2] = [Self::Stop, Self::Disarm];

    /// As in an address.
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Stop => "stop",
            Self::Disarm => "disarm",
        }
    }

    pub(crate) fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|ask| ask.name() == name)
    }

    fn request(self) -> ControllerRequest {
        match self {
            Self::Stop => ControllerRequest::Stop,
            Self::Disarm => ControllerRequest::Disarm,
        }
    }

    /// Why it may not be asked for now; `None` when it may.
    pub(crate) fn objection(self, now: Option<&Seen>) -> Option<&'static str> {
        let Some(now) = now.filter(|now| now.alive) else {
            return Some("no controller runs");
        };
        let is_armed = now.state.operating_mode != 0;
        match self {
            Self::Stop => None,
            _ if !now.operator => Some("there is no operator"),
            Self::Disarm => (!is_armed).then_some("nothing is armed"),
        }
    }
}

/// A request on its way, with the place for its answer.
#[derive(Debug)]
pub(crate) struct Requested {
    pub ask: Ask,
    pub reply: mpsc::Sender<Answer>,
}

/// Whether a request was done; why not, in one sentence.
pub(crate) type Answer = Result<(), String>;

/// A request that the controller has got.
#[derive(Debug)]
pub(crate) struct Open {
    pending: Pending<ControllerRpc>,
    since: Instant,
    reply: mpsc::Sender<Answer>,
}

/// Hands a request to the controller; one that may not be asked for, or cannot be, is
/// answered at once.
pub(crate) fn hand_over(
    requested: Requested,
    controller: Option<&RpcClient<ControllerRpc>>,
    now: Option<&Seen>,
) -> Option<Open> {
    let sent = match (requested.ask.objection(now), controller) {
        (Some(objection), _) => Err(anyhow::anyhow!(objection)),
        (None, None) => Err(anyhow::anyhow!(
            "the controller cannot be reached; use the emergency stop"
        )),
        (None, Some(controller)) => controller
            .call(&requested.ask.request())
            .context("the controller cannot be reached; use the emergency stop"),
    };
    match sent {
        Ok(pending) => Some(Open {
            pending,
            since: Instant::now(),
            reply: requested.reply,
        }),
        Err(error) => {
            let _ = requested.reply.send(Err(format!("{error:#}")));
            None
        }
    }
}

impl Open {
    /// Passes the answer on if it is there; whether the request is still open.
    pub(crate) fn is_open(&self) -> bool {
        let answer = match self.pending.try_next() {
            Ok(Some(ControllerEvent::Done)) => Ok(()),
            Ok(Some(ControllerEvent::Refused { message, .. })) => Err(message),
            Ok(Some(ControllerEvent::Step { .. } | ControllerEvent::Started { .. })) => {
                return true;
            }
            Ok(Some(other)) => Err(format!("the controller answered {other:?}")),
            Ok(None) if self.since.elapsed() < PATIENCE => return true,
            Ok(None) => Err("the controller did not answer; use the emergency stop".to_owned()),
            Err(error) => Err(error.to_string()),
        };
        // The page may be gone by now.
        let _ = self.reply.send(answer);
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use shared_types::ipc::{ControllerMode, ControllerState};

    #[test]
    fn a_stop_needs_a_controller_only_and_everything_else_an_operator() {
        let seen = |mode: ControllerMode, operating_mode: u8, operator: bool| Seen {
            state: ControllerState {
                mode: mode as u8,
                operating_mode,
                ..ControllerState::default()
            },
            alive: true,
            operator,
        };
        let alone = seen(ControllerMode::Faulted, 1, false);
        let operated = seen(ControllerMode::Faulted, 1, true);
        let silent = Seen {
            alive: false,
            ..operated
        };
        for ask in Ask::ALL {
            assert!(ask.objection(None).is_some() && ask.objection(Some(&silent)).is_some());
            assert_eq!(Ask::named(ask.name()), Some(ask));
            let objection = ask.objection(Some(&alone));
            assert_eq!(objection.is_none(), ask == Ask::Stop, "{ask:?}");
            assert_eq!(ask.objection(Some(&operated)), None, "{ask:?}");
        }
        let still = seen(ControllerMode::Idle, 0, true);
        assert!(Ask::Disarm.objection(Some(&still)).is_some());
        // Drives are enabled again only by who stands at the arm.
        for other in ["move", "acknowledge"] {
            assert_eq!(Ask::named(other), None);
        }
    }
}
