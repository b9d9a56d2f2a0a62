//! Reads the film off along the hypothesis: curve, ends and tip weight in every frame.

use super::colour::{Colour, SHADES, are_apart, coverage, groups, shaded};
use super::curve::{Pixel, across, distance_px, from_end, normals, respaced};
use super::disc::Disc;
use super::end::{self, End};
use super::ends::{END_REACH, EndPicture, Window, start_px};
use super::evidence::Lit;
use super::field::{Offset, ProfileSearch, Smoothing, moved, offsets, smooth_field, smoothed};
use super::reading::Reading;
use super::round::{self, Profile, Round};
use super::statistics::median;

/// Places along the rope.
pub(super) const NODES: usize = 64;

/// Reach of the first look across the hypothesis, and of the second across what was found.
const FIRST_REACH: usize = 14;
const SECOND_REACH: usize = 9;
/// Half the width assumed before it is known (px).
const UNKNOWN_HALF_PX: f64 = 3.0;
/// How offsets are smoothed at the first and second look.
const FIRST: Smoothing = Smoothing {
    over_time: 2.0,
    along: 1.0,
    quick_px: 0.0,
};
pub(super) const SECOND: Smoothing = Smoothing {
    over_time: 0.5,
    along: 0.5,
    quick_px: 0.75,
};
/// Weight of what is seen where the tip weight hides the rope.
const HIDDEN: f64 = 0.02;
/// Around the free end, and the tip weight found there.
const FREE_END: Window = Window {
    before: 45,
    beyond: 45,
    reach: END_REACH,
};
const TIP: Window = Window {
    before: 30,
    beyond: 30,
    reach: END_REACH,
};
/// Colours and ends are learnt from about so many frames.
const LEARNT: usize = 64;
/// Yarns of a rope, and sides of a tip weight, of different colour.
const ROPE_COLOURS: usize = 3;
const TIP_COLOURS: usize = 2;
/// The tip weight's centre lies within this of the hypothesis's end (px).
const END_REACH_PX: f64 = 24.0;
/// It covers as much of the picture as the rope, at least nearly.
const COVERED: f64 = 0.85;
/// The tip weight is looked for this far from where the curve ends, at first and when its
/// colours are known (px).
const TIP_REACH_PX: [f64; 2] = [8.0, 5.0];
/// A cylinder that leaves less than this part of the contrast unexplained tells where the
/// rope's middle is; one that leaves less than the second, how thick it is.
const CYLINDER: f64 = 0.015;
const CYLINDER_WIDTH: f64 = 0.05;
/// Where the rope is seen to begin counts within this of where the arm says it does (px).
const START_PX: f64 = 4.0;
/// How much of the difference counts.
const SEEN_PART: f64 = 0.25;
/// Shades in which its size is measured, if all frames are read. In wider ones, by which its
/// place is found better, a pixel half covered passes for a whole one.
const SIZED_SHADES: [f32; 3] = [0.85, 1.0, 1.15];
/// Stiffness of its offsets over time, and their pull to the curve's end.
const TIP_STIFFNESS: f64 = 0.05;
const TIP_PULL: f64 = 0.02;

/// A film's frames, and the hypothesis's curves in them.
pub(super) struct Reader<'a> {
    frames: Vec<&'a Lit<'a>>,
    curves: Vec<Vec<Pixel>>,
    /// Every which frame of the film they are.
    every: usize,
}

impl<'a> Reader<'a> {
    /// Of each `every`-th frame of a film.
    pub(super) fn new(frames: Vec<&'a Lit<'a>>, every: usize, curves: Vec<Vec<Pixel>>) -> Self {
        Self {
            frames,
            curves,
            every,
        }
    }

    /// The frames that colours and ends are learnt from, and the curves in them.
    fn learnt(&self) -> impl Iterator<Item = (&'a Lit<'a>, &[Pixel])> {
        let every = (self.frames.len() / LEARNT).max(1);
        let frames = self.frames.iter().zip(&self.curves).step_by(every);
        frames.map(|(lit, curve)| (*lit, curve.as_slice()))
    }

