//! Files that are written while the next ones are made.

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Sender, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{Builder, JoinHandle};

use super::ResultsError;
use epirig_data::storage::Disk;

/// A file that waits to be written.
pub(super) struct Waiting {
    /// Where it is written.
    pub(super) path: PathBuf,
    /// Its final place, for errors.
    pub(super) named: PathBuf,
    pub(super) bytes: Vec<u8>,
}

/// A thread that writes files in the order in which they come, each flushed to disk. Whoever makes them does
/// not wait for the disk, unless the system has no thread left.
pub(super) struct Writer {
    files: Arc<Files>,
    /// `None` if there is no thread, or when no more files come.
    queue: Option<Sender<Waiting>>,
    thread: Option<JoinHandle<()>>,
}

struct Files {
    disk: Mutex<Box<dyn Disk>>,
    /// Why a file could not be written. Those after it are not tried.
    failure: Mutex<Option<ResultsError>>,
    /// Whether the files that wait are of no use any more.
    given_up: AtomicBool,
}

impl Writer {
    /// A writer to `disk`.
    pub(super) fn to(disk: Box<dyn Disk>) -> Self {
        let files = Files { disk: Mutex::new(disk), failure: Mutex::default(), given_up: false.into() };
        let files = Arc::new(files);
        let (queue, waiting) = channel();
        let seen = Arc::clone(&files);
        let write_all = move || waiting.into_iter().for_each(|file| seen.write(file));
        let thread = Builder::new().name("results".to_owned()).spawn(write_all).ok();
        Self { files, queue: thread.is_some().then_some(queue), thread }
    }

    /// Writes a file some time before [`finish`](Self::finish) returns.
    pub(super) fn write(&self, file: Waiting) {
        match &self.queue {
            // The thread takes files as long as there is a queue; if it panics, `finish` does.
            Some(queue) => drop(queue.send(file)),
            None => self.files.write(file),
        }
    }

    /// Waits until all files are written, and gives the disk.
    ///
    /// # Errors
    /// That of the first file that could not be written.
    pub(super) fn finish(&mut self) -> Result<MutexGuard<'_, Box<dyn Disk>>, ResultsError> {
        self.queue = None;
        if let Some(Err(panic)) = self.thread.take().map(JoinHandle::join) {
            std::panic::resume_unwind(panic);
        }
        match held(&self.files.failure).take() {
            Some(failure) => Err(failure),
            None => Ok(held(&self.files.disk)),
        }
    }
}

impl Drop for Writer {
    fn drop(&mut self) {
        self.files.given_up.store(true, Ordering::Relaxed);
        self.queue = None;
        if let Some(thread) = self.thread.take() {
            // The folder is given up, so how its files fared has no reader.
            let _ = thread.join();
        }
    }
}

impl Files {
    fn write(&self, Waiting { path, named, bytes }: Waiting) {
        let mut failure = held(&self.failure);
        if failure.is_some() || self.given_up.load(Ordering::Relaxed) {
            return;
        }
        let mut disk = held(&self.disk);
        let mut write = || {
            if let Some(parent) = path.parent().filter(|parent| !parent.exists()) {
                disk.make_folder(parent)?;
            }
            disk.write(&path, &bytes)?;
            disk.sync(&path)
        };
        *failure = write().err().map(|source| ResultsError::Io { action: "write", path: named, source });
    }
}

/// Locks `shared`; what a thread that panicked left behind is whole.
pub(super) fn held<T>(shared: &Mutex<T>) -> MutexGuard<'_, T> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::path::Path;

    use super::*;
    use epirig_data::storage::{DiskFault, FaultyDisk, RealDisk};

    fn file(folder: &Path, name: &str) -> Waiting {
        let named = Path::new("final").join(name);
        Waiting { path: folder.join(name), named, bytes: name.as_bytes().to_vec() }
    }

    /// A writer in a system without threads.
    fn alone(disk: Box<dyn Disk>) -> Writer {
        let mut writer = Writer::to(disk);
        drop(writer.finish());
        writer
    }

    #[test]
    fn all_files_are_there_at_the_end() {
        for writer in [Writer::to, alone] {
            let folder = tempfile::tempdir().unwrap();
            let mut writer = writer(Box::new(RealDisk));
            let names: Vec<String> = (0..20).map(|index| format!("deep/{index}")).collect();
            names.iter().for_each(|name| writer.write(file(folder.path(), name)));
            drop(writer.finish().unwrap());
            assert!(names.iter().all(|name| fs::read_to_string(folder.path().join(name)).unwrap() == *name));
        }
    }

    #[test]
    fn the_first_file_that_fails_is_named_and_none_is_tried_after_it() {
        for writer in [Writer::to, alone] {
            let folder = tempfile::tempdir().unwrap();
            // Each file takes two steps: it is written and flushed.
            let mut writer = writer(Box::new(FaultyDisk::new(DiskFault::Full, 4)));
            for name in ["0", "1", "2", "3"] {
                writer.write(file(folder.path(), name));
            }
            match writer.finish().err() {
                Some(ResultsError::Io { action: "write", path, .. }) => {
                    assert_eq!(path, Path::new("final/2"))
                }
                other => panic!("{other:?}"),
            }
            assert!(!folder.path().join("3").exists());
        }
    }
}
