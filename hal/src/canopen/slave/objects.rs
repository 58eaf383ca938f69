//! The node's dictionary as SDO sees it: communication objects here, everything else at the device.

use super::{HEARTBEAT_PHASES, Identity, Slave};
use crate::canopen::cob;
use crate::canopen::heartbeat::{Consumer, Producer};
use crate::canopen::object::{Address, Device, Number, Value};
use crate::canopen::pdo::{Direction, Pdo};
use crate::canopen::sdo::{Abort, Request, Response};
use crate::canopen::sync;

impl Slave {
    /// Answers an SDO request.
    pub(super) fn serve(&mut self, message: &[u8; 8], device: &mut impl Device) -> Option<Response> {
        match Request::decode(message) {
            Err(refusal) => Some(refusal),
            Ok(Request::Segment { toggle }) => Some(self.server.segment(toggle)),
            Ok(Request::Abort(..)) => {
                self.server.stop();
                None
            }
            Ok(Request::Upload(address)) => Some(match self.read(address, device) {
                Ok(Value::Number(number)) => Response::Uploaded(address, number),
                Ok(Value::Text(text)) => self.server.start(address, text),
                Err(abort) => Response::Abort(address, abort),
            }),
            Ok(Request::Download(address, number)) => Some(match self.write(address, number, device) {
                Ok(()) => Response::Downloaded(address),
                Err(abort) => Response::Abort(address, abort),
            }),
        }
    }

    fn read(&self, address: Address, device: &impl Device) -> Result<Value, Abort> {
        let Address { index, sub } = address;
        let number = match (index, sub) {
            (0x1001, 0) => self.error_register.into(),
            (0x1005, 0) => Number::from(cob::SYNC as u32),
            (0x1006, 0) => self.sync_period_us.into(),
            (0x1016, 0) => 1u8.into(),
            (0x1016, 1) => self.consumer_entry.into(),
            (0x1017, 0) => self.producer_ms.into(),
            (0x1019, 0) => sync::OVERFLOW.into(),
            (0x1001 | 0x1005 | 0x1006 | 0x1016 | 0x1017 | 0x1019, _) => return Err(Abort::NO_SUB),
            _ => match self.pdo(index) {
                Some((pdo, Part::Communication)) => pdo.parameter(sub)?,
                Some((pdo, Part::Mapping)) => pdo.entry(sub)?,
                None => return read_object(&self.identity, address, device),
            },
        };
        Ok(Value::Number(number))
    }

    fn write(&mut self, address: Address, number: Number, device: &mut impl Device) -> Result<(), Abort> {
        let Address { index, sub } = address;
        match (index, sub) {
            // Only the standard SYNC identifier is served, and no node but the master generates it.
            (0x1005, 0) => match u32::try_from(number)? {
                cob if cob == cob::SYNC as u32 => Ok(()),
                _ => Err(Abort::RANGE),
            },
            (0x1006, 0) => {
                self.sync_period_us = number.try_into()?;
                Ok(())
            }
            (0x1016, 1) => {
                self.consumer_entry = u32::try_from(number)? & 0x007F_FFFF;
                self.consumer = Consumer::new((self.consumer_entry & 0xFFFF) * 1000);
                Ok(())
            }
            (0x1017, 0) => {
                self.producer_ms = number.try_into()?;
                let period = self.producer_ms as u32 * 1000;
                let phase = self.node as u32 % HEARTBEAT_PHASES;
                self.producer = Producer::new(period, period / HEARTBEAT_PHASES * phase);
                Ok(())
            }
            (0x1019, 0) => match u8::try_from(number)? {
                sync::OVERFLOW => Ok(()),
                _ => Err(Abort::RANGE),
            },
            (0x1000 | 0x1001 | 0x1008 | 0x1018, _) | (0x1016, 0) => Err(Abort::READ_ONLY),
            (0x1005 | 0x1006 | 0x1016 | 0x1017 | 0x1019, _) => Err(Abort::NO_SUB),
            _ => {
                let identity = self.identity;
                match self.pdo_mut(index) {
                    Some((pdo, Part::Communication)) => pdo.set_parameter(sub, number),
                    Some((pdo, Part::Mapping)) => {
                        pdo.set_entry(sub, number, |object| match read_object(&identity, object, device)? {
                            Value::Number(number) => Ok(number.len() * 8),
                            Value::Text(_) => Err(Abort::UNMAPPABLE),
                        })
                    }
                    None => device.write(address, number),
                }
            }
        }
    }

    fn pdo(&self, index: u16) -> Option<(&Pdo, Part)> {
        let (direction, part, k) = locate(index)?;
        let pdo = match direction {
            Direction::Receive => &self.receivers.get(k)?.pdo,
            Direction::Transmit => &self.transmitters.get(k)?.pdo,
        };
        Some((pdo, part))
    }

    fn pdo_mut(&mut self, index: u16) -> Option<(&mut Pdo, Part)> {
        let (direction, part, k) = locate(index)?;
        let pdo = match direction {
            Direction::Receive => &mut self.receivers.get_mut(k)?.pdo,
            Direction::Transmit => &mut self.transmitters.get_mut(k)?.pdo,
        };
        Some((pdo, part))
    }
}

/// Which half of a PDO's parameters.
enum Part {
    Communication,
    Mapping,
}

/// PDO parameter objects by index: direction, half, and number from 0.
fn locate(index: u16) -> Option<(Direction, Part, usize)> {
    let (direction, part, base) = match index & 0xFE00 {
        0x1400 => (Direction::Receive, Part::Communication, 0x1400),
        0x1600 => (Direction::Receive, Part::Mapping, 0x1600),
        0x1800 => (Direction::Transmit, Part::Communication, 0x1800),
        0x1A00 => (Direction::Transmit, Part::Mapping, 0x1A00),
        _ => return None,
    };
    Some((direction, part, (index - base) as usize))
}

/// An object that can be read without the communication parameters: the identity's, or the device's own.
pub(super) fn read_object(identity: &Identity, address: Address, device: &impl Device) -> Result<Value, Abort> {
    match address {
        Address { index: 0x1000, sub: 0 } => Ok(identity.device_type.into()),
        Address { index: 0x1008, sub: 0 } => Ok(Value::Text(identity.name)),
        Address { index: 0x1018, sub: 0 } => Ok((identity.numbers.len() as u8).into()),
        Address { index: 0x1018, sub } => match identity.numbers.get(sub as usize - 1) {
            Some(&number) => Ok(number.into()),
            None => Err(Abort::NO_SUB),
        },
        Address {
            index: 0x1000 | 0x1008, ..
        } => Err(Abort::NO_SUB),
        _ => device.read(address),
    }
}
