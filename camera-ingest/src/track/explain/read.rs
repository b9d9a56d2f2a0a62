//! Reads the film off along the hypothesis: curve, ends and tip weight in every frame.

use super::bulk::Bulk;
use super::colour::{Colour, SHADES, are_apart, colour_at, coverage, groups};
use super::curve::{from_end, normals, respaced};
use super::disc::Disc;
use super::end::{self, End};
use super::ends::{EndFrames, EndPicture, Window};
use super::evidence::Scene;
use super::field::{Look, Offset, moved, offsets, smooth_field, smoothed};
use super::reading::Reading;
use super::round::{self, Profile, Round};
use crate::frame::EyeFrame;

/// Places along the rope.
pub(super) const NODES: usize = 64;

/// Reach of the first look across the hypothesis, and of the second across what was found.
const FIRST_REACH: usize = 14;
const SECOND_REACH: usize = 9;
/// Half the width assumed before it is known (px).
const UNKNOWN_HALF_PX: f64 = 3.0;
/// Stiffness of the offsets over time and along the rope, at the first and second look.
const FIRST_STIFFNESS: [f64; 2] = [2.0, 1.0];
const SECOND_STIFFNESS: [f64; 2] = [0.5, 0.5];
/// Weight of what is seen where the tip weight hides the rope.
const HIDDEN: f64 = 0.02;
/// Around the free end, the tip weight found there, and the clamp.
const FREE_END: Window = Window {
    before: 45,
    beyond: 45,
    reach: 24,
};
const TIP: Window = Window {
    before: 30,
    beyond: 30,
    reach: 24,
};
const CLAMP_END: Window = Window {
    before: 45,
    beyond: 25,
    reach: 10,
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
/// Shades in which its size is measured: in wider ones, by which its place is found better, a
/// pixel half covered passes for a whole one.
const SIZED_SHADES: [f32; 3] = [0.85, 1.0, 1.15];
/// Stiffness of its offsets over time, and their pull to the curve's end.
const TIP_STIFFNESS: f64 = 0.3;
const TIP_PULL: f64 = 0.02;

/// One frame, how bright it is, and what in it is too large to be a rope.
pub(super) struct Lit<'a> {
    pub(super) frame: &'a EyeFrame,
    pub(super) gain: f32,
    pub(super) bulk: Bulk,
}

impl<'a> Lit<'a> {
    pub(super) fn of(frame: &'a EyeFrame, scene: &Scene) -> Self {
        let gain = scene.gain(frame);
        Self {
            frame,
            gain,
            bulk: Bulk::of(frame, gain, scene),
        }
    }
}

/// Frames of one eye, and the hypothesis's curves in them.
pub(super) struct Reader<'a> {
    scene: &'a Scene,
    frames: Vec<&'a Lit<'a>>,
    curves: Vec<Vec<[f64; 2]>>,
    /// Offsets in frames further apart in time have less to do with each other.
    apart: f64,
}

impl<'a> Reader<'a> {
    /// Of each `every`-th frame of a film.
    pub(super) fn new(
        scene: &'a Scene,
        frames: Vec<&'a Lit<'a>>,
        every: usize,
        curves: Vec<Vec<[f64; 2]>>,
    ) -> Self {
        Self {
            scene,
            frames,
            curves,
            apart: (every as f64).powi(3),
        }
    }

    fn learn_every(&self) -> usize {
        (self.frames.len() / LEARNT).max(1)
    }

    /// Colour in the scene's light, and the scene's there.
    fn colours(&self, lit: &Lit<'_>, p: [f64; 2]) -> Option<(Colour, Colour)> {
        Some((colour_at(lit.frame, lit.gain, p)?, self.scene.colour_at(p)?))
    }

    fn unexplained(&self, lit: &Lit<'_>, p: [f64; 2]) -> f32 {
        self.colours(lit, p).map_or(0.0, |(seen, behind)| {
            self.scene.unexplained(seen, behind) * lit.bulk.at(p)
        })
    }

