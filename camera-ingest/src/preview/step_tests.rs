//! The stepping logic on frames drawn from formulas.

use super::*;
use arm_model::Pole;
use arm_model::joint::START_POSE;
use nalgebra::{Matrix3, Vector3};
use shared_types::{Intrinsics, Shutter};

const WIDTH: usize = 672;
const HEIGHT: usize = 376;
const FRAME_NS: u64 = 16_666_667;
const NODES: usize = 41;
const LENGTH_M: f64 = 0.5;

fn camera() -> StereoCamera {
    let eye = Intrinsics {
        fx: 350.0,
        fy: 350.0,
        cx: 335.5,
        cy: 187.5,
        distortion: [0.0; 5],
    };
    StereoCamera {
        width_px: WIDTH as u32,
        height_px: HEIGHT as u32,
        left: eye,
        right: eye,
        r_right_left: Matrix3::identity(),
        t_right_left_m: Vector3::new(0.063, 0.0, 0.0),
        r_w_cam: Matrix3::new(1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, -1.0, 0.0),
        p_w_cam_m: Vector3::new(0.0, -0.95, 0.55),
        shutter: Shutter::Global,
        exposure_s: 0.004,
        line_time_s: 0.0,
    }
}

/// The `index`-th frame of an empty wall.
fn wall(index: u64) -> EyeFrame {
    let level = |i: usize| {
        let (u, v) = ((i % WIDTH) as f64, (i / WIDTH) as f64);
        (140.0 + 14.0 * (u / 31.0).sin() * (v / 23.0).cos()) as u8
    };
    EyeFrame {
        stamp_ns: 1_000_000_000 + index * FRAME_NS,
        sequence: index,
        luma: (0..WIDTH * HEIGHT).map(level).collect(),
        ..EyeFrame::grey([WIDTH, HEIGHT], 0)
    }
}

/// Paints a disc of one colour.
fn dot(frame: &mut EyeFrame, [u, v]: [f64; 2], radius_px: f64, ycc: [u8; 3]) {
    let span = |x: f64, n: usize| {
        let at = |x: f64| (x.max(0.0) as usize).min(n - 1);
        at(x - radius_px)..=at(x + radius_px + 1.0)
    };
    for y in span(v, HEIGHT) {
        for x in span(u, WIDTH) {
            if (x as f64 - u).hypot(y as f64 - v) <= radius_px {
                frame.luma[y * WIDTH + x] = ycc[0];
                frame.cb[y * (WIDTH / 2) + x / 2] = ycc[1];
                frame.cr[y * (WIDTH / 2) + x / 2] = ycc[2];
            }
        }
    }
}

/// A rope on a clamp that swings from `still_s` on.
struct Swing {
    still_s: f64,
    /// Of the clamp away from the camera (m).
    away_m: f64,
    hidden: bool,
}

impl Swing {
    fn clamp(&self, t_s: f64) -> Vector3<f64> {
        let since_s = (t_s - self.still_s).max(0.0);
        Vector3::new(0.04 * (5.0 * since_s).sin(), self.away_m, 0.85)
    }

    /// The frame, and where the rope is in it.
    fn frame(&self, index: u64) -> (EyeFrame, Vec<[f64; 2]>) {
        let t_s = index as f64 * FRAME_NS as f64 * 1e-9;
        let since_s = (t_s - self.still_s).max(0.0);
        let mut p = self.clamp(t_s);
        let mut nodes = vec![p];
        for i in 1..NODES {
            let part = (i as f64 - 0.5) / (NODES - 1) as f64;
            let angle = 0.5 * part * (5.0 * since_s - 0.8 * part).sin() * since_s.min(1.0);
            p += Vector3::new(angle.sin(), 0.0, -angle.cos()) * (LENGTH_M / (NODES - 1) as f64);
            nodes.push(p);
        }
        let camera = camera();
        let pixels: Vec<[f64; 2]> = nodes
            .iter()
            .map(|p| camera.project_left(p).unwrap())
            .collect();
        let mut frame = wall(index);
        if !self.hidden {
            for pair in pixels.windows(2) {
                for k in 0..8 {
                    let s = f64::from(k) / 8.0;
                    let at = [0, 1].map(|c| pair[0][c] + s * (pair[1][c] - pair[0][c]));
                    dot(&mut frame, at, 2.2, [70, 90, 200]);
                }
            }
            dot(&mut frame, pixels[NODES - 1], 7.5, [200, 60, 110]);
        }
        (frame, pixels)
    }
}

