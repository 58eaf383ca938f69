//! At a halt of the path: up from its end, or round a corner.

use super::{ARRIVED, AXES, SealJob, SealParams};
use crate::arm::Arm;
use crate::fault::Fault;
use crate::geometry::Pose;
use crate::job::phase::Phase;
use crate::job::round::{Leg, Round};

impl SealJob {
    /// At a halt: up from the end, or from the stop before a corner that is to be looked round.
    pub(super) fn halted(
        &mut self,
        params: &SealParams,
        arm: &Arm<AXES>,
        reference: &[f32; AXES],
    ) -> Result<(), Fault> {
        let Some(corner) = params.path.corner(self.halt) else {
            return self.lift(params, reference);
        };
        self.halt = params.path.halt(corner.stop + ARRIVED);
        if params.preview {
            self.round = Round::at(*corner, params.mount.pose.p.x);
            self.access.phase = Phase::Turn;
            self.access
                .up(&params.access, arm, reference, params.round.stance.raise)?;
        }
        Ok(())
    }

    /// The next leg of a look round a corner.
    #[inline(never)]
    pub(super) fn turn_on(&mut self, params: &SealParams, reference: &[f32; AXES]) -> Result<(), Fault> {
        match self.round.leg {
            Leg::Up => {
                self.round.leg = Leg::Back;
                let goal = self.to_part * self.round.pose(&params.round, &params.path, self.applied);
                self.access.go(&params.access, reference, &goal)?;
            }
            Leg::Back => {
                self.round.leg = Leg::Along;
                self.corrections.look_to(params.path.horizon(self.halt));
            }
            Leg::Along | Leg::Home => {
                let (next, height) = if self.round.leg == Leg::Along {
                    (Leg::Home, params.round.stance.raise)
                } else {
                    (Leg::Down, 0.0)
                };
                self.round.leg = next;
                // Where the nozzle stopped, with the correction that was applied there.
                let [lateral, up, roll] = self.applied;
                let stop = params.path.place(self.round.stop()).nozzle(lateral, up, roll);
                self.access
                    .go(&params.access, reference, &(self.to_part * stop).raised(height))?;
            }
            Leg::Down => {
                self.stations = [self.round.stop(); 3];
                self.access.phase = Phase::Follow;
            }
        }
        Ok(())
    }

    /// The sensor goes on along the seam.
    pub(super) fn look_round(
        &mut self,
        params: &SealParams,
        reference: &[f32; AXES],
        advance: bool,
    ) -> Result<Option<Pose>, Fault> {
        let quiet = self.corrections.settle(&params.path, self.round.due());
        // What is next is planned in a cycle that has time.
        if self.round.go(&params.round, &params.path, advance) && quiet {
            self.turn_on(params, reference)?;
            return Ok(None);
        }
        Ok(Some(
            self.to_part * self.round.pose(&params.round, &params.path, self.applied),
        ))
    }
}
