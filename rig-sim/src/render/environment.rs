//! What a renderer shows behind the moving things: the plain room, or a drawn one.

use super::appearance::Appearance;
use super::backdrop::PlainRoom;
use super::colour::{Ycc, ycc};
use super::image_view::{ImageView, Vignette};
use super::lamp_view::LampView;
use super::lighting::Lighting;
use super::shade_map::ShadeMap;
use super::texture::lattice;
use crate::room::Room;
use crate::room::lamp::level;
use crate::room::paint::Rgb;
use crate::room::still::Look;
use arm_model::Cell;
use nalgebra::Vector3;

/// Rays per pixel along u and v.
const RAYS: u32 = 2;
/// Light lost in the corners of the plain room's picture.
const CORNER_LOSS: f32 = 0.24;
/// Where the light on moving things is judged (m).
const MIDDLE_M: Vector3<f64> = Vector3::new(0.6, 0.0, 0.1);

/// One eye's still picture, and what is needed to draw moving things into it.
#[derive(Debug)]
pub(super) struct View {
    pub(super) vignette: Vignette,
    pub(super) light: Lighting,
    /// The still things, dimmed by the lens.
    pub(super) picture: Vec<Ycc>,
    /// Each lamp's light on them.
    pub(super) shades: Vec<ShadeMap>,
    /// Light scattered in the lens (levels); empty for none.
    pub(super) veil: Vec<f32>,
}

/// Casts a picture: the mean of `look` over each pixel's rays, which are numbered.
fn cast(
    image: &ImageView,
    vignette: &Vignette,
    mut look: impl FnMut(&Vector3<f64>, &Vector3<f64>, [u32; 3]) -> Rgb,
) -> Vec<Ycc> {
    let (width, height) = image.size_px();
    let offset = |i: u32| (f64::from(i) + 0.5) / f64::from(RAYS) - 0.5;
    let mut picture = Vec::with_capacity(width * height);
    for v in 0..height {
        for u in 0..width {
            let mut sum = Rgb::zeros();
            for i in 0..RAYS * RAYS {
                let pixel = [u as f64 + offset(i % RAYS), v as f64 + offset(i / RAYS)];
                let (origin, ray) = image.ray(pixel);
                sum += look(&origin, &ray, [u as u32, v as u32, i]);
            }
            let mean = sum / f64::from(RAYS * RAYS);
            let dim = vignette.at(u as f32, v as f32);
            picture.push(ycc([mean.x, mean.y, mean.z].map(|c| c as f32 * dim)));
        }
    }
    picture
}

impl View {
    /// The plain room of a cell.
    pub(super) fn plain(image: &ImageView, appearance: &Appearance, cell: &Cell) -> Self {
        let vignette = Vignette::of(image, CORNER_LOSS);
        let room = PlainRoom::new(appearance.wall_rgb, cell);
        Self {
            picture: cast(image, &vignette, |origin, ray, _| room.look(origin, ray)),
            light: Lighting::PLAIN,
            shades: Vec::new(),
            veil: Vec::new(),
            vignette,
        }
    }

    /// A drawn room.
    pub(super) fn of(image: &ImageView, room: &Room, lamps: &[LampView]) -> Self {
        let (width, height) = image.size_px();
        let vignette = Vignette::of(image, room.picture.corner_loss);
        // What each pixel shows: the last of its rays says where, all say how much light.
        let mut seen: Vec<(Vector3<f64>, [f32; 2])> = vec![Default::default(); width * height];
        let picture = cast(image, &vignette, |origin, ray, [u, v, i]| {
            let number = |k: u32| lattice(i64::from(u * 4 + i), i64::from(v * 2 + k), 77);
            // Each of a pixel's rays looks at its own quarter of a lamp.
            let turn = (f64::from(i) + 0.5 + 0.5 * number(0)) / f64::from(RAYS * RAYS);
            let look: Look = room.still.look(origin, ray, [turn, 0.5 + 0.5 * number(1)]);
            let pixel = &mut seen[v as usize * width + u as usize];
            pixel.0 = look.at_m;
            for (sum, share) in pixel.1.iter_mut().zip(look.shares) {
                *sum += share as f32 / (RAYS * RAYS) as f32;
            }
            look.rgb
        });
        let shades = lamps.iter().enumerate().map(|(i, lamp)| {
            let seen = seen.iter().map(|(at_m, shares)| (*at_m, shares[i]));
            ShadeMap::new(image, lamp, seen)
        });
        Self {
            shades: shades.collect(),
            light: lighting(image, room),
            veil: veil(image, room),
            picture,
            vignette,
        }
    }
}

/// The light on moving things: the strongest lamp's direction, and the rest from
/// everywhere.
fn lighting(image: &ImageView, room: &Room) -> Lighting {
    let light = |lamp: &crate::room::lamp::Lamp| {
        let way = (lamp.at_m - MIDDLE_M).normalize();
        lamp.light(&MIDDLE_M, &way)
    };
    let lamps = room.still.lamps.iter();
    let all = room.still.ambient + lamps.clone().map(light).sum::<f64>();
    let strongest = lamps.max_by(|a, b| light(a).total_cmp(&light(b)));
    let shaded = strongest.map_or(all, |lamp| all - 0.9 * light(lamp));
    let (dark, bright) = (level(shaded), level(all));
    let at_m = strongest.map_or(MIDDLE_M + Vector3::z(), |lamp| lamp.at_m);
    let way = image.turned(&(at_m - MIDDLE_M).normalize());
    // Nothing white is blown out.
    let gain = room.still.gain.min(1.08 / bright);
    Lighting::from(
        [way.x as f32, way.y as f32, -way.z as f32],
        (dark * gain) as f32,
        ((bright - dark) * gain) as f32,
    )
}

/// Light scattered in the lens around a bright place.
fn veil(image: &ImageView, room: &Room) -> Vec<f32> {
    let Some((at_m, levels, width_px)) = room.picture.glare else {
        return Vec::new();
    };
    let Some(at) = image.project(&at_m) else {
        return Vec::new();
    };
    let (width, height) = image.size_px();
    let level = |u: usize, v: usize| {
        let (du, dv) = (u as f32 - at[0] as f32, v as f32 - at[1] as f32);
        levels / (1.0 + (du * du + dv * dv) / (width_px * width_px))
    };
    (0..height)
        .flat_map(|v| (0..width).map(move |u| (u, v)))
        .map(|(u, v)| level(u, v))
        .collect()
}
