//! What happens, told to all open windows.

use std::convert::Infallible;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use axum::response::sse::{Event, KeepAlive, Sse};
use futures_util::stream::{Stream, unfold};
use tokio::sync::{broadcast, watch};
use vice_core::error::DataResult;
use vice_core::time::Stamp;

use super::wire::ChangeWire;
use crate::jobs::{JobState, Listener};
use crate::store::{Changed, Saver, Store};

/// Events that a window may be behind before it has to start over.
const BACKLOG: usize = 256;

/// Tells windows of changes, and the saver that there is something to save.
pub(super) struct Hub {
    sender: broadcast::Sender<(&'static str, Arc<str>)>,
    saver: Saver,
    frames: Arc<[Stamp]>,
}

impl Hub {
    /// Starts saving, too: windows hear of it when the labels file falls behind the journal.
    pub(super) fn new(
        store: Arc<Mutex<Store>>,
        save_delay: Duration,
        frames: Arc<[Stamp]>,
    ) -> DataResult<Self> {
        let sender = broadcast::channel(BACKLOG).0;
        let of_saver = sender.clone();
        let on_problem = move |problem: Option<&str>| {
            let text = serde_json::json!({ "save_problem": problem }).to_string();
            drop(of_saver.send(("save", text.into())));
        };
        let saver = Saver::start(store, save_delay, Box::new(on_problem))?;
        Ok(Self { sender, saver, frames })
    }

    /// Ends the saving.
    pub(super) fn into_saver(self) -> Saver {
        self.saver
    }

    pub(super) fn tell(&self, name: &'static str, what: &impl serde::Serialize) {
        match serde_json::to_string(what) {
            // No window is open: nobody to tell.
            Ok(text) => drop(self.sender.send((name, text.into()))),
            Err(error) => tracing::warn!("an event cannot be told: {error}"),
        }
    }

    /// The events from now on. A window that is too far behind is cut off: its browser asks anew, and it starts over.
    pub(super) fn events(
        &self,
        closing: watch::Receiver<bool>,
    ) -> Sse<impl Stream<Item = Result<Event, Infallible>> + use<>> {
        let state = Some((self.sender.subscribe(), closing));
        let stream = unfold(state, |state| async {
            let (mut events, mut closing) = state?;
            let event = tokio::select! {
                biased;
                _ = closing.wait_for(|closing| *closing) => None,
                event = events.recv() => Some(event),
            };
            match event {
                None => Some((Ok(Event::default().event("closed").data("{}")), None)),
                Some(Ok((name, text))) => {
                    Some((Ok(Event::default().event(name).data(&*text)), Some((events, closing))))
                }
                Some(Err(_)) => None,
            }
        });
        Sse::new(stream).keep_alive(KeepAlive::default())
    }
}

impl Listener for Hub {
    fn changed(&self, store: &Store, changed: &Changed) {
        self.saver.changed();
        self.tell("change", &ChangeWire::new(store, changed, &self.frames));
    }

    fn job(&self, job: &JobState) {
        self.tell("job", job);
    }
}
