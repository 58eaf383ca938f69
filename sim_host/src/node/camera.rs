//! The camera node of the cell: the node's logic in this process or on an emulated board, a sensor that takes its time to be
//! read out, and images that get lost.
//!
//! Image and vision are the runner's: at an exposure it gets an [`Exposure`], takes the image, shows it, and hands back what
//! vision found. The node sees all of that when the sensor has been read out: half a cycle's grid is what both the node
//! in process and the one on a board share.

use crate::target::camera::TargetCamera;
use crate::target::vision::CameraFigures;
use firmware::camera::Timing;
use firmware::camera::node;
use hal::board::report::HALF_US;
use hal::camera::{SLITS, Size};
use hal::can::Frame;
use hal::process::Sighting;
use rand::Rng;
use rand_pcg::Pcg32;

pub use firmware::camera::Exposure;

/// Times of the camera, in cycles, and its faults.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraTiming {
    /// From exposure to the sighting on the bus: 7 cycles, 35 ms, for the paper's 30 ms image and 2 ms pose.
    pub latency_cycles: u8,
    /// From exposure until the image is read out, or known to be lost: 2 cycles, a small field (assumed). It is over half a cycle before
    /// the sighting is due, whatever is said here.
    pub read_out_cycles: u8,
    /// Part of the images that is lost, 0..=1.
    pub loss: f64,
    /// From exposure to the sighting of a grey view of the seam's start.
    pub grey_latency_cycles: u8,
    /// Exposures tried again for one that was asked for.
    pub retries: u8,
}

impl Default for CameraTiming {
    fn default() -> Self {
        Self {
            latency_cycles: 7,
            read_out_cycles: 2,
            loss: 0.05,
            grey_latency_cycles: 55,
            retries: 3,
        }
    }
}

impl CameraTiming {
    /// What the node itself is told.
    pub fn of_node(&self) -> Timing {
        Timing {
            latency_cycles: self.latency_cycles,
            grey_latency_cycles: self.grey_latency_cycles,
            vision_cycles: self.latency_cycles.saturating_sub(self.read_out_cycles),
            retries: self.retries,
        }
    }

    /// Time from an exposure until the image is read out, s.
    pub fn read_out(&self) -> f64 {
        f64::from(self.read_out_halves()) * f64::from(HALF_US) * 1e-6
    }

    /// Half cycles of the read-out.
    fn read_out_halves(&self) -> u16 {
        let due = 2 * u16::from(self.latency_cycles.max(1));
        (2 * u16::from(self.read_out_cycles)).clamp(1, due - 1)
    }
}

/// Where the node's logic and its processor are.
enum Processor {
    Host(Box<node::CameraNode>),
    Board(Box<TargetCamera>),
}

/// What the sensor holds until it is read out.
struct Reading {
    /// Half cycles until then.
    left: u16,
    whole: bool,
    /// Rows of bytes, and their width and number.
    image: (Vec<u8>, [u16; 2]),
    /// By slit.
    sightings: [Option<Sighting>; SLITS],
}

/// The camera node of the cell.
pub struct CameraNode {
    processor: Processor,
    timing: CameraTiming,
    random: Pcg32,
    reading: Option<Reading>,
    /// Time since the last half cycle, µs.
    since_us: u32,
    /// Images taken, and of them lost.
    taken: u64,
    lost: u64,
    /// Why the board is no longer there.
    failure: Option<anyhow::Error>,
}

impl CameraNode {
    /// Node `node`, in this process; `random` is the stream of its losses, keyed by seed and run.
    pub fn new(node: u8, timing: CameraTiming, random: Pcg32) -> Self {
        Self {
            processor: Processor::Host(Box::new(node::CameraNode::new(node, timing.of_node()))),
            timing,
            random,
            reading: None,
            since_us: 0,
            taken: 0,
            lost: 0,
            failure: None,
        }
    }

    /// From now on the node is the one on this board, at the instant at which the power of either has come on: the boot-up
    /// message is on the bus already.
    pub fn move_to(&mut self, mut board: TargetCamera) -> anyhow::Result<()> {
        board.power_on(&mut |_| {})?;
        self.processor = Processor::Board(Box::new(board));
        Ok(())
    }

