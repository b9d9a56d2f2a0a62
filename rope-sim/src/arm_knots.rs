//! Kinematics of the arm at many instants side by side, one instant per lane.
//!
//! The attach motion of every candidate is needed exactly every few milliseconds
//! ([`crate::base_path`]). Instant by instant that costs a third of the rope itself;
//! in lanes, with polynomials for sine and cosine, it nearly vanishes.

use crate::algebra::{Quat, Vec3};
use crate::knot::Knot;
use crate::lanes::{LaneTask, Lanes};
use arm_model::kinematics::{JOINT_ORIGIN_M, JOINT_QUARTER_TURNS_X};
use arm_model::{JOINTS, JointState};

/// Attach frames for the joint states, in double precision.
pub(crate) struct ArmKnots<'a> {
    pub(crate) states: &'a [JointState],
    /// End of the pole in the flange frame (m).
    pub(crate) pole_end_m: [f64; 3],
}

impl LaneTask for ArmKnots<'_> {
    type Output = Vec<Knot>;

    #[inline(always)]
    fn run<V: Lanes>(self) -> Self::Output {
        let mut knots = Vec::with_capacity(self.states.len());
        for states in self.states.chunks(V::COUNT) {
            let frame = attach_frame(&JointLanes::<V>::of(states), self.pole_end_m);
            let (value, rate, acceleration) = frame.channels();
            for lane in 0..states.len() {
                knots.push(Knot {
                    value: value.map(|x| x.get(lane)),
                    rate: rate.map(|x| x.get(lane)),
                    acceleration: acceleration.map(|x| x.get(lane)),
                });
            }
        }
        knots
    }
}

/// Joint angles (rad), velocities and accelerations, one instant per lane.
struct JointLanes<V> {
    q: [V; JOINTS],
    qd: [V; JOINTS],
    qdd: [V; JOINTS],
}

impl<V: Lanes> JointLanes<V> {
    #[inline(always)]
    fn of(states: &[JointState]) -> Self {
        let zero = [V::splat(0.0); JOINTS];
        let mut out = Self {
            q: zero,
            qd: zero,
            qdd: zero,
        };
        for (lane, state) in states.iter().enumerate() {
            for joint in 0..JOINTS {
                out.q[joint].set(lane, state.q[joint]);
                out.qd[joint].set(lane, state.qd[joint]);
                out.qdd[joint].set(lane, state.qdd[joint]);
            }
        }
        out
    }
}

/// A moving frame in the world (m, rad, s).
#[derive(Clone, Copy)]
struct Frame<V> {
    origin: Vec3<V>,
    velocity: Vec3<V>,
    acceleration: Vec3<V>,
    /// Its axes.
    axes: [Vec3<V>; 3],
    /// The same attitude.
    attitude: Quat<V>,
    w: Vec3<V>,
    alpha: Vec3<V>,
}

impl<V: Lanes> Frame<V> {
    #[inline(always)]
    fn world() -> Self {
        Self {
            origin: Vec3::zero(),
            velocity: Vec3::zero(),
            acceleration: Vec3::zero(),
            axes: [
                Vec3::splat(1.0, 0.0, 0.0),
                Vec3::splat(0.0, 1.0, 0.0),
                Vec3::splat(0.0, 0.0, 1.0),
            ],
            attitude: Quat::identity(),
            w: Vec3::zero(),
            alpha: Vec3::zero(),
        }
    }

    /// Moves the origin to the point fixed in the frame at `offset_m`.
    #[inline(always)]
    fn offset(&mut self, offset_m: [f64; 3]) {
        let mut arm = Vec3::zero();
        for (axis, length_m) in self.axes.into_iter().zip(offset_m) {
            arm = axis.scale_add(V::splat(length_m), arm);
        }
        let turning = self.w.cross_add(arm, Vec3::zero());
        self.origin = self.origin.add(arm);
        self.velocity = self.velocity.add(turning);
        self.acceleration = self
            .w
            .cross_add(turning, self.alpha.cross_add(arm, self.acceleration));
    }

