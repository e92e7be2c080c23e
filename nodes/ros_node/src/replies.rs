//! Answers of services, each to whom it is for.
//!
//! A client of ros2-client hands out one answer at a time, to whoever looks: who waits for one throws away those of others
//! (`docs/upstream/ros2-client-replies.md`). So answers are taken here for everybody and filed by their request.

use std::collections::BTreeMap;
use std::fmt::Debug;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use futures::FutureExt;
use ros2_client::{Message, RmwRequestId};
use tokio::sync::oneshot;

/// Pauses between two looks for an answer: ros2-client has no way to wait for more than one. The first is short, for a
/// server on the same machine answers at once; each is twice the last, up to the longest.
const FIRST_LOOK: Duration = Duration::from_millis(1);
const LONGEST_LOOK: Duration = Duration::from_millis(20);

/// Who waits for which answer. Clones share it.
#[derive(Debug)]
pub(crate) struct Replies<Id, R> {
    waiting: Arc<Mutex<BTreeMap<Id, oneshot::Sender<R>>>>,
}

impl<Id, R> Clone for Replies<Id, R> {
    fn clone(&self) -> Self {
        Self {
            waiting: Arc::clone(&self.waiting),
        }
    }
}

impl<Id, R> Default for Replies<Id, R> {
    fn default() -> Self {
        Self {
            waiting: Arc::default(),
        }
    }
}

/// An answer that is waited for; dropped, it is not waited for any more.
#[derive(Debug)]
pub(crate) struct Reply<Id: Ord + Copy, R> {
    id: Id,
    receiver: oneshot::Receiver<R>,
    replies: Replies<Id, R>,
}

impl<Id: Ord + Copy, R> Replies<Id, R> {
    /// Notes the request that `send` sends. Nobody takes answers meanwhile, so that none comes before its place is there.
    fn expect<E>(&self, send: impl FnOnce() -> Result<Id, E>) -> Result<Reply<Id, R>, E> {
        let mut waiting = self.waiting();
        let id = send()?;
        let (sender, receiver) = oneshot::channel();
        waiting.insert(id, sender);
        drop(waiting);
        Ok(Reply {
            id,
            receiver,
            replies: self.clone(),
        })
    }

    /// Hands over everything that `take` has; answers to others are left out.
    fn deliver<E>(&self, mut take: impl FnMut() -> Result<Option<(Id, R)>, E>) -> Result<(), E> {
        let mut waiting = self.waiting();
        while let Some((id, answer)) = take()? {
            if let Some(waiter) = waiting.remove(&id) {
                // Who does not wait any more is taken off the list a moment later.
                waiter.send(answer).ok();
            }
        }
        Ok(())
    }

    /// Whether anybody waits.
    pub(crate) fn is_empty(&self) -> bool {
        self.waiting().is_empty()
    }

    // Every change under the lock is a single insertion or removal, so a panic elsewhere leaves it whole.
    fn waiting(&self) -> MutexGuard<'_, BTreeMap<Id, oneshot::Sender<R>>> {
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl<R: Message + Clone + 'static> Replies<RmwRequestId, R> {
    /// Sends a request without waiting for room.
    ///
    /// # Errors
    /// Why it cannot be sent.
    pub(crate) fn ask<Q: Message + Clone + 'static>(
        &self,
        client: &ros2_client::Client<Q, R>,
        request: Q,
    ) -> Result<Reply<RmwRequestId, R>, String> {
        self.expect(|| match client.async_send_request(request).now_or_never() {
            Some(Ok(id)) => Ok(id),
            Some(Err(error)) => Err(error.to_string()),
            None => Err("the server does not acknowledge".to_owned()),
        })
    }

    /// Takes what has come, for everybody.
    ///
    /// # Errors
    /// An answer that cannot be read; the others can be taken all the same.
    pub(crate) fn take<Q: Message + Clone + 'static>(
        &self,
        client: &ros2_client::Client<Q, R>,
    ) -> Result<(), String> {
        self.deliver(|| client.receive_response())
            .map_err(|error| error.to_string())
    }
}

impl<Id: Ord + Copy, R> Reply<Id, R> {
    /// Waits for the answer; `look` takes what has come, for everybody. Cancelling the future loses nothing.
    pub(crate) async fn wait<E: Debug>(
        &mut self,
        mut look: impl FnMut() -> Result<(), E>,
    ) -> Result<R, E> {
        let mut pause = FIRST_LOOK;
        loop {
            look()?;
            tokio::select! {
                biased;
                answer = &mut self.receiver => match answer {
                    Ok(answer) => return Ok(answer),
                    // Its place goes only with it.
                    Err(_) => std::future::pending().await,
                },
                () = tokio::time::sleep(pause) => pause = (2 * pause).min(LONGEST_LOOK),
            }
        }
    }

    /// The answer, where it has been handed over.
    pub(crate) fn try_wait(&mut self) -> Option<R> {
        self.receiver.try_recv().ok()
    }

    /// Completes when somebody else's look has brought the answer.
    pub(crate) async fn delivered(&mut self) -> R {
        match (&mut self.receiver).await {
            Ok(answer) => answer,
            Err(_) => std::future::pending().await,
        }
    }
}

impl<Id: Ord + Copy, R> Drop for Reply<Id, R> {
    fn drop(&mut self) {
        self.replies.waiting().remove(&self.id);
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use std::cell::RefCell;
    use std::convert::Infallible;

    use super::*;

    type Book = Replies<u32, &'static str>;

    fn ask(book: &Book, id: u32) -> Reply<u32, &'static str> {
        book.expect(|| Ok::<_, Infallible>(id)).unwrap()
    }

    /// Two who wait for answers of one client each get theirs, in whatever order these come, and whoever looks first.
    #[tokio::test]
    async fn each_gets_its_own() {
        let book = Book::default();
        let (mut first, mut second) = (ask(&book, 1), ask(&book, 2));
        let come = RefCell::new(vec![(1, "one"), (9, "of another node"), (2, "two")]);
        let look = || book.deliver(|| Ok::<_, Infallible>(come.borrow_mut().pop()));
        let (a, b) = tokio::join!(first.wait(look), second.wait(look));
        assert_eq!((a.unwrap(), b.unwrap()), ("one", "two"));
        assert!(book.is_empty());
    }

    /// Who does not wait any more leaves nothing behind, and takes nothing from others.
    #[tokio::test]
    async fn who_leaves_is_forgotten() {
        let book = Book::default();
        let (gone, mut here) = (ask(&book, 1), ask(&book, 2));
        drop(gone);
        let mut come = vec![(2, "two"), (1, "one")];
        book.deliver(|| Ok::<_, Infallible>(come.pop())).unwrap();
        assert_eq!(here.try_wait(), Some("two"));
        assert!(book.is_empty());
        assert_eq!(book.expect(|| Err("full")).unwrap_err(), "full");
        assert!(book.is_empty());
    }
}
