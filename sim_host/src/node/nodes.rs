//! All nodes of the cell, as the bus sees them.

use super::camera::{CameraNode, Exposure};
use super::drive::{Drive, EncoderReading, MotorCommand};
use super::io::IoNode;
use crate::bus::{Bus, Delivery, Mailboxes};

/// The drives, nodes 1..=N, the camera and the I/O node. On the bus drive `k` is sender `k`, the camera [`Self::CAMERA`],
/// the I/O node [`Self::IO`] and the controller [`Self::CONTROLLER`].
pub struct Nodes<const N: usize> {
    /// The drives, base first.
    pub drives: [Drive; N],
    /// The camera.
    pub camera: CameraNode,
    /// The I/O node.
    pub io: IoNode,
}

impl<const N: usize> Nodes<N> {
    /// Sender index of the camera.
    pub const CAMERA: usize = N;
    /// Sender index of the I/O node.
    pub const IO: usize = N + 1;
    /// Sender index of the controller.
    pub const CONTROLLER: usize = N + 2;

    /// Power of all nodes comes on.
    pub fn power_on(&mut self, bus: &mut Bus) {
        for (k, drive) in self.drives.iter_mut().enumerate() {
            drive.power_on(&mut |frame| bus.send(k, frame));
        }
        self.camera.power_on(&mut |frame| bus.send(Self::CAMERA, frame));
        self.io.power_on(&mut |frame| bus.send(Self::IO, frame));
    }

    /// Gives a frame to every node but its sender, which may answer into `mailboxes`; tells if the camera exposes now.
    pub fn deliver(&mut self, delivery: &Delivery, mailboxes: &mut Mailboxes) -> Option<Exposure> {
        let Delivery { t_ns, sender, frame } = delivery;
        for (k, drive) in self.drives.iter_mut().enumerate() {
            if k != *sender {
                drive.receive(*t_ns, frame, &mut |answer| mailboxes.send(k, answer));
            }
        }
        if *sender != Self::IO {
            self.io.receive(frame, &mut |answer| mailboxes.send(Self::IO, answer));
        }
        if *sender != Self::CAMERA {
            return self
                .camera
                .receive(*t_ns, frame, &mut |answer| mailboxes.send(Self::CAMERA, answer));
        }
        None
    }

    /// One tick of all nodes at `t_ns`, `dt_s` after the last, with what the encoders show.
    pub fn tick(&mut self, t_ns: u64, dt_s: f64, readings: &[EncoderReading; N], bus: &mut Bus) -> [MotorCommand; N] {
        let us = (dt_s * 1e6).round() as u32;
        self.camera.elapse(us, &mut |frame| bus.send(Self::CAMERA, frame));
        self.io.elapse(us, &mut |frame| bus.send(Self::IO, frame));
        let mut commands = [MotorCommand::default(); N];
        for (k, (drive, command)) in self.drives.iter_mut().zip(&mut commands).enumerate() {
            *command = drive.tick(t_ns, dt_s, readings[k], &mut |frame| bus.send(k, frame));
        }
        commands
    }
}
