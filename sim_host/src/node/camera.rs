//! The camera node: exposure by SYNC count, a processor that takes its time, and images that get lost.
//!
//! Image and vision are the runner's: at an exposure it gets an [`Exposure`], takes the image and hands back what vision
//! found. The node sends it when a real one could, and knows at read-out whether an image came at all.

use hal::camera::{Camera, IDENTITY, NO_IMAGE, SLITS};
use hal::can::Frame;
use hal::canopen::slave::{Received, Slave};
use hal::process::{Look, Sighting};
use rand::Rng;
use rand_pcg::Pcg32;

/// Images under way at once: one in the processor, one waiting. An exposure asked for beyond them is not taken, and no
/// sighting with its stamp comes.
const IN_FLIGHT: usize = 2;

/// Times of the camera, in cycles, and its faults.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraTiming {
    /// From exposure to the sighting on the bus: 7 cycles, 35 ms, for the paper's 30 ms image and 2 ms pose.
    pub latency_cycles: u8,
    /// From exposure to the knowledge that no image came: 2 cycles, the read-out of a small field (assumed).
    pub read_out_cycles: u8,
    /// Part of the images that is lost, 0..=1.
    pub loss: f64,
    /// Exposures tried again for one that was asked for.
    pub retries: u8,
}

impl Default for CameraTiming {
    fn default() -> Self {
        Self {
            latency_cycles: 7,
            read_out_cycles: 2,
            loss: 0.05,
            retries: 3,
        }
    }
}

/// The camera exposes at this instant: the runner takes the image now.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Exposure {
    /// SYNC count of this instant, the stamp of the sighting to hand back.
    pub stamp: u8,
    /// What it looks at, and by which light.
    pub look: Look,
}

/// An image on its way through the processor.
#[derive(Clone, Copy, Debug)]
struct InFlight {
    stamp: u8,
    /// SYNCs until the sighting is sent.
    left: u8,
    /// By slit.
    sightings: [Option<Sighting>; SLITS],
}

/// An image that was lost and is to be taken again.
#[derive(Clone, Copy, Debug)]
struct Retry {
    left: u8,
    tries: u8,
}

/// The camera node of the cell.
#[derive(Clone, Debug)]
pub struct CameraNode {
    slave: Slave,
    camera: Camera,
    timing: CameraTiming,
    random: Pcg32,
    in_flight: Vec<InFlight>,
    retry: Option<Retry>,
    /// Images taken, and of them lost.
    taken: u64,
    lost: u64,
}

impl CameraNode {
    /// Node `node`; `random` is the stream of its losses, keyed by seed and run.
    pub fn new(node: u8, timing: CameraTiming, random: Pcg32) -> Self {
        Self {
            slave: Slave::new(node, IDENTITY),
            camera: Camera::default(),
            timing,
            random,
            in_flight: Vec::with_capacity(IN_FLIGHT),
            retry: None,
            taken: 0,
            lost: 0,
        }
    }

    /// Power comes on.
    pub fn power_on(&mut self, tx: &mut impl FnMut(Frame)) {
        self.in_flight.clear();
        self.retry = None;
        self.slave.boot(&mut self.camera, tx);
    }

    /// Takes a frame from the bus; at a SYNC the camera may expose. An exposure whose image gets lost is not told.
    pub fn receive(&mut self, frame: &Frame, tx: &mut impl FnMut(Frame)) -> Option<Exposure> {
        if frame.cob() == hal::canopen::cob::SYNC {
            // The sighting must be in its objects before the slave reads them for this SYNC's PDOs.
            self.finish();
        }
        let Received::Sync(count) = self.slave.receive(frame, &mut self.camera, tx) else {
            return None;
        };
        let commanded = self.camera.take_exposure().is_some();
        let again = match &mut self.retry {
            Some(retry) => {
                retry.left -= 1;
                retry.left == 0
            }
            None => false,
        };
        if commanded {
            // A new command is worth more than the repetition of an old one.
            self.retry = None;
            self.expose(count, 0)
        } else if again {
            let tries = self.retry.take().map_or(0, |retry| retry.tries);
            self.expose(count, tries)
        } else {
            None
        }
    }

    /// Lets `us` microseconds pass.
    pub fn elapse(&mut self, us: u32, tx: &mut impl FnMut(Frame)) {
        self.slave.elapse(us, &mut self.camera, tx);
    }

    /// What vision made of the image of `sighting.stamp` by one slit; it is sent when the processor would be done.
    pub fn hand_back(&mut self, sighting: Sighting) {
        let image = self.in_flight.iter_mut().find(|image| image.stamp == sighting.stamp);
        if let Some(place) = image.and_then(|image| image.sightings.get_mut(usize::from(sighting.slit))) {
            *place = Some(sighting);
        }
    }

    /// Images taken so far, and how many of them were lost.
    pub fn images(&self) -> (u64, u64) {
        (self.taken, self.lost)
    }

    fn expose(&mut self, stamp: u8, tries: u8) -> Option<Exposure> {
        if self.in_flight.len() == IN_FLIGHT {
            return None;
        }
        self.taken += 1;
        if (self.random.next_u32() as f64) < self.timing.loss * 2f64.powi(32) {
            self.lost += 1;
            if tries < self.timing.retries {
                let left = self.timing.read_out_cycles.max(1);
                self.retry = Some(Retry { left, tries: tries + 1 });
            } else {
                // It gives up, and says so after the same time as for an image.
                let none = Sighting {
                    stamp,
                    look: self.camera.look(),
                    refusal: NO_IMAGE,
                    ..Sighting::default()
                };
                self.start(stamp, Some(none));
            }
            return None;
        }
        self.start(stamp, None);
        Some(Exposure {
            stamp,
            look: self.camera.look(),
        })
    }

    fn start(&mut self, stamp: u8, sighting: Option<Sighting>) {
        // One processor: an image waits for the one before it.
        let busy = self.in_flight.iter().map(|image| image.left).max().unwrap_or(0);
        let left = busy.saturating_add(self.timing.latency_cycles).max(1);
        let sightings = [sighting, None];
        self.in_flight.push(InFlight { stamp, left, sightings });
    }

    /// Counts the SYNCs; the sighting that is due goes into its objects and with this SYNC onto the bus.
    fn finish(&mut self) {
        for image in &mut self.in_flight {
            image.left = image.left.saturating_sub(1);
        }
        if let Some(k) = self.in_flight.iter().position(|image| image.left == 0) {
            let image = self.in_flight.remove(k);
            for sighting in image.sightings.into_iter().flatten() {
                for pdo in self.camera.report(sighting).into_iter().flatten() {
                    self.slave.ask(pdo);
                }
            }
        }
    }
}
