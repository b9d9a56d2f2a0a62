//! Shortest ways over a mask, and how deep inside it a pixel lies.

/// What a pixel is to a path.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Ground {
    /// Part of what moves.
    On,
    /// Passable for short gaps.
    Off,
    /// Not passable (the pole and the arm).
    Blocked,
}

/// Costs are tenths of a pixel; a gap costs this much more than firm ground.
const GAP_FACTOR: u32 = 6;
/// Straight and diagonal step in tenths of a pixel.
const STEP: [u32; 2] = [10, 14];

/// Pixels in order of cost, those of one cost in order of place. Costs are small whole
/// numbers and none is further ahead of the least than the dearest step.
struct Queue {
    /// Pixels of one cost each; the least cost is `cost`.
    ahead: Vec<Vec<usize>>,
    cost: u32,
    /// Those of the least cost, the first one last.
    now: Vec<usize>,
    waiting: usize,
}

impl Default for Queue {
    fn default() -> Self {
        Self {
            ahead: vec![Vec::new(); (GAP_FACTOR * STEP[1] + 1) as usize],
            cost: 0,
            now: Vec::new(),
            waiting: 0,
        }
    }
}

impl Queue {
    fn push(&mut self, cost: u32, at: usize) {
        let ring = self.ahead.len();
        self.ahead[cost as usize % ring].push(at);
        self.waiting += 1;
    }

    fn pop(&mut self) -> Option<(u32, usize)> {
        while self.now.is_empty() {
            if self.waiting == 0 {
                return None;
            }
            let ring = self.ahead.len();
            // What has this cost now; nothing can be added to it any more, for every step
            // costs something.
            let least = self.ahead.iter().cycle().skip(self.cost as usize % ring);
            let steps = least.take_while(|pixels| pixels.is_empty()).count();
            self.cost += u32::try_from(steps).unwrap_or(0);
            let found = &mut self.ahead[self.cost as usize % ring];
            std::mem::swap(&mut self.now, found);
            self.now.sort_unstable_by(|a, b| b.cmp(a));
        }
        self.waiting -= 1;
        self.now.pop().map(|at| (self.cost, at))
    }
}

/// Shortest paths from one pixel to all reachable ones.
pub(super) struct Geodesic {
    width: usize,
    /// Cost of the best path; `u32::MAX` where unreachable.
    cost: Vec<u32>,
    /// Length of the best path (tenths of a pixel).
    length: Vec<u32>,
    before: Vec<u32>,
}

impl Geodesic {
    /// Dijkstra over the 8-neighbourhood. Gaps in the mask may be `gap_px` long,
    /// the first one, at the start, `first_gap_px`.
    pub(super) fn from(
        start: usize,
        ground: &[Ground],
        width: usize,
        gap_px: u32,
        first_gap_px: u32,
    ) -> Self {
        let n = ground.len();
        let mut out = Self {
            width,
            cost: vec![u32::MAX; n],
            length: vec![0; n],
            before: vec![u32::MAX; n],
        };
        // Length of the gap a path is in; `first` while it has met no mask yet.
        let mut gap = vec![0_u32; n];
        let mut first = vec![false; n];
        out.cost[start] = 0;
        first[start] = true;
        let mut queue = Queue::default();
        queue.push(0, start);
        while let Some((cost, at)) = queue.pop() {
            if cost > out.cost[at] {
                continue;
            }
            for (next, diagonal) in neighbours(at, width, n / width) {
                let step = STEP[usize::from(diagonal)];
                let (price, open, is_first) = match ground[next] {
                    Ground::Blocked => continue,
                    Ground::On => (step, 0, false),
                    Ground::Off => (step * GAP_FACTOR, gap[at] + step, first[at]),
                };
                let limit = if is_first { first_gap_px } else { gap_px } * STEP[0];
                if open > limit || cost + price >= out.cost[next] {
                    continue;
                }
                out.cost[next] = cost + price;
                out.length[next] = out.length[at] + step;
                #[allow(
                    clippy::cast_possible_truncation,
                    reason = "an image has < 2^32 pixels"
                )]
                {
                    out.before[next] = at as u32;
                }
                gap[next] = open;
                first[next] = is_first;
                queue.push(cost + price, next);
            }
        }
        out
    }

    /// Length of the way to a pixel (px), `None` if there is none.
    pub(super) fn length_px(&self, at: usize) -> Option<f64> {
        (self.cost[at] != u32::MAX).then(|| f64::from(self.length[at]) / 10.0)
    }

    /// Pixels from the start to `at` as `[u, v]`.
    #[allow(clippy::cast_precision_loss, reason = "pixel indices")]
    pub(super) fn path_to(&self, mut at: usize) -> Vec<[f64; 2]> {
        let mut path = Vec::new();
        loop {
            path.push([(at % self.width) as f64, (at / self.width) as f64]);
            match self.before[at] {
                u32::MAX => break,
                before => at = before as usize,
            }
        }
        path.reverse();
        path
    }
}

