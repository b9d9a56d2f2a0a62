use super::*;
use crate::ropes::random_rope;
use crate::synthetic::{FilmNoise, FilmTiming, KeypointLayout, film, side_camera};
use crate::wiggle::{WiggleConfig, wiggle};
use arm_model::{JointTrajectory, Limits, Pole};
use nalgebra::{Matrix3, Vector3};
use rope_sim::PlannedArm;
use shared_types::{Intrinsics, RopeParams, Shutter};

fn arm() -> PlannedArm {
    PlannedArm::new(
        wiggle(&WiggleConfig::default(), &Limits::default()).unwrap(),
        Pole::default(),
    )
}

fn filmed(camera: &StereoCamera) -> KeypointTrack {
    let noise = FilmNoise::default();
    film(
        &random_rope(2),
        &arm(),
        camera,
        16,
        &FilmTiming::default(),
        &noise,
    )
    .unwrap()
    .track
}

fn features(track: &KeypointTrack, camera: &StereoCamera) -> WiggleFeatures {
    let plane = ViewPlane::of_motion(&arm(), 6.7).unwrap();
    observe(
        FeatureDefinition::default(),
        track,
        Appearance::default(),
        camera,
        &plane,
    )
    .unwrap()
}

fn farthest(a: &WiggleFeatures, b: &WiggleFeatures) -> f32 {
    let pairs = a.motion.iter().zip(&b.motion);
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
}

/// Another camera: nearer, from the other side, turned, other lens, global shutter.
fn other_camera() -> StereoCamera {
    let eye = Intrinsics {
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
        left: eye,
        right: eye,
        r_w_cam: Matrix3::from_columns(&[right, towards.cross(&right), towards]),
        p_w_cam_m: Vector3::new(0.6, 1.1, 0.1),
        shutter: Shutter::Global,
        line_time_s: 0.0,
        ..side_camera()
    }
}

#[test]
fn features_do_not_depend_on_the_camera() {
    let (side, other) = (side_camera(), other_camera());
    let a = features(&filmed(&side), &side);
    let b = features(&filmed(&other), &other);
    assert_eq!(a.seen, 400);
    // What is left are the chords between frames, at different times.
    assert!(farthest(&a, &b) < 0.03, "{}", farthest(&a, &b));
    let rms = a.motion.iter().zip(&b.motion).map(|(a, b)| (a - b).powi(2));
    let rms = (rms.sum::<f32>() / a.motion.len() as f32).sqrt();
    assert!(rms < 2e-3, "{rms}");
}