    /// Turns the attitude by quarter turns about the frame's own x axis.
    #[inline(always)]
    fn quarter_turn_x(&mut self, turns: i8) {
        let [x, y, z] = self.axes;
        let minus = |v: Vec3<V>| Vec3(-v.0, -v.1, -v.2);
        let half = core::f64::consts::FRAC_1_SQRT_2;
        let sine = match turns {
            1 => {
                self.axes = [x, z, minus(y)];
                half
            }
            -1 => {
                self.axes = [x, minus(z), y];
                -half
            }
            _ => return,
        };
        self.attitude = self.attitude.times(Quat {
            w: V::splat(half),
            v: Vec3::splat(sine, 0.0, 0.0),
        });
    }

    /// A joint about the frame's own z axis.
    #[inline(always)]
    fn joint(&mut self, q: V, qd: V, qdd: V) {
        let turn = Turn::of(q);
        let [x, y, z] = self.axes;
        let spin = z.scale(qd);
        self.alpha = self.w.cross_add(spin, z.scale_add(qdd, self.alpha));
        self.w = self.w.add(spin);
        self.axes = [
            y.scale_add(turn.sin, x.scale(turn.cos)),
            x.scale_sub(turn.sin, y.scale(turn.cos)),
            z,
        ];
        let zero = V::splat(0.0);
        self.attitude = self.attitude.times(Quat {
            w: turn.half_cos,
            v: Vec3(zero, zero, turn.half_sin),
        });
    }

    /// Position and quaternion with their first two time derivatives.
    #[inline(always)]
    fn channels(&self) -> ([V; 7], [V; 7], [V; 7]) {
        let half = V::splat(0.5);
        let zero = V::splat(0.0);
        let imaginary = |v: Vec3<V>| Quat {
            w: zero,
            v: v.scale(half),
        };
        let q = self.attitude;
        let rate = imaginary(self.w).times(q);
        let (a, b) = (
            imaginary(self.alpha).times(q),
            imaginary(self.w).times(rate),
        );
        let join = |p: Vec3<V>, w: V, v: Vec3<V>| [p.0, p.1, p.2, w, v.0, v.1, v.2];
        (
            join(self.origin, q.w, q.v),
            join(self.velocity, rate.w, rate.v),
            join(self.acceleration, a.w + b.w, a.v.add(b.v)),
        )
    }
}

/// Attach frame at the pole's end, as `arm_model::Pole::attach_motion`.
#[inline(always)]
fn attach_frame<V: Lanes>(joints: &JointLanes<V>, pole_end_m: [f64; 3]) -> Frame<V> {
    let mut frame = Frame::world();
    for i in 0..JOINTS {
        frame.offset(JOINT_ORIGIN_M[i]);
        frame.quarter_turn_x(JOINT_QUARTER_TURNS_X[i]);
        frame.joint(joints.q[i], joints.qd[i], joints.qdd[i]);
    }
    frame.offset(pole_end_m);
    // Half a turn about x: the attach frame's -z points along the pole.
    let Quat {
        w,
        v: Vec3(x, y, z),
    } = frame.attitude;
    frame.attitude = Quat {
        w: -x,
        v: Vec3(w, z, -y),
    };
    frame
}

/// Sine and cosine of an angle and of its half, the latter up to a common sign.
struct Turn<V> {
    sin: V,
    cos: V,
    half_sin: V,
    half_cos: V,
}

/// Taylor coefficients in the square of the angle, highest power first.
const SINE: [f64; 8] = [
    -1.0 / 1_307_674_368_000.0,
    1.0 / 6_227_020_800.0,
    -1.0 / 39_916_800.0,
    1.0 / 362_880.0,
    -1.0 / 5040.0,
    1.0 / 120.0,
    -1.0 / 6.0,
    1.0,
];
/// As [`SINE`].
const COSINE: [f64; 9] = [
    1.0 / 20_922_789_888_000.0,
    -1.0 / 87_178_291_200.0,
    1.0 / 479_001_600.0,
    -1.0 / 3_628_800.0,
    1.0 / 40_320.0,
    -1.0 / 720.0,
    1.0 / 24.0,
    -0.5,
    1.0,
];

