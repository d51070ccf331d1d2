//! ASSETS: the page's files, which are part of the binary.

use axum::{Router, http::header, routing::get};

use super::api_state::ApiState;

/// Where the page stands as seen from itself: `` at its root, `../` at the address of a job.
const ROOT: &str = "{root}";
const PAGE: &str = include_str!("../../page/index.html");
const JS: &str = "text/javascript; charset=utf-8";

/// Path, type and text of every other file.
const FILES: [(&str, &str, &str); 19] = [
    ("/style.css", "text/css; charset=utf-8", include_str!("../../page/style.css")),
    ("/main.js", JS, include_str!("../../page/main.js")),
    ("/ask.js", JS, include_str!("../../page/ask.js")),
    ("/files.js", JS, include_str!("../../page/files.js")),
    ("/deck.js", JS, include_str!("../../page/deck.js")),
    ("/lists.js", JS, include_str!("../../page/lists.js")),
    ("/facts.js", JS, include_str!("../../page/facts.js")),
    ("/curves.js", JS, include_str!("../../page/curves.js")),
    ("/energies.js", JS, include_str!("../../page/energies.js")),
    ("/history.js", JS, include_str!("../../page/history.js")),
    ("/timeline.js", JS, include_str!("../../page/timeline.js")),
    ("/colours.js", JS, include_str!("../../page/colours.js")),
    ("/camera.js", JS, include_str!("../../page/camera.js")),
    ("/bodies.js", JS, include_str!("../../page/bodies.js")),
    ("/view.js", JS, include_str!("../../page/view.js")),
    ("/outcome.js", JS, include_str!("../../page/outcome.js")),
    ("/again.js", JS, include_str!("../../page/again.js")),
    ("/recompute.mjs", JS, include_str!("../../page/recompute.mjs")),
    ("/icon.svg", "image/svg+xml", include_str!("../../page/icon.svg")),
];

/// The module that computes a block again, see the crate `recompute`; a build can be without it.
#[cfg(has_recompute)]
const MODULE: Option<&[u8]> = Some(include_bytes!(env!("BOLIDE_RECOMPUTE")));
#[cfg(not(has_recompute))]
const MODULE: Option<&[u8]> = None;

/// The page itself.
pub async fn page() -> impl axum::response::IntoResponse {
    ([(header::CONTENT_TYPE, "text/html; charset=utf-8")], PAGE.replace(ROOT, ""))
}

/// The page at the address of a job.
pub async fn page_of_a_job() -> impl axum::response::IntoResponse {
    ([(header::CONTENT_TYPE, "text/html; charset=utf-8")], PAGE.replace(ROOT, "../"))
}

pub fn routes() -> Router<ApiState> {
    let files = FILES.iter().fold(Router::new().route("/", get(page)), |router, &(path, kind, text)| {
        router.route(path, get(move || async move { ([(header::CONTENT_TYPE, kind)], text) }))
    });
    match MODULE {
        Some(module) => files.route(
            "/recompute.wasm",
            get(move || async move { ([(header::CONTENT_TYPE, "application/wasm")], module) }),
        ),
        None => files,
    }
}

/// Whether the page offers to compute a block again.
pub const fn recomputes() -> bool {
    MODULE.is_some()
}
