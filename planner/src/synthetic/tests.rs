use super::noise::TrackingNoise;
use super::*;
use crate::ropes::random_rope;
use crate::wiggle::{WiggleConfig, wiggling_arm};
use arm_model::{JointTrajectory, Pole};
use nalgebra::Vector3;
use rope_sim::PlannedArm;
use shared_types::Shutter;

fn arm() -> PlannedArm {
    wiggling_arm(&WiggleConfig::default()).unwrap()
}

/// Two seconds of a wiggled rope.
fn look(rope: u64, camera: &StereoCamera, keypoints: usize, noise: &FilmNoise) -> SyntheticFilm {
    let timing = FilmTiming {
        frames: 120,
        rate_hz: 60.0,
    };
    film(
        &random_rope(rope),
        &arm(),
        camera,
        keypoints,
        &timing,
        noise,
    )
    .unwrap()
}

/// Largest distance between the keypoints of two films (px).
fn apart_px(a: &SyntheticFilm, b: &SyntheticFilm) -> f64 {
    let frames = a.track.frames.iter().zip(&b.track.frames);
    frames
        .flat_map(|(a, b)| a.points.iter().zip(&b.points))
        .map(|(a, b)| (a[0] - b[0]).hypot(a[1] - b[1]))
        .fold(0.0, f64::max)
}

#[test]
fn ends_of_a_film_are_the_clamp_and_the_lead() {
    let (arm, rope, camera) = (arm(), random_rope(3), side_camera());
    let films = record(&[rope], &arm, &RecordOptions::default()).unwrap();
    for t_s in [0.0, 1.234, 3.3] {
        assert!((films[0].position(t_s, 0) - arm.at(t_s).p_m).norm() < 2e-5);
    }
    let still = films[0].position(0.0, 24);
    assert!((arm.at(0.0).p_m - still).norm() <= rope.length_m + 1e-6);
    let centres = RecordOptions {
        layout: KeypointLayout::LinkCentres,
        duration_s: 0.1,
        ..RecordOptions::default()
    };
    let film = &record(&[rope], &arm, &centres).unwrap()[0];
    assert_eq!(film.keypoints, rope.links as usize);
    let apart = (film.position(0.0, 1) - film.position(0.0, 0)).norm();
    assert!((apart - rope.link_length_m()).abs() < 1e-4);
    assert!(camera.project_left(&film.position(0.0, 0)).is_some());
}

#[test]
fn sparse_positions_in_single_precision_film_alike() {
    let (arm, camera) = (arm(), side_camera());
    let ropes: Vec<_> = (0..8).map(random_rope).collect();
    let layout = KeypointLayout::Uniform(9);
    let fine = RecordOptions {
        layout,
        ..RecordOptions::default()
    };
    let coarse = RecordOptions::for_training(layout, 2);
    let [fine, coarse] = [fine, coarse].map(|o| record(&ropes, &arm, &o).unwrap());
    let (timing, noise) = (FilmTiming::default(), FilmNoise::default());
    for (fine, coarse) in fine.iter().zip(&coarse) {
        let [a, b] = [fine, coarse].map(|film| project(film, &camera, &timing, &noise));
        let apart = apart_px(&a, &b);
        assert!(apart < 0.3, "{apart} px");
    }
}

#[test]
fn a_rolling_shutter_sees_lower_rows_later() {
    let mut camera = side_camera();
    let rolling = look(4, &camera, 9, &FilmNoise::default());
    camera.shutter = Shutter::Global;
    camera.line_time_s = 0.0;
    let global = look(4, &camera, 9, &FilmNoise::default());
    let apart = apart_px(&rolling, &global);
    // 300 rows of 26 µs at about a metre a second are some pixels.
    assert!((0.5..10.0).contains(&apart), "{apart}");
    // The film is that of a global shutter at each point's own time.
    let options = RecordOptions {
        layout: KeypointLayout::Uniform(9),
        ..RecordOptions::default()
    };
    let recorded = record(&[random_rope(4)], &arm(), &options).unwrap();
    let seen = rolling.track.frames[80].points[8];
    let t_s = 80.0 / 60.0 + 0.002 + 26e-6 * seen[1];
    let [u, v] = camera.project_left(&recorded[0].position(t_s, 8)).unwrap();
    assert!((u - seen[0]).hypot(v - seen[1]) < 0.01);
}

#[test]
fn padding_and_clock_offset_delay_the_motion() {
    let camera = side_camera();
    let plain = look(5, &camera, 5, &FilmNoise::default());
    let padded = FilmNoise {
        padding_frames: 7,
        ..FilmNoise::default()
    };
    let late = FilmNoise {
        clock_offset_s: 7.0 / 60.0,
        ..FilmNoise::default()
    };
    for (name, noise) in [("padded", padded), ("late", late)] {
        let mut delayed = look(5, &camera, 5, &noise);
        delayed.track.frames.drain(..7);
        delayed.track.frames.truncate(100);
        let apart = apart_px(&delayed, &plain);
        assert!(apart < 0.02, "{name}: {apart}");
    }
}