    /// Reads all frames. `reported_px` is where the arm says that the rope begins, from the
    /// curves' beginning on.
    pub(super) fn read(mut self, reported_px: f64) -> Reading {
        // First, whatever the scene does not explain.
        let look = ProfileSearch {
            reach: FIRST_REACH,
            half_width_px: UNKNOWN_HALF_PX,
            jump: 0.02,
        };
        let hypothesis = self.curves.clone();
        let field = self.look(look, |lit, p| lit.unexplained(p).map_or(0.0, |(e, _)| e));
        self.follow(field.clone(), FIRST, None);
        let rope = groups(&self.rope_samples(), ROPE_COLOURS);
        let frames = self.learnt();
        let evident = frames.map(|(lit, curve)| (curve.to_vec(), |p| Some(lit.unexplained(p)?.0)));
        let picture = EndPicture::of(FREE_END, evident);
        let mut end = end::find(&picture, picture.rope_half_px(), END_REACH_PX, 0.0);
        // A weight thicker than the look is wide draws it to one of its sides.
        self.curves = hypothesis;
        self.follow(field, FIRST, Some(&end));
        // The arm says where the clamp is, but for the camera's place; the picture shows where
        // the rope comes out of it, but for caps and knots, and counts less.
        let coloured = self.learnt().map(|(lit, curve)| {
            let clamp_last = curve.iter().rev().copied().collect();
            (clamp_last, |p| Some(lit.colours(p)?.0))
        });
        let seen_px = start_px(coloured);
        let seen_px = seen_px.filter(|seen| (seen - reported_px).abs() <= START_PX);
        let start_px = seen_px.map_or(reported_px, |seen| {
            reported_px + SEEN_PART * (seen - reported_px)
        });
        // Then what has the rope's colours.
        let look = ProfileSearch {
            reach: SECOND_REACH,
            half_width_px: end.rope_half_px,
            jump: 0.05,
        };
        let shades = shaded(&rope, &SHADES);
        let field = self.look(look, |lit, p| lit.present(&shades, p));
        let evident = field
            .iter()
            .map(|f| f.iter().map(|o| o.weight).collect())
            .collect();
        self.follow(field, SECOND, Some(&end));
        let still = self.still_frames();
        let round = self.round(&still);
        if round.left < CYLINDER {
            for curve in &mut self.curves {
                *curve = moved(curve, std::iter::repeat(round.middle_px));
            }
        }
        let rope_px = if round.left < CYLINDER_WIDTH {
            round.radius_px
        } else {
            end.rope_half_px
        };
        // First roughly, then with the size that the median picture of all weights has.
        let none = vec![[Offset::NONE; 2]; self.frames.len()];
        let (tip, tips) = self.tips(&end, &none, (&[], TIP_REACH_PX[0]));
        let both = [&rope[..], &tip].concat();
        let disc = self.tip_disc(&still, &end, &shaded(&both, &SHADES), &tips);
        let radius_px = if self.every > 1 {
            disc.radius_px
        } else {
            let shades = shaded(&both, &SIZED_SHADES);
            self.tip_disc(&still, &end, &shades, &tips).radius_px
        };
        let along_px = |tips: &[[Offset; 2]]| median(tips.iter().map(|[along, _]| along.px));
        end.centre_px += along_px(&tips) + disc.centre_px;
        end.radius_px = disc.radius_px;
        let (tip, mut tips) = self.tips(&end, &tips, (&rope, TIP_REACH_PX[1]));
        // Where they are on average, the median picture has told.
        let usual_px = along_px(&tips);
        tips.iter_mut().for_each(|[along, _]| along.px -= usual_px);
        Reading {
            curves: self.curves,
            evident,
            start_px,
            end,
            tips,
            radii_px: [rope_px, radius_px.max(rope_px)],
            rope,
            tip,
        }
    }

