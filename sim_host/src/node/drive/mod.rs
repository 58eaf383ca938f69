//! An emulated servo drive: a CANopen node with the CiA 402 state machine, its own speed and current loop, and the
//! limits, time-outs and faults of a real one.
//!
//! The runner ticks it every 0.25 ms with what the encoder shows and takes the motor's torque; the bus hands it frames.
//! Split: `servo` is the device (states, faults) with its dictionary in `objects`, `motion` the loops from target to
//! torque, `tracking` the speed from the encoder's counts.
//!
//! Left out: position modes, homing, touch probe, regenerative resistor, cogging and torque ripple.

pub mod data;
pub mod encoder;
mod motion;
mod objects;
mod servo;
mod tracking;

pub use data::DriveData;
pub use encoder::{Encoder, EncoderReading};
pub use servo::Servo;

use hal::can::Frame;
use hal::canopen::slave::{Identity, Slave};
use hal::cia402::{PowerState, SERVO_DRIVE};

/// Vendor number and product code of the emulated drives, object 0x1018: no vendor number is registered for us.
pub const VENDOR_PRODUCT: [u32; 2] = [0, 1];

/// What a drive does to its motor until the next tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MotorCommand {
    /// Air-gap torque at the motor shaft, N·m.
    pub torque_n_m: f64,
    /// The holding brake is closed: the shaft stands. Closed whenever the drive carries no torque.
    pub brake_closed: bool,
}

/// A servo drive on the bus.
#[derive(Clone, Debug)]
pub struct Drive {
    slave: Slave,
    servo: Servo,
}

impl Drive {
    /// Drive `node`, without power until [`Self::power_on`].
    pub fn new(node: u8, data: DriveData) -> Self {
        let [vendor, product] = VENDOR_PRODUCT;
        let identity = Identity {
            device_type: SERVO_DRIVE,
            name: "emulated servo drive",
            numbers: [vendor, product, 1, node as u32],
        };
        Self {
            slave: Slave::new(node, identity),
            servo: Servo::new(data),
        }
    }

    /// Logic power comes on: self-test, boot-up message.
    pub fn power_on(&mut self, tx: &mut impl FnMut(Frame)) {
        self.servo = Servo::new(*self.servo.data());
        self.slave.boot(&mut self.servo, tx);
    }

    /// Takes a frame that ended at `t_ns`. A SYNC latches the position of that instant, reckoned on from the last tick.
    pub fn receive(&mut self, t_ns: u64, frame: &Frame, tx: &mut impl FnMut(Frame)) {
        self.servo.now_ns = t_ns;
        self.slave.receive(frame, &mut self.servo, tx);
        self.tell(tx);
    }

    /// One step of the drive's loops at `t_ns`, `dt_s` after the last, with what the encoder shows now.
    pub fn tick(&mut self, t_ns: u64, dt_s: f64, reading: EncoderReading, tx: &mut impl FnMut(Frame)) -> MotorCommand {
        self.servo.now_ns = t_ns;
        self.slave.elapse((dt_s * 1e6).round() as u32, &mut self.servo, tx);
        let command = self.servo.tick(dt_s, reading);
        self.tell(tx);
        command
    }

    fn tell(&mut self, tx: &mut impl FnMut(Frame)) {
        if let Some(code) = self.servo.take_emergency() {
            self.slave.emergency(code, tx);
        }
    }

    /// Power state, as the statusword says it.
    pub fn state(&self) -> PowerState {
        self.servo.state()
    }

    /// The device behind the bus, to inject faults or read figures.
    pub fn servo(&mut self) -> &mut Servo {
        &mut self.servo
    }
}
