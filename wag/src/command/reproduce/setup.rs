//! What every result starts from.

use crate::cli::ReproduceArgs;
use crate::command::identify::method_of;
use crate::command::network::with_network;
use crate::config;
use cli_output::{OrInput, Outcome};
use planner::process::PlannerConfig;
use planner::sysid::IdentifyOptions;
use planner::trials::TrialRig;

/// The built-in configuration, the rig that films its wiggle, and the method asked for.
pub(super) struct Setup {
    pub config: PlannerConfig,
    pub rig: TrialRig,
    pub options: IdentifyOptions,
}

impl Setup {
    pub fn new(args: &ReproduceArgs) -> Outcome<Self> {
        let method = method_of(args.method);
        let config = config::built_in::<PlannerConfig>().or_failed()?;
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
