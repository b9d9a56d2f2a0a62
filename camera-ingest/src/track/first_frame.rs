//! Finding the rope where nothing is known yet.
//!
//! What differs from the background and hangs on the clamp is rope, lead and
//! perhaps a shadow of theirs. What lies beyond the lead is not rope.

use shared_types::StereoCamera;

use super::background::Background;
use super::clamp::ClampSample;
use super::evidence::{Colour, Matter, Window};
use super::geodesic::{Depth, Geodesic, Ground};
use super::lead::{self, TooShort};
use super::models::{FirstMask, FirstScene, ModelError, check_count};
use super::plane::{Point, RopePlane};
use crate::frame::EyeFrame;

/// Gaps in the rope's image that are bridged (px at VGA; scaled with the image).
const GAP_PX: f64 = 15.0;
/// Gap allowed right at the clamp, where the rope hardly moves (m).
const FIRST_GAP_M: f64 = 0.15;
/// Smoothing makes the mask this much wider than what is seen (px).
const MASK_GROWS_PX: f64 = 1.0;
/// The pole and what holds it: blocked out to this distance behind the clamp (m).
const BLOCKED_BEHIND_M: f64 = 0.35;
/// Half-width of what is blocked around the pole (m).
const POLE_HALF_WIDTH_M: f64 = 0.035;
/// Coverage at which a pixel counts as lead (see [`Matter::full`]).
pub(super) const LEAD_FULL: f32 = 0.6;
/// Shades of the lead (see [`Matter::shades`]).
pub(super) const LEAD_SHADES: [f32; 3] = [1.0, 0.65, 0.4];
/// What was found.
#[derive(Debug, Clone)]
pub(super) struct FirstLook {
    /// Way from clamp to lead over the plane (m), not smoothed.
    pub(super) path: Vec<Point>,
    /// Rough radius of the lead (px).
    pub(super) lead_radius_px: f64,
    /// Colours and how much they scatter.
    pub(super) rope: (Colour, f32),
    pub(super) lead: (Colour, f32),
    /// Nothing else could be the lead.
    pub(super) sole: bool,
}

/// Why nothing was found.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum NotFound {
    /// The clamp's pixel lies outside the image.
    ClampOutside([f64; 2]),
    /// Nothing long enough hangs on the clamp; longest way (m).
    NothingHangs(f64),
    /// A learned model gave no mask.
    NoMask(ModelError),
}

/// Where the rope is looked for.
#[derive(Clone, Copy)]
pub(super) struct Place<'a> {
    pub(super) background: &'a Background,
    pub(super) camera: &'a StereoCamera,
    pub(super) plane: &'a RopePlane,
    /// The clamp in this frame.
    pub(super) clamp: ClampSample,
    /// Where the lead's centre is, if somebody knows (raw pixel).
    #[expect(dead_code, reason = "nobody knows")]
    pub(super) lead_px: Option<[f64; 2]>,
}

/// Finds rope and lead in a frame, in which they hang still unless the rope's
/// length along the mask is known already to lie in `length_m`.
pub(super) fn find(
    frame: &EyeFrame,
    place: &Place<'_>,
    masker: &mut dyn FirstMask,
    length_m: Option<[f64; 2]>,
) -> Result<FirstLook, NotFound> {
    let Place {
        background,
        camera,
        plane,
        clamp,
        ..
    } = place;
    let gain = background.gain(frame);
    let width = frame.width_px;
    let clamp_px = camera
        .project_left(&clamp.p_w_m)
        .filter(|p| camera.contains(*p))
        .ok_or(NotFound::ClampOutside(
            camera.project_left(&clamp.p_w_m).unwrap_or([f64::NAN; 2]),
        ))?;
    let scene = FirstScene {
        frame,
        empty: &background.image,
        gain,
        noise: background.noise,
    };
    let mut mask = masker.mask(&scene).map_err(NotFound::NoMask)?;
    check_count("pixels of a mask", mask.len(), frame.luma.len()).map_err(NotFound::NoMask)?;
    clear_border(&mut mask, width);
    let depth = Depth::of(&mask, width);
    let ground = ground(&mask, width, camera, plane, clamp);
    let image_scale = width as f64 / 672.0;
    let start = clamp_px[1].round() as usize * width + clamp_px[0].round() as usize;
    let ways = Geodesic::from(
        start,
        &ground,
        width,
        (GAP_PX * image_scale) as u32,
        (FIRST_GAP_M * plane.px_per_m) as u32,
    );
    let lead::Best { at, sole } = lead::Search {
        frame,
        background,
        gain,
        mask: &mask,
        depth: &depth,
        ways: &ways,
        px_per_m: plane.px_per_m,
        length_m: length_m.unwrap_or([lead::LEAST_ROPE_M, f64::INFINITY]),
    }
    .best()
    .map_err(|TooShort(longest_m)| NotFound::NothingHangs(longest_m))?;
    let lead_radius_px = f64::from(depth.px(at));
    let pixels = ways.path_to(at);
    // Colour of the rope: its middle part, away from clamp and lead.
    let middle = &pixels[pixels.len() / 6..pixels.len() * 3 / 4];
    let rope = colour_of(
        frame,
        gain,
        middle.iter().map(|p| [p[0] as usize, p[1] as usize]),
    );
    let centre = [(at % width) as f64, (at / width) as f64];
    let seen_radius_px = (lead_radius_px - MASK_GROWS_PX).max(1.0);
    let (lead, mut lead_px) = lead_place(frame, background, gain, rope, centre, seen_radius_px);
    let on_way = pixels.len() / 2;
    let rope_px =
        f64::from(depth.px(pixels[on_way][1] as usize * width + pixels[on_way][0] as usize));
    if lead::blends_in(lead.0, rope, lead_radius_px / rope_px.max(1.0)) {
        lead_px = centre;
    }
    let mut path: Vec<Point> = pixels.iter().map(|p| plane.point_at(*p)).collect();
    // The way over pixels enters the lead anywhere; end it at the centre.
    let inside = lead_radius_px / plane.px_per_m;
    let end = plane.point_at(lead_px);
    while path.len() > 2
        && path
            .last()
            .is_some_and(|p| (p[0] - end[0]).hypot(p[1] - end[1]) < inside)
    {
        path.pop();
    }
    path.push(end);
    Ok(FirstLook {
        path,
        lead_radius_px,
        rope,
        lead,
        sole,
    })
}

