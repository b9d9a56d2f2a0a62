//! What every result starts from.

use crate::cli::ReproduceArgs;
use crate::command::identify::method_of;
use crate::command::plan::planner_config;
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
    pub fn new(args: &ReproduceArgs) -> anyhow::Result<Self> {
        let method = method_of(args.method)?;
        let config = planner_config(None)?;
        crate::session::watch_interrupts()?;
        Ok(Self {
            rig: TrialRig::new(&config.wiggle)?,
            options: IdentifyOptions {
                method,
                seed: args.seed,
                ..config.identify
            },
            config,
        })
    }
}