    fn board(&mut self) -> Option<&mut TargetCamera> {
        match &mut self.processor {
            Processor::Host(_) => None,
            Processor::Board(board) => Some(board),
        }
    }

    /// An error if the board failed or differed from the node in process; the node has been silent since.
    pub fn check(&mut self) -> anyhow::Result<()> {
        self.failure.take().map_or(Ok(()), Err)
    }

    /// Ends it; a board hands over what it measured of itself.
    pub fn finish(&mut self) -> anyhow::Result<Option<CameraFigures>> {
        self.check()?;
        self.board().map(TargetCamera::finish).transpose()
    }

    /// Power comes on.
    pub fn power_on(&mut self, tx: &mut impl FnMut(Frame)) {
        self.reading = None;
        self.since_us = 0;
        match &mut self.processor {
            Processor::Host(node) => node.power_on(tx),
            Processor::Board(board) => {
                let result = board.power_on(tx);
                self.note(result);
            }
        }
    }

    /// Takes a frame that ended `t_ns` after power came on; at a SYNC the camera may expose. An exposure whose image gets lost
    /// is not told.
    pub fn receive(&mut self, t_ns: u64, frame: &Frame, tx: &mut impl FnMut(Frame)) -> Option<Exposure> {
        let exposed = match &mut self.processor {
            _ if self.failure.is_some() => None,
            Processor::Host(node) => node.receive(frame, tx),
            Processor::Board(board) => {
                let result = board.receive(frame, t_ns, tx);
                self.note(result).flatten()
            }
        };
        let exposure = exposed?;
        self.taken += 1;
        let whole = f64::from(self.random.next_u32()) >= self.timing.loss * 2f64.powi(32);
        self.lost += u64::from(!whole);
        self.reading = Some(Reading {
            left: self.timing.read_out_halves(),
            whole,
            image: Default::default(),
            sightings: [None; SLITS],
        });
        whole.then_some(exposure)
    }

    /// Lets `us` microseconds pass.
    pub fn elapse(&mut self, us: u32, tx: &mut impl FnMut(Frame)) {
        self.since_us += us;
        while self.since_us >= HALF_US {
            self.since_us -= HALF_US;
            self.half_cycle(tx);
        }
    }

    /// The image of the last exposure: `height` rows of `width` bytes.
    pub fn show(&mut self, image: &[u8], size: Size) {
        if let (Processor::Board(_), Some(reading)) = (&self.processor, &mut self.reading) {
            reading.image = (image.to_vec(), size);
        }
    }

    /// What vision made of that image by one slit; it is sent when the processor would be done.
    pub fn hand_back(&mut self, sighting: Sighting) {
        if let Some(reading) = &mut self.reading
            && let Some(place) = reading.sightings.get_mut(usize::from(sighting.slit))
        {
            *place = Some(sighting);
        }
    }

    /// From here on this part of the images is lost, 0..=1.
    pub fn lose_images(&mut self, share: f64) {
        self.timing.loss = share;
    }

    /// Images taken so far, and how many of them were lost.
    pub fn images(&self) -> (u64, u64) {
        (self.taken, self.lost)
    }

    /// Half a cycle has passed.
    fn half_cycle(&mut self, tx: &mut impl FnMut(Frame)) {
        if self.failure.is_some() {
            return;
        }
        match &mut self.processor {
            Processor::Host(node) => node.elapse(HALF_US, tx),
            Processor::Board(board) => {
                let result = board.elapse(tx);
                self.note(result);
            }
        }
        let Some(reading) = &mut self.reading else { return };
        reading.left -= 1;
        if reading.left > 0 {
            return;
        }
        let Some(reading) = self.reading.take() else { return };
        let (image, size) = reading.image;
        let node = match &mut self.processor {
            Processor::Host(node) => node,
            Processor::Board(board) => board.read_out(reading.whole.then_some((image, size))),
        };
        node.read_out(reading.whole);
        for sighting in reading.sightings.into_iter().flatten() {
            node.hand_back(sighting);
        }
    }

    fn note<T>(&mut self, result: anyhow::Result<T>) -> Option<T> {
        match result {
            Ok(value) => Some(value),
            Err(error) => {
                self.failure = Some(error);
                None
            }
        }
    }
}
