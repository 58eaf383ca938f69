//! What moves beside the sealing arm: in the same cycle, on the same bus, under the same safety machine. A stop of one stops both.

use super::limb::Limb;
use crate::arm::Arm;
use crate::fault::Fault;
use crate::job::seal::AXES;
use crate::job::shuttle::{Shuttle, ShuttleParams};
use crate::servo::axes::{DriveCommand, Servo};
use hal::process::AxisInput;
use hal::stage::Stopwatch;
use hal::wire::Wire;
use hal::wire_struct;

/// Parameters of whatever moves beside the sealing arm; `()` is nothing, and takes no instruction.
pub trait Second: Wire {
    /// Its memory.
    type State;
    /// Of nothing yet.
    const EMPTY_STATE: Self::State;
    /// Its axes: drives `AXES` + 1 and up on the bus.
    const COUNT: usize;

    /// Takes in what its drives latched.
    fn measure(&self, state: &mut Self::State, axes: &[AxisInput], watch: &mut impl Stopwatch);
    /// Bumpless: the reference is where it stands.
    fn stand(&self, state: &mut Self::State);
    /// The job is to begin anew.
    fn reset(&self, state: &mut Self::State);
    /// The job's next cycle; `advance` false brakes. Whether it is at rest, and a fault that it found with the axis (of all) to blame.
    fn advance(
        &self,
        state: &mut Self::State,
        advance: bool,
        watch: &mut impl Stopwatch,
    ) -> (bool, Option<(Fault, u8)>);
    /// Gives each drive's command, in their order, to `to`, and names the axis (of all) that is too far from its reference, if one is.
    fn follow(
        &self,
        state: &mut Self::State,
        late: bool,
        to: &mut [DriveCommand],
        watch: &mut impl Stopwatch,
    ) -> Option<u8>;
}

/// Nothing: no byte.
impl Second for () {
    type State = ();
    const EMPTY_STATE: () = ();
    const COUNT: usize = 0;

    #[inline(always)]
    fn measure(&self, (): &mut (), _: &[AxisInput], _: &mut impl Stopwatch) {}
    #[inline(always)]
    fn stand(&self, (): &mut ()) {}
    #[inline(always)]
    fn reset(&self, (): &mut ()) {}
    #[inline(always)]
    fn advance(&self, (): &mut (), _: bool, _: &mut impl Stopwatch) -> (bool, Option<(Fault, u8)>) {
        (true, None)
    }
    #[inline(always)]
    fn follow(&self, (): &mut (), _: bool, _: &mut [DriveCommand], _: &mut impl Stopwatch) -> Option<u8> {
        None
    }
}

/// A second arm of `N` axes, which goes to and fro.
#[derive(Clone, Debug, PartialEq)]
pub struct SecondArm<const N: usize> {
    /// The arm.
    pub arm: Arm<N>,
    /// Its servo loops, and the model that feeds them forward.
    pub servo: Servo<N>,
    /// Its job.
    pub shuttle: ShuttleParams<N>,
}

wire_struct!(SecondArm<const N: usize> { arm: Arm<N>, servo: Servo<N>, shuttle: ShuttleParams<N> });

/// Its memory.
#[derive(Clone, Debug)]
pub struct SecondState<const N: usize> {
    limb: Limb<N>,
    job: Shuttle<N>,
}

impl<const N: usize> SecondState<N> {
    /// Joint reference of this cycle, rad.
    pub fn reference(&self) -> &[f32; N] {
        self.limb.reference()
    }
}

impl<const N: usize> Second for SecondArm<N> {
    type State = SecondState<N>;
    const EMPTY_STATE: SecondState<N> = SecondState {
        limb: Limb::EMPTY,
        job: Shuttle::IDLE,
    };
    const COUNT: usize = N;

    fn measure(&self, state: &mut Self::State, axes: &[AxisInput], watch: &mut impl Stopwatch) {
        if let Some(axes) = axes.first_chunk() {
            state.limb.measure(&self.arm, &self.servo, axes, watch);
        }
    }

    fn stand(&self, state: &mut Self::State) {
        state.limb.stand(&self.servo);
    }

    fn reset(&self, state: &mut Self::State) {
        state.job = Shuttle::IDLE;
    }

    fn advance(
        &self,
        state: &mut Self::State,
        advance: bool,
        watch: &mut impl Stopwatch,
    ) -> (bool, Option<(Fault, u8)>) {
        let SecondState { limb, job } = state;
        let newest = limb.newest();
        let wish = job.advance(&self.shuttle, &self.arm, &newest, &mut limb.turns, advance, watch);
        limb.lead(&wish.joints);
        (wish.at_rest, wish.fault.map(|(fault, axis)| (fault, axis + AXES as u8)))
    }

    fn follow(
        &self,
        state: &mut Self::State,
        late: bool,
        to: &mut [DriveCommand],
        watch: &mut impl Stopwatch,
    ) -> Option<u8> {
        let (commands, astray) = state.limb.follow(&self.arm, &self.servo, late, watch);
        if let Some(to) = to.first_chunk_mut() {
            *to = commands;
        }
        astray.map(|axis| axis + AXES as u8)
    }
}
