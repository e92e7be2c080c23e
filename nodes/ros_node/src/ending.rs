//! The end of a node's activity as a protocol: who has something to put in order does it before the gate closes.
//!
//! A main function asks for its [`Endings`] once and waits for the next one beside its inputs. Each [`Ending`] says what
//! comes: a deactivation, a cleanup, or the end of the node. Until [`Ending::done`] everything still works: publishers,
//! clients and inputs. So a table is stopped while its motions can still be heard, and a goal ends with a true result.

use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use tokio::sync::{mpsc, oneshot};

/// Endings that wait for a main function which is slow to look; there is never more than one under way.
const WAITING: usize = 4;

/// What the node is about to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Purpose {
    /// It becomes inactive, and may become active again.
    Deactivate,
    /// Its main function is dropped, and may be called again.
    CleanUp,
    /// It ends: by a signal, by a manager or by itself.
    ShutDown,
}

impl Purpose {
    /// For a sentence that begins with "the node".
    pub fn verb(self) -> &'static str {
        match self {
            Self::Deactivate => "is deactivated",
            Self::CleanUp => "is cleaned up",
            Self::ShutDown => "ends",
        }
    }
}

/// An ending under way. Dropped without a word it counts as failed.
#[derive(Debug)]
pub struct Ending {
    purpose: Purpose,
    answer: Option<oneshot::Sender<Result<(), String>>>,
}

impl Ending {
    /// What comes next.
    pub fn purpose(&self) -> Purpose {
        self.purpose
    }

    /// Everything is in order; the node may go on.
    pub fn done(mut self) {
        self.reply(Ok(()));
    }

    /// It cannot be put in order. A deactivation fails by it and the node stays active; any other end goes on, with this as
    /// an error and in the exit status.
    pub fn failed(mut self, reason: impl Into<String>) {
        self.reply(Err(reason.into()));
    }

    fn reply(&mut self, outcome: Result<(), String>) {
        if let Some(answer) = self.answer.take() {
            // Whose patience has ended does not listen any more.
            answer.send(outcome).ok();
        }
    }
}

impl Drop for Ending {
    fn drop(&mut self) {
        self.reply(Err("what was to be done before was given up".to_owned()));
    }
}

/// Where a main function hears of endings.
#[derive(Debug)]
pub struct Endings {
    receiver: mpsc::Receiver<Ending>,
}

impl Endings {
    /// The next ending. Cancelling the future loses nothing.
    pub async fn next(&mut self) -> Ending {
        match self.receiver.recv().await {
            Some(ending) => ending,
            // The node has let go of this main function.
            None => std::future::pending().await,
        }
    }

    /// An ending that is under way already.
    pub fn try_next(&mut self) -> Option<Ending> {
        self.receiver.try_recv().ok()
    }
}

/// Everybody who has asked for endings.
#[derive(Debug, Default)]
pub(crate) struct Parties {
    parties: Mutex<Vec<Party>>,
}

#[derive(Clone, Debug)]
struct Party {
    limit: Duration,
    sender: mpsc::Sender<Ending>,
}

/// Somebody who is putting things in order.
#[derive(Debug)]
pub(crate) struct Waiting {
    pub(crate) limit: Duration,
    pub(crate) answer: oneshot::Receiver<Result<(), String>>,
}

impl Parties {
    pub(crate) fn join(&self, limit: Duration) -> Endings {
        let (sender, receiver) = mpsc::channel(WAITING);
        self.lock().push(Party { limit, sender });
        Endings { receiver }
    }

    /// Tells everybody, and says whose answers are to be waited for.
    pub(crate) fn tell(&self, purpose: Purpose) -> Vec<Waiting> {
        let mut parties = self.lock();
        parties.retain(|party| !party.sender.is_closed());
        let told = parties.iter().map(|party| {
            let (answer, waiting) = oneshot::channel();
            let ending = Ending {
                purpose,
                answer: Some(answer),
            };
            let limit = party.limit;
            // Where it is full, the main function has not looked at the last ones: this one is dropped, and so failed.
            drop(party.sender.try_send(ending));
            Waiting {
                limit,
                answer: waiting,
            }
        });
        told.collect()
    }

    pub(crate) fn forget(&self) {
        self.lock().clear();
    }

    // Every change under the lock is a single step, so a panic elsewhere leaves the list whole.
    fn lock(&self) -> std::sync::MutexGuard<'_, Vec<Party>> {
        self.parties.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Waits until everybody has answered or has had its time; says what was not put in order.
pub(crate) async fn settled(waiting: Vec<Waiting>) -> Result<(), String> {
    let begun = tokio::time::Instant::now();
    let mut failures = Vec::new();
    for Waiting { limit, answer } in waiting {
        match tokio::time::timeout_at(begun + limit, answer).await {
            Ok(Ok(Ok(()))) => {}
            Ok(Ok(Err(reason))) => failures.push(reason),
            Ok(Err(_)) => failures.push("the main function has gone".to_owned()),
            Err(_) => failures.push(format!(
                "not everything was put in order within {:.1} s",
                limit.as_secs_f64()
            )),
        }
    }
    if failures.is_empty() {
        Ok(())
    } else {
        Err(failures.join("; "))
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    const LIMIT: Duration = Duration::from_secs(5);

    /// Everybody is told, and the end waits for the last one.
    #[tokio::test]
    async fn everybody_is_waited_for() {
        let parties = Parties::default();
        let (mut first, mut second) = (parties.join(LIMIT), parties.join(LIMIT));
        let end = tokio::spawn(settled(parties.tell(Purpose::Deactivate)));
        assert_eq!(first.next().await.purpose(), Purpose::Deactivate);
        // That one was dropped; the second does as it should.
        second.next().await.done();
        assert_eq!(
            end.await.unwrap(),
            Err("what was to be done before was given up".to_owned())
        );
        let end = tokio::spawn(settled(parties.tell(Purpose::CleanUp)));
        first.next().await.done();
        tokio::task::yield_now().await;
        assert!(!end.is_finished());
        second.next().await.done();
        assert_eq!(end.await.unwrap(), Ok(()));
    }

    /// What cannot be put in order says why; who has gone is not waited for.
    #[tokio::test]
    async fn failures_are_told() {
        let parties = Parties::default();
        let mut one = parties.join(LIMIT);
        drop(parties.join(LIMIT));
        let waiting = parties.tell(Purpose::ShutDown);
        assert_eq!(waiting.len(), 1);
        one.try_next().unwrap().failed("the table turns");
        assert_eq!(settled(waiting).await, Err("the table turns".to_owned()));
    }

    /// Who never answers is waited for as long as it has asked for, and no longer.
    #[tokio::test]
    async fn patience_has_an_end() {
        let parties = Parties::default();
        let _silent = parties.join(Duration::from_millis(100));
        let outcome = settled(parties.tell(Purpose::ShutDown)).await;
        assert!(outcome.unwrap_err().contains("within 0.1 s"));
    }
}
