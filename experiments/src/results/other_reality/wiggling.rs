//! A wiggle in MuJoCo: filmed, and the rope identified from it.

use super::case::Case;
use super::child::Mujoco;
use crate::results::experiment::Experiment;
use anyhow::Context;
use arm_model::{Cell, JointTrajectory, Limits};
use experiments::trials::{KEYPOINTS, alone};
use planner::history::ArmHistory;
use planner::identify::IdentifyOptions;
use planner::synthetic::{FilmNoise, FilmTiming, RopeFilm, SyntheticFilm, project};
use planner::wiggle::wiggle;
use rope_sim::{FrameTimes, PlannedArm, Sway};
use shared_types::{RopeEstimate, Task};
use std::ops::ControlFlow;

/// Time between kept positions of a film (s).
const FILM_PERIOD_S: f64 = 1.0 / 240.0;
/// Time between reports of the joints (s).
const REPORT_PERIOD_S: f64 = 4e-3;
/// The joint that wiggles (0-based).
const WIGGLED: usize = 5;
/// From a wiggle's end to the throw out of its swing (s): tracking, identification and planning of
/// `wag run --fast` on two cores.
const WAITED_S: f64 = 3.0;

/// Films and throws in MuJoCo; identifies and plans with the product's own equations.
pub(super) struct Reality<'a> {
    pub experiment: &'a Experiment<'a>,
    pub mujoco: Mujoco,
    /// Ropes of the posterior that a first throw is planned for.
    pub robust: usize,
    /// Whether throws begin out of the swing of a short wiggle, where that is worth it.
    pub fast: bool,
}

/// What was filmed, and what its joints reported.
pub(super) struct Wiggled {
    pub command: JointTrajectory,
    pub reported: JointTrajectory,
    /// How the rope swung at its begin, as identified.
    sway: Sway,
    /// Whether it was short, and a throw may begin out of its swing.
    pub short: bool,
}

/// Why there is no rope to throw.
pub(super) enum Untold {
    /// Identification refused.
    Refused(anyhow::Error),
    /// The engine or the planner failed.
    Failed(anyhow::Error),
}

impl Wiggled {
    /// How late the arm followed its setpoints (s), as `wag run` finds from the same.
    fn lag_s(&self) -> f64 {
        let differs = |lag_s: f64| {
            let times_s = (0..).map(|i| f64::from(i) * REPORT_PERIOD_S);
            let within = times_s.take_while(|t| *t <= self.command.duration_s());
            let way = |t: f64| self.reported.state_at(t + lag_s).q - self.command.state_at(t).q;
            within.map(|t| way(t)[WIGGLED].powi(2)).sum::<f64>()
        };
        let lags_s = (0..100).map(|i| f64::from(i) * 2e-3);
        let least = lags_s.min_by(|a, b| differs(*a).total_cmp(&differs(*b)));
        least.unwrap_or_default()
    }

    /// When a throw out of its swing is commanded to begin (s).
    pub fn throw_begins_s(&self) -> f64 {
        self.command.duration_s() + WAITED_S
    }

    /// What the arm did until a throw out of the swing begins.
    pub fn history(&self) -> ArmHistory {
        let times_s = (0..).map(|i| f64::from(i) * REPORT_PERIOD_S);
        let times_s = times_s.take_while(|t| *t <= self.reported.duration_s());
        let (times_s, q) = times_s.map(|t| (t, self.reported.state_at(t).q)).unzip();
        ArmHistory {
            sway: self.sway,
            times_s,
            q,
            start_s: self.throw_begins_s() + self.lag_s(),
            start_q: self.command.end(),
        }
    }
}

impl Reality<'_> {
    /// Trial `index` wiggled as `wag run` does: the rope as identified, and the wiggle that told it.
    pub(super) fn told(&self, index: u64, case: &Case) -> Result<(Wiggled, RopeEstimate), Untold> {
        let usual = *self.experiment.rig.motion.trajectory();
        if !self.fast {
            return self.told_by(index, case, 0, (usual, false));
        }
        let wiggled = self.short_wiggle(case).map_err(Untold::Failed)?;
        let (wiggled, found) = self.told_by(index, case, 0, (wiggled, true))?;
        if found.is_reliable() {
            return Ok((wiggled, found));
        }
        // The swing is damped, and what is left awaited, as before any wiggle: the film begins with
        // the sway that every film begins with.
        self.told_by(index, case, 1, (usual, false))
    }

    /// A wiggle in film `number`, and what identification makes of it.
    fn told_by(
        &self,
        index: u64,
        case: &Case,
        number: u64,
        (command, short): (JointTrajectory, bool),
    ) -> Result<(Wiggled, RopeEstimate), Untold> {
        // The fit hears what the joints report; the arm is where it is.
        let reported = case.arm.reported(&command);
        let reported = reported.map_err(|why| Untold::Failed(why.into()))?;
        let filmed = self.film(case, number, &reported).map_err(Untold::Failed)?;
        let found = self.identify(index, &filmed, &reported);
        let found = found.map_err(Untold::Refused)?;
        let wiggled = Wiggled {
            command,
            reported,
            sway: found.circumstances.sway,
            short,
        };
        Ok((wiggled, found))
    }

    fn short_wiggle(&self, case: &Case) -> anyhow::Result<JointTrajectory> {
        let config = &self.experiment.config;
        let short = config.short_wiggle(Task::Strike, case.target_m)?;
        Ok(wiggle(&short, &Limits::default())?)
    }

    fn film(
        &self,
        case: &Case,
        number: u64,
        reported: &JointTrajectory,
    ) -> anyhow::Result<SyntheticFilm> {
        let timing = timing_of(reported);
        let times = FrameTimes {
            first_s: 0.0,
            period_s: FILM_PERIOD_S,
            count: ((timing.duration_s() + 0.05) / FILM_PERIOD_S).ceil() as usize,
        };
        let motion = |t_s| case.arm.attach_frame(reported, t_s);
        let points = self
            .mujoco
            .simulate(&case.rope, motion, case.seed, &times, KEYPOINTS)?;
        let positions_m = points.iter().flat_map(|p| p.cast::<f32>().data.0[0]);
        let params = case.rope.params;
        let film =
            RopeFilm::from_positions(params, FILM_PERIOD_S, KEYPOINTS, positions_m.collect())
                .context("a film without frames")?;
        let camera = &self.experiment.rig.camera;
        let noise = FilmNoise {
            seed: case.film.seed.wrapping_add(number),
            ..case.film
        };
        Ok(project(&film, camera, &timing, &noise))
    }

    /// As `wag identify` does, with the experiment's method.
    fn identify(
        &self,
        index: u64,
        filmed: &SyntheticFilm,
        reported: &JointTrajectory,
    ) -> anyhow::Result<RopeEstimate> {
        let Experiment { rig, options, .. } = self.experiment;
        let motion = PlannedArm::new(*reported, Cell::default().pole);
        let observation = planner::observation::Observation {
            motion: &motion,
            ..rig.observation(filmed)
        };
        let options = IdentifyOptions {
            seed: options.seed ^ index,
            ..alone(options)
        };
        let network = rig.network.as_deref();
        let go_on = &mut |_| ControlFlow::Continue(());
        let found = planner::identify(&observation, &options, network, go_on);
        found.context("identification")
    }
}

/// Frames of a motion's film: the paper's 400 at most.
fn timing_of(motion: &JointTrajectory) -> FilmTiming {
    let usual = FilmTiming::default();
    FilmTiming {
        frames: usual
            .frames
            .min((usual.rate_hz * motion.duration_s()) as usize),
        ..usual
    }
}
