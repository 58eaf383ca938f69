//! The I/O node, profile CiA 401: buttons and E-stop chain in, lamps and dispenser valve out, dispenser flow as an
//! analogue output. The application runs on any `embedded-hal` pins, so the same node serves on a board.

use crate::canopen::nmt::NmtState;
use crate::canopen::object::{Address, Device, Event, Number, Value};
use crate::canopen::pdo::{Mapped, mapped};
use crate::canopen::sdo::Abort;
use crate::canopen::slave::Identity;
use embedded_hal::digital::{InputPin, OutputPin, PinState};

/// Digital inputs, sub 1, u8: bits of [`crate::process::digital`].
pub const INPUTS: u16 = 0x6000;
/// Digital outputs, sub 1, u8: bits of [`output`].
pub const OUTPUTS: u16 = 0x6200;
/// Analogue outputs, sub 1, i16: dispenser flow, per mille of nominal.
pub const FLOW: u16 = 0x6411;

/// Bits of the digital outputs.
pub mod output {
    /// Lamp: armed.
    pub const ARMED: u8 = 1 << 0;
    /// Lamp: running.
    pub const RUNNING: u8 = 1 << 1;
    /// Lamp: fault.
    pub const FAULT: u8 = 1 << 2;
    /// Dispenser valve open.
    pub const VALVE: u8 = 1 << 3;
}

/// Who the I/O node is: CiA 401 with digital in, digital out, analogue out; our product code 3.
pub const IDENTITY: Identity = Identity {
    device_type: 0x000B_0191,
    name: "cell inputs and outputs",
    numbers: [0, 3, 1, 0],
};

/// Map of RPDO1: digital outputs, flow.
pub const RPDO1: [Mapped; 2] = [mapped(OUTPUTS, 1, 8), mapped(FLOW, 1, 16)];
/// Map of TPDO1: digital inputs.
pub const TPDO1: [Mapped; 1] = [mapped(INPUTS, 1, 8)];

/// RPDO1 from the process image: lamp 0 off, 1 armed, 2 running, 3 fault; flow in per mille of nominal.
pub const fn encode_outputs(lamp: u8, flow: u16) -> [u8; 3] {
    let lamp = match lamp {
        1 => output::ARMED,
        2 => output::RUNNING,
        3 => output::FAULT,
        _ => 0,
    };
    let valve = if flow != 0 { output::VALVE } else { 0 };
    let flow = if flow > i16::MAX as u16 { i16::MAX as u16 } else { flow };
    let [low, high] = flow.to_le_bytes();
    [lamp | valve, low, high]
}

/// What sets the dispenser's flow: a pump's speed, a proportional valve.
pub trait FlowControl {
    /// Sets the flow, per mille of nominal; zero and below is closed.
    fn set_flow(&mut self, per_mille: i16);
}

/// The I/O node's application: four inputs, four outputs, one flow, in the order of their bits.
#[derive(Clone, Debug)]
pub struct CellIo<I, O, F> {
    pins_in: [I; 4],
    pins_out: [O; 4],
    flow_control: F,
    inputs: u8,
    outputs: u8,
    flow: i16,
}

impl<I: InputPin, O: OutputPin, F: FlowControl> CellIo<I, O, F> {
    /// An application on these pins, everything off.
    pub fn new(pins_in: [I; 4], pins_out: [O; 4], flow_control: F) -> Self {
        let mut io = Self {
            pins_in,
            pins_out,
            flow_control,
            inputs: 0,
            outputs: 0,
            flow: 0,
        };
        io.drive(0);
        io.set_flow(0);
        io
    }

    fn drive(&mut self, outputs: u8) {
        self.outputs = outputs;
        for (k, pin) in self.pins_out.iter_mut().enumerate() {
            // A pin that cannot be set has no one to be told here; the input side shows what the cell really does.
            let _ = pin.set_state(PinState::from(outputs >> k & 1 != 0));
        }
    }

    fn set_flow(&mut self, per_mille: i16) {
        self.flow = per_mille;
        self.flow_control.set_flow(per_mille);
    }

