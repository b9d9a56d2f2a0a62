//! The planner as a process: collects published keypoints, answers [`PlannerRpc`] with
//! [`identify`](crate::identify()), [`plan`](crate::plan()) and
//! [`settle`](crate::settle()).
//!
//! One thread serves; identification and planning use the machine's other
//! threads. Progress is streamed with every generation, step or look into the library; a caller that leaves
//! ends the work.

mod collect;
mod message;

pub use message::{Declined, IdentifyRequest, PlannerEvent, PlannerRequest, PlannerRpc};

use crate::config::PlannerConfig;
use crate::observation::{Observation, ObservedPoints};
use crate::plan::PlanRequest;
use arm_model::JointVector;
use collect::Collector;
use rope_sim::MeasuredArm;
use shared_types::MonotonicNs;
use shared_types::ipc::message::Progress;
use shared_types::ipc::rpc::{Call, RpcServer};
use shared_types::ipc::{Bus, IpcError};
use std::error::Error;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// Runs until `stop` is set.
///
/// # Errors
/// When shared memory cannot be used.
pub fn run(config: &PlannerConfig, stop: &AtomicBool) -> Result<(), IpcError> {
    let bus = Bus::join(&config.domain)?;
    let mut collector = Collector::open(&bus)?;
    let server = RpcServer::<PlannerRpc>::open(&bus)?;
    tracing::info!(domain = config.domain, "planner is ready");
    while !stop.load(Ordering::Relaxed) {
        collector.drain()?;
        match server.receive() {
            Ok(Some(call)) => serve(&mut collector, &Client { call, stop }),
            Ok(None) => std::thread::sleep(Duration::from_millis(5)),
            Err(e @ IpcError::Message { .. }) => tracing::warn!("{e}"),
            Err(e) => return Err(e),
        }
    }
    Ok(())
}

/// An answer, or in one sentence why there is none.
type Answer = Result<PlannerEvent, Box<dyn Error>>;

/// Who asked, and whether to go on for them.
struct Client<'a> {
    call: Call<PlannerRpc>,
    stop: &'a AtomicBool,
}

impl Client<'_> {
    /// Reports how far the work is; interrupts it when nobody listens.
    fn report(&self, progress: Progress) -> ControlFlow<()> {
        let progress = PlannerEvent::Progress(progress);
        let received = self.call.send(&progress).is_ok() && self.call.is_wanted();
        if received && !self.stop.load(Ordering::Relaxed) {
            ControlFlow::Continue(())
        } else {
            ControlFlow::Break(())
        }
    }
}

fn serve(collector: &mut Collector, client: &Client<'_>) {
    let result = match &client.call.request {
        PlannerRequest::Ping => Ok(PlannerEvent::Pong),
        PlannerRequest::Identify(request) => identify(collector, request, client),
        PlannerRequest::Plan(request) => plan(request, client),
        PlannerRequest::Settle(request) => crate::settle(request, &mut |p| client.report(p))
            .map(|found| PlannerEvent::Settled(Box::new(found)))
            .map_err(Box::from),
    };
    let event = result.unwrap_or_else(|e| PlannerEvent::Failed {
        message: e.to_string(),
    });
    if let Err(e) = client.call.send(&event) {
        tracing::warn!("an answer was not delivered: {e}");
    }
}

fn identify(collector: &mut Collector, request: &IdentifyRequest, client: &Client<'_>) -> Answer {
    collector.drain()?;
    let track = collector.track(request.first_stamp_ns, request.frames)?;
    let epoch = MonotonicNs(request.first_stamp_ns);
    let (times_s, q): (Vec<f64>, Vec<JointVector>) = request
        .joints
        .iter()
        .map(|(t, q)| (MonotonicNs(*t).since_s(epoch), *q))
        .unzip();
    let motion = MeasuredArm::new(&times_s, &q, request.pole)
        .map_err(|e| format!("measured joints: {e}"))?;
    let observation = Observation {
        track: &track,
        points: ObservedPoints::ArcLength,
        camera: &request.camera,
        motion: &motion,
        appearance: request.appearance,
    };
    let estimate = crate::identify(&observation, &request.options, None, &mut |p| {
        client.report(p)
    })?;
    Ok(PlannerEvent::Identified(Box::new(estimate)))
}

fn plan(request: &PlanRequest, client: &Client<'_>) -> Answer {
    let mut generation = 0;
    let plan = crate::plan(request, &mut |p| {
        generation = p.done;
        client.report(p)
    })?;
    // Nobody waits for a throw that was interrupted, and nobody may throw it by mistake.
    if plan.interrupted {
        return Err(format!("planning was cancelled after generation {generation}").into());
    }
    Ok(PlannerEvent::Planned(Box::new(plan)))
}
