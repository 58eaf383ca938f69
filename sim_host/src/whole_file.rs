//! A file that appears under its name only when it is complete.
//!
//! What a run leaves behind is either whole or absent: bytes go to a temporary file in the same folder, which takes the
//! name asked for when the writer says that it has finished, and is removed if it never does.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

/// A file being written.
pub struct WholeFile {
    path: PathBuf,
    temporary: PathBuf,
    /// `None` once finished.
    file: Option<BufWriter<File>>,
}

impl WholeFile {
    /// Begins the file `path`, and makes its folder if there is none. An error names the path.
    pub fn create(path: &Path) -> Result<Self> {
        let folder = path
            .parent()
            .filter(|folder| !folder.as_os_str().is_empty())
            .unwrap_or(Path::new("."));
        let name = path
            .file_name()
            .with_context(|| format!("file {}: no file name", path.display()))?;
        fs::create_dir_all(folder).with_context(|| format!("folder {}: cannot be made", folder.display()))?;
        let temporary = folder.join(format!(".{}.{}.partial", name.to_string_lossy(), std::process::id()));
        let file = File::create(&temporary).with_context(|| format!("file {}: cannot be written", path.display()))?;
        Ok(Self {
            path: path.to_path_buf(),
            temporary,
            file: Some(BufWriter::new(file)),
        })
    }

    /// Gives the file its name, in place of any older file of that name.
    pub fn finish(mut self) -> Result<PathBuf> {
        let context = || format!("file {}: cannot be written", self.path.display());
        if let Some(mut file) = self.file.take() {
            file.flush()
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
        if self.file.take().is_some() {
            let _ = fs::remove_file(&self.temporary); // nothing more can be done about it here
        }
    }
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

    #[test]
    fn a_place_that_cannot_be_written_is_named() {
        let folder = folder("blocked");
        fs::write(folder.join("file"), b"").expect("written");
        let error = write(&folder.join("file/run.txt"), b"").expect_err("a file is no folder");
        assert!(format!("{error:#}").contains("file: cannot be made"), "{error:#}");
    }
}
