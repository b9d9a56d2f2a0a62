use super::*;
use crate::room::{Named, RopeSurface};

/// Luma, then the pair's chroma about 0, of a pixel of the left eye.
fn ycc(yuyv: &[u8], width: usize, [u, v]: [usize; 2]) -> [f64; 3] {
    let row = v * width * 4;
    let chroma = |i: usize| f64::from(yuyv[row + u / 2 * 4 + i]) - 128.0;
    [f64::from(yuyv[row + u * 2]), chroma(1), chroma(3)]
}

/// Without what would hide the rope's colour.
fn clear(mut room: Room) -> Room {
    use crate::render::solid::Material;
    let red = Named {
        name: "red",
        rgb: [200, 30, 30],
    };
    let surface = Material::plain(red.rgb, 0.0);
    room.rope = RopeSurface {
        rope: red,
        tip: red,
        weave: "plain",
        shiny: false,
        cord: surface,
        lead: surface,
    };
    room.picture.noise_levels = 0.0;
    room
}

#[test]
fn the_true_curve_lies_on_pixels_of_the_ropes_colour() {
    for seed in [4, 9] {
        let mut film = RoomFilm::in_room(seed, clear(Room::draw(seed, Kind::Ordinary))).unwrap();
        let camera = film.setting.camera.clone();
        let radius_px = film.setting.rope.radius_m * camera.left.fx / -camera.p_w_cam_m.y;
        assert!(radius_px > 1.0, "too thin to tell");
        for i in [0, 120, 333] {
            let frame = film.frame(i);
            // Not where the collar holds the rope.
            let points = &frame.truth_px[6..];
            let red = points.iter().filter(|[u, v]| {
                let at = [u.round() as usize, v.round() as usize];
                let [y, cb, cr] = ycc(&frame.yuyv, camera.width_px as usize, at);
                cr > 0.35 * y && cr > 2.0 * cb
            });
            let part = red.count() as f64 / points.len() as f64;
            assert!(part > 0.97, "seed {seed}, frame {i}: {part}");
        }
    }
}

#[test]
fn a_seed_gives_the_same_film_again_from_any_frame() {
    let draw = || RoomFilm::draw(5, Kind::Hard).unwrap();
    let (mut first, mut second) = (draw(), draw());
    assert_eq!(first.setting, second.setting);
    assert_eq!(first.reported_joints(), second.reported_joints());
    assert_eq!(first.stamps_ns(), second.stamps_ns());
    let _ = first.frame(17);
    let (a, b) = (first.frame(200), second.frame(200));
    assert!(a.yuyv == b.yuyv && a.truth_px == b.truth_px);
}

#[test]
fn the_camera_sees_the_swing_and_is_told_a_little_wrong() {
    let mut off_mm = Vec::new();
    for seed in 0..12 {
        let (setting, swing) = Setting::draw(seed, Kind::Ordinary).unwrap();
        let (truth, reported) = (&setting.camera, &setting.calibrated);
        off_mm.push((truth.p_w_cam_m - reported.p_w_cam_m).norm() * 1e3);
        assert!(setting.film_late_s.abs() <= 0.005);
        let swept: Vec<_> = (0..60).flat_map(|i| swing.at(0.1 * f64::from(i))).collect();
        assert!(camera::sees(truth, &swept), "seed {seed}: out of view");
    }
    let mean_mm = off_mm.iter().sum::<f64>() / off_mm.len() as f64;
    assert!(mean_mm > 3.0 && mean_mm < 7.0, "{mean_mm}");
}

#[test]
fn joints_are_reported_late_and_noisy_by_what_was_drawn() {
    let (setting, _) = Setting::draw(6, Kind::Ordinary).unwrap();
    let reported = setting.reported_joints(6);
    assert!(reported.len() > 1670);
    for (t_s, q) in reported {
        let then = joints((t_s - setting.joints_late_s).max(0.0));
        assert!(
            (q - then)
                .0
                .iter()
                .all(|d| d.abs() < 6.0 * setting.joints_std_rad)
        );
    }
}

/// What a frame costs beyond the copy of the room grows with the pixels drawn anew.
#[test]
fn a_room_draws_few_pixels_anew() {
    for seed in [4, 15] {
        let mut film = RoomFilm::draw(seed, Kind::Ordinary).unwrap();
        let _ = film.frame(150);
        let all = film.renderer.frame_bytes() / 2;
        let part = film.renderer.drawn_px() as f64 / all as f64;
        assert!(part < 0.6, "seed {seed}: {part}");
    }
}