/// A report of the clamp.
fn hold(preview: &mut Preview, stamp_ns: u64, clamp: Vector3<f64>) {
    preview.arm.put(Knot::new(stamp_ns, clamp, Vector3::z()));
}

/// Mean distance of the keypoints from the true rope (px).
fn off_px(found: &PreviewFrame, truth: &[[f64; 2]]) -> f64 {
    let step = (NODES - 1) / (found.rope.points().len() - 1);
    let pairs = found.rope.points().iter().zip(truth.iter().step_by(step));
    let off = pairs.map(|(p, t)| (f64::from(p[0]) - t[0]).hypot(f64::from(p[1]) - t[1]));
    off.sum::<f64>() / found.rope.points().len() as f64
}

/// Shows the frames of a swing; the message of the last one, and the errors of all in
/// which the rope was followed.
fn show(
    preview: &mut Preview,
    swing: &Swing,
    frames: core::ops::Range<u64>,
) -> (PreviewFrame, Vec<f64>) {
    let (mut last, mut off) = (preview.without_camera(), Vec::new());
    for index in frames {
        let (frame, truth) = swing.frame(index);
        let seen_s = index as f64 * FRAME_NS as f64 * 1e-9 + 0.002;
        hold(preview, frame.stamp_ns + 2_000_000, swing.clamp(seen_s));
        last = preview.see(frame);
        if last.state() == PreviewState::Following && !last.rope.is_lost() {
            off.push(off_px(&last, &truth));
        }
    }
    (last, off)
}

#[test]
fn a_swinging_rope_is_followed_found_where_the_arm_goes_and_given_up_when_it_is_gone() {
    let mut preview = Preview::new(camera(), Pole::default(), 21).unwrap();
    let mut swing = Swing {
        still_s: 0.5,
        away_m: 0.0,
        hidden: false,
    };
    let (last, off) = show(&mut preview, &swing, 0..150);
    assert_eq!(last.state(), PreviewState::Following);
    assert_eq!((last.seen, last.skipped, last.restarts), (150, 0, 0));
    assert_eq!(last.rope.count, 21);
    assert!(off.len() > 60, "{} frames followed", off.len());
    let most = off.iter().copied().fold(0.0, f64::max);
    assert!(most < 2.0, "{most} px off");
    // The arm turns: the rope swings in another plane, nearer to the wall.
    for _ in 0..30 {
        swing.away_m += 0.003;
        let next = preview.seen;
        show(&mut preview, &swing, next..next + 1);
    }
    let (last, off) = show(&mut preview, &swing, 180..240);
    assert_eq!(last.state(), PreviewState::Following);
    assert!(last.restarts >= 1 && off.len() > 20, "{last:?}");
    assert!(off[off.len() - 1] < 2.0, "{off:?}");
    // Somebody takes it off.
    let before = last.restarts;
    swing.hidden = true;
    let (gone, _) = show(&mut preview, &swing, 240..270);
    assert_eq!((gone.state(), gone.rope.lost), (PreviewState::Following, 1));
    let (gone, _) = show(&mut preview, &swing, 270..460);
    assert_eq!(gone.restarts, before + 1);
    assert_eq!((gone.state(), gone.rope.count), (PreviewState::Looking, 0));
}

