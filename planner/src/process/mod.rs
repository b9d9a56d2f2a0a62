//! The planner process: collects published keypoints, answers `PlannerRpc`.
//!
//! One thread serves; identification and planning use the machine's other
//! threads. Progress is streamed after every generation; a caller that leaves
//! ends the work.

mod collect;
mod config;

use crate::calm::{CalmError, CalmRequest, calm};
use crate::observation::ObservedPoints;
use crate::phi::{HybridError, PhiNet, PredictError, identify_with_network};
use crate::sysid::{self, Appearance, FitProgress, IdentifyOptions, Observation};
use crate::tasks::{Belief, PlanError, PlanOptions, PlanRequest, plan_throw};
use arm_model::JointVector;
use collect::Collector;
pub use config::PlannerConfig;
use rope_sim::MeasuredArm;
use shared_types::ipc::message::{
    CalmOrder, IdentifyRequest, PlannerEvent, PlannerRequest, PlannerRpc, Progress, StrikeOrder,
};
use shared_types::ipc::rpc::{Call, RpcServer};
use shared_types::ipc::{Bus, IpcError};
use shared_types::{MonotonicNs, RopeEstimate, Task};
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// Why the process ended, or a request failed.
#[derive(Debug, thiserror::Error)]
pub enum PlannerProcessError {
    /// Shared memory failed.
    #[error(transparent)]
    Ipc(#[from] IpcError),
    /// The keypoints asked for never came.
    #[error(
        "{found} of {wanted} keypoint frames are here, the first stamped {first_stamp_ns} ns; track the recording first"
    )]
    MissingKeypoints {
        /// Frames found.
        found: usize,
        /// Frames asked for.
        wanted: usize,
        /// Stamp asked for (CLOCK_MONOTONIC, ns).
        first_stamp_ns: u64,
    },
    /// Measured joints are missing or wrong.
    #[error("measured joints: {0}")]
    Joints(#[from] rope_sim::MotionError),
    /// Identification failed.
    #[error(transparent)]
    Identify(#[from] sysid::IdentifyError),
    /// The network failed.
    #[error(transparent)]
    Network(#[from] PredictError),
    /// Planning a calming move failed.
    #[error(transparent)]
    Calm(#[from] CalmError),
    /// Planning a throw failed.
    #[error(transparent)]
    Plan(#[from] crate::tasks::PlanError),
}

/// Runs until `stop` is set.
///
/// # Errors
/// When shared memory cannot be used.
pub fn run(config: &PlannerConfig, stop: &AtomicBool) -> Result<(), PlannerProcessError> {
    let bus = Bus::join(&config.domain)?;
    let mut collector = Collector::open(&bus)?;
    let server = RpcServer::<PlannerRpc>::open(&bus)?;
    tracing::info!(domain = config.domain, "planner is ready");
    while !stop.load(Ordering::Relaxed) {
        collector.drain()?;
        match server.receive() {
            Ok(Some(call)) => serve(config, &mut collector, &call, stop),
            Ok(None) => std::thread::sleep(Duration::from_millis(5)),
            Err(e @ IpcError::Message { .. }) => tracing::warn!("{e}"),
            Err(e) => return Err(e.into()),
        }
    }
    Ok(())
}

fn serve(
    config: &PlannerConfig,
    collector: &mut Collector,
    call: &Call<PlannerRpc>,
    stop: &AtomicBool,
) {
    let result = match &call.request {
        PlannerRequest::Ping => Ok(PlannerEvent::Pong),
        PlannerRequest::Identify(request) => identify(config, collector, request, call, stop),
        PlannerRequest::Calm(order) => take_out_sway(config, order),
        PlannerRequest::Strike(order) => strike(config, order, call, stop),
    };
    let event = result.unwrap_or_else(|e| PlannerEvent::Failed {
        message: e.to_string(),
    });
    if let Err(e) = call.send(&event) {
        tracing::warn!("an answer was not delivered: {e}");
    }
}

/// Tells the caller how far the work is; breaks it off when nobody listens.
fn report(call: &Call<PlannerRpc>, stop: &AtomicBool, progress: Progress) -> ControlFlow<()> {
    let heard = call.send(&PlannerEvent::Progress(progress)).is_ok() && call.is_wanted();
    if heard && !stop.load(Ordering::Relaxed) {
        ControlFlow::Continue(())
    } else {
        ControlFlow::Break(())
    }
}

fn count(n: usize) -> u32 {
    u32::try_from(n).unwrap_or(u32::MAX)
}

fn identify(
    config: &PlannerConfig,
    collector: &mut Collector,
    request: &IdentifyRequest,
    call: &Call<PlannerRpc>,
    stop: &AtomicBool,
) -> Result<PlannerEvent, PlannerProcessError> {
    collector.drain()?;
    let track = collector.track(request.first_stamp_ns, request.frames)?;
    let epoch = MonotonicNs(request.first_stamp_ns);
    let (times_s, q): (Vec<f64>, Vec<JointVector>) = request
        .joints
        .iter()
        .map(|(t, q)| (MonotonicNs(*t).since_s(epoch), *q))
        .unzip();
    let motion = MeasuredArm::new(&times_s, &q, config.cell.pole)?;
    let appearance = request
        .appearance
        .map_or_else(Appearance::default, |a| Appearance {
            rope_radius_m: a.rope_radius_m,
            lead_radius_m: a.lead_radius_m,
        });
    let observation = Observation {
        track: &track,
        points: ObservedPoints::ArcLength,
        camera: &request.camera,
        motion: &motion,
        appearance,
    };
    let options = IdentifyOptions {
        seed: request.seed,
        lead_mass_kg: request.lead_mass_kg,
        ..config.identify
    };
    let estimate = fit(&observation, &options, &mut |p| {
        report(
            call,
            stop,
            Progress {
                done: count(p.generation),
                total: count(p.generations),
                value: p.residual_px,
                label: "residual px".to_owned(),
            },
        )
    })?;
    Ok(PlannerEvent::Identified(Box::new(estimate)))
}

/// The fit, from the built-in network's proposal where it has one.
fn fit(
    observation: &Observation<'_>,
    options: &IdentifyOptions,
    progress: &mut dyn FnMut(FitProgress) -> ControlFlow<()>,
) -> Result<RopeEstimate, PlannerProcessError> {
    match PhiNet::embedded() {
        Ok(net) => {
            let found = identify_with_network(&net, observation, options, progress);
            return found.map_err(|error| match error {
                HybridError::Identify(error) => error.into(),
                HybridError::Network(error) => error.into(),
            });
        }
        Err(error) => tracing::warn!(%error, "no network: a search proposes the rope"),
    }
    Ok(sysid::identify(observation, options, progress)?)
}

/// Times count from the first joint sample, at which the rope hangs still.
fn take_out_sway(
    config: &PlannerConfig,
    order: &CalmOrder,
) -> Result<PlannerEvent, PlannerProcessError> {
    let epoch = MonotonicNs(order.joints.first().map_or(order.start_ns, |(t, _)| *t));
    let (times_s, q) = order
        .joints
        .iter()
        .map(|(t, q)| (MonotonicNs(*t).since_s(epoch), *q))
        .unzip();
    let request = CalmRequest {
        rope: order.rope,
        times_s,
        q,
        start_s: MonotonicNs(order.start_ns).since_s(epoch),
        start_q: order.start_q,
        end_q: order.end_q,
        limits: order.limits.clone(),
        cell: config.cell,
    };
    let found = calm(&request, &config.calm)?;
    Ok(PlannerEvent::Calmed {
        trajectory: Box::new(found.trajectory),
        plain_sway_m: found.plain_sway_m,
        calm_sway_m: found.calm_sway_m,
    })
}

fn strike(
    config: &PlannerConfig,
    order: &StrikeOrder,
    call: &Call<PlannerRpc>,
    stop: &AtomicBool,
) -> Result<PlannerEvent, PlannerProcessError> {
    let task = config.task(Task::Strike, order.target_m);
    let request = PlanRequest {
        rope: order.rope,
        limits: order.limits.clone(),
        cell: config.cell,
        options: PlanOptions {
            seed: order.seed,
            ..config.search
        },
        belief: Belief::default(),
        following: None,
    };
    let mut generation = 0;
    let plan = plan_throw(&*task, &request, &mut |p| {
        generation = p.generation;
        report(
            call,
            stop,
            Progress {
                done: count(p.generation),
                total: count(p.generations),
                value: 100.0 * p.error_m,
                label: "best cm".to_owned(),
            },
        )
    })?;
    // Nobody waits for a throw that was broken off, and nobody may throw it by mistake.
    if plan.interrupted {
        return Err(PlanError::Cancelled { generation }.into());
    }
    let plan = plan.into_plan(Task::Strike, &*task, &request);
    Ok(PlannerEvent::Planned(Box::new(plan)))
}
