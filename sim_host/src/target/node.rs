//! The controller node of a trial: in this process, or on the emulated board; of the sealing arm alone, or of a second one beside it.

use super::controller::TargetController;
use super::cost::{Cost, TimedController};
use super::image;
use crate::model::SECOND_AXES;
use crate::seal::second::{ALL, SecondSetup};
use crate::seal::setup::Setup;
use anyhow::anyhow;
use clap::ValueEnum;
use firmware::controller::Controller;
use firmware::cycle::{Params, Second, SecondState, State};
use firmware::job::seal::AXES;
use hal::board::report::Instruments;
use hal::can::Frame;
use hal::master::MasterConfig;
use hal::process::{Inputs, Outputs};
use hal::stage::Trail;
use std::any::Any;

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

/// The controller node. What the cell sees of it is the sealing arm, whatever moves beside that.
pub struct Node(Box<dyn Engine>);

/// What a controller node can be.
trait Engine {
    fn sync(&mut self, transmit: &mut dyn FnMut(Frame)) -> anyhow::Result<()>;
    fn receive(&mut self, frame: &Frame, t_ns: u64);
    fn cycle(&mut self, transmit: &mut dyn FnMut(Frame)) -> anyhow::Result<(Inputs<AXES>, Outputs<AXES>)>;
    fn stall(&mut self);
    fn state(&self) -> &State;
    fn beside(&self) -> &dyn Any;
    fn trail(&self) -> Trail;
    fn cost(&self) -> Option<Cost>;
    fn load(&mut self, busy: bool);
    fn finish(self: Box<Self>) -> anyhow::Result<Option<Box<Instruments>>>;
}

impl Node {
    /// At power-up, of the sealing arm alone.
    pub fn new(on: On, config: &MasterConfig<AXES>, params: Params) -> anyhow::Result<Self> {
        Self::of(on, "controller", config, params, ())
    }

    /// At power-up, of all that `setup` moves; with `stages`, on the board, so that the stages of its cycles are told apart.
    pub fn for_setup(on: On, setup: &Setup, stages: bool) -> anyhow::Result<Self> {
        let params = setup.params.clone();
        match (&setup.second, stages) {
            (None, false) => Self::of(on, "controller", &setup.master, params, ()),
            (None, true) => Self::of(on, "controller-stages", &setup.master, params, ()),
            (Some(second), stages) => {
                let SecondSetup { master, params: arm } = &**second;
                let image = if stages { "second-arm-stages" } else { "second-arm" };
                Self::of::<_, ALL>(on, image, master, params, arm.clone())
            }
        }
    }

    /// At power-up in this process, timed.
    pub fn timed(config: &MasterConfig<AXES>, params: Params) -> anyhow::Result<Self> {
        Ok(Self(Box::new(TimedController::new(host(config, &params)?, params))))
    }

    fn of<S: Second<State: 'static> + 'static, const N: usize>(
        on: On,
        image: &str,
        config: &MasterConfig<N>,
        params: Params,
        second: S,
    ) -> anyhow::Result<Self> {
        Ok(Self(match on {
            On::Host => Box::new(HostController {
                controller: host::<S, N>(config, &params)?,
                params,
                second,
                trail: Trail::default(),
            }),
            On::Qemu => Box::new(TargetController::new(&image::find(image)?, config, params, second)?),
        }))
    }

    /// What came out of the stages of the newest cycle, by the core in this process; a timed one does not tell.
    pub fn trail(&self) -> Trail {
        self.0.trail()
    }

    /// What the newest cycle took, if anybody measured.
    pub fn cost(&self) -> Option<Cost> {
        self.0.cost()
    }

    /// The 5 ms tick. Time is zero at the first.
    pub fn sync(&mut self, transmit: &mut impl FnMut(Frame)) -> anyhow::Result<()> {
        self.0.sync(transmit)
    }

    /// A frame came, `t_ns` after the first tick.
    pub fn receive(&mut self, frame: &Frame, t_ns: u64) {
        self.0.receive(frame, t_ns);
    }

    /// The cycle: what it read and wrote.
    pub fn cycle(&mut self, transmit: &mut impl FnMut(Frame)) -> anyhow::Result<(Inputs<AXES>, Outputs<AXES>)> {
        self.0.cycle(transmit)
    }

    /// The next tick comes 1 ms late, and is told as late.
    pub fn stall(&mut self) {
        self.0.stall();
    }

    /// From here on everything below the tick is busy, or idle again; in this process there is nothing below.
    pub fn load(&mut self, busy: bool) {
        self.0.load(busy);
    }

    /// Ends it; a board hands over what it measured of itself.
    pub fn finish(self) -> anyhow::Result<Option<Box<Instruments>>> {
        self.0.finish()
    }

    /// What the cycle hands on.
    pub fn state(&self) -> &State {
        self.0.state()
    }

    /// What it hands on of the second arm, if there is one.
    pub fn second(&self) -> Option<&SecondState<SECOND_AXES>> {
        self.0.beside().downcast_ref()
    }
}

/// The controller in this process, with its parameters and the trail of its newest cycle.
struct HostController<S: Second, const N: usize> {
    controller: Controller<S, N>,
    params: Params,
    second: S,
    trail: Trail,
}

