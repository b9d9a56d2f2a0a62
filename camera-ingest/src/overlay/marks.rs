//! Marks in a picture: rings, frames, numbers.

use super::Picture;

const WHITE: [u8; 3] = [255, 255, 255];
const SHADE: [u8; 3] = [30, 32, 36];

/// Characters of times, 3 wide and 5 high: a row of three bits for each line.
const FONT: [(char, [u8; 5]); 13] = [
    ('0', [7, 5, 5, 5, 7]),
    ('1', [2, 6, 2, 2, 7]),
    ('2', [7, 1, 7, 4, 7]),
    ('3', [7, 1, 3, 1, 7]),
    ('4', [5, 5, 7, 1, 1]),
    ('5', [7, 4, 7, 1, 7]),
    ('6', [7, 4, 7, 5, 7]),
    ('7', [7, 1, 2, 2, 2]),
    ('8', [7, 5, 7, 5, 7]),
    ('9', [7, 5, 7, 1, 7]),
    ('.', [0, 0, 0, 0, 2]),
    ('-', [0, 0, 7, 0, 0]),
    ('s', [0, 3, 2, 1, 3]),
];

impl Picture {
    /// A circle one pixel wide; of what sticks out nothing is drawn.
    pub(super) fn ring(&mut self, [u, v]: [f64; 2], radius_px: f64, colour: [u8; 3]) {
        let around = radius_px.ceil() as i64 + 1;
        let (cu, cv) = (u.round() as i64, v.round() as i64);
        for dv in -around..=around {
            for du in -around..=around {
                let from_centre = (du as f64).hypot(dv as f64);
                if (from_centre - radius_px).abs() < 0.5 {
                    self.set(cu + du, cv + dv, colour);
                }
            }
        }
    }

    /// A frame around all of the picture, `wide` pixels wide.
    pub(super) fn border(&mut self, wide: usize, colour: [u8; 3]) {
        let (last_u, last_v) = (self.width_px - 1, self.height_px - 1);
        for v in 0..=last_v {
            for u in 0..=last_u {
                if u.min(v).min(last_u - u).min(last_v - v) < wide {
                    self.set(u as i64, v as i64, colour);
                }
            }
        }
    }

    /// Numbers on a dark ground, their upper left corner at a pixel; `scale` pixels for one
    /// of the font.
    pub(super) fn text(&mut self, [left, top]: [i64; 2], text: &str, scale: i64) {
        let [width, height] = text_size(text, scale);
        for v in 0..height {
            for u in 0..width {
                self.set(left + u, top + v, SHADE);
            }
        }
        for (i, letter) in text.chars().enumerate() {
            let Some((_, rows)) = FONT.iter().find(|(known, _)| *known == letter) else {
                continue;
            };
            for (v, row) in rows.iter().enumerate() {
                for u in (0..3).filter(|u| row >> (2 - u) & 1 == 1) {
                    let (u, v) = (4 * i as i64 + u + 1, v as i64 + 1);
                    for at in 0..scale * scale {
                        let (du, dv) = (at % scale, at / scale);
                        self.set(left + u * scale + du, top + v * scale + dv, WHITE);
                    }
                }
            }
        }
    }

    /// The square around a pixel, `half_px` to each side, magnified by a whole factor; what
    /// lies outside the picture is black.
    pub(super) fn magnified(&self, [u, v]: [f64; 2], half_px: usize, factor: usize) -> Self {
        let side = 2 * half_px * factor;
        let mut large = Self::black(side, side);
        let from = |x: f64| x.round() as i64 - half_px as i64;
        for row in 0..side {
            for column in 0..side {
                let at = [(from(u), column), (from(v), row)]
                    .map(|(from, to)| usize::try_from(from + (to / factor) as i64));
                if let [Ok(u), Ok(v)] = at
                    && u < self.width_px
                    && v < self.height_px
                {
                    let (from, to) = ((v * self.width_px + u) * 3, (row * side + column) * 3);
                    large.rgb[to..to + 3].copy_from_slice(&self.rgb[from..from + 3]);
                }
            }
        }
        large
    }
}

/// Width and height of a text with its ground (px).
pub(super) fn text_size(text: &str, scale: i64) -> [i64; 2] {
    [(4 * text.chars().count() as i64 + 1) * scale, 7 * scale]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn white(picture: &Picture) -> usize {
        picture.rgb.chunks(3).filter(|p| *p == WHITE).count()
    }

    #[test]
    fn drawing_stays_inside() {
        let mut picture = Picture::black(8, 4);
        picture.ring([7.0, 3.0], 3.0, WHITE);
        assert!((1..16).contains(&white(&picture)));
        picture.text([-5, -5], "0.25 s", 3);
        picture.border(1, [9, 9, 9]);
        let frame = picture.rgb.chunks(3).filter(|p| *p == [9, 9, 9]).count();
        assert_eq!(frame, 20);
    }

    #[test]
    fn a_number_has_the_pixels_of_its_font() {
        let mut picture = Picture::black(16, 16);
        picture.text([1, 1], "1", 2);
        assert_eq!(white(&picture), 4 * 8);
        assert_eq!(text_size("1.07 s", 2), [50, 14]);
        assert_eq!(text_size("", 2)[0], 2);
    }

    #[test]
    fn what_is_magnified_is_centred() {
        let mut picture = Picture::black(20, 20);
        picture.set(10, 12, WHITE);
        let large = picture.magnified([10.0, 12.0], 2, 3);
        assert_eq!(
            (large.width_px, large.height_px, white(&large)),
            (12, 12, 9)
        );
        let first = large.rgb.chunks(3).position(|p| p == WHITE).unwrap();
        assert_eq!(first, 6 * 12 + 6);
        assert_eq!(white(&picture.magnified([19.0, 19.0], 2, 3)), 0);
    }
}