/// Lead colour around a first guess, and the centre refined with it.
fn lead_place(
    frame: &EyeFrame,
    background: &Background,
    gain: f32,
    rope: (Colour, f32),
    mut centre: [f64; 2],
    radius_px: f64,
) -> ((Colour, f32), [f64; 2]) {
    let window = Window::around(std::iter::once(centre), 3.0 * radius_px + 3.0, frame);
    let core_px = 0.6 * radius_px;
    let mut lead = ([0.0; 3], 0.0);
    for _ in 0..4 {
        lead = colour_of(frame, gain, disc(centre, core_px, window));
        let matter = Matter {
            background,
            colour: lead.0,
            scatter: lead.1,
            gain,
            full: LEAD_FULL,
            shades: &LEAD_SHADES,
            rival: Some(rope.0),
            smear: 0.0,
        };
        centre = matter
            .coverage(frame, window)
            .centroid(centre, radius_px + 2.0)
            .1;
    }
    (lead, centre)
}

fn disc(centre: [f64; 2], radius_px: f64, window: Window) -> impl Iterator<Item = [usize; 2]> {
    (window.v0..window.v1).flat_map(move |v| {
        (window.u0..window.u1)
            .filter(move |&u| {
                (u as f64 - centre[0]).hypot(v as f64 - centre[1]) <= radius_px.max(1.0)
            })
            .map(move |u| [u, v])
    })
}

/// Colour of a pixel in the background's light.
pub(super) fn colour_at(frame: &EyeFrame, gain: f32, u: usize, v: usize) -> Colour {
    let [y, cb, cr] = frame.ycc(u, v).map(f32::from);
    [
        y / gain,
        128.0 + (cb - 128.0) / gain,
        128.0 + (cr - 128.0) / gain,
    ]
}

/// Median colour of some pixels in the background's light, and the median
/// distance from it.
pub(super) fn colour_of(
    frame: &EyeFrame,
    gain: f32,
    pixels: impl Iterator<Item = [usize; 2]>,
) -> (Colour, f32) {
    let colours: Vec<Colour> = pixels.map(|[u, v]| colour_at(frame, gain, u, v)).collect();
    if colours.is_empty() {
        return ([128.0; 3], 0.0);
    }
    let median = |mut values: Vec<f32>| -> f32 {
        let middle = values.len() / 2;
        *values.select_nth_unstable_by(middle, f32::total_cmp).1
    };
    let centre: Colour = core::array::from_fn(|k| median(colours.iter().map(|c| c[k]).collect()));
    let spread = median(
        colours
            .iter()
            .map(|c| {
                (0..3)
                    .map(|k| (c[k] - centre[k]).powi(2))
                    .sum::<f32>()
                    .sqrt()
            })
            .collect(),
    );
    (centre, spread)
}

/// What follows looks at the neighbours of every pixel of the mask.
fn clear_border(mask: &mut [bool], width: usize) {
    let last = mask.len() - width;
    mask[..width].fill(false);
    mask[last..].fill(false);
    for row in mask.chunks_mut(width) {
        row[0] = false;
        row[width - 1] = false;
    }
}

/// Mask with the pole and what holds it taken out of reach.
fn ground(
    mask: &[bool],
    width: usize,
    camera: &StereoCamera,
    plane: &RopePlane,
    clamp: &ClampSample,
) -> Vec<Ground> {
    let behind = |d: f64| camera.project_left(&(clamp.p_w_m + clamp.pole_w * d));
    let reach = POLE_HALF_WIDTH_M * plane.px_per_m;
    let on = |&on: &bool| if on { Ground::On } else { Ground::Off };
    let mut ground: Vec<Ground> = mask.iter().map(on).collect();
    // Begin where the half-circle around the pole's start ends at the clamp.
    let Some((a, b)) = behind(POLE_HALF_WIDTH_M + 0.004).zip(behind(BLOCKED_BEHIND_M)) else {
        return ground;
    };
    let range = |k: usize, size: usize| {
        let low = (a[k].min(b[k]) - reach).max(0.0) as usize;
        let high = (a[k].max(b[k]) + reach).max(0.0) as usize + 1;
        low.min(size)..high.min(size)
    };
    for v in range(1, mask.len() / width) {
        for u in range(0, width) {
            if distance_to_segment([u as f64, v as f64], a, b) < reach {
                ground[v * width + u] = Ground::Blocked;
            }
        }
    }
    ground
}

fn distance_to_segment(p: [f64; 2], a: [f64; 2], b: [f64; 2]) -> f64 {
    let (d, e) = ([b[0] - a[0], b[1] - a[1]], [p[0] - a[0], p[1] - a[1]]);
    let long = d[0] * d[0] + d[1] * d[1];
    let part = ((d[0] * e[0] + d[1] * e[1]) / long.max(1e-9)).clamp(0.0, 1.0);
    (e[0] - part * d[0]).hypot(e[1] - part * d[1])
}
