//! Work for its own sake, below the tick: loads and stores, multiplications, divisions and square-law loops, as planning
//! and telemetry would do them, so that the tick strikes between instructions of all kinds.

/// Words in hand: more than the registers hold.
const WORDS: usize = 32;

/// Most passes of a round. One takes some 400 instructions, so that the longest round outlasts half a cycle, 39 000 of them
/// in the emulator, and the tick comes now upon a round and now upon what is below it.
const PASSES_MAX: u32 = 127;

/// Work at one priority.
#[derive(Clone, Debug)]
pub struct Load {
    words: [u32; WORDS],
    /// Rounds done.
    rounds: u32,
}

impl Load {
    /// Nothing done yet.
    pub const fn new() -> Self {
        Self {
            words: [0x9E37_79B9; WORDS],
            rounds: 0,
        }
    }

    /// A round of work on `news`, of a length that varies from round to round. Gives the rounds done and what came out.
    pub fn round(&mut self, news: u32) -> [u32; 2] {
        let mut carry = news ^ self.rounds;
        let mut quotient = 1.0f32;
        let passes = 1 + (self.words.iter().fold(carry, |sum, word| sum.wrapping_add(*word)) & PASSES_MAX);
        for _ in 0..passes {
            for word in &mut self.words {
                let product = u64::from(*word ^ carry) * 0x9E37_79B9;
                carry = carry.rotate_left(7) ^ (product >> 32) as u32;
                quotient = 1.0 + (product as u16 as f32) / (quotient + 1.0);
                *word = word.wrapping_add(product as u32);
            }
            carry ^= quotient.to_bits();
        }
        self.rounds = self.rounds.wrapping_add(1);
        [self.rounds, carry]
    }
}

impl Default for Load {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::collections::HashSet;

    #[test]
    fn every_round_counts_and_comes_to_something_else() {
        let mut load = Load::new();
        let results: HashSet<u32> = (1..=500)
            .map(|round| {
                let [rounds, result] = load.round(7);
                assert_eq!(rounds, round);
                result
            })
            .collect();
        assert!(results.len() > 495, "{} different results", results.len());
    }
}
