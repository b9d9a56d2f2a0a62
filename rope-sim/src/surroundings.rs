//! What one live rope meets besides gravity: obstacles, and what it has beyond its nine
//! parameters. For batches see [`crate::environment`].

use crate::clock::BaseState;
use crate::contact::{Contacts, LOOK_PERIOD, Node, Predicted, StepEnd, corrected, predicted};
use crate::extra_loads::ExtraLanes;
use crate::kernel::{Elimination, step};
use crate::load::{LinkLoads, Unloaded};
use crate::scene::Scene;
use crate::scheme::Scheme;
use crate::state::{Link, RopeLanes};
use arm_model::kinematics::FrameMotion;
use shared_types::RopeParams;

/// Extras and obstacles, with the loads of the current step.
#[derive(Clone)]
pub(crate) struct Surroundings {
    extras: ExtraLanes<f64>,
    pub(crate) contacts: Option<Contacts<f64>>,
    loads: LinkLoads<f64>,
    nodes: Vec<Node<f64>>,
    /// Steps until the next look at how far everything is.
    unseen: usize,
}

impl Surroundings {
    pub(crate) fn of(rope: &RopeParams, links: &[Link<f64>], attach: &FrameMotion) -> Self {
        let mut loads = LinkLoads::new(links.len());
        let mut extras = ExtraLanes::new(&[rope], &mut loads);
        extras.start(links, &BaseState::of(attach).dynamics);
        Self {
            extras,
            contacts: None,
            loads,
            nodes: vec![Node::zero(); links.len()],
            unseen: 0,
        }
    }

    /// Puts a scene around the rope, in place of what was there.
    pub(crate) fn put(&mut self, scene: &Scene, rope: &RopeParams, max_step_s: f64) {
        let contacts = || Contacts::new(scene, &[rope], max_step_s, [0.0; 3]);
        self.contacts = (!scene.is_empty()).then(contacts);
        self.unseen = 0;
    }

    /// Whether the rope is about to touch something.
    pub(crate) fn is_imminent(&self) -> bool {
        self.contacts.as_ref().is_some_and(|c| c.imminent > 0.0)
    }

    /// Advances the rope by one step that ends at `end`.
    #[inline(always)]
    pub(crate) fn step(
        &mut self,
        links: &mut [Link<f64>],
        scratch: &mut [Elimination<f64>],
        (rope, attach, scheme): (&RopeLanes<f64>, &BaseState<f64>, &Scheme<f64>),
        end: StepEnd,
    ) {
        let base = &attach.dynamics;
        let Self {
            extras,
            contacts,
            loads,
            nodes,
            unseen,
        } = self;
        if let Some(contacts) = contacts {
            if *unseen == 0 {
                corrected(nodes, links, rope, attach);
                contacts.look(nodes, rope);
                *unseen = LOOK_PERIOD;
            }
            *unseen -= 1;
        }
        let mut engaged = contacts.as_mut().filter(|contacts| contacts.is_engaged());
        if engaged.is_none() && !extras.is_any() {
            step(links, scratch, rope, base, scheme, &Unloaded);
            return;
        }
        for link in links.iter_mut() {
            link.predict(scheme);
        }
        predicted(nodes, links, rope, attach, scheme);
        loads.clear();
        extras.load(loads, links, nodes, rope, base, scheme);
        if let Some(contacts) = &mut engaged {
            let attach = attach.position;
            contacts.load(
                loads,
                Predicted {
                    links,
                    nodes,
                    attach,
                    scheme,
                },
            );
        }
        step(links, scratch, rope, base, scheme, loads);
        extras.settle(links, base, scheme);
        if let Some(contacts) = engaged {
            corrected(nodes, links, rope, attach);
            contacts.settle(links, nodes, scheme, &[end]);
        }
    }
}
