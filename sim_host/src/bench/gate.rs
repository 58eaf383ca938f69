//! The gate: no figure may grow by more than a twentieth over the committed one.

use super::Row;

/// Growth that is let through, per cent.
const GROWTH_PERCENT: u64 = 5;

/// What grew too much, a line each; empty if nothing did. A line that is new is no growth, one that is gone is.
pub fn grown(committed: &[Row], measured: &[Row]) -> Vec<String> {
    let mut grown = Vec::new();
    for before in committed {
        let name = format!("{} ({} axes)", before.stage, before.axes);
        let same = |row: &&Row| row.stage == before.stage && row.axes == before.axes;
        let Some(now) = measured.iter().find(same) else {
            grown.push(format!("{name}: was not measured"));
            continue;
        };
        for (what, before, now) in [("median", before.median, now.median), ("max", before.max, now.max)] {
            if now * 100 > before * (100 + GROWTH_PERCENT) {
                grown.push(format!(
                    "{name}: {what} is {now} instructions, more than {GROWTH_PERCENT} % over the committed {before}"
                ));
            }
        }
    }
    grown
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(stage: &str, median: u64, max: u64) -> Row {
        Row {
            stage: stage.into(),
            axes: 6,
            median,
            max,
        }
    }

    #[test]
    fn five_per_cent_pass_and_one_instruction_more_does_not() {
        let committed = [row("cycle", 6000, 10_000)];
        assert!(grown(&committed, &[row("cycle", 6300, 10_500)]).is_empty());
        let found = grown(&committed, &[row("cycle", 6301, 10_501)]);
        assert_eq!(
            found,
            [
                "cycle (6 axes): median is 6301 instructions, more than 5 % over the committed 6000",
                "cycle (6 axes): max is 10501 instructions, more than 5 % over the committed 10000",
            ]
        );
    }

    #[test]
    fn a_line_that_is_gone_is_told_and_a_new_one_is_not() {
        let found = grown(&[row("servo", 500, 500)], &[row("solve", 500, 500)]);
        assert_eq!(found, ["servo (6 axes): was not measured"]);
    }
}
