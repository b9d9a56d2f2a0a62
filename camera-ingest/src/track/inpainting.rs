//! The scene where something covers it most of the time.
//!
//! A fat lead on a heavy rope hardly moves: the median over frames shows the lead, not
//! what is behind it. Such a place has shown two colours, and the scene's is the one that
//! goes on beside the place. What is covered in every frame is known only by what lies
//! around it: it is filled from there, as far as it looks like what was taken away.

use std::collections::VecDeque;

use crate::frame::ImageFrame;

/// Colours further apart than this are of two things (grey levels, summed over channels).
const OTHER: i32 = 40;
/// Colours nearer than this can be neighbours on one thing (grey levels, summed).
const SMOOTH: i32 = 45;
/// Part of the frames in which a place must have shown another colour.
const SEEN_ELSE: f64 = 0.08;
/// Colours nearer than this to the scene beside a place go on with it (grey levels, summed).
const FITS: i32 = 20;
/// What continues the scene so many times better than the median does is the scene.
const BETTER: i32 = 2;
/// Colours this much apart may be the same one (grey levels, summed).
const NOISE: i32 = 8;
/// Smaller parts of the picture, enclosed by places of two colours, may be covered in
/// every frame.
const ISLAND: f64 = 0.004;

/// Brightness of two pixels side by side and the chroma they share.
type Pair = [u8; 4];

fn apart(a: Pair, b: Pair) -> i32 {
    let off = |k: usize| i32::from(a[k].abs_diff(b[k]));
    (off(0) + off(1)) / 2 + off(2) + off(3)
}

fn pair(frame: &ImageFrame, at: usize) -> Pair {
    [
        frame.luma[2 * at],
        frame.luma[2 * at + 1],
        frame.cb[at],
        frame.cr[at],
    ]
}

/// A frame and how bright it is relative to the scene.
pub(super) type Lit<'a> = (&'a ImageFrame, f32);

/// A place of a frame in the scene's light.
fn lit_pair((frame, gain): Lit<'_>, at: usize) -> Pair {
    let [a, b, cb, cr] = pair(frame, at).map(f32::from);
    let luma = |y: f32| (y / gain).round() as u8;
    let chroma = |c: f32| (128.0 + (c - 128.0) / gain).round() as u8;
    [luma(a), luma(b), chroma(cb), chroma(cr)]
}

fn put(frame: &mut ImageFrame, at: usize, [a, b, cb, cr]: Pair) {
    (frame.luma[2 * at], frame.luma[2 * at + 1]) = (a, b);
    (frame.cb[at], frame.cr[at]) = (cb, cr);
}

/// What is known of a place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Place {
    /// The scene, as it is.
    Known,
    /// Has shown another colour too.
    Open,
    /// Has shown one colour, but may have been covered all the time.
    Island,
    /// Decided; what was taken away, if something was.
    Done(Option<Pair>),
}

