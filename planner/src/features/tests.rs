use super::*;
use crate::ropes::random_rope;
use crate::synthetic::{FilmNoise, FilmTiming, KeypointLayout, film, side_camera};
use crate::wiggle::{WiggleConfig, wiggling_arm};
use arm_model::{JointTrajectory, Pole};
use nalgebra::{Matrix3, Vector3};
use rope_sim::PlannedArm;
use shared_types::{Intrinsics, RopeParams, Shutter};

/// Channels of a frame of 16 keypoints.
const CHANNELS: usize = 48;

fn arm() -> PlannedArm {
    wiggling_arm(&WiggleConfig::default()).unwrap()
}

/// A film of the hanging rope 2 under a wiggle.
fn film_of(config: &WiggleConfig, camera: &StereoCamera, noise: &FilmNoise) -> KeypointTrack {
    let (rope, arm) = (random_rope(2), wiggling_arm(config).unwrap());
    let filmed = film(&rope, &arm, camera, 16, &FilmTiming::default(), noise);
    filmed.unwrap().track
}

fn filmed(camera: &StereoCamera) -> KeypointTrack {
    film_of(&WiggleConfig::default(), camera, &FilmNoise::default())
}

fn look(
    definition: FeatureDefinition,
    track: &KeypointTrack,
    camera: &StereoCamera,
) -> Result<WiggleFeatures, ObserveError> {
    let plane = ViewPlane::of_motion(&arm(), 6.7).unwrap();
    observe(definition, track, Appearance::default(), camera, &plane)
}

fn features(track: &KeypointTrack, camera: &StereoCamera) -> WiggleFeatures {
    look(FeatureDefinition::default(), track, camera).unwrap()
}

fn farthest(a: &[f32], b: &[f32]) -> f32 {
    let pairs = a.iter().zip(b);
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
}

/// Another camera: nearer, from the other side, turned, other lens, global shutter.
fn other_camera() -> StereoCamera {
    let image = Intrinsics {
        fx: 520.0,
        fy: 515.0,
        cx: 480.0,
        cy: 260.0,
        distortion: [-0.05, 0.01, 1e-3, -1e-3, 0.0],
    };
    let towards = Vector3::new(0.1, -0.9, -0.1).normalize();
    let right = towards.cross(&Vector3::z()).normalize();
    StereoCamera {
        width_px: 960,
        height_px: 540,
        left: image,
        right: image,
        r_w_cam: Matrix3::from_columns(&[right, towards.cross(&right), towards]),
        p_w_cam_m: Vector3::new(0.6, 1.1, 0.1),
        shutter: Shutter::Global,
        line_time_s: 0.0,
        ..side_camera()
    }
}

#[test]
fn features_do_not_depend_on_the_camera() {
    let [a, b] = [side_camera(), other_camera()].map(|c| features(&filmed(&c), &c));
    assert_eq!(a.seen, 400);
    // What is left are the chords between frames, at different times.
    let worst = farthest(&a.motion, &b.motion);
    assert!(worst < 0.03, "{worst}");
    let rms = a.motion.iter().zip(&b.motion).map(|(a, b)| (a - b).powi(2));
    let rms = (rms.sum::<f32>() / a.motion.len() as f32).sqrt();
    assert!(rms < 2e-3, "{rms}");
}

