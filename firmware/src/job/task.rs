//! The job in hand, whichever it is: what the cycle asks of every job.

use super::correction::Use;
use super::past::Moment;
use super::path::TaughtPath;
use super::phase::Phase;
use super::seal::{AXES, SealJob, SealParams};
use super::start_pose::StartFrame;
use super::teach::{TeachJob, TeachParams};
use super::wish::Wish;
use crate::arm::{Arm, Turns};
use crate::geometry::Pose;
use crate::servo::hold::Knot;
use hal::process::{Look, Sighting, TaughtPoint};
use hal::stage::Stopwatch;

/// What the controller was told to do: to teach, if it has the parameters for that, and else to seal.
#[derive(Clone, Copy, Debug)]
pub struct Order<'a> {
    /// Sealing.
    pub seal: &'a SealParams,
    /// Teaching.
    pub teach: Option<&'a TeachParams>,
}

/// The job's memory. One takes the place of the other.
#[derive(Clone, Debug)]
#[allow(
    clippy::large_enum_variant,
    reason = "there is no heap, and the memory is that of the larger one once"
)]
pub enum Task {
    /// Sealing.
    Seal(SealJob),
    /// Teaching.
    Teach(TeachJob),
}

impl Task {
    /// Of no path yet.
    pub const EMPTY: Self = Self::Seal(SealJob::EMPTY);

    /// Becomes the job that is ordered, not begun.
    pub fn reset(&mut self, order: Order) {
        if let Some(teach) = order.teach {
            *self = Self::Teach(TeachJob::new(teach));
            return;
        }
        if let Self::Teach(_) = self {
            *self = Self::EMPTY;
        }
        if let Self::Seal(job) = self {
            job.reset(order.seal);
        }
    }

    /// Where the job stands.
    pub fn phase(&self) -> Phase {
        match self {
            Self::Seal(job) => job.phase(),
            Self::Teach(job) => job.phase(),
        }
    }

    /// Reference station of this cycle, m.
    pub fn station(&self) -> f32 {
        match self {
            Self::Seal(job) => job.station(),
            Self::Teach(job) => job.station(),
        }
    }

    /// Deviation from the taught path that is applied at the newest reference: lateral m, height m, roll rad.
    pub fn correction_now(&self) -> [f32; 3] {
        match self {
            Self::Seal(job) => job.correction_now(),
            Self::Teach(_) => [0.0; 3],
        }
    }

    /// Where the newest correction says that the seam is: its station, m, and the nozzle's pose there, T_b_n.
    pub fn seam_ahead(&self, path: &TaughtPath) -> Option<(f32, Pose)> {
        match self {
            Self::Seal(job) => job.seam_ahead(path),
            Self::Teach(_) => None,
        }
    }

    /// The newest deviation from the taught path that sightings showed.
    pub fn newest_correction(&self) -> Option<Knot> {
        match self {
            Self::Seal(job) => job.newest_correction(),
            Self::Teach(_) => None,
        }
    }

    /// What the camera is to look at; [`Look::Dark`] if its frames do not matter now.
    pub fn look(&self) -> Look {
        match self {
            Self::Seal(job) => job.look(),
            Self::Teach(job) => job.look(),
        }
    }

    /// The start pose as last measured, if it was.
    pub fn start(&self) -> Option<&StartFrame> {
        match self {
            Self::Seal(job) => job.start(),
            Self::Teach(_) => None,
        }
    }

    /// Takes in a sighting with the moment of its exposure, and how many cycles ago that was.
    pub fn sight(
        &mut self,
        order: Order,
        arm: &Arm<AXES>,
        sighting: &Sighting,
        exposed: Option<(&Moment<AXES>, u8)>,
    ) -> Use {
        match (self, order.teach) {
            (Self::Seal(job), _) => job.sight(order.seal, arm, sighting, exposed),
            (Self::Teach(job), Some(params)) => job.sight(params, arm, sighting, exposed),
            (Self::Teach(_), None) => Use::Stale,
        }
    }

    /// One cycle on: `reference` is last cycle's wish, and what `turns` takes. `advance` false brakes, along the path.
    pub fn advance(
        &mut self,
        order: Order,
        arm: &Arm<AXES>,
        reference: &[f32; AXES],
        turns: &mut Turns<AXES>,
        advance: bool,
        watch: &mut impl Stopwatch,
    ) -> Wish<AXES> {
        match (self, order.teach) {
            (Self::Seal(job), _) => job.advance(order.seal, arm, reference, turns, advance, watch),
            (Self::Teach(job), Some(params)) => job.advance(params, arm, reference, turns, advance, watch),
            (Self::Teach(_), None) => Wish {
                joints: *reference,
                at_rest: true,
                fault: None,
            },
        }
    }

    /// SYNC count of the next exposure to command, zero for none in this cycle.
    pub fn exposure(&mut self, order: Order, sync: u8) -> u8 {
        match (self, order.teach) {
            (Self::Seal(job), _) => job.exposure(order.seal, sync),
            (Self::Teach(job), Some(params)) => job.exposure(params, sync),
            (Self::Teach(_), None) => 0,
        }
    }

    /// Dispenser flow for the coming cycle, per mille of nominal.
    pub fn flow(&self, order: Order) -> u16 {
        match self {
            Self::Seal(job) => job.flow(order.seal),
            Self::Teach(_) => 0,
        }
    }

    /// A point that was taught in this cycle.
    pub fn taught(&mut self) -> Option<TaughtPoint> {
        match self {
            Self::Seal(_) => None,
            Self::Teach(job) => job.taught(),
        }
    }
}
