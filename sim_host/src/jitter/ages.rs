//! How old is what the arm moves by: ages of feedback, commands and sightings, seen from the bus.

use crate::bus::Delivery;
use crate::model::AXES;
use crate::node::Nodes;
use crate::seal::cell::is_target;
use firmware::job::correction::Use;
use firmware::safety::State;
use hal::board::histogram::Histogram;
use hal::board::report::HALF_US;
use hal::can::Frame;
use hal::canopen::cob::SYNC;
use hal::process::{Inputs, Outputs};

/// SYNC counts from 1 to this (CiA 301, 0x1019: the most it allows).
const SYNCS: u32 = 240;

/// Distributions of ages, µs.
#[derive(Clone, Debug, Default)]
pub struct Ages {
    /// Of the oldest axis' position when the cycle that uses it begins, since the SYNC that latched it; while the arm moves.
    pub feedback: Histogram,
    /// Of the targets when the drives begin to act on them, since the cycle that computed them began.
    pub command: Histogram,
    /// Of a sighting when the drives act on the first command that it has a part in, since its exposure.
    pub vision: Histogram,
    /// Beginning of the oldest cycle whose targets no SYNC has put in force, ns, and the targets still under way.
    computed: Option<(u64, usize)>,
}

impl Ages {
    /// A frame that the controller hands over in the cycle that began at `t_ns`.
    pub fn sent(&mut self, frame: &Frame, t_ns: u64) {
        if is_target(frame) {
            let (since, under_way) = self.computed.unwrap_or((t_ns, 0));
            self.computed = Some((since, (under_way + 1).min(AXES))); // a newer target replaces one that waits
        }
    }

    /// A frame that was delivered.
    pub fn hear(&mut self, delivery: &Delivery) {
        if delivery.sender != Nodes::<AXES>::CONTROLLER {
            return;
        }
        match (self.computed, delivery.frame.cob()) {
            (Some((since, 0)), SYNC) => {
                self.command.add(((delivery.t_ns - since) / 1000) as u32);
                self.computed = None;
            }
            (Some((since, under_way)), _) if is_target(&delivery.frame) => {
                self.computed = Some((since, under_way.saturating_sub(1)));
            }
            _ => {}
        }
    }

    /// A control cycle.
    pub fn cycle(&mut self, inputs: &Inputs<AXES>, outputs: &Outputs<AXES>) {
        const PERIOD_US: u32 = 2 * HALF_US;
        let moves = [State::Running, State::Stopping].map(|state| state as u8);
        if moves.contains(&outputs.state) {
            let oldest = inputs.axes.iter().map(|axis| u32::from(axis.age)).max().unwrap_or(0);
            self.feedback.add(oldest * PERIOD_US + HALF_US);
        }
        if let Some(sighting) = &inputs.sighting
            && outputs.sighting == Use::Used as u8
        {
            let cycles = (u32::from(inputs.sync) + SYNCS - u32::from(sighting.stamp)) % SYNCS;
            self.vision.add((cycles + 1) * PERIOD_US); // what this cycle computes acts from the next SYNC
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hal::canopen::cob::rpdo;
    use hal::process::Sighting;

    fn delivery(t_ns: u64, cob: u16) -> Delivery {
        let frame = Frame::of(cob, [0]);
        Delivery {
            t_ns,
            sender: Nodes::<AXES>::CONTROLLER,
            frame,
        }
    }

    #[test]
    fn a_target_that_misses_its_sync_is_a_cycle_older() {
        let mut ages = Ages::default();
        let target = rpdo(1, 2);
        for (cycle, arrives) in [(0, 3_000_000), (1, 10_200_000)] {
            ages.sent(&Frame::of(target, [0]), cycle * 5_000_000 + 2_500_000);
            let (frame, sync) = (
                delivery(arrives, target),
                delivery((cycle + 1) * 5_000_000 + 60_000, SYNC),
            );
            let order = if arrives < sync.t_ns {
                [frame, sync]
            } else {
                [sync, frame]
            };
            order.iter().for_each(|delivery| ages.hear(delivery));
        }
        ages.hear(&delivery(15_060_000, SYNC));
        assert_eq!(
            (ages.command.least(), ages.command.greatest, ages.command.count()),
            (2560, 7560, 2)
        );
    }

    #[test]
    fn a_sighting_is_as_old_as_its_stamp_across_the_counters_wrap() {
        let mut ages = Ages::default();
        let inputs = Inputs {
            sync: 3,
            sighting: Some(Sighting {
                stamp: 239,
                ..Sighting::default()
            }),
            ..Inputs::default()
        };
        let outputs = Outputs {
            sighting: Use::Used as u8,
            ..Outputs::default()
        };
        ages.cycle(&inputs, &outputs);
        assert_eq!(ages.vision.greatest, 25_000, "four cycles, and one to the torque");
    }
}
