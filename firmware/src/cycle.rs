//! The 5 ms control cycle: a pure function of parameters, state and inputs.
//!
//! decode → past → safety looks → sighting → job → servo → safety has the last word → encode. No I/O, no clock, no allocation, no iteration
//! count that depends on data: the same inputs give the same outputs, bit for bit, on every machine. Deadline: half a period after the
//! positions arrive (2.5 ms). A cycle that is late is not lost: the drives hold their last targets, and `overruns` says so next time:
//! the derivative is then left out, for the last sample is of unknown age.

mod limb;
mod second;

pub use second::{Second, SecondArm, SecondState};

use crate::arm::Arm;
use crate::fault::{Fault, Trip};
use crate::geometry::Pose;
use crate::job::correction::Use;
use crate::job::past::{Moment, Past};
use crate::job::phase::Phase;
use crate::job::seal::{AXES, SealParams};
use crate::job::start_pose::StartFrame;
use crate::job::task::{Order, Task};
use crate::job::teach::TeachParams;
use crate::safety::{Safety, State as SafetyState};
use crate::servo::axes::{DriveCommand, Servo};
use hal::process::{AxisOutput, Inputs, Look, Outputs};
use hal::stage::{Stage, Stopwatch};
use hal::wire::Wire;
use hal::wire_struct;
use limb::Limb;

/// Everything that is settled before the first cycle.
#[derive(Clone, Debug, PartialEq)]
pub struct Params {
    /// The arm.
    pub arm: Arm<AXES>,
    /// Its servo loops, and the model that feeds them forward.
    pub servo: Servo<AXES>,
    /// The sealing job.
    pub seal: SealParams,
    /// The teaching job, if it is that which is to be done.
    pub teach: Option<TeachParams>,
    /// From the SYNC at which the drives latch their positions to the middle of the exposure that has its stamp, cycles: as measured, or zero.
    pub exposure_delay: f32,
}

wire_struct!(Params { arm: Arm<AXES>, servo: Servo<AXES>, seal: SealParams, teach: Option<TeachParams>, exposure_delay: f32 });

impl Params {
    /// To be filled, as [`Wire::EMPTY`], and all of its bytes zero: initial values that take no flash. Without a teaching job one byte
    /// would be another.
    pub const ZEROS: Self = Self {
        teach: Some(TeachParams::EMPTY),
        ..Self::EMPTY
    };

    /// The job that is to be done.
    fn order(&self) -> Order<'_> {
        Order {
            seal: &self.seal,
            teach: self.teach.as_ref(),
        }
    }
}

/// Everything that a cycle hands to the next. `Clone`, so that a run can be taken up anywhere.
#[derive(Clone, Debug)]
#[repr(C)] // small things first: a float further on than 1020 bytes takes the processor one instruction more
pub struct State {
    cycle: u32,
    safety: Safety,
    limb: Limb<AXES>,
    job: Task,
    past: Past<AXES>,
}

impl State {
    /// Of no arm yet, to be set up.
    pub const EMPTY: Self = Self {
        cycle: 0,
        safety: Safety::new(),
        past: Past::new(),
        job: Task::EMPTY,
        limb: Limb::EMPTY,
    };

    /// At power-up.
    pub fn new(params: &Params) -> Self {
        let mut state = Self::EMPTY;
        state.set_up(params);
        state
    }

    /// Sets up an [`Self::EMPTY`] state where it stands.
    pub fn set_up(&mut self, params: &Params) {
        self.job.reset(params.order());
        self.limb.stand(&params.servo);
    }

    /// Where the safety machine stands.
    pub fn safety(&self) -> SafetyState {
        self.safety.state()
    }

    /// What stopped the arm first.
    pub fn trip(&self) -> Trip {
        self.safety.trip()
    }

    /// Where the job stands.
    pub fn phase(&self) -> Phase {
        self.job.phase()
    }

    /// The start pose as last measured, if it was.
    pub fn start(&self) -> Option<&StartFrame> {
        self.job.start()
    }

    /// Joint reference of this cycle, rad.
    pub fn reference(&self) -> &[f32; AXES] {
        self.limb.reference()
    }

    /// Where the newest correction says that the seam is: its station, m, and the nozzle's pose there, T_b_n.
    pub fn seam_ahead(&self, params: &Params) -> Option<(f32, Pose)> {
        self.job.seam_ahead(&params.seal.path)
    }

    /// Deviation that the job applies at its present reference: lateral m, height m, roll rad.
    pub fn correction(&self) -> [f32; 3] {
        self.job.correction_now()
    }
}

/// One cycle.
pub fn step(params: &Params, state: &mut State, inputs: &Inputs<AXES>) -> Outputs<AXES> {
    let mut outputs = Outputs::default();
    step_watched(params, state, inputs, &mut outputs, &mut ());
    outputs
}

/// One cycle, whose stages `watch` tells apart; whatever was in `outputs` is replaced.
pub fn step_watched(
    params: &Params,
    state: &mut State,
    inputs: &Inputs<AXES>,
    outputs: &mut Outputs<AXES>,
    watch: &mut impl Stopwatch,
) {
    step_with(params, &(), state, &mut (), inputs, outputs, watch);
}

