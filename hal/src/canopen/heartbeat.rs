//! Heartbeats: proof of life by period (0x1017) and its watch (0x1016). Time is whatever unit the owner counts in.

/// Counts towards the next heartbeat of our own.
#[derive(Clone, Copy, Debug, Default)]
pub struct Producer {
    period: u32,
    left: u32,
    due: bool,
}

impl Producer {
    /// Sends every `period`, first after `first`; a period of zero sends nothing.
    pub const fn new(period: u32, first: u32) -> Self {
        Self {
            period,
            left: first,
            due: false,
        }
    }

    /// Lets `time` pass.
    pub fn elapse(&mut self, time: u32) {
        if self.period == 0 {
            return;
        }
        if self.left > time {
            self.left -= time;
        } else {
            // A pause longer than a period owes one heartbeat, not a burst.
            self.left = (self.left + self.period).saturating_sub(time).max(1);
            self.due = true;
        }
    }

    /// Whether a heartbeat is owed; asking settles it.
    pub fn take_due(&mut self) -> bool {
        core::mem::take(&mut self.due)
    }
}

/// Watches another node's heartbeat. It starts with the first one heard, as the standard has it.
#[derive(Clone, Copy, Debug, Default)]
pub struct Consumer {
    timeout: u32,
    left: u32,
    watching: bool,
}

impl Consumer {
    /// Says lost after `timeout` of silence; a timeout of zero watches nothing.
    pub const fn new(timeout: u32) -> Self {
        Self {
            timeout,
            left: 0,
            watching: false,
        }
    }

    /// A heartbeat was heard.
    pub fn heard(&mut self) {
        self.left = self.timeout;
        self.watching = self.timeout != 0;
    }

    /// Lets `time` pass; true once when the silence grows too long. The watch then rests until the next heartbeat.
    pub fn elapse(&mut self, time: u32) -> bool {
        self.left = self.left.saturating_sub(time);
        let lost = self.watching && self.left == 0;
        self.watching &= !lost;
        lost
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_producer_of_100_is_due_every_100_whatever_the_step() {
        for step in [1, 7, 25, 100] {
            let mut producer = Producer::new(100, 50);
            let mut sent = 0;
            for _ in 0..(100_000 / step) {
                producer.elapse(step);
                sent += u32::from(producer.take_due());
            }
            assert!((999..=1001).contains(&sent), "step {step}: {sent}");
        }
    }

    #[test]
    fn a_consumer_says_lost_once_and_only_after_the_first_heartbeat() {
        let mut consumer = Consumer::new(10);
        assert!((0..100).all(|_| !consumer.elapse(1)));
        consumer.heard();
        assert_eq!((1..100).find(|_| consumer.elapse(1)), Some(10));
        assert!((0..100).all(|_| !consumer.elapse(1)));
    }
}
