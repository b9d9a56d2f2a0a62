//! `wag identify`: rope parameters from a video or from keypoints.

use super::film_input::{FilmInput, named_motion};
use super::learned::Learned;
use super::network::{network, no_model_without_network};
use super::plan::LOOK;
use super::track::{overlay, track_video};
use crate::cli::IdentifyArgs;
use crate::config;
use anyhow::Context;
use camera_ingest::load_camera;
use cli_output::{Failure, OrInput, Outcome, Stage};
use planner::PlannerConfig;
use planner::identify::{IdentifyOptions, Method};
use planner::observation::{Appearance, Observation, ObservedPoints};
use planner::phi::PhiNet;
use rope_sim::AttachMotion;
use run_log::{ClampMotion, Run, confirm, files};
use serde_json::{Value, json};
use shared_types::rope::{Ambiguity, RANGES};
use shared_types::{KeypointTrack, RopeEstimate, RopeParams, StereoCamera};
use std::path::Path;

/// Keypoints per frame when a video is given.
const KEYPOINTS: usize = 24;

/// Keypoints, what the picture says of sizes, the camera and the clamp's motion.
struct Observed {
    track: KeypointTrack,
    appearance: Appearance,
    camera: StereoCamera,
    motion: Box<dyn AttachMotion>,
    warnings: Vec<String>,
}

impl Observed {
    /// What a run keeps of its tracked wiggle.
    fn of_run(
        folder: &Path,
        camera: Option<&Path>,
        (method, accepted): (Method, bool),
    ) -> Outcome<Self> {
        let run = Run::open(folder).or_input()?;
        let kept = run.folder().join(files::CAMERA);
        let camera = load_camera(camera.unwrap_or(&kept)).or_input()?;
        let film = run.tracked_film().or_input()?;
        let pole = config::cell_of(&run).or_input()?.pole;
        let clamp = ClampMotion::new(folder, Some(film.joints), pole, 0.0);
        let film_s = film.track.frames.last().map_or(0.0, |frame| frame.t_s);
        clamp.check_covers(film_s).or_input()?;
        let look = format!("look at `{}`", folder.join("wiggle.png").display());
        confirm(&film.track.unconfirmed, accepted, &look).or_failed()?;
        let [rope_radius_m, lead_radius_m] = film.radii_m;
        let observed = Self {
            appearance: Appearance {
                rope_radius_m,
                lead_radius_m,
            },
            track: film.track,
            camera,
            motion: clamp.attach().or_input()?,
            warnings: other_pole(&clamp, method).into_iter().collect(),
        };
        observed.warn();
        Ok(observed)
    }

    /// Tells a person what is poor about it.
    fn warn(&self) {
        for warning in &self.warnings {
            eprintln!("warning: {warning}");
        }
    }

    /// The rope behind it.
    fn estimate(
        &self,
        options: &IdentifyOptions,
        net: Option<&PhiNet>,
        stage: &Stage,
    ) -> Outcome<RopeEstimate> {
        let observation = Observation {
            track: &self.track,
            points: ObservedPoints::ArcLength,
            camera: &self.camera,
            motion: self.motion.as_ref(),
            appearance: self.appearance,
        };
        planner::identify(&observation, options, net, &mut |p| stage.go_on(&p))
            .map_err(|error| Failure::of(error.is_input(), error))
    }
}

/// What to know about the pole, where a network is asked.
fn other_pole(motion: &ClampMotion, method: Method) -> Option<String> {
    method.warning_of_pole(motion.pole()?).map(str::to_owned)
}

fn read_keypoints(path: &Path) -> anyhow::Result<KeypointTrack> {
    let fail = || {
        format!(
            "`{}` is not keypoints (JSON, as `wag track` writes them)",
            path.display()
        )
    };
    let track: KeypointTrack = serde_json::from_str(&files::read_text(path)?).with_context(fail)?;
    track.validate().with_context(fail)?;
    Ok(track)
}

fn observe(args: &IdentifyArgs, method: Method) -> Outcome<Observed> {
    if let Some(path) = &args.observation.keypoints {
        if path.is_dir() {
            if args.scene.motion.is_given() || args.scene.film_late_ms != 0.0 {
                return Err(bad_input!(
                    "`{}` is a run, which tells its motion itself: leave out --joints, --pose and --film-late-ms",
                    path.display()
                ));
            }
            let camera = args.scene.camera.as_deref();
            return Observed::of_run(path, camera, (method, args.accept_unconfirmed));
        }
        let camera = args.scene.camera().or_input()?;
        let clamp = named_motion(&args.scene).or_input()?;
        let motion = clamp.attach().or_input()?;
        let track = read_keypoints(path).or_input()?;
        let film_s = track.frames.last().map_or(0.0, |frame| frame.t_s);
        clamp.check_covers(film_s).or_input()?;
        confirm(&track.unconfirmed, args.accept_unconfirmed, LOOK).or_failed()?;
        let observed = Observed {
            track,
            appearance: Appearance::default(),
            camera,
            motion,
            warnings: other_pole(&clamp, method).into_iter().collect(),
        };
        observed.warn();
        return Ok(observed);
    }
    let Some(video) = &args.observation.video else {
        return Err(bad_input!(
            "name the observation with --video or --keypoints"
        ));
    };
    let mut filmed = FilmInput::open(video, args.fps, &args.scene)?;
    filmed.warnings.extend(other_pole(&filmed.motion, method));
    filmed.warn();
    // Before the long work: what the simulator needs of the motion.
    let motion = filmed.motion.attach().or_input()?;
    let stage = Stage::begin("track");
    let file = args.scene.camera.as_deref();
    let mut learned = Learned::load(None, file)?;
    let (frames, result) = track_video(&mut filmed, &mut learned, KEYPOINTS, &stage)?;
    stage.done(&format!("{} frames", frames.len()));
    if !result.track.unconfirmed.is_empty() {
        let sheet = args.out.with_extension("track.png");
        let picture = overlay(&sheet, &frames, &result.track).or_failed()?;
        files::write_atomic(&sheet, &picture).or_failed()?;
        let look = format!("look at `{}`", sheet.display());
        confirm(&result.track.unconfirmed, args.accept_unconfirmed, &look).or_failed()?;
    }
    let appearance = Appearance {
        rope_radius_m: Some(result.appearance.rope_radius_m),
        lead_radius_m: Some(result.appearance.lead_radius_m),
    };
    Ok(Observed {
        track: result.track,
        appearance,
        camera: filmed.camera,
        motion,
        warnings: filmed.warnings,
    })
}