    /// Evidence of things of some colours.
    fn present(&self, lit: &Lit<'_>, colours: &[Colour], p: [f64; 2]) -> f32 {
        self.scene.present(lit.frame, lit.gain, colours, p)
    }

    /// Reads all frames. `told_px` is where the arm says that the rope begins, from the
    /// curves' beginning on.
    pub(super) fn read(mut self, told_px: f64) -> Reading {
        // First, whatever the scene does not explain.
        let look = Look {
            reach: FIRST_REACH,
            half_width_px: UNKNOWN_HALF_PX,
            jump: 0.02,
        };
        let hypothesis = self.curves.clone();
        let field = self.look(look, |reader, lit, p| reader.unexplained(lit, p));
        self.follow(field.clone(), FIRST_STIFFNESS, None);
        let rope = groups(&self.rope_samples(), ROPE_COLOURS);
        let picture = self.picture(&FREE_END, |curve| curve.to_vec());
        let mut end = end::find(&picture, picture.rope_half_px(), END_REACH_PX, 0.0);
        // A weight thicker than the look is wide draws it to one of its sides.
        self.curves = hypothesis;
        self.follow(field, FIRST_STIFFNESS, Some(&end));
        // The arm says where the clamp is, but for the camera's place; the picture shows where
        // the rope comes out of it, but for caps and knots, and counts less.
        let clamp_last = |curve: &[[f64; 2]]| curve.iter().rev().copied().collect();
        let seen_px = self.picture(&CLAMP_END, clamp_last).start_px();
        let seen_px = seen_px.filter(|seen| (seen - told_px).abs() <= START_PX);
        let start_px = seen_px.map_or(told_px, |seen| told_px + SEEN_PART * (seen - told_px));
        // Then what has the rope's colours.
        let look = Look {
            reach: SECOND_REACH,
            half_width_px: end.rope_half_px,
            jump: 0.05,
        };
        let field = self.look(look, |reader, lit, p| reader.present(lit, &rope, p));
        let evident = field
            .iter()
            .map(|f| f.iter().map(|o| o.weight).collect())
            .collect();
        self.follow(field, SECOND_STIFFNESS, Some(&end));
        let still = self.still_frames();
        let round = self.round(&still);
        if round.left < CYLINDER {
            self.shift(round.middle_px);
        }
        let rope_px = if round.left < CYLINDER_WIDTH {
            round.radius_px
        } else {
            end.rope_half_px
        };
        // First roughly, then with the size that the median picture of all weights has.
        let none = vec![(Offset::NONE, Offset::NONE); self.frames.len()];
        let (tip, tips) = self.tips(&end, &none, (&[], TIP_REACH_PX[0]));
        let both = [&rope[..], &tip].concat();
        let disc = self.tip_disc(&still, &end, (&both, &SHADES), &tips);
        let sized = self.tip_disc(&still, &end, (&both, &SIZED_SHADES), &tips);
        end.centre_px += median_px(&tips) + disc.centre_px;
        end.radius_px = disc.radius_px;
        let (tip, mut tips) = self.tips(&end, &tips, (&rope, TIP_REACH_PX[1]));
        // Where they are on average, the median picture has told.
        let usual_px = median_px(&tips);
        tips.iter_mut().for_each(|(along, _)| along.px -= usual_px);
        Reading {
            curves: self.curves,
            evident,
            start_px,
            end,
            tips,
            radii_px: [rope_px, sized.radius_px.max(rope_px)],
            rope,
            tip,
        }
    }

