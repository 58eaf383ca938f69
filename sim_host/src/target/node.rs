//! The controller node of a trial: in this process, or on the emulated board.

use super::controller::TargetController;
use super::cost::{Cost, TimedController};
use super::image;
use anyhow::anyhow;
use clap::ValueEnum;
use firmware::controller::Controller;
use firmware::cycle::{Params, State};
use firmware::job::seal::AXES;
use hal::board::report::Instruments;
use hal::can::Frame;
use hal::master::MasterConfig;
use hal::process::{Inputs, Outputs};
use hal::stage::Trail;

/// A stall, µs: late by twice what is allowed, and over before the other timer event of the period.
const STALL_US: u32 = 1000;

/// Where the controller runs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum On {
    /// In this process.
    #[default]
    Host,
    /// As a Cortex-M image under QEMU, in lock step, held against the one in this process.
    Qemu,
}

/// The controller in this process, with its parameters and the trail of its newest cycle.
pub struct HostController {
    controller: Controller,
    params: Params,
    trail: Trail,
}

/// The controller node.
pub enum Node {
    /// In this process.
    Host(Box<HostController>),
    /// In this process, timed.
    Timed(Box<TimedController>),
    /// On the emulated board.
    Target(Box<TargetController>),
}

impl Node {
    /// At power-up.
    pub fn new(on: On, config: &MasterConfig<AXES>, params: Params) -> anyhow::Result<Self> {
        Ok(match on {
            On::Host => Self::Host(Box::new(HostController {
                controller: host(config, &params)?,
                params,
                trail: Trail::default(),
            })),
            On::Qemu => Self::Target(Box::new(TargetController::new(
                &image::find("controller")?,
                config,
                params,
            )?)),
        })
    }

    /// At power-up, and so that the stages of its cycles are told apart.
    pub fn with_stages(on: On, config: &MasterConfig<AXES>, params: Params) -> anyhow::Result<Self> {
        Ok(match on {
            On::Host => Self::Timed(Box::new(TimedController::new(host(config, &params)?, params))),
            On::Qemu => Self::Target(Box::new(TargetController::new(
                &image::find("controller-stages")?,
                config,
                params,
            )?)),
        })
    }

    /// What came out of the stages of the newest cycle, by the core in this process; a timed one does not tell.
    pub fn trail(&self) -> Trail {
        match self {
            Self::Host(host) => host.trail,
            Self::Timed(_) => Trail::default(),
            Self::Target(controller) => controller.trail(),
        }
    }

    /// What the newest cycle took, if anybody measured.
    pub fn cost(&self) -> Option<Cost> {
        match self {
            Self::Host(..) => None,
            Self::Timed(controller) => Some(controller.cost()),
            Self::Target(controller) => Some(controller.cost()),
        }
    }

    /// The 5 ms tick. Time is zero at the first.
    pub fn sync(&mut self, transmit: &mut impl FnMut(Frame)) -> anyhow::Result<()> {
        match self {
            Self::Host(host) => {
                host.controller.sync(transmit);
                Ok(())
            }
            Self::Timed(controller) => {
                controller.sync(transmit);
                Ok(())
            }
            Self::Target(controller) => controller.sync(transmit),
        }
    }

    /// A frame came, `t_ns` after the first tick.
    pub fn receive(&mut self, frame: &Frame, t_ns: u64) {
        match self {
            Self::Host(host) => host.controller.receive(frame),
            Self::Timed(controller) => controller.receive(frame),
            Self::Target(controller) => controller.receive(frame, t_ns),
        }
    }

    /// The cycle: what it read and wrote.
    pub fn cycle(&mut self, transmit: &mut impl FnMut(Frame)) -> anyhow::Result<(Inputs<AXES>, Outputs<AXES>)> {
        match self {
            Self::Host(host) => {
                host.trail = Trail::default();
                let (inputs, outputs) = host.controller.cycle_watched(&host.params, transmit, &mut host.trail);
                Ok((*inputs, *outputs))
            }
            Self::Timed(controller) => Ok(controller.cycle(transmit)),
            Self::Target(controller) => controller.cycle(transmit),
        }
    }

    /// The next tick comes 1 ms late, and is told as late.
    pub fn stall(&mut self) {
        match self {
            Self::Host(host) => host.controller.overran(1),
            Self::Timed(controller) => controller.overran(1),
            Self::Target(controller) => controller.stall(STALL_US),
        }
    }

    /// From here on everything below the tick is busy, or idle again; in this process there is nothing below.
    pub fn load(&mut self, busy: bool) {
        if let Self::Target(controller) = self {
            controller.load(busy);
        }
    }

    /// Ends it; a board hands over what it measured of itself.
    pub fn finish(self) -> anyhow::Result<Option<Box<Instruments>>> {
        match self {
            Self::Host(..) | Self::Timed(_) => Ok(None),
            Self::Target(controller) => controller.finish().map(Some),
        }
    }

    /// What the cycle hands on.
    pub fn state(&self) -> &State {
        match self {
            Self::Host(host) => host.controller.state(),
            Self::Timed(controller) => controller.controller.state(),
            Self::Target(controller) => controller.state(),
        }
    }
}

fn host(config: &MasterConfig<AXES>, params: &Params) -> anyhow::Result<Controller> {
    Controller::new(config, params).map_err(|error| {
        anyhow!(
            "{}: {} must be {} to {}",
            error.field,
            error.value,
            error.low,
            error.high
        )
    })
}