impl<S: Second<State: 'static>, const N: usize> Engine for HostController<S, N> {
    fn sync(&mut self, mut transmit: &mut dyn FnMut(Frame)) -> anyhow::Result<()> {
        self.controller.sync(&mut transmit);
        Ok(())
    }

    fn receive(&mut self, frame: &Frame, _: u64) {
        self.controller.receive(frame);
    }

    fn cycle(&mut self, mut transmit: &mut dyn FnMut(Frame)) -> anyhow::Result<(Inputs<AXES>, Outputs<AXES>)> {
        self.trail = Trail::default();
        let Self { params, second, .. } = self;
        let (inputs, outputs) = self
            .controller
            .cycle_watched(params, second, &mut transmit, &mut self.trail);
        Ok((read_of_sealing(inputs), written_of_sealing(outputs)))
    }

    fn stall(&mut self) {
        self.controller.overran(1);
    }

    fn state(&self) -> &State {
        self.controller.state()
    }

    fn beside(&self) -> &dyn Any {
        self.controller.beside()
    }

    fn trail(&self) -> Trail {
        self.trail
    }

    fn cost(&self) -> Option<Cost> {
        None
    }

    fn load(&mut self, _: bool) {}

    fn finish(self: Box<Self>) -> anyhow::Result<Option<Box<Instruments>>> {
        Ok(None)
    }
}

impl Engine for TimedController {
    fn sync(&mut self, mut transmit: &mut dyn FnMut(Frame)) -> anyhow::Result<()> {
        Self::sync(self, &mut transmit);
        Ok(())
    }

    fn receive(&mut self, frame: &Frame, _: u64) {
        Self::receive(self, frame);
    }

    fn cycle(&mut self, mut transmit: &mut dyn FnMut(Frame)) -> anyhow::Result<(Inputs<AXES>, Outputs<AXES>)> {
        Ok(Self::cycle(self, &mut transmit))
    }

    fn stall(&mut self) {
        self.overran(1);
    }

    fn state(&self) -> &State {
        self.controller.state()
    }

    fn beside(&self) -> &dyn Any {
        self.controller.beside()
    }

    fn trail(&self) -> Trail {
        Trail::default()
    }

    fn cost(&self) -> Option<Cost> {
        Some(Self::cost(self))
    }

    fn load(&mut self, _: bool) {}

    fn finish(self: Box<Self>) -> anyhow::Result<Option<Box<Instruments>>> {
        Ok(None)
    }
}

impl<S: Second<State: 'static>, const N: usize> Engine for TargetController<S, N> {
    fn sync(&mut self, mut transmit: &mut dyn FnMut(Frame)) -> anyhow::Result<()> {
        Self::sync(self, &mut transmit)
    }

    fn receive(&mut self, frame: &Frame, t_ns: u64) {
        Self::receive(self, frame, t_ns);
    }

    fn cycle(&mut self, mut transmit: &mut dyn FnMut(Frame)) -> anyhow::Result<(Inputs<AXES>, Outputs<AXES>)> {
        let (inputs, outputs) = Self::cycle(self, &mut transmit)?;
        Ok((read_of_sealing(&inputs), written_of_sealing(&outputs)))
    }

    fn stall(&mut self) {
        Self::stall(self, STALL_US);
    }

    fn state(&self) -> &State {
        Self::state(self)
    }

    fn beside(&self) -> &dyn Any {
        Self::beside(self)
    }

    fn trail(&self) -> Trail {
        Self::trail(self)
    }

    fn cost(&self) -> Option<Cost> {
        Some(Self::cost(self))
    }

    fn load(&mut self, busy: bool) {
        Self::load(self, busy);
    }

    fn finish(self: Box<Self>) -> anyhow::Result<Option<Box<Instruments>>> {
        Self::finish(*self).map(Some)
    }
}

/// The node in this process.
pub(super) fn host<S: Second, const N: usize>(
    config: &MasterConfig<N>,
    params: &Params,
) -> anyhow::Result<Controller<S, N>> {
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

/// Of all axes the sealing arm's, which are the first.
fn own<T: Copy, const N: usize>(axes: &[T; N]) -> [T; AXES] {
    *axes.first_chunk().expect("every controller moves the sealing arm")
}

fn read_of_sealing<const N: usize>(inputs: &Inputs<N>) -> Inputs<AXES> {
    Inputs {
        sync: inputs.sync,
        axes: own(&inputs.axes),
        sighting: inputs.sighting,
        camera_age: inputs.camera_age,
        digital: inputs.digital,
        io_age: inputs.io_age,
        bus_ready: inputs.bus_ready,
        emergency_node: inputs.emergency_node,
        emergency_code: inputs.emergency_code,
        overruns: inputs.overruns,
    }
}

fn written_of_sealing<const N: usize>(outputs: &Outputs<N>) -> Outputs<AXES> {
    Outputs {
        axes: own(&outputs.axes),
        exposure: outputs.exposure,
        look: outputs.look,
        flow: outputs.flow,
        lamp: outputs.lamp,
        state: outputs.state,
        reason: outputs.reason,
        phase: outputs.phase,
        sighting: outputs.sighting,
        station_um: outputs.station_um,
        taught: outputs.taught,
    }
}
