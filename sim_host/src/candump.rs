//! The bus log in the text form of `candump -L`, which can-utils, python-can and Wireshark read.
//!
//! A line per frame, in the order of the bus: `(1436509052.249713) can0 123#DEADBEEF`. Seconds are those of the run, from
//! zero, so that the same run gives the same file.

use std::fmt;
use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use embedded_can::Frame as _;
use hal::can::Frame;

use crate::whole_file::WholeFile;

/// Name of the one bus, as Linux would call it.
const INTERFACE: &str = "can0";

/// One frame at its time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Line {
    /// End of the frame on the bus, ns since the beginning of the run; the text gives whole microseconds.
    pub time_ns: u64,
    /// The frame.
    pub frame: Frame,
}

impl fmt::Display for Line {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let micros = self.time_ns / 1000;
        write!(
            f,
            "({:010}.{:06}) {INTERFACE} {:03X}#",
            micros / 1_000_000,
            micros % 1_000_000,
            self.frame.cob()
        )?;
        if self.frame.is_remote_frame() {
            return write!(f, "R{}", self.frame.dlc());
        }
        self.frame.bytes().iter().try_for_each(|byte| write!(f, "{byte:02X}"))
    }
}

/// A bus log being written; it takes its name when it is [finished](CandumpWriter::finish).
pub struct CandumpWriter {
    file: WholeFile,
    path: PathBuf,
}

impl CandumpWriter {
    /// Begins the file `path`.
    pub fn create(path: &Path) -> Result<Self> {
        Ok(Self {
            file: WholeFile::create(path)?,
            path: path.into(),
        })
    }

    /// Appends a frame whose end on the bus was at `time_ns` since the beginning of the run.
    pub fn frame(&mut self, time_ns: u64, frame: &Frame) -> Result<()> {
        let line = Line { time_ns, frame: *frame };
        writeln!(self.file, "{line}").with_context(|| format!("bus log {}: cannot be written", self.path.display()))
    }

    /// Completes the file, and returns its path.
    pub fn finish(self) -> Result<PathBuf> {
        self.file.finish()
    }
}

#[cfg(test)]
mod tests {
    use embedded_can::StandardId;

    use super::*;
    use crate::whole_file::tests::folder;

    /// python-can 4.6 reads this text back to the same frames and times (`can.CanutilsLogReader`), and Wireshark 4.0
    /// dissects it as CANopen (`tshark -d can.subdissector,canopen`): checked November 2026.
    const EXPECTED: &str = "\
(0000000000.000047) can0 000#0100
(0000000000.005047) can0 080#01
(0000000000.005250) can0 181#DEADBEEF00112233
(0000000012.345678) can0 705#
(1436509052.249713) can0 701#R1
";

    #[test]
    fn frames_are_written_as_candump_writes_them() {
        let folder = folder("candump");
        let path = folder.join("bus.log");
        let mut log = CandumpWriter::create(&path).expect("created");
        let data = |id, bytes: &[u8]| Frame::data(id, bytes).expect("a legal frame");
        let sdo = data(0x181, &[0xDE, 0xAD, 0xBE, 0xEF, 0x00, 0x11, 0x22, 0x33]);
        let remote = Frame::new_remote(StandardId::new(0x701).expect("standard"), 1).expect("a legal frame");
        log.frame(47_000, &data(0, &[1, 0])).expect("written");
        log.frame(5_047_999, &data(0x80, &[1])).expect("written");
        log.frame(5_250_000, &sdo).expect("written");
        log.frame(12_345_678_000, &data(0x705, &[])).expect("written");
        log.frame(1_436_509_052_249_713_000, &remote).expect("written");
        log.finish().expect("finished");
        assert_eq!(std::fs::read_to_string(path).expect("readable"), EXPECTED);
    }
}
