//! A file that appears under its name only when it is complete.
//!
//! What a run leaves behind is either whole or absent: bytes go to a temporary file in the same folder, which takes the
//! name asked for when the writer says that it has finished, and is gone if it never does: on Linux, where it has no name
//! until then, even if the process is killed. A [`PassingFile`] never has one there.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

use anyhow::{Context, Result, ensure};

/// A file being written.
pub struct WholeFile {
    path: PathBuf,
    temporary: PathBuf,
    /// It is not yet under the temporary name either.
    unnamed: bool,
    /// `None` once finished.
    file: Option<BufWriter<File>>,
}

impl WholeFile {
    /// Begins the file `path`, and makes its folder if there is none. What is there and no file, as a folder or a device, is refused. An error
    /// names the path.
    pub fn create(path: &Path) -> Result<Self> {
        let replaceable = fs::metadata(path).map_or(true, |there| there.is_file());
        ensure!(
            replaceable,
            "file {}: is a folder or a device, must be a file or not be there",
            path.display()
        );
        let folder = path
            .parent()
            .filter(|folder| !folder.as_os_str().is_empty())
            .unwrap_or(Path::new("."));
        let name = path
            .file_name()
            .with_context(|| format!("file {}: no file name", path.display()))?;
        fs::create_dir_all(folder).with_context(|| format!("folder {}: cannot be made", folder.display()))?;
        let temporary = folder.join(format!(".{}.{}.partial", name.to_string_lossy(), std::process::id()));
        let (file, unnamed) = match without_name(folder) {
            Some(file) => (Ok(file), true),
            None => (File::create(&temporary), false),
        };
        let file = file.with_context(|| format!("file {}: cannot be written", path.display()))?;
        Ok(Self {
            path: path.to_path_buf(),
            temporary,
            unnamed,
            file: Some(BufWriter::new(file)),
        })
    }

    /// Gives the file its name, in place of any older file of that name.
    pub fn finish(mut self) -> Result<PathBuf> {
        let context = || format!("file {}: cannot be written", self.path.display());
        if let Some(mut file) = self.file.take() {
            file.flush()
                .and_then(|()| match self.unnamed {
                    true => name(file.get_ref(), &self.temporary),
                    false => Ok(()),
                })
                .and_then(|()| fs::rename(&self.temporary, &self.path))
                .inspect_err(|_| {
                    let _ = fs::remove_file(&self.temporary); // the first error is the one to tell
                })
                .with_context(context)?;
        }
        Ok(self.path.clone())
    }
}

impl Write for WholeFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file.as_mut().map_or(Ok(0), |file| file.write(bytes))
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.as_mut().map_or(Ok(()), |file| file.flush())
    }
}

impl Drop for WholeFile {
    fn drop(&mut self) {
        if self.file.take().is_some() && !self.unnamed {
            let _ = fs::remove_file(&self.temporary); // nothing more can be done about it here
        }
    }
}

/// A file for another process to read, gone with its owner.
pub struct PassingFile {
    path: PathBuf,
    /// Open as long as that process may want it; `None` where it has a name.
    unnamed: Option<File>,
}

impl PassingFile {
    /// One that holds `bytes`, in the system's folder for such.
    pub fn create(bytes: &[u8]) -> Result<Self> {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        let folder = std::env::temp_dir();
        if let Some(mut file) = without_name(&folder) {
            let path = open_as(&file);
            let written = file.write_all(bytes);
            written.with_context(|| format!("folder {}: a file in it cannot be written", folder.display()))?;
            return Ok(Self {
                path,
                unnamed: Some(file),
            });
        }
        let count = COUNT.fetch_add(1, Ordering::Relaxed);
        let path = folder.join(format!("tesaki-{}-{count}", std::process::id()));
        let file = Self { path, unnamed: None };
        fs::write(&file.path, bytes).with_context(|| format!("file {}: cannot be written", file.path.display()))?;
        Ok(file)
    }

    /// Where another process finds it.
    pub fn path(&self) -> &Path {
        &self.path
    }
}

impl Drop for PassingFile {
    fn drop(&mut self) {
        if self.unnamed.take().is_none() {
            let _ = fs::remove_file(&self.path); // nothing more can be done about it here
        }
    }
}

/// A file in `folder` that is gone with the process unless it is given a [`name`]; `None` where there are no such files.
#[cfg(target_os = "linux")]
fn without_name(folder: &Path) -> Option<File> {
    use rustix::fs::{Mode, OFlags, open};
    let flags = OFlags::TMPFILE | OFlags::WRONLY | OFlags::CLOEXEC;
    let file = File::from(open(folder, flags, Mode::from_raw_mode(0o666)).ok()?);
    open_as(&file).exists().then_some(file)
}

/// Gives a file of [`without_name`] this one.
#[cfg(target_os = "linux")]
fn name(file: &File, path: &Path) -> io::Result<()> {
    use rustix::fs::{AtFlags, CWD, linkat};
    let _ = fs::remove_file(path); // what a process of the same number may have left when it was killed right here
    Ok(linkat(CWD, open_as(file), CWD, path, AtFlags::SYMLINK_FOLLOW)?)
}

