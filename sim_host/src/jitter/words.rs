//! The figures for people.

use super::figures::JitterFigures;
use crate::table::Table;
use firmware::fault::Fault;
use hal::board::histogram::Histogram;
use std::fmt::Write;

/// Unexplained stops that are shown; JSON has all.
const UNEXPLAINED_SHOWN: usize = 5;

/// The figures as a table, and what is to be said of them.
pub fn text(figures: &JitterFigures) -> String {
    let distributions = &figures.distributions;
    let (instruments, scale) = (&distributions.instruments, distributions.scale);
    let mut table = Table::new(["", "median", "99.99 %", "max", "unit"]);
    let mut row = |name: &str, histogram: &Histogram, unit: &str, show: &dyn Fn(u32) -> String| {
        let [median, most] = [500_000, 999_900].map(|share| show(histogram.percentile(share)));
        table.row([name.into(), median, most, show(histogram.greatest), unit.into()]);
    };
    let us = |counts: u32| format!("{:.2}", scale.us(counts));
    row("start to start, error", &instruments.start_error, "µs", &us);
    row("timer to first reading", &instruments.latency, "µs", &us);
    row("control cycle, time", &instruments.cycle, "µs", &us);
    row("SYNC event, time", &instruments.sync, "µs", &us);
    if scale.instructions(0).is_some() {
        let count = |counts: u32| scale.instructions(counts).unwrap_or_default().to_string();
        row("timer to first reading", &instruments.latency, "instructions", &count);
        row("control cycle", &instruments.cycle, "instructions", &count);
        row("SYNC event", &instruments.sync, "instructions", &count);
    }
    let ms = |us: u32| format!("{:.2}", f64::from(us) * 1e-3);
    if let Some((feedback, command)) = &distributions.bus {
        row("age of feedback in the cycle", feedback, "ms", &ms);
        row("age of commands at the drives", command, "ms", &ms);
    }
    row("age of a sighting at the torque", &distributions.vision, "ms", &ms);

    let mut text = table.to_string();
    let say = |text: &mut String, line: &str| text.extend([line, "\n"]);
    say(
        &mut text,
        &format!(
            "{} cycles, {} deadlines missed",
            figures.cycles, figures.deadline_misses
        ),
    );
    let [background, idle] = instruments.load;
    if background > 0 {
        say(
            &mut text,
            &format!("load: {background} rounds of work in the background, {idle} in idle"),
        );
    }
    let [boot, deepest] = instruments.stack;
    if deepest > 0 {
        say(
            &mut text,
            &format!("stack, painted: {boot} bytes up to the first tick, {deepest} since"),
        );
    }
    if let Some(latencies) = &figures.cyclictest {
        say(
            &mut text,
            &format!(
                "cyclictest beside: {} wake-ups, {} µs least, {} mean, {} most",
                latencies.cycles, latencies.min_us, latencies.avg_us, latencies.max_us
            ),
        );
    }
    if let Some(account) = &figures.faults {
        let mut table = Table::new(["broken", "times"]);
        for (name, times) in &account.injected {
            table.row([name.to_string(), times.to_string()]);
        }
        let mut stops = Table::new(["stopped by", "times"]);
        for (number, times) in &account.stops {
            stops.row([format!("fault {number}: {}", line_of(*number)), times.to_string()]);
        }
        // Writing to a string does not fail.
        let _ = write!(text, "{table}{stops}");
        say(
            &mut text,
            &format!("{} jobs done, hash {}", account.jobs_done, account.log_hash),
        );
        for stop in account.unexplained.iter().take(UNEXPLAINED_SHOWN) {
            say(&mut text, &format!("unexplained: {stop}"));
        }
        say(&mut text, &format!("{} stops unexplained", account.unexplained.len()));
    }
    say(
        &mut text,
        &format!(
            "verdict, in the bands of LinuxCNC's latency test: {} (greatest start error {:.2} µs)",
            figures.verdict, figures.start_error_max_us
        ),
    );
    for caveat in &figures.caveats {
        say(&mut text, &format!("caveat: {caveat}"));
    }
    text
}

fn line_of(number: u8) -> &'static str {
    use hal::wire::Wire;
    Fault::read(&mut [number].as_slice()).map_or("", Fault::line)
}
