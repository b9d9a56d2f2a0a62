//! Surface textures without pictures: hashed lattice noise.

/// A fixed pseudo-random number in -1..1 for a lattice point.
pub(crate) fn lattice(x: i64, y: i64, seed: u64) -> f64 {
    // SplitMix64 finaliser over the mixed coordinates.
    let mut h = seed
        ^ x.cast_unsigned().wrapping_mul(0x9e37_79b9_7f4a_7c15)
        ^ y.cast_unsigned().wrapping_mul(0xc2b2_ae3d_27d4_eb4f);
    h = (h ^ (h >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    h = (h ^ (h >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    h ^= h >> 31;
    f64::from((h >> 32) as u32) / f64::from(u32::MAX) * 2.0 - 1.0
}

/// Smooth noise in -1..1, one bump per unit of `x` and `y`.
pub(crate) fn noise(x: f64, y: f64, seed: u64) -> f64 {
    let (x0, y0) = (x.floor(), y.floor());
    let (i, j) = (x0 as i64, y0 as i64);
    let ease = |t: f64| t * t * (3.0 - 2.0 * t);
    let (u, v) = (ease(x - x0), ease(y - y0));
    let row = |j: i64| {
        let (a, b) = (lattice(i, j, seed), lattice(i + 1, j, seed));
        a + u * (b - a)
    };
    let (near, far) = (row(j), row(j + 1));
    near + v * (far - near)
}

/// Sum of `octaves` of [`noise`], each twice as fine and half as strong.
pub(crate) fn fractal(x: f64, y: f64, octaves: u32, seed: u64) -> f64 {
    let (mut sum, mut scale, mut weight) = (0.0, 1.0, 0.5);
    for octave in 0..octaves {
        sum += weight * noise(x * scale, y * scale, seed.wrapping_add(u64::from(octave)));
        scale *= 2.0;
        weight *= 0.5;
    }
    sum
}
