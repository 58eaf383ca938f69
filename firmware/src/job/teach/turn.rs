//! At rest where the seam went out of sight: to its other leg, and on along that.

use super::ending::Ending;
use super::lead::Lead;
use super::search::{BEYOND, Next, Search};
use super::{Guide, TeachJob, TeachParams};
use crate::arm::Arm;
use crate::fault::Fault;
use crate::geometry::Pose;
use crate::job::phase::Phase;
use crate::job::seal::AXES;

/// Way past the corner over which the nozzle comes down to the seam again, m.
const LANDING: f32 = 0.020;

impl TeachJob {
    /// The seam went out of sight, and the arm is at rest.
    #[inline(never)] // as all of these in no hurry
    pub(super) fn look_round(
        &mut self,
        params: &TeachParams,
        arm: &Arm<AXES>,
        reference: &[f32; AXES],
    ) -> Result<(), Fault> {
        self.search = Some(Search::new(self.seam.as_ref().ok_or(Fault::SeamLost)?));
        self.access.phase = Phase::Turn;
        self.access.up(&params.access, arm, reference, params.search.raise)
    }

    /// To the next place of the search, or along the leg that it found.
    #[inline(never)]
    pub(super) fn turn_on(&mut self, params: &TeachParams, reference: &[f32; AXES]) -> Result<(), Fault> {
        let search = self.search.as_mut().ok_or(Fault::SeamLost)?;
        if let Next::Go(goal) = search.next(&params.search)? {
            if self.access.turn(&params.access, reference, &goal).is_err() {
                search.bar()?;
                self.access.stay(reference);
            }
            return Ok(());
        }
        let (first, nozzle, corner) = search.found(&params.search).ok_or(Fault::SeamLost)?;
        self.guide = Guide::Lead(Lead::new(&nozzle));
        let station = corner + BEYOND;
        self.stations = [station - params.search.look; 3];
        self.raised_to = corner;
        if let Some(seam) = &mut self.seam {
            seam.start(station, first, &nozzle, params.search.look);
        }
        self.ending = Ending::default();
        self.search = None;
        self.access.phase = Phase::Follow;
        Ok(())
    }

    /// The nozzle's pose where `goal` would have it on the seam, at distance `station` (m): raised and leaning until it is past the corner.
    pub(super) fn landing(&self, params: &TeachParams, station: f32, goal: Pose) -> Pose {
        let down = (station - self.raised_to) * (1.0 / LANDING);
        if down >= 1.0 {
            return goal;
        }
        let down = down.max(0.0);
        let up = 1.0 - down * down * (3.0 - 2.0 * down);
        let (ahead, normal) = (goal.r.column(0).into(), goal.r.column(2).into());
        let place = goal.p + ahead * params.search.look;
        params.search.over(&place, &ahead, &normal, up)
    }
}
