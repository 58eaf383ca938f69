//! The camera node on an emulated board of its own, with the calls of the one in process, and held against it.
//!
//! The board's frames are the ones that go out to the bus. It stops whenever it has served a frame or half a cycle, and stands
//! still until the cell has come to the next of either: so what it answers to a frame is on the bus at the instant of that
//! frame, as from the node in process. Only frames that its CAN controller's filter lets through reach it. Beside it the
//! node runs in process: every frame and exposure of the board is compared with it, bit for bit.
//!
//! The cell's vision stands for the board's in that node, so the comparison of frames compares sightings too.

use super::emulator::{Emulator, Message, SensorOutput};
use super::vision::CameraFigures;
use crate::log::bytes_of;
use anyhow::{Context, bail};
use firmware::camera::node::CameraNode;
use firmware::camera::{Event, Exposure, Params, Report};
use hal::board::frames::{GUARD_US, Stamped, ask};
use hal::board::report::HALF_US;
use hal::can::Frame;
use hal::wire::Wire;
use std::fmt::Debug;
use std::path::Path;

/// On the camera one instruction takes 2^1 ns, 500 million a second: a Cortex-M7 of the STM32H7 class at 480 MHz, which executes
/// about one instruction of such code per clock (data sheet: 5.01 CoreMark/MHz; a Cortex-M4 has 3.4). The emulated core
/// has the instructions of a Cortex-M4F all the same.
pub const SHIFT: u8 = 1;

/// Half a cycle, ns.
const HALF_NS: u64 = HALF_US as u64 * 1000;

/// Instructions in one count of the board's 25 MHz counter: what the vision's costs are resolved to.
const INSTRUCTIONS_PER_COUNT: u64 = 40 >> SHIFT;

/// The camera node on an emulated board.
pub struct TargetCamera {
    emulator: Emulator,
    mirror: CameraNode,
    /// What it said when its power came on, until the cell's comes on.
    boot: Option<Message>,
    /// Half cycles since then.
    halves: u64,
    /// What its sensor gives with the next answer.
    output: SensorOutput,
    /// Images that it was given.
    images: usize,
    vision: Vec<(Exposure, u64)>,
}

impl TargetCamera {
    /// Starts `image` with these parameters; power comes on.
    pub fn start(image: &Path, params: &Params) -> anyhow::Result<Self> {
        let mut emulator = Emulator::start(image, &bytes_of(params), SHIFT)?;
        let boot = emulator.message().context("camera")?;
        Ok(Self {
            emulator,
            mirror: CameraNode::new(params.node, params.timing),
            boot: Some(boot),
            halves: 0,
            output: SensorOutput::Nothing,
            images: 0,
            vision: Vec::new(),
        })
    }

    /// Power comes on in the cell. It does so once: the board is on.
    pub fn power_on(&mut self, transmit: &mut impl FnMut(Frame)) -> anyhow::Result<()> {
        let mut expected = Vec::new();
        self.mirror.power_on(&mut |frame| expected.push(frame));
        let Some(message) = self.boot.take() else {
            bail!("camera: the board cannot be switched off and on again");
        };
        self.hand_on(&message, Event::Tick, None, &expected, transmit)
    }

    /// Takes a frame that ended `t_ns` after power came on; at a SYNC the camera may expose.
    pub fn receive(
        &mut self,
        frame: &Frame,
        t_ns: u64,
        transmit: &mut impl FnMut(Frame),
    ) -> anyhow::Result<Option<Exposure>> {
        if !self.mirror.hears(frame.cob()) {
            return Ok(None);
        }
        let mut expected = Vec::new();
        let exposure = self.mirror.receive(frame, &mut |frame| expected.push(frame));
        let since_us = t_ns.saturating_sub(self.halves * HALF_NS) / 1000;
        let at_us = since_us.min(u64::from(HALF_US - GUARD_US)) as u16;
        let message = self.next(&[Stamped { at_us, frame: *frame }], 0)?;
        self.hand_on(&message, Event::Receive, exposure, &expected, transmit)?;
        Ok(exposure)
    }

