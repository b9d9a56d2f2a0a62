//! Pictures of the rig against the geometry they were drawn from.
#![cfg(test)]
#![allow(missing_docs, reason = "a test")]

use arm_model::Cell;
use arm_model::joint::START_POSE;
use camera_ingest::{ImageFrame, StereoFrame};
use nalgebra::Vector3;
use rig_sim::CameraConfig;
use rig_sim::render::{Appearance, Renderer, RopeShape, ScenePose};
use shared_types::StereoCamera;

const ROPE: RopeShape = RopeShape {
    radius_m: 0.006,
    lead_radius_m: 0.025,
};

const COLOURS: Appearance = Appearance {
    rope_rgb: [214, 96, 36],
    lead_rgb: [44, 84, 196],
    target_rgb: [38, 168, 74],
    wall_rgb: [186, 187, 184],
};

fn renderer(camera: &StereoCamera) -> Renderer {
    Renderer::new(camera, &Cell::default(), ROPE, COLOURS, 0.0, 5)
}

/// A bent rope in front of the wall, moved sideways by `shift_m`.
fn pose(shift_m: f64) -> ScenePose {
    let (clamp, _) = Cell::default().pole.attach_pose(&START_POSE);
    let nodes = (0..=22).map(|i| {
        let s = f64::from(i) / 22.0;
        clamp + Vector3::new(0.12 * (s * 4.0).sin() + shift_m, 0.05 * s, -0.55 * s)
    });
    ScenePose {
        q: START_POSE,
        nodes: nodes.collect(),
    }
}

fn without_rope() -> ScenePose {
    ScenePose {
        nodes: Vec::new(),
        ..pose(0.0)
    }
}

/// What both eyes see.
fn both(renderer: &mut Renderer, camera: &StereoCamera, poses: &[ScenePose]) -> [ImageFrame; 2] {
    let mut bytes = vec![0; renderer.frame_bytes()];
    renderer.render(poses, 0, &mut bytes);
    let size = [camera.width_px as usize * 2, camera.height_px as usize];
    let frame = StereoFrame::from_yuyv(&bytes, size, 0, 0).unwrap();
    [frame.left(), frame.right()]
}

fn ycc(image: &ImageFrame, u: usize, v: usize) -> [f64; 3] {
    image.ycc(u, v).map(f64::from)
}

/// How much of a pixel something new covers: full from a difference on that every
/// shaded side of the rope has against the wall.
fn covered(full: &ImageFrame, empty: &ImageFrame, u: usize, v: usize) -> f64 {
    let (a, b) = (ycc(full, u, v), ycc(empty, u, v));
    let d: f64 = (0..3).map(|i| (a[i] - b[i]).powi(2)).sum();
    (d.sqrt() / 60.0).min(1.0)
}

fn project(camera: &StereoCamera, side: usize, p: &Vector3<f64>) -> [f64; 2] {
    if side == 0 {
        camera.project_left(p).unwrap()
    } else {
        camera.project_right(p).unwrap()
    }
}

#[test]
fn rope_and_lead_lie_where_the_camera_model_puts_them() {
    let camera = CameraConfig::default().stereo_camera();
    let mut renderer = renderer(&camera);
    let empty = both(&mut renderer, &camera, &[without_rope()]);
    let full = both(&mut renderer, &camera, &[pose(0.0)]);
    let nodes = pose(0.0).nodes;
    for side in 0..2 {
        for link in nodes[2..20].windows(2) {
            let [a, b] = [0, 1].map(|end| project(&camera, side, &link[end]));
            let v = a[1].ceil();
            let [error, weight] = crossing(&full[side], &empty[side], [a, b], v as usize, 9);
            assert!(
                error.abs() < 0.35,
                "eye {side} row {v}: off by {error:.3} px"
            );
            // A bend widens the cut through a slanted rope; it never gets thinner.
            assert!(weight > 2.5 && weight < 7.0, "width {weight:.2} px");
        }
        let want = project(&camera, side, nodes.last().unwrap());
        let [u, v, area] = blob(&full[side], &empty[side], want, 8);
        let error = (u - want[0]).hypot(v - want[1]);
        assert!(error < 0.35, "lead in eye {side} off by {error:.3} px");
        assert!(area > 90.0, "lead of {area} px in eye {side}");
    }
}

/// By how much row `v` of what is new is off the line from `a` to `b`, and how wide it is
/// (px), within `reach` pixels.
fn crossing(
    full: &ImageFrame,
    empty: &ImageFrame,
    [a, b]: [[f64; 2]; 2],
    v: usize,
    reach: usize,
) -> [f64; 2] {
    let want = a[0] + (b[0] - a[0]) * (v as f64 - a[1]) / (b[1] - a[1]);
    let (mut weight, mut moment) = (0.0, 0.0);
    for u in want as usize - reach..=want as usize + reach {
        let w = covered(full, empty, u, v);
        weight += w;
        moment += w * u as f64;
    }
    [moment / weight - want, weight]
}

