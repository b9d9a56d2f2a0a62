//! What the rope in a room looks like.

use super::paint::Rgb;
use super::palette::{Named, ROPES, about, apart, bytes, one_of};
use crate::render::colour::ycc;
use crate::render::solid::Material;
use crate::render::weave::Weave;
use rand::{Rng, RngExt};

/// How far a rope's colour lies from the wall's and from the floor's where a person must
/// see it.
const VISIBLE: [f64; 2] = [38.0, 26.0];

/// Surfaces of a rope and its tip weight.
#[derive(Debug, Clone, PartialEq)]
pub struct RopeSurface {
    /// The rope's main colour.
    pub rope: Named,
    /// The tip weight's colour.
    pub tip: Named,
    /// The pattern: plain, rings, braid or twist.
    pub weave: &'static str,
    /// Whether it shines.
    pub shiny: bool,
    pub(crate) cord: Material,
    pub(crate) lead: Material,
}

impl RopeSurface {
    /// A rope and a tip weight of one colour each (8-bit video RGB).
    pub(crate) fn plain(rope_rgb: [u8; 3], tip_rgb: [u8; 3]) -> Self {
        let given = |rgb| Named { name: "given", rgb };
        Self {
            rope: given(rope_rgb),
            tip: given(tip_rgb),
            weave: "plain",
            shiny: false,
            cord: Material::plain(rope_rgb, 10.0),
            lead: Material::plain(tip_rgb, 55.0),
        }
    }
}

/// A rope before a wall and a floor of these colours, in any colours that stand out from
/// them.
pub(crate) fn visible(rng: &mut impl Rng, wall: &Rgb, floor: &Rgb) -> RopeSurface {
    let far = |named: &Named| {
        let own = Rgb::from(named.rgb.map(f64::from));
        apart(&own, wall) > VISIBLE[0] && apart(&own, floor) > VISIBLE[1]
    };
    let seen: Vec<Named> = ROPES.into_iter().filter(far).collect();
    let rope = one_of(rng, &seen);
    // One rope in four has a tip weight of its own colour.
    let tip = if rng.random_bool(0.25) {
        rope
    } else {
        one_of(rng, &seen)
    };
    surface(rng, [rope, tip], &seen)
}

/// A rope in the wall's colour, with any tip weight.
pub(crate) fn hidden(rng: &mut impl Rng, wall: &Rgb) -> RopeSurface {
    let rope = Named {
        name: "the wall's",
        rgb: bytes(&about(rng, bytes(wall), 12.0)),
    };
    let tip = if rng.random_bool(0.3) {
        rope
    } else {
        one_of(rng, &ROPES)
    };
    surface(rng, [rope, tip], &ROPES)
}

/// A surface in these colours, with a second one of `others` on the rope.
fn surface(rng: &mut impl Rng, [rope, tip]: [Named; 2], others: &[Named]) -> RopeSurface {
    let own = Rgb::from(rope.rgb.map(f64::from));
    // A second colour: a shade of the rope's own, or another altogether.
    let other = if rng.random_bool(0.6) {
        own * rng.random_range(0.45..0.75)
    } else {
        Rgb::from(one_of(rng, others).rgb.map(f64::from))
    };
    let other = ycc(bytes(&other).map(f32::from));
    let pitch_m = rng.random_range(0.012..0.030);
    let (name, weave) = match rng.random_range(0..10) {
        0..5 => ("plain", Weave::Plain),
        5 => (
            "rings",
            Weave::Rings {
                other,
                period_m: rng.random_range(0.03..0.12),
            },
        ),
        6 | 7 => ("braid", Weave::Braid { other, pitch_m }),
        _ => ("twist", Weave::Twist { other, pitch_m }),
    };
    let shiny = rng.random_bool(0.25);
    let mut gloss = |dull: f32| {
        dull + if shiny {
            rng.random_range(50.0..110.0)
        } else {
            0.0
        }
    };
    RopeSurface {
        rope,
        tip,
        weave: name,
        shiny,
        cord: Material {
            weave,
            ..Material::plain(rope.rgb, gloss(8.0))
        },
        lead: Material::plain(tip.rgb, gloss(30.0)),
    }
}
