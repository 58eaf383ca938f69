//! The I/O node on virtual pins: the same application as on a board.

use hal::can::Frame;
use hal::canopen::slave::Slave;
use hal::io::{CellIo, FlowControl, IDENTITY};
use std::convert::Infallible;

/// A pin without a wire.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct VirtualPin {
    /// High.
    pub high: bool,
}

impl embedded_hal::digital::ErrorType for VirtualPin {
    type Error = Infallible;
}

impl embedded_hal::digital::InputPin for VirtualPin {
    fn is_high(&mut self) -> Result<bool, Infallible> {
        Ok(self.high)
    }

    fn is_low(&mut self) -> Result<bool, Infallible> {
        Ok(!self.high)
    }
}

impl embedded_hal::digital::OutputPin for VirtualPin {
    fn set_high(&mut self) -> Result<(), Infallible> {
        self.high = true;
        Ok(())
    }

    fn set_low(&mut self) -> Result<(), Infallible> {
        self.high = false;
        Ok(())
    }
}

/// The dispenser's pump.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Pump {
    per_mille: i16,
}

impl FlowControl for Pump {
    fn set_flow(&mut self, per_mille: i16) {
        self.per_mille = per_mille;
    }
}

/// The I/O node of the cell.
#[derive(Clone, Debug)]
pub struct IoNode {
    slave: Slave,
    io: CellIo<VirtualPin, VirtualPin, Pump>,
}

impl IoNode {
    /// Node `node`, all inputs low: the E-stop chain is open until [`Self::set_inputs`] closes it.
    pub fn new(node: u8) -> Self {
        Self {
            slave: Slave::new(node, IDENTITY),
            io: CellIo::new(Default::default(), Default::default(), Pump::default()),
        }
    }

    /// Power comes on.
    pub fn power_on(&mut self, tx: &mut impl FnMut(Frame)) {
        self.slave.boot(&mut self.io, tx);
    }

    /// Takes a frame from the bus.
    pub fn receive(&mut self, frame: &Frame, tx: &mut impl FnMut(Frame)) {
        self.slave.receive(frame, &mut self.io, tx);
    }

    /// Lets `us` microseconds pass.
    pub fn elapse(&mut self, us: u32, tx: &mut impl FnMut(Frame)) {
        self.slave.elapse(us, &mut self.io, tx);
    }

    /// Sets the inputs, bits of [`hal::process::digital`]; they are read at the next SYNC.
    pub fn set_inputs(&mut self, bits: u8) {
        for (k, pin) in self.io.pins_in().iter_mut().enumerate() {
            pin.high = bits >> k & 1 != 0;
        }
    }

    /// The outputs as they stand, bits of [`hal::io::output`].
    pub fn outputs(&self) -> u8 {
        let (_, pins, _) = self.io.parts();
        pins.iter().enumerate().map(|(k, pin)| (pin.high as u8) << k).sum()
    }

    /// Dispenser flow as it stands, per mille of nominal.
    pub fn flow(&self) -> i16 {
        let (_, _, pump) = self.io.parts();
        pump.per_mille
    }
}
