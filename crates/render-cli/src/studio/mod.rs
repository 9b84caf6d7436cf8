//! `selvedge studio`: a local page that shows a cloth and draws it anew while its yarns are changed.
//!
//! ```text
//! page ──fabric, view──▶ api ──▶ Document ──▶ Session ──▶ painter ──▶ frames ──▶ page
//! ```
//!
//! The page owns what is shown and sends all of it; here it is checked, drawn as [`command::render`] and
//! [`command::swatch`] draw it, and forgotten when the next comes. There is no shading and no parsing
//! of its own.
//!
//! Nothing is answered but by a request that carries the token of this run and names this address as its
//! host; else it is 403. No path that comes from a client is ever opened.
//!
//! [`command::render`]: crate::command::render
//! [`command::swatch`]: crate::command::swatch

mod api;
mod cloth;
mod document;
mod draft;
mod guard;
mod look;
mod page;
mod painter;
mod parameters;
mod reply;
mod server;
mod session;
mod thumbnails;
mod view;

use std::{
    net::{IpAddr, SocketAddr, TcpListener},
    path::Path,
    sync::{Arc, atomic::AtomicBool},
    thread,
    time::Duration,
};

use anyhow::Context;

pub use self::view::{Kind, View};
use self::{guard::Guard, painter::Painter, session::Session};
use crate::fabric;

/// How the studio is served.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    /// The address to listen on.
    pub host: IpAddr,
    /// The port; 0 for a free one.
    pub port: u16,
    /// Threads to draw with, if not one per processor.
    pub threads: Option<u16>,
    /// Time without requests after which it ends.
    pub idle_exit: Option<Duration>,
}

/// A studio that listens.
#[derive(Debug)]
pub struct Studio {
    listener: TcpListener,
    address: SocketAddr,
    guard: Guard,
    session: Arc<Session>,
    options: Options,
}

impl Studio {
    /// The studio that shows the draft, fabric or preset `input`.
    ///
    /// # Errors
    ///
    /// When there is no such cloth, the address cannot be listened on, or the system has no random
    /// numbers.
    pub fn new(input: &Path, options: Options) -> anyhow::Result<Self> {
        let session = Session::new(fabric::read(input)?, input)?;
        let wanted = SocketAddr::new(options.host, options.port);
        let listener = TcpListener::bind(wanted).with_context(|| wanted.to_string())?;
        let address = listener.local_addr().with_context(|| wanted.to_string())?;
        let guard = Guard::new(address)?;
        Ok(Self { listener, address, guard, session: Arc::new(session), options })
    }

    /// The address of the page, with the token.
    pub fn url(&self) -> String {
        format!("http://{}/?token={}", self.address, self.guard.token())
    }

    /// Draws and answers until `stop` is set, or nobody has asked for as long as the options say.
    ///
    /// # Errors
    ///
    /// When the system gives no threads, or no means to listen.
    pub fn run(self, stop: &AtomicBool) -> anyhow::Result<()> {
        let Self { listener, guard, session, options, .. } = self;
        let painter = Painter::new(Arc::clone(&session), options.threads)?;
        thread::scope(|scope| {
            let painter = thread::Builder::new()
                .name("painter".to_owned())
                .spawn_scoped(scope, || painter.run())
                .context("threads: cannot be started")?;
            let served =
                server::serve(listener, guard, Arc::clone(&session), options.idle_exit, stop);
            session.close();
            if painter.join().is_err() {
                anyhow::bail!("the painter stopped before its time");
            }
            served
        })
    }
}
