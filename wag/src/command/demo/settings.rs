//! What a demo tells the planner.

use planner::PlannerConfig;
use planner::identify::IdentifyOptions;

/// What anybody's configuration says. Nothing that is known about the
/// rig alone, such as how exactly its camera stands, may help the demo.
pub(super) fn settings(configured: PlannerConfig, seed: u64) -> PlannerConfig {
    let identify = IdentifyOptions {
        seed,
        ..configured.identify
    };
    PlannerConfig {
        identify,
        ..configured
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_demo_knows_no_more_about_its_camera_than_its_user_states() {
        let configured = |std_m: f64| {
            let mut config = PlannerConfig::default();
            config.identify.camera_position_std_m = std_m;
            config
        };
        let stated = settings(configured(0.005), 7);
        assert_eq!(stated.identify.seed, 7);
        let mut back = stated;
        back.identify.seed = PlannerConfig::default().identify.seed;
        assert_eq!(back, configured(0.005));
    }
}