#[test]
fn frames_left_out_are_counted_and_do_not_stop_it() {
    let mut preview = Preview::new(camera(), Pole::default(), 21).unwrap();
    let swing = Swing {
        still_s: 0.5,
        away_m: 0.0,
        hidden: false,
    };
    show(&mut preview, &swing, 0..120);
    // Half a second in which it did not run, then every third frame; reports wait.
    for index in 120..150 {
        let stamp_ns = wall(index).stamp_ns;
        hold(
            &mut preview,
            stamp_ns,
            swing.clamp((stamp_ns - 1_000_000_000) as f64 * 1e-9),
        );
    }
    for index in (150..300).step_by(3) {
        show(&mut preview, &swing, index..index + 1);
    }
    let (last, off) = show(&mut preview, &swing, 300..301);
    assert_eq!((last.seen, last.skipped), (171, 130));
    assert_eq!(
        (last.state(), last.restarts, last.rope.lost),
        (PreviewState::Following, 0, 0)
    );
    assert!(off[0] < 3.0, "{off:?}");
}

/// One that has seen `frames` frames of a wall under an arm that stands.
fn looking(frames: u64) -> Preview {
    let mut preview = Preview::new(camera(), Pole::default(), 21).unwrap();
    for index in 0..frames {
        let frame = wall(index);
        preview.report(frame.stamp_ns, &START_POSE);
        assert_eq!(preview.see(frame).state(), PreviewState::Looking);
    }
    preview
}

#[test]
fn without_a_camera_or_an_arm_it_waits_and_says_so() {
    let mut preview = Preview::new(camera(), Pole::default(), 21).unwrap();
    assert_eq!(preview.without_camera().state(), PreviewState::NoCamera);
    let found = preview.see(wall(0));
    assert_eq!((found.state(), found.seen), (PreviewState::NoArm, 1));
    assert_eq!(
        (found.rope.sequence, found.rope.stamp_ns),
        (0, wall(0).stamp_ns),
        "a frame that was looked at is named"
    );
    preview.report(wall(1).stamp_ns, &START_POSE);
    assert_eq!(preview.see(wall(1)).state(), PreviewState::Looking);
    // The controller ends: for a moment the arm stands where it stood.
    assert_eq!(preview.see(wall(2)).state(), PreviewState::Looking);
    let gone = preview.see(wall(30));
    assert_eq!((gone.state(), gone.restarts), (PreviewState::NoArm, 1));
    assert_eq!(preview.see(wall(31)).restarts, 1, "once is enough");
    // The next one comes.
    preview.report(wall(32).stamp_ns, &START_POSE);
    assert_eq!(preview.see(wall(32)).state(), PreviewState::Looking);
}

#[test]
fn a_camera_that_begins_anew_or_pauses_and_an_arm_that_jumps_are_noticed() {
    let mut preview = looking(5);
    preview.report(wall(3).stamp_ns + 1, &START_POSE);
    let again = preview.see(EyeFrame {
        sequence: 0,
        ..wall(6)
    });
    assert_eq!((again.restarts, again.skipped), (1, 0));
    let mut preview = looking(5);
    let late = 4 + 62;
    preview.report(wall(late).stamp_ns, &START_POSE);
    let paused = preview.see(wall(late));
    assert_eq!((paused.restarts, paused.skipped), (1, 61));
    let mut preview = looking(5);
    let mut elsewhere = START_POSE;
    elsewhere[0] += 0.3;
    preview.report(wall(5).stamp_ns, &elsewhere);
    let jumped = preview.see(wall(5));
    assert_eq!(
        (jumped.state(), jumped.restarts),
        (PreviewState::Looking, 1)
    );
}

#[test]
fn frames_of_another_camera_are_said_to_be_unfit_and_end_with_the_next_that_fits() {
    let mut preview = looking(3);
    let mut narrow = wall(3);
    narrow.width_px /= 2;
    assert_eq!(preview.see(narrow).state(), PreviewState::Unfit);
    assert_eq!(preview.unfit(4, wall(4).stamp_ns).restarts, 1);
    assert_eq!(preview.see(wall(5)).state(), PreviewState::Looking);
    assert!(Preview::new(camera(), Pole::default(), 1).is_err());
}