/// What the film leaves open, in words: a parameter, or a combination of some.
fn in_words(ambiguity: &Ambiguity) -> String {
    const PART: f64 = 0.3;
    let parts: Vec<String> = RANGES
        .iter()
        .zip(ambiguity.direction)
        .filter(|(_, part)| part.abs() > PART)
        .map(|(range, part)| format!("{}{}", if part < 0.0 { "-" } else { "+" }, range.label))
        .collect();
    match parts.as_slice() {
        [one] => format!("{} cannot be identified from this film", &one[1..]),
        _ => format!("this film cannot separate {}", parts.join(" ")),
    }
}

/// What a rope has beyond the nine parameters, in words.
fn beyond_in_words(rope: &RopeParams) -> Option<String> {
    let extras = rope.extras?;
    let [x, y, _] = extras.rest_curvature_per_m;
    let held =
        extras.friction.map_or(0.0, |f| f.moment_max_nm) / rope.bending_stiffness_nm2().max(1e-12);
    let (curvature, clamp) = (x.hypot(y), extras.clamp_stiffness);
    Some(format!(
        "the film shows more than the nine parameters: a rest curvature of {curvature:.2} rad/m, friction that holds {held:.2} rad/m, a clamp {clamp:.1} times as stiff as a joint"
    ))
}

/// What a person should know beside the numbers.
fn print_remarks(estimate: &RopeEstimate) {
    for warning in &estimate.warnings {
        eprintln!("warning: {warning}");
    }
    if let Some(beyond) = beyond_in_words(&estimate.params) {
        println!("{beyond}");
    }
    for ambiguity in &estimate.posterior.ambiguities {
        println!("{}", in_words(ambiguity));
    }
    if estimate.out_of_distribution.is_flagged() {
        println!(
            "the rope is outside the known ranges (score {:.1}, limit {:.1}): {}",
            estimate.out_of_distribution.score,
            estimate.out_of_distribution.limit,
            estimate.out_of_distribution.reasons.join("; ")
        );
    }
    if estimate.method.as_str() == planner::identify::WIDE {
        println!("it was fitted again, by a search without ranges");
    } else if estimate.out_of_distribution.is_flagged() {
        println!("--method hybrid fits it again by a search without ranges");
    }
}

/// The rope of a run whose wiggle was tracked, identified again, and why its track should not be
/// relied on.
pub fn again(
    run: &Path,
    options: &IdentifyOptions,
    accept_unconfirmed: bool,
) -> Outcome<(RopeEstimate, Vec<String>)> {
    let method = options.method;
    let net = method.asks_network().then(|| network(None)).transpose()?;
    let observed = Observed::of_run(run, None, (method, accept_unconfirmed))?;
    let stage = Stage::begin("identify");
    let estimate = observed.estimate(options, net.as_ref(), &stage)?;
    stage.done(&format!("residual {:.2} px", estimate.residual_px));
    Ok((estimate, observed.track.unconfirmed))
}

pub fn run(args: &IdentifyArgs) -> Outcome<Option<Value>> {
    let (method, model) = (args.method, args.model.as_deref());
    no_model_without_network(method, model)?;
    let net = method.asks_network().then(|| network(model)).transpose()?;
    let config = config::here::<PlannerConfig>(None).or_input()?;
    cli_output::watch_interrupts().or_failed()?;
    let observed = observe(args, method)?;
    let stage = Stage::begin("identify");
    let options = IdentifyOptions {
        method,
        seed: args.seed,
        lead_mass_kg: args.lead_mass,
        length_m: args.length,
        ..config.identify
    };
    let estimate = observed.estimate(&options, net.as_ref(), &stage)?;
    let seconds = stage.done(&format!(
        "residual {:.2} px, {} simulations",
        estimate.residual_px, estimate.simulations
    ));
    files::write_rope_estimate(&args.out, &estimate, &observed.track.unconfirmed).or_failed()?;
    println!(
        "{}\nresidual {:.2} px -> `{}`",
        run_log::parameter_table(&estimate, None),
        estimate.residual_px,
        args.out.display()
    );
    print_remarks(&estimate);
    Ok(Some(json!({
        "ok": true, "command": "identify", "out": args.out, "seconds": seconds,
        "rope": estimate.params, "std_dev": estimate.std_dev, "residual_px": estimate.residual_px,
        "simulations": estimate.simulations, "time_offset_s": estimate.time_offset_s,
        "method": estimate.method, "posterior": estimate.posterior,
        "circumstances": estimate.circumstances, "warnings": ([observed.warnings, estimate.warnings].concat()),
        "unconfirmed": observed.track.unconfirmed,
        "out_of_distribution": estimate.out_of_distribution,
        "out_of_distribution_score": estimate.out_of_distribution.score,
    })))
}
