//! The cycle on this machine, in real time: wakes at absolute times, runs the controller on a recorded job's frames, and measures
//! itself with the instruments that the image has. One count is a nanosecond.

use super::busy::Busy;
use super::cyclictest::{Cyclictest, Latencies};
use super::tape::Tape;
use crate::progress;
use anyhow::{bail, ensure};
use hal::board::report::{Event, HALF_US, Instruments, Timing};
use std::thread;

/// From cycle to cycle, µs.
pub const PERIOD_US: u32 = 2 * HALF_US;
/// Priority under SCHED_FIFO, as cyclictest's users take it: above the kernel's interrupt threads, which have 50.
pub const PRIORITY: u8 = 80;

/// Nanoseconds from one timer event to the next.
const HALF_NS: u64 = HALF_US as u64 * 1000;

/// What came of a run.
pub struct Measured {
    /// The distributions, ns.
    pub instruments: Instruments,
    /// Events that were not over when the next one was due.
    pub deadline_misses: u64,
    /// What was not granted, in words.
    pub refused: Vec<String>,
    /// What cyclictest measured meanwhile, where it is installed.
    pub cyclictest: Option<Latencies>,
}

/// Runs `cycles` cycles, with everything below busy if `loaded`.
pub fn run(tape: &Tape, cycles: u64, loaded: bool) -> anyhow::Result<Measured> {
    let bar = progress::bar(cycles, "cycles");
    let beside = Cyclictest::start(cycles)?;
    let busy = loaded.then(Busy::start);
    let thread = thread::scope(|scope| scope.spawn(|| real_time(tape, cycles, busy.as_ref(), &bar)).join());
    drop(busy);
    bar.finish_and_clear();
    let Ok(measured) = thread else {
        bail!("the real-time thread panicked");
    };
    let (mut measured, reference) = (measured?, beside.map(Cyclictest::finish));
    match reference {
        Some(Ok(latencies)) => measured.cyclictest = Some(latencies),
        Some(Err(error)) => measured.refused.push(format!("no reference: {error}")),
        None => {}
    }
    Ok(measured)
}

/// The real-time thread.
fn real_time(tape: &Tape, cycles: u64, busy: Option<&Busy>, bar: &indicatif::ProgressBar) -> anyhow::Result<Measured> {
    let refused = system::become_real_time();
    let mut measured = Measured {
        instruments: Instruments::new(),
        deadline_misses: 0,
        refused,
        cyclictest: None,
    };
    let mut controller = tape.controller()?;
    let mut at = 0;
    let mut due = system::now_ns() + 4 * HALF_NS;
    for event in 0..2 * cycles {
        system::sleep_until(due)?;
        let start = system::now_ns();
        tape.frames(at).iter().for_each(|frame| controller.receive(frame));
        let mut sent = 0u32;
        let event = if event.is_multiple_of(2) {
            controller.sync(&mut |_| sent += 1);
            Event::Sync
        } else {
            let (_, outputs) = controller.cycle(tape.params(), &(), &mut |_| sent += 1);
            let outputs = *outputs;
            let end = system::now_ns(); // the comparison is ours, not the cycle's
            take(&mut measured, Event::Cycle, due, start, end);
            ensure!(
                tape.agrees(at / 2, &outputs),
                "cycle {}: other outputs than in the recording",
                at / 2
            );
            bar.inc(1);
            Event::Cycle
        };
        if event == Event::Sync {
            take(&mut measured, event, due, start, system::now_ns());
        }
        if let Some(busy) = busy {
            busy.tell(start as u32 ^ sent);
        }
        at += 1;
        if at == tape.events() {
            (at, controller) = (0, tape.controller()?);
        }
        due += HALF_NS;
    }
    Ok(measured)
}

