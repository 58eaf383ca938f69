//! A classic CAN bus that takes real bit time.
//!
//! Every node has one transmit mailbox per identifier; a newer frame replaces one that still waits. When the bus is idle
//! the lowest identifier among the waiting frames wins, a frame under way is never pre-empted, and a frame takes the
//! bit times of its own bits, stuffing included ([`length`]). A destroyed frame costs what it had sent, an error frame,
//! and its repetition. Frames are handed out at the instant of their last bit, to the caller, who gives them to every
//! node but the sender; what a node answers waits from that instant on.
//!
//! Time is the simulation's, in nanoseconds; nothing here knows a wall clock.

pub mod length;
pub mod load;

use hal::can::Frame;
use load::Load;

/// Nominal bit time at 1 Mbit/s, ns.
pub const BIT_NS: u64 = 1000;
/// Error frame and recovery, bits: two error flags of 6 that follow each other, delimiter 8, intermission 3, and the
/// suspended transmission of 8 of an error-passive sender (Tindell, Burns, Wellings 1995: 31 bits at most).
pub const ERROR_BITS: u64 = 31;

/// A frame that has just been received by everyone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Delivery {
    /// End of the frame, ns.
    pub t_ns: u64,
    /// Who sent it: an index that the caller chose.
    pub sender: usize,
    /// The frame.
    pub frame: Frame,
}

/// A frame in its sender's mailbox.
#[derive(Clone, Copy, Debug)]
struct Waiting {
    since_ns: u64,
    sender: usize,
    frame: Frame,
}

/// The frames that nodes offer to the bus from an instant on.
#[derive(Clone, Debug, Default)]
pub struct Mailboxes {
    now_ns: u64,
    waiting: Vec<Waiting>,
}

impl Mailboxes {
    /// Offers a frame from now on. A frame of the same sender and identifier that still waits is replaced.
    pub fn send(&mut self, sender: usize, frame: Frame) {
        let since_ns = self.now_ns;
        let offer = Waiting {
            since_ns,
            sender,
            frame,
        };
        match self
            .waiting
            .iter_mut()
            .find(|w| w.sender == sender && w.frame.cob() == frame.cob())
        {
            Some(mailbox) => *mailbox = offer,
            None => self.waiting.push(offer),
        }
    }

    /// Takes the winner of the arbitration at the first instant, not before `free_ns`, at which anyone wants to send.
    fn arbitrate(&mut self, free_ns: u64, until_ns: u64) -> Option<(u64, Waiting)> {
        let start = self.waiting.iter().map(|w| w.since_ns).min()?.max(free_ns);
        if start >= until_ns {
            return None;
        }
        let ready = self.waiting.iter().enumerate().filter(|(_, w)| w.since_ns <= start);
        // Two senders of one identifier are a fault of configuration; the lower index then goes first.
        let (k, _) = ready.min_by_key(|(_, w)| (w.frame.cob(), w.sender))?;
        Some((start, self.waiting.swap_remove(k)))
    }
}

/// The bus.
#[derive(Clone, Debug)]
pub struct Bus {
    mailboxes: Mailboxes,
    free_ns: u64,
    /// A frame under way: its end, and the frame.
    under_way: Option<Delivery>,
    disturbances: u32,
    load: Load,
}

impl Bus {
    /// An idle bus at time zero, whose load is counted in cycles of `cycle_ns`.
    pub fn new(cycle_ns: u64) -> Self {
        Self {
            mailboxes: Mailboxes::default(),
            free_ns: 0,
            under_way: None,
            disturbances: 0,
            load: Load::new(cycle_ns),
        }
    }

    /// Offers a frame at the time that [`Self::run_until`] has reached.
    pub fn send(&mut self, sender: usize, frame: Frame) {
        self.mailboxes.send(sender, frame);
    }

    /// Destroys each of the next `count` transmissions at the last bit of its end of frame, the most expensive place; the
    /// frame is sent again as soon as it wins the bus.
    pub fn disturb(&mut self, count: u32) {
        self.disturbances += count;
    }

    /// Runs the bus up to `t_ns`. Each frame that ends by then is handed to `deliver` at its time, in order, with the
    /// mailboxes to answer into.
    pub fn run_until(&mut self, t_ns: u64, mut deliver: impl FnMut(&Delivery, &mut Mailboxes)) {
        loop {
            if let Some(delivery) = self.under_way {
                if delivery.t_ns > t_ns {
                    break;
                }
                self.under_way = None;
                self.mailboxes.now_ns = delivery.t_ns;
                deliver(&delivery, &mut self.mailboxes);
            }
            let Some((start, winner)) = self.mailboxes.arbitrate(self.free_ns, t_ns) else {
                break;
            };
            let bits = length::bits(&winner.frame) as u64;
            if self.disturbances > 0 {
                self.disturbances -= 1;
                let lost = bits - length::INTERFRAME as u64 + ERROR_BITS;
                self.free_ns = start + lost * BIT_NS;
                self.load.add(start, lost * BIT_NS);
                self.load.errors += 1;
                // The sender repeats it, unless a newer frame took the mailbox meanwhile; none can before it ends.
                self.mailboxes.waiting.push(Waiting {
                    since_ns: self.free_ns,
                    ..winner
                });
                continue;
            }
            self.free_ns = start + bits * BIT_NS;
            self.load.add(start, bits * BIT_NS);
            self.load.frames += 1;
            self.under_way = Some(Delivery {
                t_ns: self.free_ns - length::INTERFRAME as u64 * BIT_NS,
                sender: winner.sender,
                frame: winner.frame,
            });
        }
        self.mailboxes.now_ns = t_ns;
    }

