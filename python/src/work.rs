//! Long work beside the interpreter: its lock is let go, Ctrl-C is heard, and progress is told.

use crate::error::{Error, exception};
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// How often signals are looked at and progress is told: below what a hand notices.
const BEAT: Duration = Duration::from_millis(50);
/// Stack of a worker, bytes: what the command's main thread has.
const STACK: usize = 8 << 20;

/// How far the work is, and whether it is still wanted.
#[derive(Default)]
pub struct Watch {
    stage: Mutex<(String, f64)>,
    unwanted: AtomicBool,
}

/// What unwinds work that is no longer wanted.
struct Unwanted;

impl Watch {
    /// Notes a stage with the part of the work that is done when it begins, 0 to 1; ends work that is not wanted any more.
    pub fn stage(&self, stage: &str, part: f64) {
        if self.unwanted.load(Ordering::Relaxed) {
            // Not a panic: no message, and nothing above but `work` sees it.
            resume_unwind(Box::new(Unwanted));
        }
        *self.stage.lock().unwrap_or_else(PoisonError::into_inner) = (stage.to_owned(), part);
    }
}

/// Does `job` on a thread of the pool and waits for it without the interpreter's lock. After Ctrl-C, or an exception in
/// `told(stage, part)`, it returns at once, and the job ends where it next notes a stage.
///
/// # Errors
/// The job's, as an exception; what Ctrl-C and `told` raise.
pub fn work<T: Send + 'static>(
    py: Python<'_>,
    told: Option<&Bound<'_, PyAny>>,
    job: impl FnOnce(&Watch) -> anyhow::Result<T> + Send + 'static,
) -> PyResult<T> {
    let watch = Arc::new(Watch::default());
    let (send, mut receive) = channel();
    let watched = Arc::clone(&watch);
    pool()?.spawn(move || {
        // Nobody listens after Ctrl-C.
        let _ = send.send(catch_unwind(AssertUnwindSafe(|| job(&watched))));
    });
    let mut last = String::new();
    loop {
        let receive = &mut receive;
        match py.detach(move || receive.recv_timeout(BEAT)) {
            Ok(Ok(result)) => return result.map_err(exception),
            Ok(Err(panic)) => resume_unwind(panic),
            Err(RecvTimeoutError::Disconnected) => return Err(Error::new_err("the work ended without a result")),
            Err(RecvTimeoutError::Timeout) => {}
        }
        let (stage, part) = watch.stage.lock().unwrap_or_else(PoisonError::into_inner).clone();
        let heard = py.check_signals().and_then(|()| match told {
            Some(told) if stage != last => told.call1((&stage, part)).map(|_| ()),
            _ => Ok(()),
        });
        if let Err(error) = heard {
            watch.unwanted.store(true, Ordering::Relaxed);
            return Err(error);
        }
        last = stage;
    }
}

/// The pool of this process. A child made by `fork` has none of its parent's threads and needs its own.
///
/// # Errors
/// Threads that cannot be started.
pub fn pool() -> PyResult<Arc<ThreadPool>> {
    static POOL: Mutex<Option<(u32, Arc<ThreadPool>)>> = Mutex::new(None);
    let mut held = POOL.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some((_, pool)) = held.as_ref().filter(|(process, _)| *process == std::process::id()) {
        return Ok(Arc::clone(pool));
    }
    let made = ThreadPoolBuilder::new().stack_size(STACK).build();
    let pool = Arc::new(made.map_err(|error| Error::new_err(format!("no threads can be started: {error}")))?);
    if let Some(parents) = held.replace((std::process::id(), Arc::clone(&pool))) {
        // Its threads do not exist here: nothing of it must be waited for.
        std::mem::forget(parents);
    }
    Ok(pool)
}