/// Centroid and area of what has turned blue within `reach` pixels: the lead,
/// not the orange rope above it.
fn blob(full: &ImageFrame, empty: &ImageFrame, near: [f64; 2], reach: usize) -> [f64; 3] {
    let mut sums = [0.0; 3];
    let (u0, v0) = (near[0].round() as usize, near[1].round() as usize);
    for v in v0 - reach..=v0 + reach {
        for u in u0 - reach..=u0 + reach {
            let w = ((ycc(full, u, v)[1] - ycc(empty, u, v)[1]) / 25.0).clamp(0.0, 1.0);
            sums[0] += w * u as f64;
            sums[1] += w * v as f64;
            sums[2] += w;
        }
    }
    [sums[0] / sums[2], sums[1] / sums[2], sums[2]]
}

#[test]
fn a_rolling_shutter_shows_each_row_at_its_own_time() {
    let config = CameraConfig {
        line_time_s: 26.1e-6,
        ..CameraConfig::default()
    };
    let camera = config.stereo_camera();
    let mut renderer = renderer(&camera);
    // Sideways at 3 m/s: 9 px during a row's exposure, 25 px from the first row to the last.
    let at = |t_s: f64| pose(3.0 * t_s - 0.03);
    let frame_s = camera.frame_time_s();
    let count = renderer.sub_frames(&at(0.0), &at(frame_s));
    let poses: Vec<_> = (0..count)
        .map(|i| at(frame_s * (i as f64 + 0.5) / count as f64))
        .collect();
    let empty = both(&mut renderer, &camera, &[without_rope()]);
    let full = both(&mut renderer, &camera, &poses);
    for (v, t_s) in (130..300)
        .step_by(10)
        .map(|v| (v, camera.row_time_s(v as f64)))
    {
        for side in 0..2 {
            let nodes = at(t_s).nodes;
            let pixels: Vec<_> = nodes.iter().map(|p| project(&camera, side, p)).collect();
            let mut links = pixels[2..21].windows(2).map(|w| [w[0], w[1]]);
            let Some([a, b]) = links.find(|[a, b]| a[1] <= v as f64 && v as f64 <= b[1]) else {
                continue;
            };
            let [error, weight] = crossing(&full[side], &empty[side], [a, b], v, 16);
            assert!(
                error.abs() < 0.5,
                "eye {side} row {v}: off by {error:.2} px"
            );
            assert!(weight > 2.5, "eye {side} row {v}: {weight} px");
        }
    }
}

#[test]
fn motion_blur_spreads_evenly_about_the_middle_of_the_exposure() {
    let camera = CameraConfig::default().stereo_camera();
    let mut renderer = renderer(&camera);
    let (start, end) = (pose(-0.02), pose(0.02));
    let count = renderer.sub_frames(&start, &end);
    assert!(count >= 8, "40 mm are some 10 px, drawn in {count} steps");
    assert_eq!(renderer.sub_frames(&start, &start), 1);
    let poses: Vec<_> = (0..count)
        .map(|i| pose(-0.02 + 0.04 * (i as f64 + 0.5) / count as f64))
        .collect();
    let empty = both(&mut renderer, &camera, &[without_rope()]);
    let blurred = both(&mut renderer, &camera, &poses);
    let sharp = both(&mut renderer, &camera, &[pose(0.0)]);
    let want = project(&camera, 0, pose(0.0).nodes.last().unwrap());
    let [u, _, area] = blob(&blurred[0], &empty[0], want, 14);
    let [_, _, sharp_area] = blob(&sharp[0], &empty[0], want, 14);
    assert!((u - want[0]).abs() < 0.5, "{u} and {}", want[0]);
    assert!(area > 1.2 * sharp_area, "{area} against {sharp_area}");
}

#[test]
fn what_is_nearer_covers_what_is_behind() {
    let camera = CameraConfig::default().stereo_camera();
    let mut renderer = renderer(&camera);
    let lead = *pose(0.0).nodes.last().unwrap();
    let [u, v] = project(&camera, 0, &lead);
    let mut seen = |offset_m: f64| {
        let towards = (camera.p_w_cam_m - lead).normalize();
        renderer.place_target(Some(lead + towards * offset_m));
        let [left, _] = both(&mut renderer, &camera, &[pose(0.0)]);
        ycc(&left, u.round() as usize, v.round() as usize)
    };
    let (ball, lead) = (seen(0.1), seen(-0.1));
    assert!(
        ball[1] < 128.0 && ball[2] < 110.0,
        "green ball in front: {ball:?}"
    );
    assert!(lead[1] > 150.0, "blue lead in front: {lead:?}");
}
