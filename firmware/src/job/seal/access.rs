//! From point to point: to the part, from place to place of its measurement, and away.

use super::{AXES, SealJob, SealParams};
use crate::arm::Arm;
use crate::fault::Fault;
use crate::geometry::Pose;
use crate::job::measure::Next;
use crate::job::phase::Phase;

impl SealJob {
    /// First of all up, clear of whatever the arm was stopped over.
    #[inline(never)] // as all of these it is in no hurry, and following is to have the registers
    pub(super) fn rise(&mut self, params: &SealParams, arm: &Arm<AXES>, reference: &[f32; AXES]) -> Result<(), Fault> {
        let start = self.beginning(params);
        self.access.rise(&params.access, arm, reference, &start)
    }

    /// The run-in's beginning, T_b_n.
    fn beginning(&self, params: &SealParams) -> Pose {
        self.to_part * params.path.place(self.stations[2]).nozzle(0.0, 0.0, 0.0)
    }

    /// Up from where the nozzle is at the end of the run-out: the last correction still holds there.
    #[inline(never)]
    pub(super) fn lift(&mut self, params: &SealParams, reference: &[f32; AXES]) -> Result<(), Fault> {
        self.access.phase = Phase::Lift;
        let station = self.stations[2];
        let [lateral, height, roll] = self.correction(params, station);
        let goal = params
            .path
            .place(station)
            .nozzle(lateral, height + params.access.clearance, roll);
        self.access.go(&params.access, reference, &(self.to_part * goal))
    }

    /// Between two motions of the measurement. A measured part is left straight up.
    #[inline(never)]
    pub(super) fn measure_on(
        &mut self,
        params: &SealParams,
        arm: &Arm<AXES>,
        reference: &[f32; AXES],
    ) -> Result<(), Fault> {
        let next = self
            .measure
            .next(&params.measure, &params.path, &params.mount, &mut self.to_part)?;
        match next {
            Next::Wait => Ok(()),
            Next::Go(goal) if self.measure.start().is_none() => self.access.begin(&params.access, reference, &goal),
            Next::Go(goal) => self.access.go(&params.access, reference, &goal),
            Next::Done => self.rise(params, arm, reference),
        }
    }

    #[inline(never)]
    pub(super) fn point_to_point(
        &mut self,
        params: &SealParams,
        reference: &[f32; AXES],
        advance: bool,
    ) -> Result<[f32; AXES], Fault> {
        let (joints, arrived) = self.access.step(&params.access, reference, advance);
        if self.access.phase == Phase::Turn {
            self.corrections.settle(&params.path, self.round.due());
        }
        if !arrived {
            return Ok(joints);
        }
        match self.access.phase {
            Phase::Turn => {
                self.turn_on(params, &joints)?;
                return Ok(joints);
            }
            Phase::Rise if params.measure.start && !self.measure.is_done() => self.access.phase = Phase::Measure,
            Phase::Measure => {}
            _ => {
                let start = self.beginning(params);
                self.access.arrived(&params.access, &joints, &start)?;
            }
        }
        if let (Phase::Follow, Some(start)) = (self.access.phase, self.measure.start()) {
            self.corrections.begin(&params.path, &self.to_part, &start.pose);
        }
        Ok(joints)
    }
}
