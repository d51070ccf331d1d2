//! Requests to end, such as Ctrl-C, as a flag.

use std::sync::{
    Arc,
    atomic::{AtomicBool, Ordering},
};

use system::interrupts::Interrupts;

use crate::shell::tell;

/// A flag that Ctrl-C, or another request to end, sets, saying `what` happens now; a second one ends the process at once.
pub fn stop_on_interrupt(what: &'static str) -> Arc<AtomicBool> {
    let stop = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&stop);
    let (heeded, heeding) = std::sync::mpsc::channel();
    let spawned = std::thread::Builder::new().name("signals".to_owned()).spawn(move || {
        let Ok(runtime) = tokio::runtime::Builder::new_current_thread().enable_all().build() else {
            return;
        };
        runtime.block_on(async {
            let Ok(mut interrupts) = Interrupts::listen() else { return };
            // The caller waits for this.
            let _ = heeded.send(());
            loop {
                interrupts.next().await;
                if flag.swap(true, Ordering::Relaxed) {
                    std::process::exit(130);
                }
                tell(&format!("{what}; once more to leave at once"));
            }
        });
    });
    if spawned.is_ok() {
        // Without the thread Ctrl-C ends the process as usual.
        let _ = heeding.recv();
    }
    stop
}
