//! Who is connected: so many at most, none for ever without asking anything.
//!
//! Any program on this machine can connect, also one that may not ask. Such connections end after a while, and when there
//! are too many the oldest of them makes room, never one that has shown the cookie.

use std::convert::Infallible;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use axum::Router;
use axum::extract::Request;
use hyper::body::Incoming;
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{Notify, watch};

use super::guard::Known;

/// Connections at a time: far fewer than the files that a process may open, so that the labels can always be written.
const MAX_CONNECTIONS: usize = 128;
/// How long the head of a request may take, and how long a connection may be idle between two.
const HEAD_TIMEOUT: Duration = Duration::from_secs(15);
/// How long to wait where the system has no more connections to give.
const RETRY: Duration = Duration::from_millis(50);

/// One that is open.
struct Open {
    number: u64,
    known: Known,
    leave: Arc<Notify>,
}

/// Those that are open, oldest first.
#[derive(Clone, Default)]
struct Table {
    open: Arc<Mutex<Vec<Open>>>,
    left: Arc<Notify>,
}

impl Table {
    /// A place for one more; makes room by sending away the oldest that nobody knows.
    async fn enter(&self, number: u64, known: &Known) -> Arc<Notify> {
        loop {
            let left = self.left.notified();
            {
                let mut open = self.open.lock().unwrap_or_else(PoisonError::into_inner);
                if open.len() >= MAX_CONNECTIONS
                    && let Some(at) = open.iter().position(|o| !o.known.is_set())
                {
                    open.remove(at).leave.notify_one();
                }
                if open.len() < MAX_CONNECTIONS {
                    let leave = Arc::new(Notify::new());
                    open.push(Open { number, known: known.clone(), leave: Arc::clone(&leave) });
                    return leave;
                }
            }
            left.await;
        }
    }

    fn leave(&self, number: u64) {
        self.open.lock().unwrap_or_else(PoisonError::into_inner).retain(|o| o.number != number);
        self.left.notify_waiters();
    }

    fn is_empty(&self) -> bool {
        self.open.lock().unwrap_or_else(PoisonError::into_inner).is_empty()
    }
}

/// Serves until it is closing and the last request is answered.
pub(super) async fn serve(listener: TcpListener, router: Router, closing: watch::Receiver<bool>) {
    let table = Table::default();
    let mut closed = closing.clone();
    let mut number = 0;
    loop {
        let stream = tokio::select! {
            biased;
            _ = closed.wait_for(|closing| *closing) => break,
            accepted = listener.accept() => match accepted {
                Ok((stream, _)) => stream,
                // One that went away again, or no more files: the others go on.
                Err(_) => {
                    tokio::time::sleep(RETRY).await;
                    continue;
                }
            },
        };
        let known = Known::default();
        let leave = tokio::select! {
            biased;
            _ = closed.wait_for(|closing| *closing) => break,
            leave = table.enter(number, &known) => leave,
        };
        tokio::spawn(one(stream, router.clone(), (known, leave), (table.clone(), number), closing.clone()));
        number += 1;
    }
    drop(listener);
    while !table.is_empty() {
        let left = table.left.notified();
        if !table.is_empty() {
            left.await;
        }
    }
}

async fn one(
    stream: TcpStream,
    router: Router,
    (known, leave): (Known, Arc<Notify>),
    (table, number): (Table, u64),
    mut closing: watch::Receiver<bool>,
) {
    // Answers are small and asked for one by one: none waits for the next.
    let _ = stream.set_nodelay(true);
    let service = hyper::service::service_fn(move |mut request: hyper::Request<Incoming>| {
        request.extensions_mut().insert(known.clone());
        let answer =
            tower_service::Service::<Request>::call(&mut router.clone(), request.map(axum::body::Body::new));
        async move { Ok::<_, Infallible>(answer.await.unwrap_or_else(|never| match never {})) }
    });
    let connection = http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(HEAD_TIMEOUT)
        .serve_connection(TokioIo::new(stream), service);
    tokio::pin!(connection);
    let closed = async {
        let _ = closing.wait_for(|closing| *closing).await;
    };
    tokio::select! {
        // How a client went is its own affair.
        _ = connection.as_mut() => {}
        () = leave.notified() => {}
        () = closed => {
            connection.as_mut().graceful_shutdown();
            let _ = connection.as_mut().await;
        }
    }
    table.leave(number);
}
