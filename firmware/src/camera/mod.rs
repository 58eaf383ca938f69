//! What runs in the camera: a node on the bus that exposes by SYNC count ([`node`]), and what its processor makes of an
//! image ([`sight`]). The same code runs on the board, and in the simulator's cell.

pub mod memory;
pub mod node;
pub mod sight;

use crate::vision::camera::Pinhole;
use crate::vision::joint::Joint;
use hal::camera::{ONE_SLIT, SLITS, START, Size, TWO_SLITS};
use hal::process::Look;
use hal::{wire_enum, wire_struct};

/// Everything that is settled before the camera is switched on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Params {
    /// Its node number.
    pub node: u8,
    /// When sightings are sent, and what is repeated.
    pub timing: Timing,
    /// Slits of the seam sensor, 1 or 2.
    pub slits: u8,
    /// Lens and slit, for each; the nearer to the nozzle first. Of one slit the second is not looked at.
    pub pinholes: [Pinhole; SLITS],
    /// Lens and slit in the start view.
    pub start: Pinhole,
    /// The joint to look for.
    pub joint: Joint,
}

wire_struct!(Params {
    node: u8,
    timing: Timing,
    slits: u8,
    pinholes: [Pinhole; SLITS],
    start: Pinhole,
    joint: Joint
});

impl Params {
    /// Size of the image that is taken to look at `look`.
    pub fn size(&self, look: Look) -> Size {
        match look {
            Look::StartGrey | Look::StartSlit => START,
            Look::Seam | Look::Dark if self.slits == 1 => ONE_SLIT,
            Look::Seam | Look::Dark => TWO_SLITS,
        }
    }
}

/// Times of the node, in cycles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Timing {
    /// From an exposure to the SYNC with which its sighting is sent. Fixed, and not as soon as may be, so that a run
    /// does not depend on how long a processor takes: long enough for read-out and vision.
    pub latency_cycles: u8,
    /// The same of a grey view of the seam's start, which is much to look through, and for which the arm stands still.
    pub grey_latency_cycles: u8,
    /// What vision takes of that, at most: so long the processor cannot begin another image, while the sensor is read out it can.
    pub vision_cycles: u8,
    /// Exposures tried again for one that was asked for.
    pub retries: u8,
}

wire_struct!(Timing {
    latency_cycles: u8,
    grey_latency_cycles: u8,
    vision_cycles: u8,
    retries: u8
});

/// The camera exposes at this instant.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Exposure {
    /// SYNC count of this instant, the stamp of what is seen.
    pub stamp: u8,
    /// What it looks at, and by which light.
    pub look: Look,
}

wire_struct!(Exposure { stamp: u8, look: Look });

/// What an image of the camera tells through the trace port whenever it has sent what it had to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Report {
    /// What it did.
    pub event: Event,
    /// It exposes now.
    pub exposure: Option<Exposure>,
    /// Vision finished since the last report: the exposure, and counts of the board's counter, with whatever interrupted it.
    pub vision: Option<(Exposure, u32)>,
}

wire_struct!(Report {
    event: Event,
    exposure: Option<Exposure>,
    vision: Option<(Exposure, u32)>
});

/// What a [`Report`] follows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum Event {
    /// Half a cycle has passed on the camera's own clock.
    #[default]
    Tick,
    /// Frames came.
    Receive,
}

wire_enum!(Event { Tick, Receive });