#[test]
fn channels_are_positions_and_angles_of_the_hanging_rope() {
    let camera = side_camera();
    let rope = random_rope(2);
    let f = features(&filmed(&camera), &camera);
    let still = &f.motion[..CHANNELS];
    // Straight down: the last keypoint is the rope's length below the first.
    assert!((still[2 * 15 + 1] + rope.length_m as f32).abs() < 4e-3);
    for k in 1..16 {
        assert!(still[2 * k].abs() < 2e-3, "forward of {k}");
        let down = -rope.length_m as f32 * k as f32 / 15.0;
        assert!((still[2 * k + 1] - down).abs() < 4e-3, "height of {k}");
    }
    assert!(still[32..47].iter().all(|a| a.abs() < 0.02));
    assert!((still[47] - 1.0).abs() < 1e-6);
    // Angles follow from the positions in every frame.
    for frame in f.motion.chunks(CHANNELS).step_by(17) {
        let mut positions = frame[..32].to_vec();
        positions[..2].fill(0.0);
        for (k, pair) in positions.windows(4).step_by(2).enumerate() {
            let angle = (pair[2] - pair[0]).atan2(pair[1] - pair[3]);
            assert!((angle - frame[32 + k]).abs() < 1e-3);
        }
    }
    // The clamp sways about its mean.
    let clamp = f.motion.chunks(CHANNELS).map(|c| c[0]);
    let mean: f32 = clamp.clone().sum::<f32>() / 400.0;
    let most = clamp.fold(0.0, f32::max);
    assert!(mean.abs() < 1e-4 && most > 0.03, "{mean} {most}");
}

#[test]
fn what_was_not_seen_is_marked_and_short_gaps_are_bridged() {
    let camera = side_camera();
    let mut track = filmed(&camera);
    let whole = features(&track, &camera);
    for frame in &mut track.frames[100..130] {
        frame.lost = true;
    }
    track.frames[200].confidence[7] = 0.0;
    track.frames[210].confidence[15] = 0.0;
    track.frames[220].lost = true;
    let f = features(&track, &camera);
    let seen = |i: usize| f.motion[i * CHANNELS + 47] > 0.5;
    // Frames next to the gap may stand in for its ends.
    assert!((102..128).all(|i| !seen(i)) && seen(98) && seen(132));
    let lost = &f.motion[110 * CHANNELS..111 * CHANNELS];
    assert!(lost.iter().all(|x| *x == 0.0));
    assert!(seen(200) && seen(210) && seen(220));
    assert!(f.seen < 376 && f.seen >= 370, "{}", f.seen);
    for i in [200, 210, 220] {
        // The mean of the clamp is another one with frames missing.
        let range = i * CHANNELS + 2..i * CHANNELS + 47;
        let apart = farthest(&f.motion[range.clone()], &whole.motion[range]);
        assert!(apart < 0.02, "frame {i}: {apart}");
    }
}

#[test]
fn masking_blanks_whole_frames_and_counts_them() {
    let camera = side_camera();
    let mut f = features(&filmed(&camera), &camera);
    f.mask(10..20);
    f.mask(15..25);
    f.mask(395..500);
    assert_eq!(f.seen, 400 - 15 - 5);
    let blank = |frames: core::ops::Range<usize>| {
        let numbers = &f.motion[frames.start * CHANNELS..frames.end * CHANNELS];
        numbers.iter().all(|x| *x == 0.0)
    };
    assert!(blank(10..25) && !blank(25..26));
}

#[test]
fn angles_are_continuous_along_a_rope_thrown_over() {
    let camera = side_camera();
    let mut track = filmed(&camera);
    // A rope that curls once around: pixels on a circle that begins at the clamp.
    for frame in &mut track.frames {
        let [u, v] = frame.points[0];
        for (k, p) in frame.points.iter_mut().enumerate() {
            let angle = k as f64 / 15.0 * 5.5;
            *p = [u - 60.0 + 60.0 * angle.cos(), v + 60.0 * angle.sin()];
        }
    }
    let f = features(&track, &camera);
    let angles = &f.motion[32..47];
    for pair in angles.windows(2) {
        assert!((pair[1] - pair[0]).abs() < 0.6, "{angles:?}");
    }
    assert!((angles[14] - angles[0]).abs() > 4.0);
}

