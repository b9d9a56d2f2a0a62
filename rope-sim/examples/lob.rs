//! Lobs the lead onto a board with a domino on it, many times a little differently, in
//! single and in double precision, and prints what came of it.

use arm_model::kinematics::FrameMotion;
use nalgebra::Vector3;
use rope_sim::{
    AttachMotion, Candidate, Domino, FrameTimes, Obstacle, Outcome, Precision, Rollout, Scene,
    SimOptions, SimulateError, Start, Watch, roll_out_in,
};
use shared_types::RopeParams;

/// Middle of the board's upper face (m).
const TARGET_M: [f64; 3] = [0.85, 0.0, 0.20];
const THROWS: u32 = 64;
const LEAD_RADIUS_M: f64 = 0.02;
/// Rest between the strokes, while the lead swings forth (s).
const LOWER_AFTER_S: f64 = 0.15;

/// Board on a column, with the domino on the robot's side of the target.
fn scene() -> Scene {
    let [x, y, z] = TARGET_M;
    let below_board_m = [x, y, z - 0.01];
    Scene {
        obstacles: vec![
            Obstacle::box_below(TARGET_M, [0.30, 0.40, 0.01], 0.6),
            Obstacle::column_below(below_board_m, 0.02, 0.94, 0.6),
            Obstacle::floor(-0.75, 0.6),
        ],
        domino: Some(Domino {
            foot_m: [x - 0.06, y, z],
            facing_rad: 0.0,
            thickness_m: 0.008,
            width_m: 0.025,
            height_m: 0.050,
            mass_kg: 0.010,
            friction: 0.4,
        }),
    }
}

/// Swings the rope forth, then lowers it, in smooth strokes.
struct Lob {
    forth_m: f64,
    forth_s: f64,
    down_m: f64,
    down_s: f64,
}

/// Way, speed and acceleration of a stroke at rest before and after.
fn stroke(way: f64, duration_s: f64, t_s: f64) -> [f64; 3] {
    let w = core::f64::consts::TAU / duration_s;
    let t = t_s.clamp(0.0, duration_s);
    let (s, c) = (w * t).sin_cos();
    let speed = way / duration_s;
    [speed * (t - s / w), speed * (1.0 - c), speed * w * s]
}

impl AttachMotion for Lob {
    fn at(&self, t_s: f64) -> FrameMotion {
        let x = stroke(self.forth_m, self.forth_s, t_s);
        let z = stroke(
            -self.down_m,
            self.down_s,
            t_s - self.forth_s - LOWER_AFTER_S,
        );
        FrameMotion {
            p_m: Vector3::new(0.30 + x[0], 0.0, 0.85 + z[0]),
            v_m_s: Vector3::new(x[1], 0.0, z[1]),
            a_m_s2: Vector3::new(x[2], 0.0, z[2]),
            ..FrameMotion::world()
        }
    }
    fn duration_s(&self) -> f64 {
        self.forth_s + LOWER_AFTER_S + self.down_s
    }
    fn acceleration_jumps_s(&self) -> Vec<f64> {
        Vec::new()
    }
}

fn on_board(run: &Rollout) -> bool {
    let tip = run.nodes.position(1, 22) - Vector3::from(TARGET_M);
    tip.x.abs() < 0.15 && tip.y.abs() < 0.20 && (0.0..0.05 + LEAD_RADIUS_M).contains(&tip.z)
}

fn throw(precision: Precision, throws: &[Lob]) -> Result<Vec<Rollout>, SimulateError> {
    let rope = RopeParams::from_array([
        22.0,
        0.55,
        0.01,
        0.05,
        0.005,
        0.04,
        0.03,
        LEAD_RADIUS_M,
        0.8,
    ]);
    let candidates: Vec<Candidate> = throws.iter().map(|t| Candidate::new(&rope, t)).collect();
    let options = SimOptions {
        step_s: 5e-4,
        precision,
        start: Start::Equilibrium,
        frames: FrameTimes {
            first_s: 0.0,
            period_s: 4.0,
            count: 2,
        },
        watch: Watch::default(),
        horizon_s: 4.0,
        threads: 2,
    };
    roll_out_in(&scene(), &candidates, &options)
}

fn main() -> Result<(), SimulateError> {
    let throws: Vec<Lob> = (0..THROWS)
        .map(|i| Lob {
            forth_m: 0.28 + 0.01 * f64::from(i % 8),
            forth_s: 0.45 + 0.02 * f64::from(i / 8),
            down_m: 0.27,
            down_s: 0.3,
        })
        .collect();
    for precision in [Precision::F32, Precision::F64] {
        let runs = throw(precision, &throws)?;
        let count = |what: fn(&Rollout) -> bool| runs.iter().filter(|r| what(r)).count();
        let down = count(|r| r.domino.is_some_and(|d| d.down_at_s.is_some()));
        let peak_n = runs.iter().flat_map(|r| &r.contacts);
        let deepest_m = peak_n.fold(0.0_f64, |m, c| m.max(c.greatest_penetration_m));
        println!(
            "{precision:?}: of {THROWS} throws {} as asked, domino down {down}, lead left on the \
             board {}, board touched {}, deepest {:.2} mm",
            count(|r| r.outcome == Outcome::Clean),
            count(on_board),
            count(|r| r.contacts[0].touched()),
            1e3 * deepest_m,
        );
    }
    Ok(())
}