    /// Where evidence lies across the curves.
    fn look(&self, look: Look, at: impl Fn(&Self, &Lit<'_>, [f64; 2]) -> f32) -> Vec<Vec<Offset>> {
        let frames = self.frames.iter().zip(&self.curves);
        frames
            .map(|(lit, curve)| offsets(curve, &normals(curve), look, |p| at(self, lit, p)))
            .collect()
    }

    /// Moves all curves to what was seen, but for what the tip weight hides.
    fn follow(
        &mut self,
        mut field: Vec<Vec<Offset>>,
        [over_time, along]: [f64; 2],
        end: Option<&End>,
    ) {
        if let Some(end) = end {
            for (offsets, curve) in field.iter_mut().zip(&self.curves) {
                for offset in &mut offsets[end.nodes_shown(curve)..] {
                    offset.weight *= HIDDEN;
                }
            }
        }
        smooth_field(&mut field, over_time / self.apart, along);
        for (curve, offsets) in self.curves.iter_mut().zip(&field) {
            *curve = respaced(&moved(curve, &normals(curve), offsets), curve);
        }
    }

    /// The quarter of the frames in which the rope moves least.
    fn still_frames(&self) -> Vec<usize> {
        let moved = |i: usize| {
            let [before, now] = [&self.curves[i.saturating_sub(1)], &self.curves[i]];
            let ways = before.iter().zip(now);
            ways.map(|(a, b)| (a[0] - b[0]).hypot(a[1] - b[1]))
                .sum::<f64>()
        };
        let mut order: Vec<(f64, usize)> = (1..self.curves.len()).map(|i| (moved(i), i)).collect();
        order.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        order
            .into_iter()
            .map(|(_, i)| i)
            .take(self.curves.len().div_ceil(4))
            .collect()
    }

    /// The rope's cross section in some frames, but for its ends.
    fn round(&self, still: &[usize]) -> Round {
        let mut profile = Profile {
            seen: [0.0; _],
            behind: [0.0; _],
        };
        let mut counts = profile.seen;
        for &i in still {
            let (lit, curve) = (&self.frames[i], &self.curves[i]);
            for (p, n) in curve
                .iter()
                .zip(normals(curve))
                .take(NODES * 3 / 4)
                .skip(NODES / 6)
            {
                for (k, count) in counts.iter_mut().enumerate() {
                    let aside = (k as f64 - round::REACH as f64) * round::STEP_PX;
                    let place = [p[0] + n[0] * aside, p[1] + n[1] * aside];
                    if let Some((seen, behind)) = self.colours(lit, place) {
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

    /// Moves all curves along their normals.
    fn shift(&mut self, px: f64) {
        for curve in &mut self.curves {
            let normals = normals(curve);
            for (p, n) in curve.iter_mut().zip(normals) {
                *p = [p[0] + n[0] * px, p[1] + n[1] * px];
            }
        }
    }

    /// Centre and radius of the tip weight in the median picture of some frames around where
    /// it was found.
    fn tip_disc(
        &self,
        still: &[usize],
        end: &End,
        (colours, shades): (&[Colour], &[f32]),
        places: &[(Offset, Offset)],
    ) -> End {
        let mut frames = EndFrames::new(TIP);
        let noise = self.scene.noise();
        for &i in still {
            let (lit, curve, (along, across)) = (&self.frames[i], &self.curves[i], places[i]);
            let (c, t) = from_end(curve, end.centre_px + along.px);
            let c = [c[0] - t[1] * across.px, c[1] + t[0] * across.px];
            // Straight on both sides: the weight hides how the rope bends there.
            let axis: Vec<[f64; 2]> = (0..5)
                .map(|i| {
                    let back = 10.0 * f64::from(4 - i);
                    [c[0] - t[0] * back, c[1] - t[1] * back]
                })
                .collect();
            frames.add(&axis, |p| {
                let (seen, behind) = self.colours(lit, p)?;
                Some((coverage(seen, behind, colours, shades, noise), seen))
            });
        }
        let picture = frames.picture();
        let rope_half_px = picture.rope_half_px().min(end.rope_half_px);
        end::find(&picture, rope_half_px, TIP_REACH_PX[0], COVERED)
    }

    /// Colours where the rope is evident, but for its ends, across half its width.
    fn rope_samples(&self) -> Vec<Colour> {
        let mut samples = Vec::new();
        for (lit, curve) in self
            .frames
            .iter()
            .zip(&self.curves)
            .step_by(self.learn_every())
        {
            for (p, n) in curve
                .iter()
                .zip(normals(curve))
                .take(NODES * 7 / 8)
                .skip(NODES / 8)
            {
                for aside in [-2.0, 0.0, 2.0] {
                    self.sample(
                        lit,
                        [p[0] + n[0] * aside, p[1] + n[1] * aside],
                        &mut samples,
                    );
                }
            }
        }
        samples
    }

    fn sample(&self, lit: &Lit<'_>, p: [f64; 2], samples: &mut Vec<Colour>) {
        if let Some((seen, behind)) = self.colours(lit, p)
            && self.scene.unexplained(seen, behind) * lit.bulk.at(p) > 0.6
        {
            samples.push(seen);
        }
    }

    /// Median picture around one end, which `turned` puts last.
    fn picture(
        &self,
        window: &Window,
        turned: impl Fn(&[[f64; 2]]) -> Vec<[f64; 2]>,
    ) -> EndPicture {
        let mut frames = EndFrames::new(*window);
        for (lit, curve) in self
            .frames
            .iter()
            .zip(&self.curves)
            .step_by(self.learn_every())
        {
            frames.add(&turned(curve), |p| {
                let (seen, behind) = self.colours(lit, p)?;
                Some((self.scene.unexplained(seen, behind) * lit.bulk.at(p), seen))
            });
        }
        frames.picture()
    }

    /// The tip weight's colours, learnt where it was found before, and its place along and
    /// across the curve in each frame; it may also have the colours of the rope before it.
    fn tips(
        &self,
        end: &End,
        before: &[(Offset, Offset)],
        (rope, reach_px): (&[Colour], f64),
    ) -> (Vec<Colour>, Vec<(Offset, Offset)>) {
        let colours = groups(&self.tip_samples(end, before), TIP_COLOURS);
        // Where it has colours of its own, the rope's would only blur where it begins.
        let is_own = |c: &&Colour| rope.iter().all(|r| are_apart(c, r));
        let own: Vec<Colour> = colours.iter().filter(is_own).copied().collect();
        let looked_for = if own.is_empty() {
            [&colours[..], rope].concat()
        } else {
            own
        };
        let frames = self.frames.iter().zip(&self.curves);
        let (along, across): (Vec<Offset>, Vec<Offset>) = frames
            .map(|(lit, curve)| {
                let (centre, t) = from_end(curve, end.centre_px);
                let disc = Disc {
                    centre,
                    radius_px: end.radius_px,
                    outwards: t,
                    reach_px,
                };
                let (o, weight) = disc.find(|p| self.present(lit, &looked_for, p));
                let offset = |px| Offset { px, weight };
                (
                    offset(o[0] * t[0] + o[1] * t[1]),
                    offset(o[1] * t[0] - o[0] * t[1]),
                )
            })
            .unzip();
        let smooth = |offsets: &[Offset]| smoothed(offsets, TIP_STIFFNESS, TIP_PULL);
        let places = smooth(&along).into_iter().zip(smooth(&across));
        (colours, places.collect())
    }

    /// Colours around the tip weight's centre where it was found.
    fn tip_samples(&self, end: &End, places: &[(Offset, Offset)]) -> Vec<Colour> {
        let mut samples = Vec::new();
        let found = self.frames.iter().zip(&self.curves).zip(places);
        for ((lit, curve), (along, across)) in found.step_by(self.learn_every()) {
            let (c, t) = from_end(curve, end.centre_px + along.px);
            let c = [c[0] - t[1] * across.px, c[1] + t[0] * across.px];
            let r = 0.4 * end.radius_px;
            for (x, y) in [(0.0, 0.0), (r, 0.0), (-r, 0.0), (0.0, r), (0.0, -r)] {
                self.sample(lit, [c[0] + x, c[1] + y], &mut samples);
            }
        }
        samples
    }
}

/// How far along the curve the tip weight is usually found.
fn median_px(tips: &[(Offset, Offset)]) -> f64 {
    let mut along: Vec<f64> = tips.iter().map(|(along, _)| along.px).collect();
    along.sort_by(f64::total_cmp);
    along.get(along.len() / 2).copied().unwrap_or(0.0)
}