impl<V: Lanes> Turn<V> {
    /// A quarter of the angle, reduced to half a turn either way, is at most pi/4,
    /// where the series are exact to 1e-16; doubling it twice needs no case by
    /// quadrant.
    #[inline(always)]
    fn of(angle: V) -> Self {
        // Adding and taking away 1.5 * 2^52 rounds to an integer.
        let round = V::splat(6_755_399_441_055_744.0);
        let turns = angle.fma(V::splat(1.0 / core::f64::consts::TAU), round) - round;
        let reduced = turns.fnma(V::splat(core::f64::consts::TAU), angle);
        // What 2 pi is more than its double.
        let reduced = turns.fnma(V::splat(2.449_293_598_294_706_4e-16), reduced);
        let y = reduced * V::splat(0.25);
        let square = y * y;
        let series = |coefficients: &[f64]| {
            let mut sum = V::splat(coefficients[0]);
            for coefficient in &coefficients[1..] {
                sum = sum.fma(square, V::splat(*coefficient));
            }
            sum
        };
        let (sin, cos) = doubled(y * series(&SINE), series(&COSINE));
        let (half_sin, half_cos) = (sin, cos);
        let (sin, cos) = doubled(sin, cos);
        Self {
            sin,
            cos,
            half_sin,
            half_cos,
        }
    }
}

/// Sine and cosine of twice the angle.
#[inline(always)]
fn doubled<V: Lanes>(sin: V, cos: V) -> (V, V) {
    let twice = sin + sin;
    (twice * cos, twice.fnma(sin, V::splat(1.0)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Kernel;
    use arm_model::{JointVector, Pole};

    fn states() -> Vec<JointState> {
        let wave = |i: usize, joint: usize, scale: f64| {
            scale * (1.3 * i as f64 + 0.7 * joint as f64).sin()
        };
        (0..37)
            .map(|i| JointState {
                q: JointVector(core::array::from_fn(|j| wave(i, j, 6.2))),
                qd: JointVector(core::array::from_fn(|j| wave(i + 100, j, 3.0))),
                qdd: JointVector(core::array::from_fn(|j| wave(i + 200, j, 20.0))),
            })
            .collect()
    }

    fn knots(kernel: Kernel, states: &[JointState], pole: &Pole) -> Vec<Knot> {
        kernel.run_double(ArmKnots {
            states,
            pole_end_m: pole.end_m().into(),
        })
    }

    #[test]
    fn agrees_with_the_arm_one_instant_at_a_time() {
        let states = states();
        let lab = Pole::default();
        let aside = Pole {
            length_m: 0.3,
            offset_m: [0.01, -0.02, 0.03],
            ..lab
        };
        for pole in [lab, aside] {
            let knots = knots(Kernel::ScalarF64, &states, &pole);
            for (state, got) in states.iter().zip(knots) {
                let mut want = Knot::new(&pole.attach_motion(state));
                want.on_the_side_of(&got);
                for c in 0..7 {
                    assert!((got.value[c] - want.value[c]).abs() < 1e-14);
                    assert!((got.rate[c] - want.rate[c]).abs() < 1e-13);
                    assert!((got.acceleration[c] - want.acceleration[c]).abs() < 1e-12);
                }
            }
        }
    }

    #[test]
    fn kernels_agree_bit_by_bit() {
        let states = states();
        let bits = |kernel: Kernel| -> Vec<u64> {
            let knots = knots(kernel, &states, &Pole::default());
            let numbers = |k: Knot| [k.value, k.rate, k.acceleration].concat();
            knots
                .into_iter()
                .flat_map(numbers)
                .map(f64::to_bits)
                .collect()
        };
        for kernel in [Kernel::Avx512F64, Kernel::Avx2F64] {
            assert!(bits(kernel) == bits(Kernel::ScalarF64), "{kernel:?}");
        }
    }
}