fn neighbours(at: usize, width: usize, height: usize) -> impl Iterator<Item = (usize, bool)> {
    let (u, v) = (at % width, at / width);
    (v.saturating_sub(1)..=(v + 1).min(height - 1)).flat_map(move |y| {
        (u.saturating_sub(1)..=(u + 1).min(width - 1)).filter_map(move |x| {
            let next = y * width + x;
            (next != at).then_some((next, x != u && y != v))
        })
    })
}

/// Distance of every mask pixel to the nearest pixel off the mask (px), by the
/// two-pass 5-7-11 chamfer (within 2 % of the Euclidean distance).
#[allow(clippy::cast_sign_loss, reason = "offsets back are not positive")]
pub(super) fn depth_px(mask: &[bool], width: usize) -> Vec<f32> {
    const FAR: i32 = 1 << 28;
    const BACK: [(i32, i32, i32); 8] = [
        (-1, 0, 5),
        (0, -1, 5),
        (-1, -1, 7),
        (1, -1, 7),
        (-2, -1, 11),
        (2, -1, 11),
        (-1, -2, 11),
        (1, -2, 11),
    ];
    // With a border of two pixels: what lies beyond the image is not mask.
    let (wide, rows) = (width + 4, mask.len() / width);
    let mut d = vec![0_i32; wide * (rows + 4)];
    for (row, out) in mask.chunks(width).zip(d.chunks_mut(wide).skip(2)) {
        for (&on, out) in row.iter().zip(&mut out[2..]) {
            *out = if on { FAR } else { 0 };
        }
    }
    // Most of an image is not mask.
    let on: Vec<usize> = (0..d.len()).filter(|at| d[*at] != 0).collect();
    let offsets = BACK.map(|(dx, dy, step)| ((-dy) as usize * wide, dx as isize, step));
    let mut relax = |at: usize, forth: bool| {
        for (up, along, step) in offsets {
            let beyond = if forth {
                (at - up).wrapping_add_signed(along)
            } else {
                (at + up).wrapping_add_signed(-along)
            };
            d[at] = d[at].min(d[beyond] + step);
        }
    };
    on.iter().for_each(|at| relax(*at, true));
    on.iter().rev().for_each(|at| relax(*at, false));
    let inner = d.chunks(wide).skip(2).take(rows);
    #[allow(clippy::cast_precision_loss, reason = "distances are small")]
    inner
        .flat_map(|row| &row[2..2 + width])
        .map(|x| *x as f32 / 5.0)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_bridge_small_gaps_only_and_respect_walls() {
        // A bar of 40 px with a gap of 5 px at 20..25, in a strip 3 rows high.
        let width = 40;
        let mut ground = vec![Ground::Off; 3 * width];
        for u in (0..20).chain(25..40) {
            ground[width + u] = Ground::On;
        }
        let end = width + 39;
        let open = Geodesic::from(width, &ground, width, 6, 0);
        assert_eq!(open.length_px(end), Some(39.0));
        assert_eq!(open.path_to(end).len(), 40);
        assert_eq!(
            Geodesic::from(width, &ground, width, 4, 0).length_px(end),
            None
        );
        for row in 0..3 {
            ground[row * width + 10] = Ground::Blocked;
        }
        assert_eq!(
            Geodesic::from(width, &ground, width, 6, 0).length_px(end),
            None
        );
    }

    #[test]
    fn depth_of_a_disc_is_its_radius() {
        let width = 41;
        // Nearest pixel off the disc: (9, 8) away, at sqrt(145) = 12.04 px.
        let mask: Vec<bool> = (0..width * width)
            .map(|i| {
                let (x, y) = ((i % width) as f64 - 20.0, (i / width) as f64 - 20.0);
                x.hypot(y) <= 12.0
            })
            .collect();
        let depth = depth_px(&mask, width);
        assert!(
            (depth[20 * width + 20] - 12.04).abs() < 0.25,
            "{}",
            depth[20 * width + 20]
        );
        assert_eq!(depth[0], 0.0);
    }
}
