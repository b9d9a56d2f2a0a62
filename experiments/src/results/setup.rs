//! What every result starts from.

use crate::args::ResultArgs;
use crate::network::with_network;
use cli_output::{OrInput, Outcome};
use experiments::trials::TrialRig;
use planner::process::PlannerConfig;
use planner::sysid::{IdentifyOptions, Method};

/// The planner's built-in configuration, whatever this machine's folders say: results
/// must be the same everywhere.
pub(crate) fn built_in() -> Result<PlannerConfig, toml::de::Error> {
    toml::from_str(include_str!("../../../configs/planner/planner.toml"))
}

/// The built-in configuration, the rig that films its wiggle, and the method asked for.
pub(super) struct Setup {
    pub config: PlannerConfig,
    pub rig: TrialRig,
    pub options: IdentifyOptions,
}

impl Setup {
    pub fn new(args: &ResultArgs) -> Outcome<Self> {
        let method: Method = args.method.into();
        let config = built_in().or_failed()?;
        let mut rig = TrialRig::new(&config.wiggle).or_failed()?;
        with_network(&mut rig, method, args.model.as_deref())?;
        cli_output::watch_interrupts().or_failed()?;
        Ok(Self {
            rig,
            options: IdentifyOptions {
                method,
                seed: args.seed,
                threads: args.threads.map_or(config.identify.threads, usize::from),
                ..config.identify
            },
            config,
        })
    }
}
