//! QEMU with an image, and the two pipes to its board.
//!
//! The board speaks by semihosting on QEMU's standard input and output ([`hal::board::frames`] says what), so nothing has to be made
//! in a file system for it, and the end of the emulator is the end of a pipe. Virtual time is counted in instructions
//! (`-icount`) and stands still while the board waits for an answer.

use super::region;
use crate::log::bytes_of;
use crate::whole_file::PassingFile;
use anyhow::{Context, bail};
use hal::board::frames::{FRAMES_MAX, Head, ReadOut, Stamped};
use hal::camera::{START, room};
use hal::wire::Wire;
use std::io::{ErrorKind, Read, Write};
use std::path::Path;
use std::process::{Child, ChildStderr, ChildStdin, ChildStdout, Command, Stdio};
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Duration;

/// The program.
const QEMU: &str = "qemu-system-arm";

/// Start of the parameter region of `mps2-an386`: PARAMETERS in memory.x.
const PARAMETERS: u32 = 0x2100_0000;

/// On the controller one instruction takes 2^6 ns of virtual time, 15.6 million a second: the largest step of which 5 ms hold a whole number
/// (78 125), so that every cycle begins at the same fraction of an instruction; and 1.6 counts of the board's 25 MHz
/// counter, so that it resolves single instructions.
pub const SHIFT: u8 = 6;

/// An emulator that lets itself be waited for twice this long, in real time, hangs. A timer event takes it less than a
/// millisecond.
const PATIENCE: Duration = Duration::from_secs(10);

/// What the board hands over at a timer event.
#[derive(Clone, Debug, Default)]
pub struct Message {
    /// Frames sent.
    pub frames: Vec<Stamped>,
    /// Frames that the board had to drop.
    pub dropped: u8,
    /// Trace of the image.
    pub trace: Vec<u8>,
}

/// What a board's image sensor gives.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum SensorOutput {
    /// Nothing now.
    #[default]
    Nothing,
    /// An image, rows from the top, and its width and height.
    Image(Vec<u8>, [u16; 2]),
    /// An image was lost.
    Lost,
}

/// A running emulator; ends with its owner.
pub struct Emulator {
    process: Arc<Process>,
    input: ChildStdin,
    output: ChildStdout,
    errors: ChildStderr,
    parameters: Option<PassingFile>,
    /// The watch's life line: dropped, it goes home.
    _watch: mpsc::Sender<()>,
}

