//! Measurements that take more than a look at a shader's values.

pub mod figures;
pub mod filaments;
pub mod trade;

use std::{sync::atomic::AtomicBool, time::Duration};

use crate::{
    render::{
        View,
        accumulate::{Accumulator, Layers},
        film::Frame,
        progressive::{self, Control, Limits, Plan, Save},
    },
    scene::Scene,
};

/// What `scene` shows in a frame; `study` is called after each pass.
pub(crate) fn expose(
    scene: &Scene,
    frame: Frame,
    limits: Limits,
    seed: u64,
    study: Option<&(dyn Fn(&Accumulator) + Sync)>,
) -> Accumulator {
    let view = View::new(scene, frame.size(), seed, false);
    let plan = Plan { frame, layers: Layers::None, limits, key: 0 };
    let interrupt = AtomicBool::new(false);
    let study = study.map(|save| Save { every: Duration::MAX, save });
    let control = Control { study, ..Control::until(&interrupt) };
    progressive::expose(&view, &plan, &control).accumulator
}