#[test]
fn channels_are_positions_and_angles_of_the_hanging_rope() {
    let camera = side_camera();
    let rope = random_rope(2);
    let f = features(&filmed(&camera), &camera);
    let still = &f.motion[..48];
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
    for frame in f.motion.chunks(48).step_by(17) {
        for k in 0..15 {
            let at = |k: usize| {
                if k == 0 {
                    [0.0; 2]
                } else {
                    [frame[2 * k], frame[2 * k + 1]]
                }
            };
            let (a, b) = (at(k), at(k + 1));
            let angle = (b[0] - a[0]).atan2(a[1] - b[1]);
            assert!((angle - frame[32 + k]).abs() < 1e-3);
        }
    }
    // The clamp sways about its mean.
    let mean: f32 = f.motion.chunks(48).map(|c| c[0]).sum::<f32>() / 400.0;
    let most = f.motion.chunks(48).map(|c| c[0]).fold(0.0, f32::max);
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
    let seen = |i: usize| f.motion[i * 48 + 47] > 0.5;
    // Frames next to the gap may stand in for its ends.
    assert!((102..128).all(|i| !seen(i)) && seen(98) && seen(132));
    assert!(f.motion[110 * 48..111 * 48].iter().all(|x| *x == 0.0));
    assert!(seen(200) && seen(210) && seen(220));
    assert!(f.seen < 376 && f.seen >= 370, "{}", f.seen);
    for i in [200, 210, 220] {
        // The mean of the clamp is another one with frames missing.
        let range = i * 48 + 2..i * 48 + 47;
        let apart = f.motion[range.clone()].iter().zip(&whole.motion[range]);
        let apart = apart.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
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
    assert!(f.motion[10 * 48..25 * 48].iter().all(|x| *x == 0.0));
    assert!(f.motion[25 * 48..26 * 48].iter().any(|x| *x != 0.0));
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
    let plane = ViewPlane::of_motion(&arm(), 6.7).unwrap();
    let look = |track: &KeypointTrack, camera: &StereoCamera| {
        observe(
            FeatureDefinition::default(),
            track,
            Appearance::default(),
            camera,
            &plane,
        )
        .unwrap_err()
    };
    let mut lost = filmed(&camera);
    lost.frames[50..].iter_mut().for_each(|f| f.lost = true);
    assert!(matches!(
        look(&lost, &camera),
        ObserveError::TooFewSeen { .. }
    ));
    let edge_on = StereoCamera {
        r_w_cam: Matrix3::new(0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0),
        p_w_cam_m: Vector3::new(-1.0, 0.0, 0.0),
        ..camera.clone()
    };
    let track = filmed(&camera);
    assert!(matches!(
        look(&track, &edge_on),
        ObserveError::EdgeOn { .. }
    ));
    let mut bad = track;
    bad.frames[3].points.pop();
    assert!(matches!(look(&bad, &camera), ObserveError::Keypoints(_)));
    let hold = JointTrajectory::hold(arm_model::joint::START_POSE, 3.0).unwrap();
    assert!(matches!(
        ViewPlane::of_motion(&PlannedArm::new(hold, Pole::default()), 3.0),
        Err(ObserveError::NoWiggle { .. })
    ));
}

#[test]
fn widths_not_seen_are_marked() {
    let seen = Appearance {
        rope_radius_m: None,
        lead_radius_m: Some(0.02),
    };
    assert_eq!(widths(seen), [0.0, 0.0, 0.02, 1.0]);
}

/// A film of the hanging rope under a wiggle, begun `padding_frames` early.
fn film_of(config: &WiggleConfig, padding_frames: u32) -> KeypointTrack {
    let arm = PlannedArm::new(wiggle(config, &Limits::default()).unwrap(), Pole::default());
    let noise = FilmNoise {
        padding_frames,
        clock_offset_s: 0.007,
        ..FilmNoise::default()
    };
    let timing = FilmTiming::default();
    film(&random_rope(2), &arm, &side_camera(), 16, &timing, &noise)
        .unwrap()
        .track
}

#[test]
fn time_counts_from_the_wiggle_whenever_the_film_began() {
    let camera = side_camera();
    let early = features(&film_of(&WiggleConfig::default(), 15), &camera);
    let plain = features(&filmed(&camera), &camera);
    // The film that began early ends before the last frames.
    assert!((380..390).contains(&early.seen), "{}", early.seen);
    for i in (20..380).step_by(9) {
        let range = i * 48 + 2..i * 48 + 32;
        let pairs = early.motion[range.clone()].iter().zip(&plain.motion[range]);
        let apart = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(apart < 4e-3, "frame {i}: {apart}");
    }
}

#[test]
fn another_wiggle_is_refused() {
    let camera = side_camera();
    let plane = ViewPlane::of_motion(&arm(), 6.7).unwrap();
    let usual = WiggleConfig::default();
    let slow = WiggleConfig {
        frequency_hz: 1.0,
        ..usual
    };
    let small = WiggleConfig {
        amplitude_rad: usual.amplitude_rad * 0.6,
        ..usual
    };
    for other in [slow, small] {
        let refused = observe(
            FeatureDefinition::default(),
            &film_of(&other, 0),
            Appearance::default(),
            &camera,
            &plane,
        );
        assert!(
            matches!(refused, Err(ObserveError::OtherWiggle { .. })),
            "{other:?}"
        );
    }
}

#[test]
fn link_centres_show_how_many_links_there_are() {
    let (arm, camera) = (arm(), side_camera());
    let plane = ViewPlane::of_motion(&arm, 6.7).unwrap();
    let definition = FeatureDefinition {
        keypoints: 26,
        points: ObservedPoints::LinkCentres,
        ..FeatureDefinition::default()
    };
    let track_of = |links: u32| {
        let rope = RopeParams {
            links,
            ..random_rope(2)
        };
        let noise = FilmNoise::white(2.0, 3);
        let layout = KeypointLayout::LinkCentres;
        film(&rope, &arm, &camera, layout, &FilmTiming::default(), &noise)
            .unwrap()
            .track
    };
    let look = |definition, links| {
        let track = track_of(links);
        observe(definition, &track, Appearance::default(), &camera, &plane)
    };
    for links in [21, 26] {
        let features = look(definition, links).unwrap();
        let channels = definition.channels();
        let frame = &features.motion[100 * channels..101 * channels];
        let links = links as usize;
        // Places and angles of the links there are, and zeros for the others.
        assert!(frame[2..2 * links].iter().any(|x| x.abs() > 0.1));
        assert!(frame[2 * links..52].iter().all(|x| *x == 0.0));
        assert!(frame[52..51 + links].iter().all(|x| *x != 0.0));
        assert!(frame[51 + links..77].iter().all(|x| *x == 0.0));
        assert_eq!(frame[77], 1.0);
    }
    let few = FeatureDefinition {
        keypoints: 20,
        ..definition
    };
    assert_eq!(
        look(few, 21).unwrap_err(),
        ObserveError::LinkCentres { found: 21, max: 20 }
    );
}
