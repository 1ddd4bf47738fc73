//! Writes frames in a thread of its own, so that the stage moves while frames are compressed and written.

use std::sync::mpsc::{SyncSender, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{Builder, JoinHandle};

use epirig_core::frame::Frame;
use epirig_data::sequence::{
    Event, ExitStatus, FrameFacts, FrameKind, SequenceError, SequenceWriter, StopFacts,
};

/// Most frames that wait: one is written while the next is taken. A slow disk slows the scan but does not
/// fill the memory.
const WAITING: usize = 2;

enum Job {
    Frame {
        kind: FrameKind,
        index: usize,
        frame: Box<Frame>,
        facts: Box<FrameFacts>,
    },
    Note(Box<Event>),
    /// Reply once all earlier frames are on disk.
    Flush(SyncSender<()>),
}

/// A writer with its thread. Writing ends at the first error.
pub(super) struct Archive {
    writer: Arc<Mutex<SequenceWriter>>,
    /// `None` if there is no thread.
    jobs: Option<SyncSender<Job>>,
    thread: Option<JoinHandle<Result<(), SequenceError>>>,
    /// Whether an error has ended the writing.
    is_closed: bool,
}

impl Archive {
    /// If the system allows no thread, the scan waits for each frame to be written.
    pub(super) fn new(writer: SequenceWriter) -> Self {
        let (jobs, received) = sync_channel(WAITING);
        let writer = Arc::new(Mutex::new(writer));
        let shared = Arc::clone(&writer);
        // Log events of the thread belong to the span of the scan.
        let span = tracing::Span::current();
        let work = move || span.in_scope(|| received.into_iter().try_for_each(|job| done(&shared, job)));
        let thread = Builder::new().name("archive".to_owned()).spawn(work).ok();
        Self { writer, jobs: thread.is_some().then_some(jobs), thread, is_closed: false }
    }

    pub(super) fn frame(
        &mut self,
        kind: FrameKind,
        index: usize,
        frame: Frame,
        facts: FrameFacts,
    ) -> Result<(), SequenceError> {
        self.send(Job::Frame { kind, index, frame: Box::new(frame), facts: Box::new(facts) })
    }

    pub(super) fn note(&mut self, event: Event) -> Result<(), SequenceError> {
        self.send(Job::Note(Box::new(event)))
    }

    /// Returns when all frames are on disk.
    pub(super) fn flush(&mut self) -> Result<(), SequenceError> {
        let (reply, wait) = sync_channel(1);
        self.send(Job::Flush(reply))?;
        // If the thread has ended, it holds an error.
        wait.recv().or_else(|_| self.end())
    }

    fn send(&mut self, job: Job) -> Result<(), SequenceError> {
        if self.is_closed {
            // The error has been returned before.
            return Err(SequenceError::Closed);
        }
        match &self.jobs {
            Some(jobs) => jobs.send(job).or_else(|_| self.end()),
            None => done(&self.writer, job).inspect_err(|_| self.is_closed = true),
        }
    }

    /// Waits for the thread, and returns its error if there is one.
    fn end(&mut self) -> Result<(), SequenceError> {
        (self.jobs, self.is_closed) = (None, true);
        match self.thread.take().map(JoinHandle::join) {
            None => Ok(()),
            Some(Ok(result)) => result,
            Some(Err(panic)) => std::panic::resume_unwind(panic),
        }
    }

    /// Writes the waiting frames, and then the record of the end if possible.
    pub(super) fn finish(mut self, status: ExitStatus, facts: StopFacts) -> Result<(), SequenceError> {
        let ended = self.end();
        // The thread has given up its share.
        let writer = Arc::into_inner(self.writer).map(|writer| writer.into_inner());
        let writer = writer.map(|writer| writer.unwrap_or_else(PoisonError::into_inner));
        let finished = writer.map_or(Ok(()), |writer| writer.finish(status, facts));
        ended.and(finished)
    }
}

fn done(writer: &Mutex<SequenceWriter>, job: Job) -> Result<(), SequenceError> {
    let mut writer = writer.lock().unwrap_or_else(PoisonError::into_inner);
    match job {
        Job::Frame { kind, index, frame, facts } => writer.put(kind, index, &frame, *facts),
        Job::Note(event) => writer.note(&event),
        Job::Flush(reply) => {
            // The receiver may have given up waiting.
            let _ = reply.send(());
            Ok(())
        }
    }
}

#[cfg(test)]
mod tests {
    use std::io;
    use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
    use std::time::Duration;

    use super::*;
    use epirig_core::frame::Samples;
    use epirig_data::sequence::{Origin, SequenceRecord};
    use epirig_data::storage::{Disk, DiskStep, RealDisk};

    /// A disk that writes no frame until it is released.
    struct Stuck(Arc<AtomicBool>);

    impl Stuck {
        fn wait(&self) {
            while !self.0.load(Ordering::SeqCst) {
                std::thread::sleep(Duration::from_millis(1));
            }
        }
    }

    impl Disk for Stuck {
        fn act(&mut self, step: DiskStep<'_>) -> io::Result<()> {
            if let DiskStep::Write(path, _) = step
                && path.extension().is_some_and(|extension| extension == "part")
                && path.to_string_lossy().contains("png")
            {
                self.wait();
            }
            RealDisk.act(step)
        }
    }

    #[test]
    fn a_disk_that_hangs_holds_the_scan_and_no_more_than_the_frames_that_may_wait() {
        const FRAMES: usize = 12;
        let folder = tempfile::tempdir().unwrap();
        let origin = Origin::Imported {
            folder: String::new(),
            conversions: Vec::new(),
            findings: Vec::new(),
            calibration_folders: Default::default(),
            rig: None,
        };
        let record = SequenceRecord::new(origin, (1, 2), 8, FRAMES);
        let open = Arc::new(AtomicBool::new(false));
        let disk = Box::new(Stuck(Arc::clone(&open)));
        let writer = SequenceWriter::create_on(disk, &folder.path().join("seq"), &record).unwrap();
        let sent = Arc::new(AtomicUsize::new(0));
        let counter = Arc::clone(&sent);
        let scan = std::thread::spawn(move || {
            let mut archive = Archive::new(writer);
            for index in 0..FRAMES {
                let frame = Frame::new(1, 2, 8, Samples::U8(vec![1, 2])).unwrap();
                archive.frame(FrameKind::Scan, index, frame, FrameFacts::default()).unwrap();
                counter.fetch_add(1, Ordering::SeqCst);
            }
            archive.finish(ExitStatus::Complete, StopFacts::default()).unwrap();
        });
        std::thread::sleep(Duration::from_millis(200));
        // One in the writer, and the waiting ones.
        assert!(sent.load(Ordering::SeqCst) <= WAITING + 1);
        open.store(true, Ordering::SeqCst);
        scan.join().unwrap();
        assert_eq!(sent.load(Ordering::SeqCst), FRAMES);
    }
}
