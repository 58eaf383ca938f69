//! The camera as a node on the bus, without sensor, processor and board: when it exposes, and when a sighting is sent.
//!
//! Whoever owns them calls: [`CameraNode::receive`] for each frame, which tells when to expose; [`CameraNode::elapse`] as time
//! passes; [`CameraNode::read_out`] when the sensor has been read out; and [`CameraNode::hand_back`] with what vision saw.
//!
//! - An exposure that is commanded while the sensor is still read out, or while [`IN_FLIGHT`] images are under way, is not taken:
//!   no sighting with its stamp comes. Nor is one of the seam's start while any image is under way: there is memory for one as large as that.
//! - A sighting is sent with the SYNC that is `latency_cycles` (of a grey view: `grey_latency_cycles`) after its exposure, or later by as
//!   much as an image before it holds the processor up.
//! - Vision that is late holds its sighting up, and nothing else: it goes with the first SYNC after it is there. Its stamp is that of its
//!   exposure, so it is late for the controller, but not wrong.
//! - An image that is lost is taken again at the next SYNC, `retries` times; then the node says so ([`NO_IMAGE`]).

use super::{Exposure, Timing};
use hal::camera::{Camera, IDENTITY, IN_FLIGHT, NO_IMAGE, SLITS};
use hal::can::Frame;
use hal::canopen::cob;
use hal::canopen::slave::{Received, Slave};
use hal::process::{Look, Sighting};

/// An image under way.
#[derive(Clone, Copy, Debug)]
struct InFlight {
    stamp: u8,
    /// SYNCs until its sighting is due; less than none once it is late.
    left: i16,
    /// By slit.
    sightings: [Option<Sighting>; SLITS],
}

/// The camera node.
#[derive(Clone, Debug)]
pub struct CameraNode {
    slave: Slave,
    camera: Camera,
    timing: Timing,
    /// The exposure that is being read out, and how often its image has been lost before.
    reading: Option<(Exposure, u8)>,
    /// The next SYNC exposes again, for an image lost so many times.
    again: Option<u8>,
    in_flight: [Option<InFlight>; IN_FLIGHT],
}

impl CameraNode {
    /// Node `node`, silent until power comes on.
    pub fn new(node: u8, timing: Timing) -> Self {
        Self {
            slave: Slave::new(node, IDENTITY),
            camera: Camera::default(),
            timing,
            reading: None,
            again: None,
            in_flight: [None; IN_FLIGHT],
        }
    }

    /// Power comes on.
    pub fn power_on(&mut self, transmit: &mut impl FnMut(Frame)) {
        self.reading = None;
        self.again = None;
        self.in_flight = [None; IN_FLIGHT];
        self.slave.boot(&mut self.camera, transmit);
    }

    /// Whether frames with this identifier mean anything to the node.
    pub fn hears(&self, id: u16) -> bool {
        self.slave.hears(id)
    }

    /// Takes a frame from the bus; at a SYNC the camera may expose.
    pub fn receive(&mut self, frame: &Frame, transmit: &mut impl FnMut(Frame)) -> Option<Exposure> {
        if frame.cob() == cob::SYNC {
            // The sighting must be in its objects before the slave reads them for this SYNC's PDOs.
            self.finish();
        }
        let Received::Sync(count) = self.slave.receive(frame, &mut self.camera, transmit) else {
            return None;
        };
        let commanded = self.camera.take_exposure().is_some();
        // A new command is worth more than the repetition of an old one.
        match (commanded, self.again.take()) {
            (true, _) => self.expose(count, 0),
            (false, Some(losses)) => self.expose(count, losses),
            (false, None) => None,
        }
    }

    /// Lets `us` microseconds pass.
    pub fn elapse(&mut self, us: u32, transmit: &mut impl FnMut(Frame)) {
        self.slave.elapse(us, &mut self.camera, transmit);
    }

    /// The sensor has been read out; the exposure whose image is there for vision, if one came whole.
    pub fn read_out(&mut self, whole: bool) -> Option<Exposure> {
        let (exposure, losses) = self.reading.take()?;
        if whole {
            return Some(exposure);
        }
        if losses < self.timing.retries {
            let lost = |image: &InFlight| image.stamp == exposure.stamp;
            for place in &mut self.in_flight {
                if place.as_ref().is_some_and(lost) {
                    *place = None;
                }
            }
            self.again = Some(losses + 1);
        } else {
            self.hand_back(Sighting {
                stamp: exposure.stamp,
                look: exposure.look,
                refusal: NO_IMAGE,
                ..Sighting::default()
            });
        }
        None
    }

    /// What vision made of the image of `sighting.stamp` by one slit.
    pub fn hand_back(&mut self, sighting: Sighting) {
        let mut images = self.in_flight.iter_mut().flatten();
        let image = images.find(|image| image.stamp == sighting.stamp);
        if let Some(place) = image.and_then(|image| image.sightings.get_mut(usize::from(sighting.slit))) {
            *place = Some(sighting);
        }
    }

    fn expose(&mut self, stamp: u8, losses: u8) -> Option<Exposure> {
        let look = self.camera.look();
        let large = matches!(look, Look::StartGrey | Look::StartSlit);
        if self.reading.is_some() || large && self.in_flight.iter().any(Option::is_some) {
            return None;
        }
        // One processor: an image waits for the one before it, once it is read out.
        let busy = self.in_flight.iter().flatten().map(|image| image.left).max();
        let alone = i16::from(if look == Look::StartGrey {
            self.timing.grey_latency_cycles
        } else {
            self.timing.latency_cycles
        })
        .max(1);
        let queued = busy.unwrap_or(0).max(0) + i16::from(self.timing.vision_cycles);
        let place = self.in_flight.iter_mut().find(|place| place.is_none())?;
        *place = Some(InFlight {
            stamp,
            left: alone.max(queued),
            sightings: [None; SLITS],
        });
        let exposure = Exposure { stamp, look };
        self.reading = Some((exposure, losses));
        Some(exposure)
    }

    /// Counts the SYNCs; a sighting that is due goes into its objects and with this SYNC onto the bus.
    fn finish(&mut self) {
        for image in self.in_flight.iter_mut().flatten() {
            image.left = image.left.saturating_sub(1);
        }
        let left = |place: &Option<InFlight>| match place {
            Some(image) if image.left <= 0 && image.sightings.iter().any(Option::is_some) => Some(image.left),
            _ => None,
        };
        let due = self.in_flight.iter_mut().filter(|place| left(place).is_some());
        let Some(place) = due.min_by_key(|place| left(place)) else {
            return;
        };
        // One slit's with this SYNC, the other's with the next: the master hands on one in a cycle, and the bus is not loaded by two at once.
        let mut sightings = place.iter_mut().flat_map(|image| &mut image.sightings);
        let sighting = sightings.find_map(Option::take);
        if sightings.all(|left| left.is_none()) {
            *place = None;
        }
        for pdo in sighting
            .and_then(|sighting| self.camera.report(sighting))
            .into_iter()
            .flatten()
        {
            self.slave.ask(pdo);
        }
    }
}

#[cfg(test)]
mod tests;