    /// Where evidence lies across the curves.
    fn look(&self, look: ProfileSearch, at: impl Fn(&Lit<'_>, Pixel) -> f32) -> Vec<Vec<Offset>> {
        let frames = self.frames.iter().zip(&self.curves);
        frames
            .map(|(lit, curve)| offsets(curve, look, |p| at(lit, p)))
            .collect()
    }

    /// Moves all curves to what was seen, but for what the tip weight hides.
    fn follow(&mut self, mut field: Vec<Vec<Offset>>, mut smoothing: Smoothing, end: Option<&End>) {
        if let Some(end) = end {
            for (offsets, curve) in field.iter_mut().zip(&self.curves) {
                for offset in &mut offsets[end.nodes_shown(curve)..] {
                    offset.weight *= HIDDEN;
                }
            }
        }
        // Offsets in frames further apart in time have less to do with each other.
        let apart = (self.every as f64).powi(3);
        smoothing.over_time /= apart;
        smooth_field(&mut field, smoothing);
        for (curve, offsets) in self.curves.iter_mut().zip(&field) {
            *curve = respaced(&moved(curve, offsets.iter().map(|o| o.px)), curve);
        }
    }

    /// The quarter of the frames in which the rope moves least.
    fn still_frames(&self) -> Vec<usize> {
        let moved_px = |i: usize| -> f64 {
            let ways = self.curves[i - 1].iter().zip(&self.curves[i]);
            ways.map(|(a, b)| distance_px(*a, *b)).sum()
        };
        let mut order: Vec<(f64, usize)> =
            (1..self.curves.len()).map(|i| (moved_px(i), i)).collect();
        order.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        order.truncate(self.curves.len().div_ceil(4));
        order.into_iter().map(|(_, i)| i).collect()
    }

    /// The rope's cross section in some frames, but for its ends.
    fn round(&self, still: &[usize]) -> Round {
        let mut profile = Profile {
            seen: [0.0; _],
            behind: [0.0; _],
        };
        let mut counts = profile.seen;
        for &i in still {
            let nodes = self.curves[i].iter().zip(normals(&self.curves[i]));
            for (p, n) in nodes.take(NODES * 3 / 4).skip(NODES / 6) {
                for (k, count) in counts.iter_mut().enumerate() {
                    let aside = (k as f64 - round::REACH as f64) * round::STEP_PX;
                    if let Some((seen, behind)) = self.frames[i].colours(p + n * aside) {
                        profile.seen[k] += f64::from(seen[0]);
                        profile.behind[k] += f64::from(behind[0]);
                        *count += 1.0;
                    }
                }
            }
        }
        for (k, count) in counts.into_iter().enumerate() {
            profile.seen[k] /= f64::max(count, 1.0);
            profile.behind[k] /= f64::max(count, 1.0);
        }
        round::fit(&profile)
    }

    /// Centre and radius of the tip weight in the median picture of some frames around where
    /// it was found.
    fn tip_disc(
        &self,
        still: &[usize],
        end: &End,
        shades: &[Colour],
        places: &[[Offset; 2]],
    ) -> End {
        let frames = still.iter().map(|&i| {
            let (lit, (c, t)) = (self.frames[i], tip(&self.curves[i], end, places[i]));
            // Straight on both sides: the weight hides how the rope bends there.
            let axis = (0..5).map(|i| c - t * (10.0 * f64::from(4 - i))).collect();
            (axis, move |p| {
                let (seen, behind) = lit.colours(p)?;
                Some(coverage(seen, behind, shades, lit.scene.noise, 0.0))
            })
        });
        let picture = EndPicture::of(TIP, frames);
        let rope_half_px = picture.rope_half_px().min(end.rope_half_px);
        end::find(&picture, rope_half_px, TIP_REACH_PX[0], COVERED)
    }

    /// Colours where the rope is evident, but for its ends, across half its width.
    fn rope_samples(&self) -> Vec<Colour> {
        let mut samples = Vec::new();
        for (lit, curve) in self.learnt() {
            let nodes = curve.iter().zip(normals(curve));
            for (p, n) in nodes.take(NODES * 7 / 8).skip(NODES / 8) {
                let places = [-2.0, 0.0, 2.0].map(|aside| p + n * aside);
                samples.extend(places.into_iter().filter_map(|p| evident(lit, p)));
            }
        }
        samples
    }

    /// Colours around the tip weight's centre where it was found.
    fn tip_samples(&self, end: &End, places: &[[Offset; 2]]) -> Vec<Colour> {
        let every = (self.frames.len() / LEARNT).max(1);
        let mut samples = Vec::new();
        for ((lit, curve), place) in self.learnt().zip(places.iter().step_by(every)) {
            let (c, _) = tip(curve, end, *place);
            let [u, v] = [Pixel::x(), Pixel::y()].map(|d| d * (0.4 * end.radius_px));
            let around = [c, c + u, c - u, c + v, c - v];
            samples.extend(around.into_iter().filter_map(|p| evident(lit, p)));
        }
        samples
    }

    /// The tip weight's colours, learnt where it was found before, and its place along and
    /// across the curve in each frame; it may also have the colours of the rope before it.
    fn tips(
        &self,
        end: &End,
        before: &[[Offset; 2]],
        (rope, reach_px): (&[Colour], f64),
    ) -> (Vec<Colour>, Vec<[Offset; 2]>) {
        let colours = groups(&self.tip_samples(end, before), TIP_COLOURS);
        // Where it has colours of its own, the rope's would only blur where it begins.
        let is_own = |c: &&Colour| rope.iter().all(|r| are_apart(c, r));
        let own: Vec<Colour> = colours.iter().filter(is_own).copied().collect();
        let looked_for = if own.is_empty() {
            [&colours[..], rope].concat()
        } else {
            own
        };
        let looked_for = shaded(&looked_for, &SHADES);
        let frames = self.frames.iter().zip(&self.curves);
        let (along, aside): (Vec<Offset>, Vec<Offset>) = frames
            .map(|(lit, curve)| {
                let (centre, t) = from_end(curve, end.centre_px);
                let disc = Disc {
                    centre,
                    radius_px: end.radius_px,
                    outwards: t,
                    reach_px,
                };
                let (o, weight) = disc.find(|p| lit.present(&looked_for, p));
                let offset = |px| Offset { px, weight };
                (offset(o.dot(&t)), offset(o.dot(&across(t))))
            })
            .unzip();
        let smooth = |offsets: &[Offset]| smoothed(offsets, TIP_STIFFNESS, TIP_PULL);
        let places = smooth(&along).into_iter().zip(smooth(&aside));
        (
            colours,
            places.map(|(along, aside)| [along, aside]).collect(),
        )
    }
}

/// The tip weight's centre where it was found, and the curve's direction there.
fn tip(curve: &[Pixel], end: &End, [along, aside]: [Offset; 2]) -> (Pixel, Pixel) {
    let (c, t) = from_end(curve, end.centre_px + along.px);
    (c + across(t) * aside.px, t)
}

/// Colour of a place where something other than the scene is evident.
fn evident(lit: &Lit<'_>, p: Pixel) -> Option<Colour> {
    let (evidence, seen) = lit.unexplained(p)?;
    (evidence > 0.6).then_some(seen)
}