/// Where the system shows this open file, to other processes too.
#[cfg(target_os = "linux")]
fn open_as(file: &File) -> PathBuf {
    use std::os::fd::AsRawFd;
    format!("/proc/{}/fd/{}", std::process::id(), file.as_raw_fd()).into()
}

#[cfg(not(target_os = "linux"))]
fn without_name(_: &Path) -> Option<File> {
    None
}

#[cfg(not(target_os = "linux"))]
fn open_as(_: &File) -> PathBuf {
    PathBuf::new()
}

#[cfg(not(target_os = "linux"))]
fn name(_: &File, _: &Path) -> io::Result<()> {
    Err(io::ErrorKind::Unsupported.into())
}

/// Whether the file `path` could be written: for a long run to ask before it begins. Makes the file's folder if there is none.
pub fn check(path: &Path) -> Result<()> {
    WholeFile::create(path).map(drop)
}

/// Writes `bytes` as the whole of the file `path`.
pub fn write(path: &Path, bytes: &[u8]) -> Result<PathBuf> {
    let mut file = WholeFile::create(path)?;
    file.write_all(bytes)
        .with_context(|| format!("file {}: cannot be written", path.display()))?;
    file.finish()
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// An empty folder of the test's own, gone when it goes out of scope; `name` tells tests of one process apart.
    pub(crate) struct Folder(PathBuf);

    pub(crate) fn folder(name: &str) -> Folder {
        let folder = std::env::temp_dir().join(format!("tesaki-test-{}-{name}", std::process::id()));
        fs::create_dir_all(&folder).expect("temporary folder");
        Folder(folder)
    }

    impl std::ops::Deref for Folder {
        type Target = Path;
        fn deref(&self) -> &Path {
            &self.0
        }
    }

    impl Drop for Folder {
        fn drop(&mut self) {
            let _ = fs::remove_dir_all(&self.0); // a temporary folder left behind fails no test
        }
    }

    #[test]
    fn a_finished_file_is_alone_in_its_folder() {
        let folder = folder("finished");
        let path = write(&folder.join("deep/run.txt"), b"whole").expect("written");
        assert_eq!(fs::read(&path).expect("readable"), b"whole");
        assert_eq!(fs::read_dir(folder.join("deep")).expect("folder").count(), 1);
    }

    #[test]
    fn an_abandoned_file_leaves_nothing_and_spares_the_old_one() {
        let folder = folder("abandoned");
        let path = write(&folder.join("run.txt"), b"old").expect("written");
        let mut file = WholeFile::create(&path).expect("created");
        file.write_all(b"half").expect("written");
        drop(file);
        assert_eq!(fs::read(&path).expect("readable"), b"old");
        assert_eq!(fs::read_dir(&*folder).expect("folder").count(), 1);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn before_it_is_finished_a_file_has_no_name_that_could_be_left_behind() {
        let folder = folder("unnamed");
        if without_name(&folder).is_none() {
            return; // not on every file system
        }
        let mut file = WholeFile::create(&folder.join("run.txt")).expect("created");
        file.write_all(&[0; 100_000]).expect("written");
        assert_eq!(fs::read_dir(&*folder).expect("folder").count(), 0);
        file.finish().expect("finished");
        assert_eq!(fs::read(folder.join("run.txt")).expect("readable").len(), 100_000);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_passing_file_is_read_by_another_process_and_has_no_name_that_could_be_left_behind() {
        if without_name(&std::env::temp_dir()).is_none() {
            return; // not on every file system
        }
        let file = PassingFile::create(b"passing").expect("created");
        let read = std::process::Command::new("cat")
            .arg(file.path())
            .output()
            .expect("read");
        assert_eq!(read.stdout, b"passing");
        assert!(file.path().starts_with("/proc"));
        drop(file);
        let named = format!("tesaki-{}-", std::process::id());
        let left = fs::read_dir(std::env::temp_dir()).expect("folder").flatten();
        assert_eq!(
            left.filter(|entry| entry.file_name().to_string_lossy().starts_with(&named))
                .count(),
            0
        );
    }

    #[test]
    fn a_place_that_cannot_be_written_is_named_and_left_as_it_is() {
        let folder = folder("blocked");
        fs::write(folder.join("file"), b"").expect("written");
        let error = write(&folder.join("file/run.txt"), b"").expect_err("a file is no folder");
        assert!(format!("{error:#}").contains("file: cannot be made"), "{error:#}");
        let error = check(&folder).expect_err("a folder is no file");
        assert!(format!("{error:#}").ends_with(": is a folder or a device, must be a file or not be there"));
        check(&folder.join("deep/run.txt")).expect("could be written");
        assert_eq!(fs::read_dir(folder.join("deep")).expect("folder").count(), 0);
    }
}
