//! The user's wish to end: Ctrl-C.

use std::{
    process,
    sync::{
        Once,
        atomic::{AtomicBool, Ordering},
    },
};

/// Exit code of a program that the user interrupts, 128 + SIGINT.
pub const INTERRUPTED: u8 = 130;

/// Is set by the first Ctrl-C from now on; the next one ends the program at once.
///
/// Where the system does not let us listen, Ctrl-C ends the program as it does any other.
pub fn flag() -> &'static AtomicBool {
    static FLAG: AtomicBool = AtomicBool::new(false);
    static LISTENING: Once = Once::new();
    LISTENING.call_once(|| {
        let _ = ctrlc::set_handler(|| {
            if FLAG.swap(true, Ordering::Relaxed) {
                process::exit(INTERRUPTED.into());
            }
        });
    });
    &FLAG
}
