//! One step of the tracker: from the curve in one frame to the next.

use shared_types::StereoCamera;

use super::background::Background;
use super::clamp::ClampPath;
use super::curve::{add, folds, length, norm, normals, resample, scale, smooth, sub};
use super::evidence::{Band, Colour, Coverage, Matter, Window};
use super::first_frame::{LEAD_FULL, LEAD_SHADES};
use super::lateral::{Across, Search, measure};
use super::lead;
use super::outline::{Circle, Contrast, RopeEnd};
use super::plane::{Point, RopePlane};
use super::state::State;
use crate::frame::EyeFrame;

/// Nodes of the tracked curve.
pub(super) const NODES: usize = 64;
/// Search range across the curve (px).
pub(super) const RANGE_PX: f64 = 12.0;
/// Search range after the rope was lost (px).
const WIDE_RANGE_PX: f64 = 32.0;
/// Strength of smoothing against weights of at most 1: features longer than
/// about a sixth of the rope pass.
pub(super) const SMOOTHING: f64 = 10.0;
/// Length may differ from the first frame's by this part.
const LENGTH_TOLERANCE: f64 = 0.04;
/// The clamp hides the rope's first part (m).
const HIDDEN_BY_CLAMP_M: f64 = 0.007;
/// Coverage below which a node counts as not seen.
const LEAST_COVERAGE: f64 = 0.2;
/// Weight that keeps an unseen node near its prediction.
pub(super) const UNSEEN_WEIGHT: f64 = 1e-3;
/// Part of the lead's area that must be seen.
pub(super) const LEAST_LEAD: f64 = 0.35;
/// Mean coverage below which the rope is lost.
pub(super) const LOST_BELOW: f64 = 0.3;
/// Ropes of a larger radius show a lit and a dark side (px).
const FAT_ROPE_PX: f64 = 2.2;
/// How far the chroma of a thinner rope's pixels may be off (part of its contrast): one
/// pixel on the rope and one beside it share a sample.
const SMEAR: f32 = 0.5;
/// Weight of clamp and lead against a node's.
pub(super) const ANCHOR: f64 = 50.0;
/// What looks like the rope is noticed this far beside it (px).
const NOTICE_PX: f64 = 24.0;
/// Coverage of something beside the rope that can be taken for it.
const RIVAL: f64 = 0.6;
/// Part of the lead's area that, seen in one place beside it, can be another lead.
const RIVAL_LEAD: f64 = 0.5;
/// Part of the coverage of most nodes below which one may be covered by something; a thin
/// rope in motion is seen less everywhere.
const UNSEEN: f64 = 0.5;
/// Part of the nodes beside which a rival makes a frame ambiguous, and of nodes in a row
/// not seen that makes the rope hidden in part.
const RIVALS: f64 = 0.12;
/// Part of the search range in which the lead is looked for first.
const NEAR: f64 = 0.3;
/// Part of the lead's area that, seen near the expected place, ends the search.
const ENOUGH_LEAD: f64 = 0.7;

/// The lead in one frame.
struct LeadFound {
    /// `None` when too little of it is seen.
    centre: Option<Point>,
    /// Part of its area that is seen.
    seen: f64,
    /// A second one is near.
    rival: bool,
}

/// What the rope looks like, learnt from the first frame.
#[derive(Debug, Clone)]
pub(super) struct RopeModel {
    pub(super) rope: (Colour, f32),
    pub(super) lead: (Colour, f32),
    pub(super) rope_radius_m: f64,
    pub(super) lead_radius_m: f64,
    pub(super) length_m: f64,
    /// Coverage found along a fully visible rope: shaded edges and poor contrast
    /// leave it below 1.
    pub(super) usual_coverage: f64,
}

impl RopeModel {
    /// Neither colour nor width sets the lead apart from the rope.
    pub(super) fn lead_blends_in(&self) -> bool {
        lead::blends_in(
            self.lead.0,
            self.rope,
            self.lead_radius_m / self.rope_radius_m,
        )
    }
}

/// Everything that stays the same from frame to frame.
pub(super) struct Follower<'a> {
    pub(super) camera: &'a StereoCamera,
    pub(super) clamp: &'a ClampPath,
    pub(super) plane: &'a RopePlane,
    pub(super) background: &'a Background,
    pub(super) model: RopeModel,
}

