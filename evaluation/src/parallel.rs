//! Measurements without times, on all cores at once.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc;
use std::thread;

use anyhow::Result;

use crate::provenance::cores;

/// Workers that need nothing but a thread, one for each core.
pub(crate) fn threads() -> Vec<()> {
    vec![(); cores()]
}

/// Does jobs with one thread for each worker. `work` emits results one by one, and `keep` gets them
/// on the caller's thread in the order in which they are made, which differs from run to run. After
/// a failure no further job begins; what was made until then is kept.
///
/// # Errors
/// The first failure of `keep`, or else of `work`.
pub(crate) fn for_each<W: Send, J: Sync, R: Send>(
    workers: &mut [W],
    jobs: &[J],
    work: impl Fn(&mut W, &J, &mut dyn FnMut(R)) -> Result<()> + Sync,
    mut keep: impl FnMut(R) -> Result<()>,
) -> Result<()> {
    let (next, failed) = (AtomicUsize::new(0), AtomicBool::new(false));
    let (sender, results) = mpsc::channel();
    thread::scope(|scope| {
        let (next, failed, work) = (&next, &failed, &work);
        let threads: Vec<_> = workers
            .iter_mut()
            .map(|worker| {
                let sender = sender.clone();
                scope.spawn(move || {
                    while !failed.load(Ordering::Relaxed)
                        && let Some(job) = jobs.get(next.fetch_add(1, Ordering::Relaxed))
                    {
                        // The receiver goes on until the last sender is gone.
                        let outcome = work(worker, job, &mut |result| {
                            let _ = sender.send(result);
                        });
                        if outcome.is_err() {
                            failed.store(true, Ordering::Relaxed);
                            return outcome;
                        }
                    }
                    Ok(())
                })
            })
            .collect();
        drop(sender);
        let mut kept = Ok(());
        for result in results {
            if kept.is_ok() {
                kept = keep(result);
                failed.fetch_or(kept.is_err(), Ordering::Relaxed);
            }
        }
        let outcomes = threads.into_iter().map(|thread| thread.join().expect("no panic"));
        kept.and(outcomes.collect::<Result<Vec<_>>>().map(|_| ()))
    })
}

/// What some jobs come to, in their order, with one thread for each worker.
///
/// # Errors
/// The first failure; no further job begins after it.
pub(crate) fn map<W: Send, J: Sync, R: Send>(
    workers: &mut [W],
    jobs: &[J],
    work: impl Fn(&mut W, &J) -> Result<R> + Sync,
) -> Result<Vec<R>> {
    let indices: Vec<usize> = (0..jobs.len()).collect();
    let mut all: Vec<Option<R>> = jobs.iter().map(|_| None).collect();
    let work = |worker: &mut W, &index: &usize, emit: &mut dyn FnMut((usize, R))| {
        emit((index, work(worker, &jobs[index])?));
        Ok(())
    };
    for_each(workers, &indices, work, |(index, result)| {
        all[index] = Some(result);
        Ok(())
    })?;
    Ok(all.into_iter().flatten().collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_job_is_done_once_by_some_worker() {
        let mut counts = [0; 3];
        let jobs: Vec<u32> = (0..50).collect();
        let mut kept = Vec::new();
        let outcome = for_each(
            &mut counts,
            &jobs,
            |count, &job, emit| {
                *count += 1;
                emit(2 * job);
                emit(2 * job + 1);
                Ok(())
            },
            |result| {
                kept.push(result);
                Ok(())
            },
        );
        assert!(outcome.is_ok());
        kept.sort_unstable();
        assert_eq!(kept, (0..100).collect::<Vec<_>>());
        assert_eq!(counts.iter().sum::<u32>(), 50);
    }

    #[test]
    fn results_have_the_order_of_their_jobs() {
        let jobs: Vec<u32> = (0..50).collect();
        let doubled = map(&mut [(), ()], &jobs, |(), job| Ok(2 * job)).expect("nothing fails");
        assert_eq!(doubled, (0..50).map(|job| 2 * job).collect::<Vec<_>>());
        let failed = map(&mut [(), ()], &jobs, |(), job| {
            anyhow::ensure!(*job != 7, "job {job}");
            Ok(())
        });
        assert_eq!(failed.expect_err("the eighth fails").to_string(), "job 7");
    }

    #[test]
    fn a_failure_ends_the_work_and_what_was_made_before_is_kept() {
        let jobs: Vec<u32> = (0..1000).collect();
        let mut kept = Vec::new();
        let outcome = for_each(
            &mut [()],
            &jobs,
            |(), &job, emit| {
                anyhow::ensure!(job < 7, "job {job}");
                emit(job);
                Ok(())
            },
            |result| {
                kept.push(result);
                Ok(())
            },
        );
        assert_eq!(outcome.expect_err("the eighth fails").to_string(), "job 7");
        assert_eq!(kept, [0, 1, 2, 3, 4, 5, 6]);
        let refused = for_each(
            &mut [(), ()],
            &jobs,
            |(), &job, emit| {
                emit(job);
                Ok(())
            },
            |_: u32| anyhow::bail!("a full disk"),
        );
        assert_eq!(refused.expect_err("nothing is kept").to_string(), "a full disk");
    }
}
