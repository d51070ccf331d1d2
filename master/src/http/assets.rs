//! ASSETS: the page's files, which are part of the binary.

use axum::{Router, http::header, routing::get};

use super::api_state::ApiState;

/// Path, type and text of every file.
const FILES: [(&str, &str, &str); 9] = [
    ("/", "text/html; charset=utf-8", include_str!("../../page/index.html")),
    ("/style.css", "text/css; charset=utf-8", include_str!("../../page/style.css")),
    ("/main.js", JS, include_str!("../../page/main.js")),
    ("/files.js", JS, include_str!("../../page/files.js")),
    ("/lists.js", JS, include_str!("../../page/lists.js")),
    ("/curves.js", JS, include_str!("../../page/curves.js")),
    ("/timeline.js", JS, include_str!("../../page/timeline.js")),
    ("/bodies.js", JS, include_str!("../../page/bodies.js")),
    ("/icon.svg", "image/svg+xml", include_str!("../../page/icon.svg")),
];
const JS: &str = "text/javascript; charset=utf-8";

/// The page itself.
pub async fn page() -> impl axum::response::IntoResponse {
    let (_, kind, text) = FILES[0];
    ([(header::CONTENT_TYPE, kind)], text)
}

pub fn routes() -> Router<ApiState> {
    FILES.iter().fold(Router::new(), |router, &(path, kind, text)| {
        router.route(path, get(move || async move { ([(header::CONTENT_TYPE, kind)], text) }))
    })
}