    /// The pins and the flow, for the owner that watches them.
    pub fn parts(&self) -> (&[I; 4], &[O; 4], &F) {
        (&self.pins_in, &self.pins_out, &self.flow_control)
    }

    /// The input pins, for the owner that moves them.
    pub fn pins_in(&mut self) -> &mut [I; 4] {
        &mut self.pins_in
    }
}

impl<I: InputPin, O: OutputPin, F: FlowControl> Device for CellIo<I, O, F> {
    fn read(&self, at: Address) -> Result<Value, Abort> {
        Ok(match (at.index, at.sub) {
            (INPUTS | OUTPUTS | FLOW, 0) => 1u8.into(),
            (INPUTS, 1) => self.inputs.into(),
            (OUTPUTS, 1) => self.outputs.into(),
            (FLOW, 1) => self.flow.into(),
            (INPUTS | OUTPUTS | FLOW, _) => return Err(Abort::NO_SUB),
            _ => return Err(Abort::NO_OBJECT),
        })
    }

    fn write(&mut self, at: Address, number: Number) -> Result<(), Abort> {
        match (at.index, at.sub) {
            (OUTPUTS, 1) => self.drive(number.try_into()?),
            (FLOW, 1) => self.set_flow(number.try_into()?),
            _ => return Err(self.read(at).err().unwrap_or(Abort::READ_ONLY)),
        }
        Ok(())
    }

    fn sync(&mut self, _count: u8) {
        self.inputs = 0;
        for (k, pin) in self.pins_in.iter_mut().enumerate() {
            // A pin that cannot be read counts as low, which for the E-stop chain is open: stop.
            if pin.is_high().unwrap_or(false) {
                self.inputs |= 1 << k;
            }
        }
    }

    fn event(&mut self, event: Event) {
        // No sealant without a master, and the lamp says why.
        if event != Event::State(NmtState::Operational) {
            self.drive(output::FAULT);
            self.set_flow(0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::canopen::object::at;
    use core::convert::Infallible;
    use embedded_hal::digital::ErrorType;

    #[derive(Clone, Copy, Default)]
    struct Pin(bool);
    impl ErrorType for Pin {
        type Error = Infallible;
    }
    impl InputPin for Pin {
        fn is_high(&mut self) -> Result<bool, Infallible> {
            Ok(self.0)
        }
        fn is_low(&mut self) -> Result<bool, Infallible> {
            Ok(!self.0)
        }
    }
    impl OutputPin for Pin {
        fn set_high(&mut self) -> Result<(), Infallible> {
            self.0 = true;
            Ok(())
        }
        fn set_low(&mut self) -> Result<(), Infallible> {
            self.0 = false;
            Ok(())
        }
    }
    #[derive(Default)]
    struct Pump(i16);
    impl FlowControl for Pump {
        fn set_flow(&mut self, per_mille: i16) {
            self.0 = per_mille;
        }
    }

    #[test]
    fn inputs_are_sampled_at_the_sync_and_outputs_follow_their_bits() {
        let mut io = CellIo::new(
            [Pin(true), Pin(false), Pin(true), Pin(false)],
            [Pin(false); 4],
            Pump(-1),
        );
        io.sync(1);
        assert_eq!(io.read(at(INPUTS, 1)), Ok(0b0101u8.into()));
        let [outputs, low, high] = encode_outputs(2, 950);
        io.write(at(OUTPUTS, 1), outputs.into()).unwrap();
        io.write(at(FLOW, 1), i16::from_le_bytes([low, high]).into()).unwrap();
        let (_, pins, pump) = io.parts();
        assert_eq!((pins.map(|pin| pin.0), pump.0), ([false, true, false, true], 950));
        assert_eq!(io.write(at(INPUTS, 1), 1u8.into()), Err(Abort::READ_ONLY));
    }

    #[test]
    fn losing_the_master_closes_the_dispenser() {
        let mut io = CellIo::new([Pin(true); 4], [Pin(true); 4], Pump(-1));
        io.write(at(FLOW, 1), 1000i16.into()).unwrap();
        io.event(Event::MasterLost);
        let (_, pins, pump) = io.parts();
        assert_eq!((pins.map(|pin| pin.0), pump.0), ([false, false, true, false], 0));
    }
}