fn take(measured: &mut Measured, event: Event, due: u64, start: u64, end: u64) {
    let count = |from: u64, to: u64| u32::try_from(to.saturating_sub(from)).unwrap_or(u32::MAX);
    measured.deadline_misses += u64::from(end > due + HALF_NS);
    let timing = Timing {
        event,
        latency: count(due, start),
        start: start as u32, // the instruments take differences, which may wrap
        busy: count(start, end),
        overruns: 0,
    };
    measured.instruments.add(&timing, PERIOD_US * 1000);
}

/// What of the operating system is needed.
#[cfg(target_os = "linux")]
mod system {
    use super::PRIORITY;
    use anyhow::Context;
    use rustix::mm::{MlockAllFlags, mlockall};
    use rustix::thread::{ClockId, clock_nanosleep_absolute};
    use rustix::time::{Timespec, clock_gettime};
    use thread_priority::unix::{
        RealtimeThreadSchedulePolicy, ThreadSchedulePolicy, set_thread_priority_and_policy, thread_native_id,
    };
    use thread_priority::{ThreadPriority, ThreadPriorityValue};

    const SECOND_NS: u64 = 1_000_000_000;

    /// Monotonic time, ns.
    pub fn now_ns() -> u64 {
        let now = clock_gettime(ClockId::Monotonic);
        now.tv_sec as u64 * SECOND_NS + now.tv_nsec as u64
    }

    /// Sleeps until then; not at all if then is past.
    pub fn sleep_until(due_ns: u64) -> anyhow::Result<()> {
        let due = Timespec {
            tv_sec: (due_ns / SECOND_NS) as i64,
            tv_nsec: (due_ns % SECOND_NS) as i64,
        };
        clock_nanosleep_absolute(ClockId::Monotonic, &due).context("clock_nanosleep")
    }

    /// Takes this thread to SCHED_FIFO and locks the memory; what is not granted is told.
    pub fn become_real_time() -> Vec<String> {
        let mut refused = Vec::new();
        let priority = ThreadPriorityValue::try_from(PRIORITY).map(ThreadPriority::Crossplatform);
        let fifo = ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo);
        let granted =
            priority.is_ok_and(|priority| set_thread_priority_and_policy(thread_native_id(), priority, fifo).is_ok());
        if !granted {
            refused.push(
                "no real-time priority: SCHED_FIFO was not granted (root, or an rtprio line in /etc/security/limits.conf)".into(),
            );
        }
        if let Err(error) = mlockall(MlockAllFlags::CURRENT | MlockAllFlags::FUTURE) {
            refused.push(format!(
                "memory not locked, pages may be missing when they are needed: mlockall: {error}"
            ));
        }
        refused
    }
}

#[cfg(not(target_os = "linux"))]
mod system {
    use std::sync::OnceLock;
    use std::thread;
    use std::time::{Duration, Instant};

    static START: OnceLock<Instant> = OnceLock::new();

    /// Monotonic time, ns.
    pub fn now_ns() -> u64 {
        START.get_or_init(Instant::now).elapsed().as_nanos() as u64
    }

    /// Sleeps until then; not at all if then is past.
    pub fn sleep_until(due_ns: u64) -> anyhow::Result<()> {
        thread::sleep(Duration::from_nanos(due_ns.saturating_sub(now_ns())));
        Ok(())
    }

    /// Nothing: only Linux is asked.
    pub fn become_real_time() -> Vec<String> {
        vec!["no real-time priority, and sleep by relative times: this is not Linux".into()]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Model;
    use crate::seal::scenario::{Options, PathName};

    #[test]
    fn a_second_in_real_time_takes_a_second_and_every_event_is_measured() {
        let options = Options {
            path: PathName::Straight,
            ..Options::told()
        };
        let tape = Tape::record(&options, &Model::k3s(), 1).unwrap();
        let begin = std::time::Instant::now();
        let measured = run(&tape, 200, false).unwrap();
        assert!(begin.elapsed().as_secs_f64() > 0.99);
        assert_eq!(measured.instruments.cycle.count(), 200);
        assert_eq!(measured.instruments.latency.count(), 400);
        assert_eq!(measured.instruments.start_error.count(), 398);
    }
}