impl Emulator {
    /// Starts `image` with `parameters`, byte form without head; an instruction takes 2^`shift` ns.
    pub fn start(image: &Path, body: &[u8], shift: u8) -> anyhow::Result<Self> {
        if !image.is_file() {
            bail!("image {}: no such file; `cargo xtask build` makes it", image.display());
        }
        let parameters = PassingFile::create(&region::with_head(body))?;
        let mut command = Command::new(QEMU);
        command
            .args([
                "-machine",
                "mps2-an386",
                "-display",
                "none",
                "-serial",
                "none",
                "-monitor",
                "none",
            ])
            .args(["-semihosting-config", "enable=on,target=native"])
            .args(["-icount", &format!("shift={shift},sleep=off")])
            .arg("-device")
            .arg(format!(
                "loader,file={},addr={PARAMETERS:#x},force-raw=on",
                escaped(parameters.path())
            ))
            .arg("-kernel")
            .arg(image)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped());
        let mut child = match command.spawn() {
            Ok(child) => child,
            Err(error) if error.kind() == ErrorKind::NotFound => {
                bail!(
                    "{QEMU} is not installed: on Debian `apt-get install qemu-system-arm`, elsewhere QEMU 7.2 or newer"
                )
            }
            Err(error) => return Err(error).context(format!("cannot start {QEMU}")),
        };
        let (Some(input), Some(output), Some(errors)) = (child.stdin.take(), child.stdout.take(), child.stderr.take())
        else {
            bail!("{QEMU} was started without its pipes");
        };
        let process = Arc::new(Process {
            child: Mutex::new(child),
            steps: AtomicU32::new(0),
            hangs: AtomicBool::new(false),
        });
        let watch = watch(Arc::clone(&process));
        Ok(Self {
            process,
            input,
            output,
            errors,
            parameters: Some(parameters),
            _watch: watch,
        })
    }

    /// Waits for what the board hands over next.
    pub fn message(&mut self) -> anyhow::Result<Message> {
        self.process.steps.fetch_add(1, Ordering::Relaxed);
        let mut head = [0; Head::BYTES];
        self.read(&mut head)?;
        let head = Head::read(&mut head.as_slice()).context("head of a message")?;
        let mut bytes = vec![0; usize::from(head.length)];
        self.read(&mut bytes)?;
        self.process.steps.fetch_add(1, Ordering::Relaxed);
        let mut rest = bytes.as_slice();
        let frames: Option<Vec<Stamped>> = (0..head.frames).map(|_| Stamped::read(&mut rest)).collect();
        let frames = frames.context("frame in a message of the board")?;
        Ok(Message {
            frames,
            dropped: head.flags,
            trace: rest.to_vec(),
        })
    }

    /// Waits for a value from an image that has its own way of speaking.
    pub fn get<T: Wire>(&mut self) -> anyhow::Result<T> {
        self.process.steps.fetch_add(1, Ordering::Relaxed);
        let mut bytes = vec![0; T::BYTES];
        self.read(&mut bytes)?;
        self.process.steps.fetch_add(1, Ordering::Relaxed);
        T::read(&mut bytes.as_slice()).context("the image sent no legal value")
    }

    /// Sends a value to such an image.
    pub fn put(&mut self, value: &impl Wire) -> anyhow::Result<()> {
        self.write(&bytes_of(value))
    }

    fn read(&mut self, bytes: &mut [u8]) -> anyhow::Result<()> {
        if let Err(error) = self.output.read_exact(bytes) {
            return Err(self.end(error));
        }
        // The image runs, so its parameters are in its memory.
        self.parameters = None;
        Ok(())
    }

    /// Sends bytes to such an image.
    pub fn write(&mut self, bytes: &[u8]) -> anyhow::Result<()> {
        match self.input.write_all(bytes) {
            Ok(()) => Ok(()),
            Err(error) => Err(self.end(error)),
        }
    }

    /// Lets the board go on to the next timer event, in which stretch it receives `frames`, in the order of their times.
    pub fn answer(&mut self, frames: &[Stamped], ask: u8) -> anyhow::Result<()> {
        self.answer_with(frames, ask, &SensorOutput::Nothing)
    }

    /// The same, and what its image sensor has been read out to.
    pub fn answer_with(&mut self, frames: &[Stamped], ask: u8, output: &SensorOutput) -> anyhow::Result<()> {
        if frames.len() > FRAMES_MAX {
            bail!(
                "{} frames in half a cycle: the bus carries at most {FRAMES_MAX}",
                frames.len()
            );
        }
        let length = (frames.len() * Stamped::BYTES) as u16;
        let mut bytes = bytes_of(&Head {
            length,
            frames: frames.len() as u8,
            flags: ask,
            read_out: match output {
                SensorOutput::Nothing => ReadOut::None,
                SensorOutput::Image(..) => ReadOut::Image,
                SensorOutput::Lost => ReadOut::Lost,
            },
        });
        frames.iter().for_each(|stamped| bytes.extend(bytes_of(stamped)));
        if let SensorOutput::Image(pixels, [width, height]) = output {
            if pixels.len() != usize::from(*width) * usize::from(*height) || pixels.len() > room(START) {
                bail!(
                    "image of {width} × {height} px in {} bytes: at most {} fit",
                    pixels.len(),
                    room(START)
                );
            }
            bytes.extend(bytes_of(&(*width, *height)));
            bytes.extend_from_slice(pixels);
        }
        self.write(&bytes)
    }

    /// Says why the emulator ended.
    fn end(&mut self, error: std::io::Error) -> anyhow::Error {
        let status = self.process.child().wait();
        let mut said = String::new();
        // Whatever it wrote is in the pipe; a pipe that cannot be read says no more than an empty one.
        let _ = self.errors.read_to_string(&mut said);
        let after = self.process.steps.load(Ordering::Relaxed) / 2;
        match (said.trim(), status) {
            ("", Ok(status)) if status.code() == Some(1) => {
                anyhow::anyhow!("the image stopped itself after {after} timer events: parameters refused, or a panic")
            }
            ("", _) if self.process.hangs.load(Ordering::Relaxed) => {
                anyhow::anyhow!(
                    "{QEMU} said nothing for over {} s after {after} timer events",
                    PATIENCE.as_secs()
                )
            }
            ("", Ok(status)) => anyhow::anyhow!("{QEMU} ended after {after} timer events, {status}: {error}"),
            (said, _) => anyhow::anyhow!("{QEMU} ended after {after} timer events: {said}"),
        }
    }
}

impl Drop for Emulator {
    fn drop(&mut self) {
        let mut child = self.process.child();
        // Fails only for one that has ended.
        let _ = child.kill();
        let _ = child.wait();
    }
}

/// What the watch shares with the owner.
struct Process {
    child: Mutex<Child>,
    /// Steps of [`Emulator::message`]: odd while it waits, and twice the messages that have come.
    steps: AtomicU32,
    /// The watch ended it.
    hangs: AtomicBool,
}

impl Process {
    /// A thread that died holding the lock leaves the child as it was.
    fn child(&self) -> MutexGuard<'_, Child> {
        self.child.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Ends the emulator when it is waited for over two looks at it, [`PATIENCE`] apart.
fn watch(process: Arc<Process>) -> mpsc::Sender<()> {
    let (line, owner) = mpsc::channel::<()>();
    thread::spawn(move || {
        let mut seen = 0;
        while owner.recv_timeout(PATIENCE) == Err(RecvTimeoutError::Timeout) {
            let now = process.steps.load(Ordering::Relaxed);
            if now == seen && now % 2 == 1 {
                process.hangs.store(true, Ordering::Relaxed);
                // Fails only for one that has ended.
                let _ = process.child().kill();
                break;
            }
            seen = now;
        }
    });
    line
}

/// QEMU takes a comma for the end of an option's value, and two for one.
fn escaped(path: &Path) -> String {
    path.display().to_string().replace(',', ",,")
}
