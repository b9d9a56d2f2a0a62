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
    /// Number of every pixel among those found, which are few; 0 where unreachable. With a
    /// border of one pixel.
    number: Vec<u32>,
    /// The first one stands for all unreachable pixels.
    found: Vec<Found>,
}

/// The best path to a pixel.
#[derive(Debug, Clone, Copy)]
struct Found {
    cost: u32,
    /// Length of it (tenths of a pixel).
    length: u32,
    /// Place of the pixel before; `u32::MAX` at the start.
    before: u32,
    /// Length of the gap it is in.
    gap: u32,
    /// It has met no mask yet.
    first: bool,
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
        let nothing = Found {
            cost: u32::MAX,
            length: 0,
            before: u32::MAX,
            gap: 0,
            first: false,
        };
        // With a border, so that every pixel has all its neighbours.
        let wide = width + 2;
        let mut fenced = vec![Ground::Blocked; wide * (ground.len() / width + 2)];
        let inner = fenced.chunks_exact_mut(wide).skip(1);
        for (out, row) in inner.zip(ground.chunks_exact(width)) {
            out[1..=width].copy_from_slice(row);
        }
        let ground = fenced;
        let mut out = Self {
            width,
            number: vec![0; ground.len()],
            found: vec![nothing],
        };
        let start = out.place(start);
        out.number[start] = 1;
        out.found.push(Found {
            cost: 0,
            first: true,
            ..nothing
        });
        let mut queue = Queue::default();
        queue.push(0, start);
        while let Some((cost, at)) = queue.pop() {
            let here = out.found[out.number[at] as usize];
            if cost > here.cost {
                continue;
            }
            let [straight, diagonal] = STEP;
            let (above, below) = (at - wide, at + wide);
            for (next, step) in [
                (above - 1, diagonal),
                (above, straight),
                (above + 1, diagonal),
                (at - 1, straight),
                (at + 1, straight),
                (below - 1, diagonal),
                (below, straight),
                (below + 1, diagonal),
            ] {
                let (price, open, is_first) = match ground[next] {
                    Ground::Blocked => continue,
                    Ground::On => (step, 0, false),
                    Ground::Off => (step * GAP_FACTOR, here.gap + step, here.first),
                };
                let limit = if is_first { first_gap_px } else { gap_px } * STEP[0];
                let number = out.number[next] as usize;
                if open > limit || cost + price >= out.found[number].cost {
                    continue;
                }
                let better = Found {
                    cost: cost + price,
                    length: here.length + step,
                    before: at as u32,
                    gap: open,
                    first: is_first,
                };
                if number == 0 {
                    out.number[next] = out.found.len() as u32;
                    out.found.push(better);
                } else {
                    out.found[number] = better;
                }
                queue.push(better.cost, next);
            }
        }
        out
    }

    /// Place of a pixel among all with their border.
    fn place(&self, at: usize) -> usize {
        at + 2 * (at / self.width) + self.width + 3
    }

    /// Length of the way to a pixel (px), `None` if there is none.
    pub(super) fn length_px(&self, at: usize) -> Option<f64> {
        let number = self.number[self.place(at)] as usize;
        (number > 0).then(|| f64::from(self.found[number].length) / 10.0)
    }

    /// Pixels from the start to `at` as `[u, v]`.
    pub(super) fn path_to(&self, at: usize) -> Vec<[f64; 2]> {
        let (mut place, wide) = (self.place(at), self.width + 2);
        let mut path = Vec::new();
        loop {
            path.push([(place % wide - 1) as f64, (place / wide - 1) as f64]);
            match self.found[self.number[place] as usize].before {
                u32::MAX => break,
                before => place = before as usize,
            }
        }
        path.reverse();
        path
    }
}

/// How deep inside a mask its pixels lie.
pub(super) struct Depth {
    width: usize,
    /// Fifths of a pixel, with a border of two pixels.
    fifths: Vec<i32>,
}

/// Columns on either side of a row, and rows above and below all.
const BORDER: usize = 2;

impl Depth {
    /// Distance of every mask pixel to the nearest pixel off the mask, by the two-pass
    /// 5-7-11 chamfer (within 2 % of the Euclidean distance). What lies beyond the image is
    /// not mask.
    pub(super) fn of(mask: &[bool], width: usize) -> Self {
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
        /// Pixels passed over at once where none is mask: most of an image.
        const CHUNK: usize = 16;
        let (wide, rows) = (width + 2 * BORDER, mask.len() / width);
        let mut d = vec![0_i32; wide * (rows + 2 * BORDER)];
        let mut on = Vec::new();
        for (row, line) in (BORDER..).zip(mask.chunks_exact(width)) {
            for (chunk, pixels) in line.chunks(CHUNK).enumerate() {
                if pixels.iter().fold(false, |any, on| any | on) {
                    let first = row * wide + BORDER + chunk * CHUNK;
                    on.extend((first..).zip(pixels).filter(|x| *x.1).map(|x| x.0));
                }
            }
        }
        for at in &on {
            d[*at] = FAR;
        }
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
        Self { width, fifths: d }
    }

    /// Distance of a pixel (px).
    pub(super) fn px(&self, at: usize) -> f32 {
        let (u, v) = (at % self.width, at / self.width);
        let wide = self.width + 2 * BORDER;
        self.fifths[(v + BORDER) * wide + u + BORDER] as f32 / 5.0
    }
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
    fn ways_over_open_ground_go_straight_and_diagonally() {
        let (width, height) = (11, 9);
        let ground = vec![Ground::On; width * height];
        let (u0, v0) = (5, 4);
        let ways = Geodesic::from(v0 * width + u0, &ground, width, 0, 0);
        for at in 0..width * height {
            let (along, down) = ((at % width).abs_diff(u0), (at / width).abs_diff(v0));
            let (far, near) = (along.max(down), along.min(down));
            let wanted = (far - near) as f64 + 1.4 * near as f64;
            assert!((ways.length_px(at).unwrap() - wanted).abs() < 1e-9, "{at}");
            let path = ways.path_to(at);
            assert_eq!(path.len(), far + 1);
            assert_eq!(path[0], [u0 as f64, v0 as f64]);
            assert_eq!(path[far], [(at % width) as f64, (at / width) as f64]);
        }
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
        let depth = Depth::of(&mask, width);
        let middle = depth.px(20 * width + 20);
        assert!((middle - 12.04).abs() < 0.25, "{middle}");
        assert_eq!(depth.px(0), 0.0);
    }
}
