//! A controller that runs as a service: what it is configured for, asked before anything moves.

use anyhow::{Context, anyhow, bail, ensure};
use rt_controller::ControllerConfig;
use session::Session;
use shared_types::FaultCode;
use shared_types::ipc::message::{ControllerEvent, ControllerRequest, ControllerRpc};
use shared_types::ipc::rpc::RpcClient;
use shared_types::ipc::{Bus, ControllerMode, DomainSweep, IpcError};
use std::time::Duration;

/// Longest wait for an answer: a bring-up that somebody else asked for may be under way.
const ANSWERED_WITHIN: Duration = Duration::from_secs(20);

/// A running controller.
#[derive(Debug, Clone)]
pub struct Service {
    /// How it is configured; its limits are in it.
    pub config: ControllerConfig,
    /// Why it has stopped, if it has.
    pub stopped: Option<FaultCode>,
}

impl Service {
    /// Asks the controller of a shared-memory domain.
    ///
    /// # Errors
    /// None runs there, or it does not say.
    pub fn find(domain: &str) -> anyhow::Result<Self> {
        // Removed last: it looks for others in the domain.
        let _sweep = DomainSweep::new(domain);
        let bus = Bus::join(domain)?;
        let client = RpcClient::<ControllerRpc>::open(&bus)?;
        let ask = |request: &ControllerRequest| match client.call(request) {
            Ok(pending) => pending.finish::<anyhow::Error>(ANSWERED_WITHIN, || Ok(()), |_| ()),
            Err(IpcError::Gone { .. }) => Err(anyhow!(
                "no controller runs in domain `{domain}`: start one (`systemctl start wag-controller`, or `wag process rt-controller --config FILE`), as the same user"
            )),
            Err(reason) => Err(reason.into()),
        };
        let config = configuration(&ask(&ControllerRequest::Configuration)?)?;
        let stopped = match ask(&ControllerRequest::Status)? {
            ControllerEvent::Status { mode, fault, .. } => match mode {
                ControllerMode::Offline | ControllerMode::Idle => None,
                ControllerMode::Faulted => Some(fault),
                busy => bail!("the controller of `{domain}` is {busy:?}: somebody else uses it"),
            },
            other => bail!("the controller of `{domain}` answered with {other:?}"),
        };
        Ok(Self { config, stopped })
    }

    /// Refuses a controller that was started anew with another configuration since it was found.
    pub fn require_unchanged(
        &self,
        session: &mut Session,
        link: &RpcClient<ControllerRpc>,
    ) -> anyhow::Result<()> {
        let now = &session.ask(link, &ControllerRequest::Configuration, 5.0, |_| ())?;
        let same = configuration(now)? == self.config;
        ensure!(
            same,
            "the controller of `{}` was started anew with another configuration meanwhile; run the command again",
            self.config.domain
        );
        Ok(())
    }
}

/// The configuration that a controller answered with.
fn configuration(event: &ControllerEvent) -> anyhow::Result<ControllerConfig> {
    match event {
        ControllerEvent::Configuration(text) => {
            toml::from_str(text).context("configuration of the running controller")
        }
        other => bail!("the controller was asked for its configuration and answered {other:?}"),
    }
}
