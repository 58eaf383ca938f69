//! The reference beside our own measurement: cyclictest of Debian's rt-tests, in the same run, if it is installed.

use super::host::{PERIOD_US, PRIORITY};
use anyhow::{Context, bail};
use serde::Serialize;
use std::io::ErrorKind;
use std::process::{Child, Command, Stdio};

/// What cyclictest measured: time from the timer's instant to the thread's wake-up, µs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Latencies {
    /// Wake-ups.
    pub cycles: u64,
    /// Least.
    pub min_us: u64,
    /// Mean.
    pub avg_us: u64,
    /// Greatest.
    pub max_us: u64,
}

/// A running cyclictest.
pub struct Cyclictest(Child);

impl Cyclictest {
    /// Starts it for so many cycles of 5 ms; none where it is not installed.
    pub fn start(cycles: u64) -> anyhow::Result<Option<Self>> {
        let mut command = Command::new("cyclictest");
        command
            .args(["--quiet", "--threads=1", "--mlockall"])
            .arg(format!("--interval={PERIOD_US}"))
            .arg(format!("--priority={PRIORITY}"))
            .arg(format!("--loops={cycles}"))
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped());
        match command.spawn() {
            Ok(child) => Ok(Some(Self(child))),
            Err(error) if error.kind() == ErrorKind::NotFound => Ok(None),
            Err(error) => Err(error).context("cannot start cyclictest"),
        }
    }

    /// Waits for its end, which comes with ours.
    pub fn finish(self) -> anyhow::Result<Latencies> {
        let output = self.0.wait_with_output().context("cyclictest")?;
        let said = String::from_utf8_lossy(&output.stdout);
        match parse(&said) {
            Some(latencies) if output.status.success() => Ok(latencies),
            _ => bail!(
                "cyclictest ended with {}: {}{}",
                output.status,
                said.trim(),
                String::from_utf8_lossy(&output.stderr).trim()
            ),
        }
    }
}

/// Reads the line of the first thread: "T: 0 (31779) P:80 I:5000 C:    400 Min:     13 Act:   33 Avg:   44 Max:      93".
fn parse(said: &str) -> Option<Latencies> {
    let line = said.lines().find(|line| line.starts_with("T: 0"))?;
    let number = |name: &str| -> Option<u64> {
        let (_, rest) = line.split_once(name)?;
        rest.split_whitespace().next()?.parse().ok()
    };
    Some(Latencies {
        cycles: number(" C:")?,
        min_us: number("Min:")?,
        avg_us: number("Avg:")?,
        max_us: number("Max:")?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_summary_of_version_2_4_is_read() {
        let said = "# /dev/cpu_dma_latency set to 0us\nT: 0 (31779) P:80 I:5000 C:    400 Min:     13 Act:   33 Avg:   44 Max:      93\n";
        let expected = Latencies {
            cycles: 400,
            min_us: 13,
            avg_us: 44,
            max_us: 93,
        };
        assert_eq!(parse(said), Some(expected));
        assert_eq!(parse("unable to change scheduling policy"), None);
    }
}