/// Takes out of `scene`, the median over `frames`, what covers it mostly.
pub(super) fn uncover(scene: &mut ImageFrame, frames: &[Lit<'_>]) {
    let width = scene.width_px / 2;
    let open = open_places(scene, frames);
    if !open.contains(&true) {
        return;
    }
    let mut places = survey(&open, width);
    let mut queue: VecDeque<usize> = (0..places.len())
        .filter(|at| places[*at] == Place::Known)
        .collect();
    while let Some(from) = queue.pop_front() {
        for at in beside(from, width, places.len()) {
            let taken = match places[at] {
                Place::Known | Place::Done(_) => continue,
                Place::Open => uncovered(scene, &places, at, frames)
                    .or_else(|| continued(scene, places[from], from, at)),
                Place::Island => continued(scene, places[from], from, at),
            };
            if let Some((_, scene_there)) = taken {
                put(scene, at, scene_there);
            }
            places[at] = Place::Done(taken.map(|(covering, _)| covering));
            queue.push_back(at);
        }
    }
}

/// Places that are not of the median's colour in enough of the frames.
fn open_places(scene: &ImageFrame, frames: &[Lit<'_>]) -> Vec<bool> {
    let mut count = vec![0_u16; scene.cb.len()];
    for &frame in frames {
        for (at, count) in count.iter_mut().enumerate() {
            *count += u16::from(apart(lit_pair(frame, at), pair(scene, at)) > OTHER);
        }
    }
    let least = SEEN_ELSE * frames.len() as f64;
    count.iter().map(|n| f64::from(*n) >= least).collect()
}

/// Small parts that places of two colours enclose are islands.
fn survey(open: &[bool], width: usize) -> Vec<Place> {
    let place = |open: &bool| if *open { Place::Open } else { Place::Island };
    let mut places: Vec<Place> = open.iter().map(place).collect();
    let largest_island = ISLAND * open.len() as f64;
    let mut visited = open.to_vec();
    for start in 0..open.len() {
        if visited[start] {
            continue;
        }
        visited[start] = true;
        let mut part = vec![start];
        let mut next = 0;
        while let Some(&from) = part.get(next) {
            next += 1;
            for at in beside(from, width, open.len()) {
                if !std::mem::replace(&mut visited[at], true) {
                    part.push(at);
                }
            }
        }
        if part.len() as f64 > largest_island {
            part.into_iter().for_each(|at| places[at] = Place::Known);
        }
    }
    places
}

/// The places left, right, above and below.
fn beside(at: usize, width: usize, len: usize) -> impl Iterator<Item = usize> {
    let column = at % width;
    [
        (column > 0).then(|| at.wrapping_sub(1)),
        (column + 1 < width).then_some(at + 1),
        at.checked_sub(width),
        Some(at + width).filter(|below| *below < len),
    ]
    .into_iter()
    .flatten()
}

/// What covers an open place and what is behind, if the scene is not what its median
/// shows.
fn uncovered(
    scene: &ImageFrame,
    places: &[Place],
    at: usize,
    frames: &[Lit<'_>],
) -> Option<(Pair, Pair)> {
    let shown = pair(scene, at);
    let around: Vec<Pair> = beside(at, scene.width_px / 2, places.len())
        .filter(|near| matches!(places[*near], Place::Known | Place::Done(_)))
        .map(|near| pair(scene, near))
        .collect();
    let border = |colour: Pair| around.iter().map(|near| apart(*near, colour)).min();
    let mut fitting: Vec<Pair> = frames
        .iter()
        .map(|frame| lit_pair(*frame, at))
        .filter(|seen| border(*seen).is_some_and(|off| off <= FITS))
        .collect();
    if (fitting.len() as f64) < SEEN_ELSE * frames.len() as f64 {
        return None;
    }
    let middle = fitting.len() / 2;
    let mut behind = [0; 4];
    for (k, value) in behind.iter_mut().enumerate() {
        fitting.sort_unstable_by_key(|seen| seen[k]);
        *value = fitting[middle][k];
    }
    let better = BETTER * border(behind)? + NOISE < border(shown)?;
    better.then_some((shown, behind))
}

/// Whether what was taken away at `from` goes on at a place that never or hardly ever
/// showed the scene, and if so what is behind it there.
fn continued(scene: &ImageFrame, there: Place, from: usize, at: usize) -> Option<(Pair, Pair)> {
    let Place::Done(Some(covering)) = there else {
        return None;
    };
    let shown = pair(scene, at);
    (apart(shown, covering) <= SMOOTH).then(|| (shown, pair(scene, from)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::scene::median_frame;

    const WIDTH: usize = 192;
    const HEIGHT: usize = 128;

    /// A textured wall, a still post, and a shaded disc about a column.
    fn frame(centre_u: f64) -> ImageFrame {
        let mut frame = ImageFrame::grey([WIDTH, HEIGHT], 40);
        for i in 0..WIDTH * HEIGHT {
            let (u, v) = ((i % WIDTH) as f64, (i / WIDTH) as f64);
            let wall = 120 + ((u * 0.7).sin() * 6.0 + (v * 0.4).cos() * 6.0) as i16;
            let away = (u - centre_u).hypot(v - 32.0);
            if away < 10.0 {
                frame.luma[i] = 200 - (away * 2.0) as u8;
                if i % 2 == 0 {
                    frame.cb[i / 2] = 60;
                }
            } else if !(70.0..73.0).contains(&u) {
                frame.luma[i] = u8::try_from(wall).unwrap();
            }
        }
        frame
    }

    fn lit(frames: &[ImageFrame]) -> Vec<Lit<'_>> {
        frames.iter().map(|frame| (frame, 1.0)).collect()
    }

    fn scene_of(amplitude_px: f64) -> ImageFrame {
        let swing = |i: usize| 40.0 + amplitude_px * (i as f64 * 0.37).sin();
        let frames: Vec<ImageFrame> = (0..31).map(|i| frame(swing(i))).collect();
        let mut scene = median_frame(&frames);
        uncover(&mut scene, &lit(&frames));
        scene
    }

    /// Places whose scene is another than without the disc.
    fn wrong(scene: &ImageFrame) -> usize {
        let empty = frame(-100.0);
        (0..scene.cb.len())
            .filter(|at| apart(pair(scene, *at), pair(&empty, *at)) > OTHER)
            .count()
    }

    #[test]
    fn a_fat_thing_that_hardly_moves_is_taken_away() {
        // 14: no place is always covered. 7: the middle is.
        for amplitude_px in [14.0, 7.0] {
            let wrong = wrong(&scene_of(amplitude_px));
            assert!(wrong <= 8, "{amplitude_px} px: {wrong} places");
        }
    }

    #[test]
    fn what_never_moves_stays() {
        let still = vec![frame(40.0); 31];
        let mut scene = still[0].clone();
        uncover(&mut scene, &lit(&still));
        assert_eq!(scene, still[0]);
        // The post is passed by the disc now and then.
        let scene = scene_of(28.0);
        let empty = frame(-100.0);
        for v in 0..HEIGHT {
            assert_eq!(scene.luma[v * WIDTH + 71], empty.luma[v * WIDTH + 71]);
        }
    }
}
