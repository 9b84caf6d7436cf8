//! `selvedge studio`: the artist's panel, in a browser.

use crate::{
    args::StudioOptions,
    interrupt,
    output::{Sink, tell},
    studio::{Options, Studio},
};

/// Serves the page until Ctrl-C.
///
/// # Errors
///
/// When there is no such cloth, or the port is taken.
pub fn run(options: &StudioOptions) -> anyhow::Result<()> {
    let &StudioOptions { ref input, port, host, no_open, idle_exit, threads } = options;
    // Ctrl-C is for the loop to see, from before anything is begun.
    let stop = interrupt::flag();
    let studio = Studio::new(input, Options { host, port, threads, idle_exit })?;
    let url = studio.url();
    Sink::new(None)?.write(|out| writeln!(out, "{url}"))?;
    if !host.is_loopback() {
        tell(format_args!("warning: --host {host}: other machines can use it, unencrypted"));
    }
    if !no_open && let Err(error) = open::that_detached(&url) {
        tell(format_args!("warning: no browser could be opened: {error}"));
    }
    studio.run(stop)
}
