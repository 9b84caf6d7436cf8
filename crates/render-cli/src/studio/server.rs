//! Connections: who may have one, and for how long.

use std::{
    convert::Infallible,
    net::TcpListener,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    time::Duration,
};

use anyhow::Context;
use hyper::{server::conn::http1, service::service_fn};
use hyper_util::rt::{TokioIo, TokioTimer};
use tokio::{runtime::Builder, sync::Semaphore, time};

use super::{
    api::{self, App},
    guard::Guard,
    session::Session,
};

/// Connections at a time; a browser has six.
const MAX_CONNECTIONS: usize = 64;

/// Time in which a request must have said what it wants, also the first of a connection and the next
/// after another.
const HEADER_TIME: Duration = Duration::from_secs(15);

/// Bytes and number of the lines in which it says so.
const HEADER_BYTES: usize = 16 * 1024;
const HEADERS: usize = 64;

/// How often it is looked whether to go on.
const TICK: Duration = Duration::from_millis(100);

/// Time that requests under way are given when it ends.
const GRACE: Duration = Duration::from_millis(500);

/// Answers those who come to `listener` until `stop` is set, or nobody has come for `idle_exit`.
///
/// # Errors
///
/// When the system does not let us wait for them.
pub(super) fn serve(
    listener: TcpListener,
    guard: Guard,
    session: Arc<Session>,
    idle_exit: Option<Duration>,
    stop: &AtomicBool,
) -> anyhow::Result<()> {
    let runtime = Builder::new_current_thread()
        .enable_all()
        .max_blocking_threads(4)
        .build()
        .context("threads: cannot be started")?;
    let app = Arc::new(App::new(guard, session));
    let served = runtime.block_on(accept(listener, &app, idle_exit, stop));
    runtime.shutdown_timeout(GRACE);
    served
}

async fn accept(
    listener: TcpListener,
    app: &Arc<App>,
    idle_exit: Option<Duration>,
    stop: &AtomicBool,
) -> anyhow::Result<()> {
    listener.set_nonblocking(true).context("port: cannot be listened on")?;
    let listener =
        tokio::net::TcpListener::from_std(listener).context("port: cannot be listened on")?;
    let places = Arc::new(Semaphore::new(MAX_CONNECTIONS));
    while !stop.load(Ordering::Relaxed) && idle_exit.is_none_or(|time| app.idle() < time) {
        let next = async {
            let place = Arc::clone(&places).acquire_owned().await;
            (place, listener.accept().await)
        };
        let Ok((place, accepted)) = time::timeout(TICK, next).await else { continue };
        let Ok((stream, _)) = accepted else {
            // Too many files are open, or who came has gone: the next may fare better.
            time::sleep(TICK).await;
            continue;
        };
        let app = Arc::clone(app);
        tokio::spawn(async move {
            let _place = place;
            let answer = service_fn(|request| {
                let app = Arc::clone(&app);
                async move { Ok::<_, Infallible>(api::answer(&app, request).await) }
            });
            // A connection that breaks off concerns nobody else.
            let _ = http1::Builder::new()
                .timer(TokioTimer::new())
                .header_read_timeout(HEADER_TIME)
                .max_buf_size(HEADER_BYTES)
                .max_headers(HEADERS)
                .serve_connection(TokioIo::new(stream), answer)
                .await;
        });
    }
    Ok(())
}
