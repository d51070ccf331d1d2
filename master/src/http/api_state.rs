//! What every request of the page is answered from.

use std::sync::Arc;

use tokio::sync::mpsc;

use super::{board::Board, guard::Guard};
use crate::notice::Notice;

/// What every request needs of the daemon.
#[derive(Clone)]
pub struct ApiState {
    /// To the scheduler.
    pub notices: mpsc::Sender<Notice>,
    /// What runs show.
    pub board: Arc<Board>,
    /// The line to paste on a new worker.
    pub join: String,
    /// Whether results are shown and nothing is run.
    pub only_shows: bool,
    /// Who may ask.
    pub guard: Guard,
}