#[test]
fn useless_recordings_are_refused_with_the_reason() {
    let camera = side_camera();
    let good = filmed(&camera);
    let mut lost = good.clone();
    lost.frames[50..].iter_mut().for_each(|f| f.lost = true);
    let mut bad = good.clone();
    bad.frames[3].points.pop();
    let edge_on = StereoCamera {
        r_w_cam: Matrix3::new(0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0),
        p_w_cam_m: Vector3::new(-1.0, 0.0, 0.0),
        ..camera.clone()
    };
    let usual = WiggleConfig::default();
    let slow = WiggleConfig {
        frequency_hz: 1.0,
        ..usual
    };
    let small = WiggleConfig {
        amplitude_rad: usual.amplitude_rad * 0.6,
        ..usual
    };
    let [slow, small] = [slow, small].map(|w| film_of(&w, &camera, &FilmNoise::default()));
    for (name, track, camera, reason) in [
        ("lost", &lost, &camera, "the rope was seen in 50 of 400"),
        ("edge on", &good, &edge_on, "film it from the side"),
        ("a point too few", &bad, &camera, "frame 3"),
        ("slow", &slow, &camera, "film that wiggle"),
        ("small", &small, &camera, "film that wiggle"),
    ] {
        let refused = look(FeatureDefinition::default(), track, camera).unwrap_err();
        assert!(refused.to_string().contains(reason), "{name}: {refused}");
    }
    let hold = JointTrajectory::hold(arm_model::joint::START_POSE, 3.0).unwrap();
    let still = ViewPlane::of_motion(&PlannedArm::new(hold, Pole::default()), 3.0).unwrap_err();
    assert!(still.to_string().contains("moves 0.0 mm"), "{still}");
}

#[test]
fn widths_not_seen_are_marked() {
    let seen = Appearance {
        rope_radius_m: None,
        lead_radius_m: Some(0.02),
    };
    assert_eq!(widths(seen), [0.0, 0.0, 0.02, 1.0]);
}

#[test]
fn time_counts_from_the_wiggle_whenever_the_film_began() {
    let camera = side_camera();
    let noise = FilmNoise {
        padding_frames: 15,
        clock_offset_s: 0.007,
        ..FilmNoise::default()
    };
    let early = features(&film_of(&WiggleConfig::default(), &camera, &noise), &camera);
    let plain = features(&filmed(&camera), &camera);
    // The film that began early ends before the last frames.
    assert!((380..390).contains(&early.seen), "{}", early.seen);
    for i in (20..380).step_by(9) {
        let range = i * CHANNELS + 2..i * CHANNELS + 32;
        let apart = farthest(&early.motion[range.clone()], &plain.motion[range]);
        assert!(apart < 4e-3, "frame {i}: {apart}");
    }
}

#[test]
fn link_centres_show_how_many_links_there_are() {
    let (arm, camera) = (arm(), side_camera());
    let look_at = |keypoints, links| {
        let definition = FeatureDefinition {
            keypoints,
            points: ObservedPoints::LinkCentres,
            ..FeatureDefinition::default()
        };
        let rope = RopeParams {
            links,
            ..random_rope(2)
        };
        let (timing, noise) = (FilmTiming::default(), FilmNoise::white(2.0, 3));
        let layout = KeypointLayout::LinkCentres;
        let filmed = film(&rope, &arm, &camera, layout, &timing, &noise);
        look(definition, &filmed.unwrap().track, &camera)
    };
    for links in [21, 26] {
        let features = look_at(26, links).unwrap();
        let frame = &features.motion[100 * 78..101 * 78];
        let links = links as usize;
        // Places and angles of the links there are, and zeros for the others.
        assert!(frame[2..2 * links].iter().any(|x| x.abs() > 0.1));
        assert!(frame[2 * links..52].iter().all(|x| *x == 0.0));
        assert!(frame[52..51 + links].iter().all(|x| *x != 0.0));
        assert!(frame[51 + links..77].iter().all(|x| *x == 0.0));
        assert_eq!(frame[77], 1.0);
    }
    let refused = look_at(20, 21).unwrap_err().to_string();
    assert_eq!(refused, "21 link centres, but 2 to 20 are expected");
}