/// The same with what moves beside the sealing arm; of the `N` axes it has those behind the arm's.
#[inline(always)]
pub fn step_with<S: Second, const N: usize>(
    params: &Params,
    second: &S,
    state: &mut State,
    beside: &mut S::State,
    inputs: &Inputs<N>,
    outputs: &mut Outputs<N>,
    watch: &mut impl Stopwatch,
) {
    const { assert!(N == AXES + S::COUNT) };
    let mut commands = [DriveCommand::default(); N];
    let (Some((own, others)), Some((commanded, others_commanded))) = (
        inputs.axes.split_first_chunk::<AXES>(),
        commands.split_first_chunk_mut::<AXES>(),
    ) else {
        return;
    };
    state.cycle = state.cycle.wrapping_add(1);
    let order = params.order();
    watch.result(Stage::Decode, &mut { *inputs });
    state.limb.measure(&params.arm, &params.servo, own, watch);
    second.measure(beside, others, watch);
    state.past.push(Moment {
        sync: inputs.sync,
        joints: *state.limb.joints(),
        station: state.job.station(),
    });
    watch.lap(Stage::Estimate);

    let before = state.safety.state();
    let permit = state
        .safety
        .observe(state.cycle, inputs, state.job.look() != Look::Dark);
    if !permit.servo || before == SafetyState::Arming {
        state.limb.stand(&params.servo);
        second.stand(beside);
    }
    if state.safety.state() == SafetyState::Arming && before != SafetyState::Arming {
        state.job.reset(order);
        second.reset(beside);
    }
    watch.lap(Stage::Safety);
    watch.result(
        Stage::Safety,
        &mut (state.safety.state() as u8, permit.servo, permit.advance),
    );

    let (mut used, mut newly_taught) = (Use::None, None);
    if let Some(sighting) = &inputs.sighting {
        let exposed = state.past.at(sighting.stamp, params.exposure_delay);
        let exposed = exposed.as_ref().map(|(moment, age)| (moment, *age));
        used = state.job.sight(order, &params.arm, sighting, exposed);
        newly_taught = state.job.taught();
    }
    watch.lap(Stage::Estimate);
    watch.result(Stage::Estimate, &mut (used as u8, state.job.newest_correction()));

    if permit.servo {
        let newest = state.limb.newest();
        let wish = state.job.advance(
            order,
            &params.arm,
            &newest,
            &mut state.limb.turns,
            permit.advance,
            watch,
        );
        state.limb.lead(&wish.joints);
        // The second arm goes on for as long as the sealing one has something to do.
        let (at_rest, fault) = second.advance(beside, permit.advance && !wish.at_rest, watch);
        if let Some((fault, place)) = wish.fault.or(fault) {
            state.safety.latch(fault, place, state.cycle);
        }
        if wish.at_rest && at_rest && state.safety.state() != SafetyState::Armed {
            state.safety.at_rest(state.cycle);
        }
        watch.lap(Stage::Safety);
        watch.result(Stage::Safety, &mut (state.safety.state() as u8));
        let late = inputs.overruns > 0;
        let (wanted, astray) = state.limb.follow(&params.arm, &params.servo, late, watch);
        *commanded = wanted;
        let astray = astray.or(second.follow(beside, late, others_commanded, watch));
        if let Some(axis) = astray {
            state.safety.latch(Fault::FollowingError, axis, state.cycle);
        }
    }

    // The last word: whatever was computed, the drives are asked for what the machine now allows, and nothing moves without leave.
    let permit = state.safety.permit();
    if !permit.servo {
        commands = [DriveCommand::default(); N];
    }
    // By name, so that none is left from the cycle before.
    let Outputs {
        axes,
        exposure,
        look,
        flow,
        lamp,
        state: safety_state,
        reason,
        phase,
        sighting,
        station_um,
        taught,
    } = outputs;
    for (axis, DriveCommand { velocity, torque }) in axes.iter_mut().zip(commands) {
        *axis = AxisOutput {
            request: permit.power,
            velocity,
            torque,
        };
    }
    watch.lap(Stage::Safety);
    watch.result(Stage::Safety, axes);
    (*exposure, *look) = if permit.servo {
        (state.job.exposure(order, inputs.sync), state.job.look())
    } else {
        (0, Look::Dark)
    };
    *flow = if permit.advance { state.job.flow(order) } else { 0 };
    *lamp = match state.safety.state() {
        SafetyState::EStop | SafetyState::Faulted => 3,
        SafetyState::Running | SafetyState::Stopping => 2,
        SafetyState::Arming | SafetyState::Armed | SafetyState::Stopped => 1,
        SafetyState::NotArmed => 0,
    };
    *safety_state = state.safety.state() as u8;
    *reason = state.safety.trip().fault as u8;
    *phase = state.job.phase() as u8;
    *sighting = used as u8;
    *station_um = (state.job.station() * 1e6) as i32;
    *taught = newly_taught;
    watch.result(Stage::Encode, outputs);
}