    /// Half a cycle has passed.
    pub fn elapse(&mut self, transmit: &mut impl FnMut(Frame)) -> anyhow::Result<()> {
        let mut expected = Vec::new();
        self.mirror.elapse(HALF_US, &mut |frame| expected.push(frame));
        let message = self.next(&[], 0)?;
        self.halves += 1;
        self.hand_on(&message, Event::Tick, None, &expected, transmit)
    }

    /// The sensor has been read out: an image with its width and height, or nothing. The node in process, to be told too.
    pub fn read_out(&mut self, image: Option<(Vec<u8>, [u16; 2])>) -> &mut CameraNode {
        self.images += usize::from(image.is_some());
        self.output = image.map_or(SensorOutput::Lost, |(pixels, size)| SensorOutput::Image(pixels, size));
        &mut self.mirror
    }

    /// Runs on for two more half cycles, and returns what the board measured.
    pub fn finish(&mut self) -> anyhow::Result<CameraFigures> {
        self.elapse(&mut |_| {})?;
        let mut expected = Vec::new();
        self.mirror.elapse(HALF_US, &mut |frame| expected.push(frame));
        let mut message = self.next(&[], ask::INSTRUMENTS)?;
        self.halves += 1;
        let report = message.trace.split_off(Report::BYTES.min(message.trace.len()));
        let stack = <[u32; 2]>::read(&mut report.as_slice()).context("camera: stack depths")?;
        self.hand_on(&message, Event::Tick, None, &expected, &mut |_| {})?;
        Ok(CameraFigures {
            vision: std::mem::take(&mut self.vision),
            stack,
        })
    }

    /// Lets the board go on to where it stops next.
    fn next(&mut self, frames: &[Stamped], ask: u8) -> anyhow::Result<Message> {
        let output = std::mem::take(&mut self.output);
        self.emulator
            .answer_with(frames, ask, &output)
            .and_then(|()| self.emulator.message())
            .with_context(|| self.place())
    }

    /// Passes the board's frames on, if it did what the node in process does.
    fn hand_on(
        &mut self,
        message: &Message,
        event: Event,
        exposure: Option<Exposure>,
        expected: &[Frame],
        transmit: &mut impl FnMut(Frame),
    ) -> anyhow::Result<()> {
        if message.dropped > 0 {
            bail!("{}: the board had no room for {} frames", self.place(), message.dropped);
        }
        let mut rest = message.trace.as_slice();
        let report = Report::read(&mut rest).with_context(|| format!("{}: no report", self.place()))?;
        self.same("events", &report.event, &event)?;
        self.same("exposures", &report.exposure, &exposure)?;
        self.vision.extend(
            report
                .vision
                .map(|(exposure, counts)| (exposure, u64::from(counts) * INSTRUCTIONS_PER_COUNT)),
        );
        let frames: Vec<Frame> = message.frames.iter().map(|stamped| stamped.frame).collect();
        if frames.is_empty() && !expected.is_empty() && self.vision.len() < self.images {
            bail!(
                "{}: the board's vision is late, so its sighting will be: what the latency leaves after read-out is too short for this processor",
                self.place()
            );
        }
        self.same("frames", &frames.as_slice(), &expected)?;
        frames.into_iter().for_each(transmit);
        Ok(())
    }

    fn same<T: PartialEq + Debug>(&self, what: &str, target: &T, host: &T) -> anyhow::Result<()> {
        if target != host {
            bail!(
                "{}: {what} differ between the board and the node in process:\nboard   {target:?}\nprocess {host:?}",
                self.place()
            );
        }
        Ok(())
    }

    fn place(&self) -> String {
        format!("camera, cycle {}", self.halves / 2 + 1)
    }
}

#[cfg(test)]
mod tests;
