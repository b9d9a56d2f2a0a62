//! The way back from where the rope is proven, compared with the way forth.

use super::curve::{add, norm, scale, sub};
use super::follow::{NODES, SEEN};
use super::state::State;

/// Where nobody saw the rope, both ways may be so many times as far apart.
const BLIND: f64 = 4.0;
/// Where both see it, they nearly agree up to so many times as far.
const CLOSE: f64 = 2.0;

/// How the way back from where the rope is proven compares with the way forth in a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Ways {
    /// They agree, as far as anybody can see.
    Same,
    /// They nearly agree, and both see the rope.
    Close,
    /// The way forth took something else, or saw too little: the way back sees the rope
    /// with nothing like it near.
    Mistaken,
    /// The way back sees nothing where it differs, and tells nothing.
    Blind,
    /// They differ.
    Apart,
}

impl Ways {
    pub(super) fn of(forth: &State, back: &State, same_m: f64) -> Self {
        let apart_m = |node: usize| norm(sub(back.curve[node], forth.curve[node]));
        let sees = |state: &State, node: usize| state.confidence[node] >= SEEN;
        let far = |node: &usize| {
            let unseen = forth.hidden && !(sees(forth, *node) && sees(back, *node));
            apart_m(*node) > if unseen { BLIND * same_m } else { same_m }
        };
        let far: Vec<usize> = (0..NODES).filter(far).collect();
        let back_sees = far.iter().all(|node| sees(back, *node));
        let forth_sees = far.iter().all(|node| sees(forth, *node));
        if far.is_empty() {
            Self::Same
        } else if back_sees && !back.ambiguous && (forth.ambiguous || !forth_sees) {
            Self::Mistaken
        } else if back_sees && forth_sees && far.iter().all(|n| apart_m(*n) < CLOSE * same_m) {
            Self::Close
        } else if forth.is_clear() && !far.iter().any(|node| sees(back, *node)) {
            Self::Blind
        } else {
            Self::Apart
        }
    }
}

/// Takes a state so far (0 to 1) towards where the way back has it.
pub(super) fn between(state: &mut State, back: &State, part: f64, same_m: f64) {
    let sure = state.near(back, same_m);
    for (forth, back) in state.curve.iter_mut().zip(&back.curve) {
        *forth = add(*forth, scale(sub(*back, *forth), part));
    }
    if !sure {
        state.distrust();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Millimetres, so to say.
    const SAME_M: f64 = 1.0;

    /// A straight rope whose lower half is so far aside and so well seen.
    fn rope(aside_m: f64, confidence: f64) -> State {
        let below = |node: usize| node >= NODES / 2;
        let point = |node| [if below(node) { aside_m } else { 0.0 }, node as f64];
        let mut state = State::resting(0.0, (0..NODES).map(point).collect());
        state.confidence[NODES / 2..].fill(confidence);
        state
    }

    fn ambiguous(state: State) -> State {
        State {
            ambiguous: true,
            ..state
        }
    }

    fn hidden(state: State) -> State {
        State {
            hidden: true,
            ..state
        }
    }

    #[test]
    fn ways_compare_by_who_sees_the_rope() {
        let here = rope(0.0, 1.0);
        for (forth, back, ways) in [
            (here.clone(), rope(0.9, 1.0), Ways::Same),
            // Nobody saw it: four times as far.
            (hidden(rope(0.0, 0.1)), rope(3.9, 1.0), Ways::Same),
            (hidden(rope(0.0, 0.1)), rope(4.1, 0.4), Ways::Apart),
            // Both see it, nearly in one place.
            (here.clone(), rope(1.9, 1.0), Ways::Close),
            (here.clone(), rope(2.1, 1.0), Ways::Apart),
            // The way forth had to choose, or saw nothing; the way back sees it.
            (ambiguous(here.clone()), rope(5.0, 1.0), Ways::Mistaken),
            (hidden(rope(0.0, 0.1)), rope(5.0, 1.0), Ways::Mistaken),
            (
                ambiguous(here.clone()),
                ambiguous(rope(5.0, 1.0)),
                Ways::Apart,
            ),
            (ambiguous(here.clone()), rope(5.0, 0.4), Ways::Apart),
            // The way back sees nothing where the way forth saw it.
            (here.clone(), rope(5.0, 0.4), Ways::Blind),
        ] {
            assert_eq!(Ways::of(&forth, &back, SAME_M), ways, "{forth:?} {back:?}");
        }
    }

    #[test]
    fn what_nobody_saw_is_taken_between_and_doubted() {
        let mut state = rope(0.0, 1.0);
        between(&mut state, &rope(0.8, 1.0), 0.25, SAME_M);
        assert_eq!(state.curve[NODES - 1][0], 0.2);
        assert_eq!(state.confidence[NODES - 1], 1.0);
        between(&mut state, &rope(2.2, 1.0), 0.5, SAME_M);
        assert!((state.curve[NODES - 1][0] - 1.2).abs() < 1e-12);
        assert!(state.confidence.iter().all(|c| *c <= 0.5));
    }
}