/// Nodes in a row that something may cover: seen far less than most of the rope is.
fn longest_unseen(nodes: &[Across]) -> usize {
    let mut seen: Vec<f64> = nodes.iter().map(|node| node.confidence).collect();
    seen.sort_by(f64::total_cmp);
    let least = UNSEEN * seen.get(seen.len() / 2).copied().unwrap_or(0.0);
    nodes
        .split(|node| node.confidence >= least)
        .map(<[Across]>::len)
        .max()
        .unwrap_or(0)
}

impl Follower<'_> {
    /// The clamp on the plane in the frame that starts at `t_s`: the row it
    /// is seen in decides when.
    pub(super) fn clamp_at(&self, t_s: f64) -> Point {
        let mut row = f64::from(self.camera.height_px) / 2.0;
        let mut pixel = None;
        for _ in 0..2 {
            let p = self.clamp.at(t_s + self.camera.row_time_s(row)).p_w_m;
            pixel = self.camera.project_left(&p);
            row = pixel.map_or(row, |[_, v]| v);
        }
        pixel.map_or([0.0, 0.0], |p| self.plane.point_at(p))
    }

    /// Finds the rope in a frame from its state in a neighbouring one (earlier
    /// or later).
    pub(super) fn step(&self, frame: &EyeFrame, t_s: f64, before: &State) -> State {
        let dt = t_s - before.t_s;
        let mut predicted: Vec<Point> = before
            .curve
            .iter()
            .zip(&before.velocity)
            .map(|(p, v)| add(*p, scale(*v, dt)))
            .collect();
        // The clamp is known: pull the curve onto it, less and less along the rope.
        let miss = sub(self.clamp_at(t_s), predicted[0]);
        blend(&mut predicted, miss, |part| (1.0 - 2.0 * part).max(0.0));
        let gain = self.background.gain(frame);
        let state = self.locate(frame, gain, t_s, &predicted, before, RANGE_PX);
        let lost = state.score() < LOST_BELOW;
        if !lost && !state.hidden {
            return state;
        }
        // What is covered stays unseen; what moved otherwise than predicted, as after
        // missing frames, is seen whole further off.
        let wide = self.locate(frame, gain, t_s, &predicted, before, WIDE_RANGE_PX);
        let whole = !wide.hidden && !wide.ambiguous;
        if wide.score() > state.score() && (lost || whole) {
            wide
        } else {
            state
        }
    }

    /// Finds the rope near a predicted curve.
    pub(super) fn locate(
        &self,
        frame: &EyeFrame,
        gain: f32,
        t_s: f64,
        predicted: &[Point],
        before: &State,
        range_px: f64,
    ) -> State {
        let dt = t_s - before.t_s;
        let mut curve = predicted.to_vec();
        if self.model.lead_blends_in() {
            // Only along the rope itself can its end be found.
            let found = self.find_rope(frame, gain, &curve, &before.velocity, range_px);
            let places: Vec<Point> = found.iter().map(|node| node.point).collect();
            let weights: Vec<f64> = found.iter().map(|node| node.confidence + 1e-3).collect();
            curve = resample(
                &smooth(&places, &weights, SMOOTHING),
                self.model.length_m,
                NODES,
            );
        }
        let tip_speed = norm(before.velocity[NODES - 1]);
        let LeadFound {
            centre: lead,
            seen: lead_seen,
            rival: lead_rival,
        } = self.find_lead(frame, gain, &curve, tip_speed, range_px);
        if let Some(lead) = lead {
            let miss = sub(lead, curve[NODES - 1]);
            blend(&mut curve, miss, |part| part * part);
        }
        let found = self.find_rope(frame, gain, &curve, &before.velocity, range_px);
        let spacing = self.model.length_m / (NODES - 1) as f64;
        let first = (HIDDEN_BY_CLAMP_M / spacing).ceil() as usize;
        let last = NODES - 1 - (self.model.lead_radius_m * 1.1 / spacing).ceil() as usize;
        // Hidden or unseen nodes stay near where they were expected.
        let mut places = curve.clone();
        let mut weights = vec![UNSEEN_WEIGHT; NODES];
        for (i, node) in found.iter().enumerate().take(last + 1).skip(first) {
            if node.confidence > LEAST_COVERAGE {
                places[i] = node.point;
                weights[i] = node.confidence * node.confidence;
            }
        }
        places[0] = self.clamp_at(t_s);
        weights[0] = ANCHOR;
        if let Some(lead) = lead {
            places[NODES - 1] = lead;
            weights[NODES - 1] = ANCHOR * lead_seen;
        }
        let fitted = smooth(&places, &weights, SMOOTHING);
        let long = self.plausible_length(length(&fitted), lead.is_some());
        let curve = resample(&fitted, long, NODES);

        let rivals = found[first..=last].iter();
        let rivals = rivals.filter(|node| node.rival > RIVAL).count();
        let ambiguous = lead_rival || rivals as f64 > RIVALS * NODES as f64;
        let unseen = longest_unseen(&found[first..=last]) as f64 > RIVALS * NODES as f64;
        // No rope turns back on itself within a node: some of it was not measured.
        let hidden = unseen || folds(&curve);
        let mut confidence: Vec<f64> = found.iter().map(|node| node.confidence).collect();
        let at_end = if lead.is_some() {
            lead_seen
        } else {
            confidence[last] / 2.0
        };
        let at_start = confidence[first];
        confidence[..first].fill(at_start);
        confidence[last + 1..].fill(at_end);
        let lost = mean(&confidence) < LOST_BELOW;
        let velocity = if lost {
            // Do not extrapolate what was not seen.
            before.velocity.iter().map(|v| scale(*v, 0.7)).collect()
        } else {
            let moved = curve.iter().zip(&before.curve);
            moved
                .map(|(now, then)| scale(sub(*now, *then), 1.0 / dt))
                .collect()
        };
        State {
            t_s,
            velocity,
            curve,
            confidence,
            lost,
            hidden,
            ambiguous,
        }
    }

    /// Measures the rope across a curve that moves with the given velocity.
    fn find_rope(
        &self,
        frame: &EyeFrame,
        gain: f32,
        curve: &[Point],
        velocity: &[Point],
        range_px: f64,
    ) -> Vec<Across> {
        let exposure = self.camera.exposure_s * self.plane.px_per_m;
        let blur: Vec<f64> = velocity
            .iter()
            .zip(normals(curve))
            .map(|(v, n)| (v[0] * n[0] + v[1] * n[1]).abs() * exposure)
            .collect();
        let pixels: Vec<[f64; 2]> = curve.iter().map(|p| self.plane.to_pixel(*p)).collect();
        let notice_px = range_px.max(NOTICE_PX);
        let reach_px = notice_px + 4.0;
        let window = Window::around(pixels.iter().copied(), reach_px, frame);
        let band = Band::along(&pixels, reach_px, window);
        let coverage = self.rope_matter(gain).coverage_of(frame, window, &band);
        let search = Search {
            range_px,
            notice_px,
            lead_radius_px: self.model.lead_radius_m * self.plane.px_per_m,
            rope_radius_px: self.model.rope_radius_m * self.plane.px_per_m,
            usual_coverage: self.model.usual_coverage,
            blur_px: &blur,
        };
        measure(curve, self.plane, &coverage, &search)
    }

    /// Length to be used where `measured` was found.
    pub(super) fn plausible_length(&self, measured: f64, lead_found: bool) -> f64 {
        let tolerance = if lead_found { LENGTH_TOLERANCE } else { 0.0 };
        measured.clamp(
            self.model.length_m * (1.0 - tolerance),
            self.model.length_m * (1.0 + tolerance),
        )
    }

    /// A thin rope's coverage is measured; a fat one is shaded like the lead,
    /// and only its outline counts.
    pub(super) fn rope_matter(&self, gain: f32) -> Matter<'_> {
        let fat = self.model.rope_radius_m * self.plane.px_per_m > FAT_ROPE_PX;
        let (full, shades) = if fat {
            (LEAD_FULL, &LEAD_SHADES[..])
        } else {
            (1.0, &[1.0][..])
        };
        Matter {
            background: self.background,
            colour: self.model.rope.0,
            scatter: self.model.rope.1,
            gain,
            full,
            shades,
            rival: None,
            smear: if fat { 0.0 } else { SMEAR },
        }
    }

    pub(super) fn lead_matter(&self, gain: f32) -> Matter<'_> {
        Matter {
            background: self.background,
            colour: self.model.lead.0,
            scatter: self.model.lead.1,
            gain,
            full: LEAD_FULL,
            shades: &LEAD_SHADES,
            rival: Some(self.model.rope.0),
            smear: 0.0,
        }
    }

    /// Where the rope of a curve hides the lead's outline.
    pub(super) fn rope_at_lead(&self, curve: &[Point]) -> RopeEnd {
        let spacing = self.model.length_m / (NODES - 1) as f64;
        let nodes = (1.5 * self.model.lead_radius_m / spacing).ceil() as usize;
        let [a, b] = [NODES - 1, NODES - 1 - nodes.clamp(1, NODES / 4)]
            .map(|node| self.plane.to_pixel(curve[node]));
        RopeEnd {
            angle_rad: (b[1] - a[1]).atan2(b[0] - a[0]),
            radius_px: self.model.rope_radius_m * self.plane.px_per_m,
        }
    }

    /// The lead near a predicted place: a centroid over a shrinking window (mean
    /// shift), then its outline.
    fn find_lead(
        &self,
        frame: &EyeFrame,
        gain: f32,
        predicted: &[Point],
        speed_m_s: f64,
        range_px: f64,
    ) -> LeadFound {
        let radius = self.model.lead_radius_m * self.plane.px_per_m;
        let blur = speed_m_s * self.camera.exposure_s * self.plane.px_per_m;
        let expected = Circle {
            centre: self.plane.to_pixel(predicted[NODES - 1]),
            radius_px: radius,
        };
        // The widest look, and room for the centre to move.
        let margin = radius + 2.0 * range_px + blur / 2.0 + 2.0;
        let window = Window::around(std::iter::once(expected.centre), margin, frame);
        let coverage = self.lead_matter(gain).coverage(frame, window);
        let tight = radius + blur / 2.0 + 1.5;
        let whole = std::f64::consts::PI * radius * radius;
        // Near the expected place first: further off there may be another one.
        let near = [NEAR, NEAR / 2.0, 0.0, 0.0, 0.0];
        let far = [1.0, 0.6, 0.3, 0.0, 0.0, 0.0];
        let (mut area, mut centre) = shift(&coverage, expected.centre, tight, range_px, &near);
        if area < ENOUGH_LEAD * whole {
            (area, centre) = shift(&coverage, expected.centre, tight, range_px, &far);
        }
        let seen = (area / whole).min(1.0);
        let contrast = Contrast {
            frame,
            background: self.background,
            gain,
        };
        let blends_in = self.model.lead_blends_in();
        let other = coverage.most_beside(centre, tight, radius, 1.5 * range_px);
        let rope = self.rope_at_lead(predicted);
        if blends_in {
            // A centroid would creep up the rope.
            centre = contrast
                .free_end(expected, rope, range_px)
                .unwrap_or(expected.centre);
        } else if let Some(circle) = contrast.circle(Circle { centre, ..expected }, blur, rope) {
            centre = circle.centre;
        }
        LeadFound {
            centre: (seen > LEAST_LEAD).then(|| self.plane.point_at(centre)),
            seen,
            rival: !blends_in && other > RIVAL_LEAD * whole,
        }
    }
}

/// Mean shift: sum and centroid of coverage over windows of the radii `tight_px`
/// and the given parts of `range_px`.
fn shift(
    coverage: &Coverage,
    mut centre: [f64; 2],
    tight_px: f64,
    range_px: f64,
    parts: &[f64],
) -> (f64, [f64; 2]) {
    let mut area = 0.0;
    for part in parts {
        (area, centre) = coverage.centroid(centre, tight_px + part * range_px);
    }
    (area, centre)
}

/// Adds `shift` to every node times a factor of its place (0 clamp, 1 lead).
fn blend(curve: &mut [Point], shift: Point, factor: impl Fn(f64) -> f64) {
    let last = (curve.len() - 1) as f64;
    for (i, p) in curve.iter_mut().enumerate() {
        *p = add(*p, scale(shift, factor(i as f64 / last)));
    }
}

pub(super) fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}
