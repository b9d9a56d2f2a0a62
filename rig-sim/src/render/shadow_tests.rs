//! Shadows against the geometry they follow from.

use super::image_view::ImageView;
use super::lamp_view::{Cover, LampView};
use super::shade_map::ShadeMap;
use super::solid::{Material, Solid};
use crate::CameraConfig;
use crate::room::lamp::Lamp;
use nalgebra::Vector3;

const WALL_Y_M: f64 = 1.0;

fn lamp(radius_m: f64) -> Lamp {
    Lamp {
        at_m: Vector3::new(0.2, -1.0, 0.9),
        radius_m,
        power: 0.5,
        reach_m: 2.0,
    }
}

/// A ball in the lamp's light.
fn ball(at_m: Vector3<f64>) -> Solid {
    Solid::new(&at_m, &at_m, 0.03, Material::plain([200; 3], 0.0))
}

/// Where the line from a lamp through a point meets the wall (m).
fn on_wall(lamp: &Lamp, p: &Vector3<f64>) -> Vector3<f64> {
    let way = p - lamp.at_m;
    lamp.at_m + way * ((WALL_Y_M - lamp.at_m.y) / way.y)
}

/// The light held up from places of the wall.
fn held_up(lamp: &Lamp, solids: &[Solid]) -> impl Fn(&Vector3<f64>) -> f32 + use<> {
    let view = LampView::of(lamp, WALL_Y_M);
    let mut cover = Cover::empty();
    cover.draw(&view, solids);
    move |place| view.see(place).map_or(0.0, |(texel, _)| cover.at(texel))
}

#[test]
fn a_ball_darkens_the_wall_where_the_line_from_the_lamp_through_it_ends() {
    let lamp = lamp(0.001);
    let at_m = Vector3::new(0.7, 0.05, -0.1);
    let held_up = held_up(&lamp, &[ball(at_m)]);
    let middle = on_wall(&lamp, &at_m);
    assert!((middle - Vector3::new(1.152_381, 1.0, -1.004_762)).norm() < 1e-5);
    assert!(held_up(&middle) > 0.99);
    // The lamp is 1.05 m before the ball and 2 m before the wall: the shadow is larger.
    let radius_m = 0.03 * 2.0 / 1.05;
    for way in [Vector3::x(), -Vector3::x(), Vector3::z()] {
        assert!(held_up(&(middle + way * radius_m * 0.8)) > 0.9);
        assert!(held_up(&(middle + way * radius_m * 1.7)) < 0.1);
    }
}

#[test]
fn a_larger_lamp_casts_a_softer_shadow_of_the_same_light() {
    let at_m = Vector3::new(0.6, 0.0, 0.2);
    let across = |radius_m: f64| -> (f32, f32) {
        let lamp = lamp(radius_m);
        let held_up = held_up(&lamp, &[ball(at_m)]);
        let middle = on_wall(&lamp, &at_m);
        let places = (-400..=400).map(|i| middle + Vector3::x() * f64::from(i) * 1e-3);
        let all: Vec<f32> = places.map(|p| held_up(&p)).collect();
        (all.iter().sum(), all.iter().fold(0.0, |a, b| a.max(*b)))
    };
    let (sharp, soft) = (across(0.002), across(0.08));
    assert!(
        (sharp.0 - soft.0).abs() < 0.05 * sharp.0,
        "{sharp:?} {soft:?}"
    );
    assert!(sharp.1 > 0.99 && soft.1 < 0.8, "{sharp:?} {soft:?}");
}

#[test]
fn the_eye_sees_the_shadow_at_the_pixel_of_its_place_on_the_wall() {
    let lamp = lamp(0.001);
    let at_m = Vector3::new(0.6, 0.0, 0.2);
    let view = LampView::of(&lamp, WALL_Y_M);
    let mut cover = Cover::empty();
    cover.draw(&view, &[ball(at_m)]);
    let camera = CameraConfig::default().stereo_camera();
    let image = ImageView::left(&camera);
    let (width, height) = image.size_px();
    let wall = (0..height).flat_map(|v| (0..width).map(move |u| [u as f64, v as f64]));
    let wall = wall.map(|pixel| {
        let (origin, ray) = image.ray(pixel);
        let p = origin + ray * ((WALL_Y_M - origin.y) / ray.y);
        (p, 0.25)
    });
    let shade = ShadeMap::new(&image, &view, wall);
    let (mut sum, mut moment) = (0.0, [0.0; 2]);
    for v in 0..height {
        let mut lack = vec![0.0; width];
        let (from, to) = shade.darken(v, &cover, &mut lack);
        for (u, lack) in lack.iter().enumerate() {
            assert!(*lack <= 0.2501 && (*lack == 0.0 || (from..to).contains(&u)));
            let lack = f64::from(*lack);
            sum += lack;
            moment = [moment[0] + lack * u as f64, moment[1] + lack * v as f64];
        }
    }
    let want = image.project(&on_wall(&lamp, &at_m)).unwrap();
    let off = (moment[0] / sum - want[0]).hypot(moment[1] / sum - want[1]);
    assert!(off < 0.3, "{off} px");
}
