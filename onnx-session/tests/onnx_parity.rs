//! The shipped networks as `planner::phi` computes them, against an ONNX runtime that
//! nobody here wrote.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    reason = "tests may fail loudly"
)]

#[path = "../../hil-tests/support/missing.rs"]
mod missing;

use arm_model::Pole;
use planner::features::{WIDTHS, WiggleFeatures};
use planner::observation::{Observation, ObservedPoints};
use planner::phi::{INPUTS, OUTPUTS, PARITY, PhiNet, difference};
use planner::ropes::random_rope;
use planner::synthetic::{FilmNoise, FilmTiming, KeypointLayout, film, side_camera};
use planner::wiggle::wiggle;
use rope_sim::PlannedArm;
use std::path::Path;

/// What the network sees of simulated ropes on its wiggle, one film with frames unseen.
fn films(net: &PhiNet) -> Vec<WiggleFeatures> {
    let wiggle = wiggle(&net.metadata().wiggle, &arm_model::Limits::default()).unwrap();
    let (motion, camera) = (PlannedArm::new(wiggle, Pole::default()), side_camera());
    let points = net.metadata().features.points;
    let layout = match points {
        ObservedPoints::ArcLength => KeypointLayout::Uniform(24),
        ObservedPoints::LinkCentres => KeypointLayout::LinkCentres,
    };
    let seen = |seed| {
        let noise = FilmNoise::white(1.0, seed);
        let timing = FilmTiming::default();
        let filmed = film(
            &random_rope(seed),
            &motion,
            &camera,
            layout,
            &timing,
            &noise,
        )
        .unwrap();
        net.see(&Observation {
            track: &filmed.track,
            points,
            camera: &camera,
            motion: &motion,
            appearance: filmed.appearance,
        })
        .unwrap()
    };
    let mut films: Vec<WiggleFeatures> = (1..5).map(seen).collect();
    films[1].mask(100..160);
    films[2].widths = [0.0; WIDTHS];
    films
}

#[test]
fn the_shipped_networks_give_what_an_onnx_runtime_gives() {
    if missing::named(onnx_session::LIBRARY, "ONNX Runtime library").is_none() {
        return;
    }
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs/models");
    for file in ["phi-nn.onnx", "phi-nn-links.onnx"] {
        let bytes = std::fs::read(folder.join(file)).unwrap();
        let net = PhiNet::from_bytes(file, &bytes).unwrap();
        let mut session = onnx_session::open(&bytes).unwrap();
        for film in films(&net) {
            let found = net.run(&film).unwrap();
            let shape = [1, film.definition.frames, film.definition.channels()];
            let inputs: [onnx_session::Input<'_>; 2] = [
                (INPUTS[0], &shape, &film.motion),
                (INPUTS[1], &[1, WIDTHS], &film.widths),
            ];
            let expected = onnx_session::outputs(&mut session, inputs, OUTPUTS).unwrap();
            let found = [
                found.mean,
                found.log_variance,
                found.embedding,
                vec![found.out_of_distribution],
            ];
            for ((expected, found), output) in expected.iter().zip(&found).zip(OUTPUTS) {
                let off = difference(expected, found);
                println!("{file}: {output} off by {off:.1e}");
                assert!(off <= PARITY, "{file}: {output} off by {off:.1e}");
            }
        }
    }
}