    /// Counts load, frames and errors anew from here, as after set-up, which is denser than the run.
    pub fn restart_load(&mut self) {
        self.load.restart(self.mailboxes.now_ns);
    }

    /// How busy the bus was.
    pub fn load(&self) -> &Load {
        &self.load
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CYCLE_NS: u64 = 5_000_000;

    fn frame(cob: u16) -> Frame {
        Frame::of(cob, [0x55; 8])
    }

    fn delivered(bus: &mut Bus, t_ns: u64) -> Vec<(u64, u16)> {
        let mut seen = Vec::new();
        bus.run_until(t_ns, |d, _| seen.push((d.t_ns, d.frame.cob())));
        seen
    }

    #[test]
    fn the_lowest_identifier_wins_but_never_pre_empts() {
        let mut bus = Bus::new(CYCLE_NS);
        bus.send(0, frame(0x300));
        bus.run_until(10_000, |_, _| panic!("nothing ends in 10 µs"));
        for (sender, cob) in [(1, 0x281), (2, 0x181), (3, 0x080)] {
            bus.send(sender, frame(cob));
        }
        let order: Vec<u16> = delivered(&mut bus, CYCLE_NS).into_iter().map(|(_, cob)| cob).collect();
        assert_eq!(order, [0x300, 0x080, 0x181, 0x281]);
    }

    #[test]
    fn frames_follow_each_other_after_three_bits() {
        let mut bus = Bus::new(CYCLE_NS);
        bus.send(0, frame(0x101));
        bus.send(1, frame(0x102));
        let seen = delivered(&mut bus, CYCLE_NS);
        let bits = |cob| length::bits(&frame(cob)) as u64;
        assert_eq!(
            seen,
            [
                ((bits(0x101) - 3) * BIT_NS, 0x101),
                ((bits(0x101) + bits(0x102) - 3) * BIT_NS, 0x102)
            ]
        );
    }

    #[test]
    fn a_newer_frame_replaces_one_that_waits() {
        let mut bus = Bus::new(CYCLE_NS);
        bus.send(0, Frame::of(0x100, [0]));
        bus.run_until(1_000, |_, _| {});
        for value in 1..=9u8 {
            bus.send(1, Frame::of(0x200, [value]));
        }
        let mut seen = Vec::new();
        bus.run_until(CYCLE_NS, |d, _| seen.push(d.frame.bytes().to_vec()));
        assert_eq!(seen, [[0], [9]]);
    }

    #[test]
    fn an_answer_given_at_a_frame_s_end_follows_it() {
        let mut bus = Bus::new(CYCLE_NS);
        bus.send(0, Frame::of(0x080, [1]));
        bus.send(0, frame(0x7FF));
        let mut seen = Vec::new();
        bus.run_until(CYCLE_NS, |d, mailboxes| {
            seen.push(d.frame.cob());
            if d.frame.cob() == 0x080 {
                mailboxes.send(1, frame(0x181));
            }
        });
        assert_eq!(seen, [0x080, 0x181, 0x7FF]);
    }

    #[test]
    fn an_error_frame_costs_at_most_166_bits_and_the_frame_comes_all_the_same() {
        let mut worst = 0;
        for data in [[0x00; 8], [0xFF; 8], [0x55; 8], [0xF0; 8]] {
            let arrival = |errors| {
                let mut bus = Bus::new(CYCLE_NS);
                bus.send(0, Frame::of(0x101, data));
                bus.disturb(errors);
                delivered(&mut bus, CYCLE_NS)[0].0
            };
            let cost = (arrival(1) - arrival(0)) / BIT_NS;
            assert_eq!(arrival(3) - arrival(0), 3 * cost * BIT_NS);
            worst = worst.max(cost);
        }
        assert!((140..=166).contains(&worst), "{worst} bits");
    }

    #[test]
    fn running_in_small_steps_gives_the_same_times() {
        let run = |step: u64| {
            let mut bus = Bus::new(CYCLE_NS);
            for k in 0..10u16 {
                bus.send(k as usize, frame(0x180 + k));
            }
            (1..=CYCLE_NS / step)
                .flat_map(|k| delivered(&mut bus, k * step))
                .collect::<Vec<_>>()
        };
        assert_eq!(run(CYCLE_NS), run(250_000));
        assert_eq!(run(CYCLE_NS), run(1_000));
    }
}
