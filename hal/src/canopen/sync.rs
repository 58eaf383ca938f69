//! The SYNC counter: one byte, 1..=overflow, in every SYNC frame (object 0x1019).

/// Counter overflow value, object 0x1019: the highest count, and the longest history a stamp can name (1.2 s).
pub const OVERFLOW: u8 = 240;

/// The next count after `count`, cyclic in 1..=[`OVERFLOW`]; anything outside starts at 1.
pub const fn next(count: u8) -> u8 {
    if count >= OVERFLOW { 1 } else { count + 1 }
}

/// SYNCs from `then` to `now`, 0..240: how old a stamp is, given that it is younger than one round of the counter.
pub const fn since(then: u8, now: u8) -> u8 {
    if now >= then {
        now - then
    } else {
        // Counts of an honest bus are at most OVERFLOW; a wild stamp saturates instead of wrapping.
        (OVERFLOW - if then > OVERFLOW { OVERFLOW } else { then }) + now
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_run_from_1_to_240_and_the_distance_counts_the_steps() {
        let mut count = 0;
        for k in 0..1000u32 {
            count = next(count);
            assert_eq!(count as u32, k % 240 + 1);
        }
        for start in 1..=240 {
            let mut now = start;
            for steps in 0..240 {
                assert_eq!(since(start, now), steps);
                now = next(now);
            }
        }
    }
}
