//! What begins and ends a search; ropes are in `hil-tests/tests/preview_rendered.rs`.

use super::*;
use arm_model::Pole;
use arm_model::joint::START_POSE;
use nalgebra::{Matrix3, Vector3};
use shared_types::{Intrinsics, Shutter};

const SIZE: [usize; 2] = [64, 48];
const FRAME_NS: u64 = 16_666_667;

fn preview() -> Preview {
    let image = Intrinsics {
        fx: 35.0,
        fy: 35.0,
        cx: 31.5,
        cy: 23.5,
        distortion: [0.0; 5],
    };
    let camera = StereoCamera {
        width_px: SIZE[0] as u32,
        height_px: SIZE[1] as u32,
        left: image,
        right: image,
        r_right_left: Matrix3::identity(),
        t_right_left_m: Vector3::new(0.063, 0.0, 0.0),
        r_w_cam: Matrix3::new(1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, -1.0, 0.0),
        p_w_cam_m: Vector3::new(0.7, -1.4, 0.3),
        shutter: Shutter::Global,
        exposure_s: 0.004,
        line_time_s: 0.0,
    };
    Preview::new(camera, Pole::default(), 21).unwrap()
}

/// The `index`-th frame of an empty wall.
fn wall(index: u64) -> ImageFrame {
    ImageFrame {
        stamp_ns: 1_000_000_000 + index * FRAME_NS,
        sequence: index,
        ..ImageFrame::grey(SIZE, 140)
    }
}

/// Shows frames of a wall under an arm whose joint 6 swings with this amplitude (rad) from
/// a second on; the index of the frame after which a search was due.
fn swing(preview: &mut Preview, amplitude_rad: f64, frames: u64) -> Option<(u64, Search)> {
    for index in 0..frames {
        let frame = wall(index);
        for part in 1..5 {
            let stamp_ns = frame.stamp_ns - FRAME_NS + part * FRAME_NS / 4;
            let since_s = (stamp_ns as f64 * 1e-9 - 2.0).max(0.0);
            let mut q = START_POSE;
            q[5] += amplitude_rad * since_s.min(1.0) * (7.0 * since_s).sin();
            preview.report(stamp_ns, &q);
        }
        assert_eq!(preview.see(frame).state(), PreviewState::Looking);
        if let Some(search) = preview.search() {
            return Some((index, search));
        }
    }
    None
}

#[test]
fn a_motion_from_rest_is_searched_and_nothing_else() {
    let (index, search) = swing(&mut preview(), 0.2, 600).unwrap();
    let searched_s = PERIOD_NS as f64 * 1e-9 * FRAMES as f64;
    let after_s = index as f64 / 60.0;
    assert!((after_s - 1.0 - searched_s).abs() < 1.2, "{after_s}");
    assert_eq!(search.frames.len(), FRAMES);
    let rest = search.motion.joints_at(0.0);
    let off_rad = (rest.q - START_POSE).max_abs();
    assert!(off_rad < 1e-4, "smoothed by {off_rad} rad");
    let mut standing = preview();
    assert!(swing(&mut standing, 0.0, 900).is_none());
    let Stage::Collecting(frames) = &standing.stage else {
        panic!("{:?}", standing.stage);
    };
    assert_eq!(frames.len(), 1, "copies are not kept");
    assert!(swing(&mut preview(), 0.02, 900).is_none(), "too little");
}

#[test]
fn an_answer_counts_if_nothing_began_anew_since_and_no_rope_is_none() {
    let mut preview = preview();
    let (index, search) = swing(&mut preview, 0.2, 600).unwrap();
    let answer = search.run();
    assert!(answer.found.is_err(), "there is no rope");
    let restarted = preview.see(ImageFrame {
        sequence: 0,
        ..wall(index + 1)
    });
    assert_eq!(restarted.restarts, 1);
    preview.take(answer);
    assert_eq!(preview.restarts, 1);
    let mut preview = super::tests::preview();
    let (_, search) = swing(&mut preview, 0.2, 600).unwrap();
    preview.take(search.run());
    assert_eq!(preview.restarts, 1);
    assert!(matches!(&preview.stage, Stage::Collecting(frames) if frames.is_empty()));
}

/// One that has seen `frames` frames of a wall under an arm that stands.
fn looking(frames: u64) -> Preview {
    let mut preview = preview();
    assert!(swing(&mut preview, 0.0, frames).is_none());
    preview
}

#[test]
fn without_a_camera_or_an_arm_it_waits_and_says_so() {
    let mut preview = preview();
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
    let again = preview.see(ImageFrame {
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
    let camera = preview.camera;
    assert!(Preview::new(camera, Pole::default(), 1).is_err());
}
