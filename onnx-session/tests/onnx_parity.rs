//! The shipped networks as `planner::phi` computes them, against an ONNX runtime that
//! nobody here wrote.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    reason = "tests may fail loudly"
)]

use planner::observation::{WIDTHS, WiggleFeatures};
use planner::phi::{INPUTS, OUTPUTS, PARITY, PhiNet, difference, probe};
use std::path::Path;

/// The test input, and the same with other frames and widths unseen and numbers moved.
fn films(net: &PhiNet) -> Vec<WiggleFeatures> {
    let first = probe(net.metadata().features);
    let channels = first.definition.channels();
    let mut films = vec![first];
    for film in 1..6_u16 {
        let mut next = films[0].clone();
        let phase = f32::from(film);
        for (i, frame) in next.motion.chunks_mut(channels).enumerate() {
            let seen = frame[channels - 1];
            for x in &mut frame[..channels - 1] {
                *x = seen * (*x * 0.6 + 0.1 * (0.05 * phase * i as f32).sin());
            }
        }
        next.mask(30 * usize::from(film)..30 * usize::from(film) + 60);
        next.widths = [0.004 + 0.001 * phase, 1.0, 0.0, 0.0];
        films.push(next);
    }
    films
}

#[test]
fn the_shipped_networks_give_what_an_onnx_runtime_gives() {
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
                vec![found.oddity],
            ];
            for ((expected, found), output) in expected.iter().zip(&found).zip(OUTPUTS) {
                let off = difference(expected, found);
                println!("{file}: {output} off by {off:.1e}");
                assert!(off <= PARITY, "{file}: {output} off by {off:.1e}");
            }
        }
    }
}
