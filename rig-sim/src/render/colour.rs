//! Colours as the camera delivers them: full-range BT.601.

/// Luma 0 to 255 and the two chroma differences about 0.
pub(crate) type Ycc = [f32; 3];

/// Luma and chroma of 8-bit video RGB.
pub(crate) fn ycc(rgb: [f32; 3]) -> Ycc {
    let [r, g, b] = rgb;
    let y = 0.299 * r + 0.587 * g + 0.114 * b;
    [y, (b - y) / 1.772, (r - y) / 1.402]
}

/// A surface's colour under light: `shade` scales it, `gloss` adds white.
pub(crate) fn lit([y, cb, cr]: Ycc, shade: f32, gloss: f32) -> Ycc {
    [y * shade + gloss, cb * shade, cr * shade]
}

/// Linear mixture, `u` of the second colour.
pub(crate) fn mix(a: Ycc, b: Ycc, u: f32) -> Ycc {
    core::array::from_fn(|i| a[i] + u * (b[i] - a[i]))
}