#[test]
fn tracking_errors_have_the_size_and_correlation_asked_for() {
    let noise = FilmNoise {
        longitudinal_px: 2.0,
        lateral_px: 0.5,
        correlation: 0.8,
        seed: 9,
        ..FilmNoise::default()
    };
    let (keypoints, frames) = (20, 4000);
    let mut errors = TrackingNoise::new(&noise, keypoints);
    let mut squares = [0.0; 2];
    let mut products = 0.0;
    let mut before = vec![0.0; keypoints];
    for _ in 0..frames {
        for (k, before) in before.iter_mut().enumerate() {
            let error = errors.error_px(k);
            squares[0] += error[0] * error[0];
            squares[1] += error[1] * error[1];
            products += error[0] * *before;
            *before = error[0];
        }
        errors.advance();
    }
    let count = (keypoints * frames) as f64;
    assert!(((squares[0] / count).sqrt() / 2.0 - 1.0).abs() < 0.03);
    assert!(((squares[1] / count).sqrt() / 0.5 - 1.0).abs() < 0.03);
    assert!((products / squares[0] - 0.8).abs() < 0.02);
}

#[test]
fn errors_lie_along_and_across_the_rope() {
    let hold = JointTrajectory::hold(arm_model::joint::START_POSE, 3.0).unwrap();
    let arm = PlannedArm::new(hold, Pole::default());
    let timing = FilmTiming {
        frames: 120,
        rate_hz: 60.0,
    };
    // A hanging rope is upright in the picture: along it is along v.
    let noisy = FilmNoise {
        longitudinal_px: 2.0,
        ..FilmNoise::default()
    };
    let [plain, noisy] = [FilmNoise::default(), noisy]
        .map(|noise| film(&random_rope(6), &arm, &side_camera(), 9, &timing, &noise).unwrap());
    let (mut sideways, mut upright) = (0.0_f64, 0.0_f64);
    for (a, b) in noisy.track.frames.iter().zip(&plain.track.frames) {
        for (a, b) in a.points.iter().zip(&b.points) {
            sideways = sideways.max((a[0] - b[0]).abs());
            upright = upright.max((a[1] - b[1]).abs());
        }
    }
    assert!(upright > 3.0 && sideways < 0.5, "{upright} {sideways}");
}

#[test]
fn a_misplaced_camera_moves_the_picture_but_keeps_what_it_looks_at() {
    // 2 cm nearer: everything 2 % larger.
    let nearer = FilmNoise {
        camera_shift_m: Vector3::new(0.0, 0.02, 0.0),
        ..FilmNoise::default()
    };
    // Looking 2 cm further right moves the picture by 7 px.
    let turned = FilmNoise {
        lookat_shift_m: Vector3::new(0.02, 0.0, 0.0),
        ..FilmNoise::default()
    };
    let [plain, nearer, turned] =
        [FilmNoise::default(), nearer, turned].map(|noise| look(7, &side_camera(), 5, &noise));
    let length = |f: &SyntheticFilm| {
        let points = &f.track.frames[0].points;
        (points[4][0] - points[0][0]).hypot(points[4][1] - points[0][1])
    };
    let ratio = length(&nearer) / length(&plain);
    assert!((ratio - 1.0 / 0.98).abs() < 3e-3, "{ratio}");
    let wide = |f: &SyntheticFilm| f.appearance.lead_radius_m.unwrap();
    assert!((wide(&nearer) / wide(&plain) - 1.0 / 0.98).abs() < 1e-3);
    assert!((wide(&plain) / random_rope(7).lead_radius_m - 1.0).abs() < 1e-6);
    let moved = plain.track.frames[0].points[2][0] - turned.track.frames[0].points[2][0];
    assert!((moved - 7.0).abs() < 0.5, "{moved}");
}

#[test]
fn draws_follow_seed_and_index_alone() {
    let ranges = Randomisation::default();
    ranges.check().unwrap();
    let mut camera = 0.0;
    for index in 0..500 {
        let noise = ranges.draw(11, index);
        assert_eq!(noise, ranges.draw(11, index));
        assert_ne!(noise, ranges.draw(12, index));
        assert_ne!(noise, ranges.draw(11, index + 1));
        assert!((0.0..=3.0).contains(&noise.longitudinal_px) && noise.padding_frames <= 20);
        assert!(noise.clock_offset_s.abs() <= 0.02);
        camera += noise.camera_shift_m.norm_squared() / 3.0;
    }
    let deviation = (camera / 500.0).sqrt();
    assert!((deviation / 0.02 - 1.0).abs() < 0.08, "{deviation}");
}

#[test]
fn ranges_that_cannot_be_drawn_from_are_named() {
    type Change = fn(&mut Randomisation);
    let cases: [(&str, Change); 3] = [
        ("correlation", |r| r.correlation = 1.5),
        ("tracking_px", |r| r.tracking_px = [2.0, 1.0]),
        ("width_px", |r| r.width_px = f64::NAN),
    ];
    for (key, change) in cases {
        let mut wrong = Randomisation::default();
        change(&mut wrong);
        assert_eq!(wrong.check().unwrap_err().key, key);
    }
}
