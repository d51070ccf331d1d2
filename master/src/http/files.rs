//! FILES: the results of a job as files, one by one or all in an archive, and columns of its history.

use std::{
    fs::File,
    io::{self, Read},
    path::{Path as FilePath, PathBuf},
};

use axum::{
    Json,
    body::{Body, Bytes},
    extract::{Path, Query, State},
    http::{HeaderValue, StatusCode, header},
    response::{IntoResponse, Response},
};
use protocol::request::check_file_name;
use serde::Deserialize;
use serde_json::json;
use tokio::sync::mpsc;
use tokio_stream::wrappers::ReceiverStream;

use super::{
    api::{Fault, folder_of, missing},
    api_state::ApiState,
    board::{POINTS_LIMIT, thinned},
    tar,
};
use crate::{
    client_requests,
    results::{HISTORY, REPORT, history::Table},
};

/// Bytes that are read at a time, and pieces that may wait for a slow caller.
const PIECE: usize = 256 << 10;
const WAITING: usize = 4;
/// Columns that are given at a time.
const MOST_COLUMNS: usize = 64;
/// What the report may load: the style and the pictures in it.
const REPORT_POLICY: &str =
    "default-src 'none'; style-src 'unsafe-inline'; img-src data:; frame-ancestors 'none'";

/// Does what waits for the disk; an error is told as 404.
///
/// # Errors
/// The error, or that the work had a bug.
pub async fn blocking<T: Send + 'static>(
    work: impl FnOnce() -> Result<T, String> + Send + 'static,
) -> Result<T, Fault> {
    match tokio::task::spawn_blocking(work).await {
        Ok(result) => result.map_err(missing),
        Err(_) => {
            let why = "a bug here; the log has the words";
            Err(Fault(StatusCode::INTERNAL_SERVER_ERROR, json!({ "error": why })))
        }
    }
}

/// `GET /api/jobs/N/files`.
pub async fn list(
    State(api_state): State<ApiState>,
    Path(job): Path<u32>,
) -> Result<Json<serde_json::Value>, Fault> {
    let folder = folder_of(&api_state, job).await?;
    let files = blocking(move || client_requests::list(&folder).map_err(|e| e.to_string())).await?;
    let files = files.into_iter().map(|(name, bytes)| json!({ "name": name, "bytes": bytes }));
    Ok(Json(files.collect()))
}

/// `GET /api/jobs/N/files/NAME`. The report opens in the browser, anything else is saved.
pub async fn file(
    State(api_state): State<ApiState>,
    Path((job, name)): Path<(u32, String)>,
) -> Result<Response, Fault> {
    check_file_name(&name).map_err(missing)?;
    let path = folder_of(&api_state, job).await?.join(&name);
    let open = move || open(&path).map_err(|e| format!("{}: {e}", path.display()));
    let (file, bytes) = blocking(open).await?;
    let mut answer = stream(move |send| send_file(file, bytes, send)).into_response();
    let headers = answer.headers_mut();
    headers.insert(header::CONTENT_LENGTH, HeaderValue::from(bytes));
    if name == REPORT {
        headers.insert(header::CONTENT_TYPE, HeaderValue::from_static("text/html; charset=utf-8"));
        headers.insert(header::CONTENT_SECURITY_POLICY, HeaderValue::from_static(REPORT_POLICY));
    } else {
        save_as(&mut answer, &name);
    }
    Ok(answer)
}

/// `GET /api/jobs/N/results.tar`: a folder `job-N` with every file.
pub async fn archive(State(api_state): State<ApiState>, Path(job): Path<u32>) -> Result<Response, Fault> {
    let folder = folder_of(&api_state, job).await?;
    let listed = folder.clone();
    let files = blocking(move || client_requests::list(&listed).map_err(|e| e.to_string())).await?;
    let mut answer = stream(move |send| send_archive(&folder, job, &files, send)).into_response();
    save_as(&mut answer, &format!("job-{job}.tar"));
    Ok(answer)
}

/// Has a browser save an answer. A name has passed [`check_file_name`], so it has no letter that a header would need quoted.
fn save_as(answer: &mut Response, name: &str) {
    let headers = answer.headers_mut();
    headers.insert(header::CONTENT_TYPE, HeaderValue::from_static("application/octet-stream"));
    if let Ok(value) = HeaderValue::from_str(&format!("attachment; filename=\"{name}\"")) {
        headers.insert(header::CONTENT_DISPOSITION, value);
    }
}

/// A regular file and its length.
fn open(path: &FilePath) -> io::Result<(File, u64)> {
    let meta = path.symlink_metadata()?;
    if !meta.is_file() {
        return Err(io::Error::new(io::ErrorKind::NotFound, "no file"));
    }
    Ok((File::open(path)?, meta.len()))
}

type Pieces = mpsc::Sender<io::Result<Bytes>>;

/// A body that a thread of its own fills; it ends when the caller goes.
fn stream(work: impl FnOnce(&Pieces) -> io::Result<()> + Send + 'static) -> Body {
    let (send, receive) = mpsc::channel(WAITING);
    tokio::task::spawn_blocking(move || {
        if let Err(error) = work(&send) {
            // A caller that has gone needs no reason.
            let _ = send.blocking_send(Err(error));
        }
    });
    Body::from_stream(ReceiverStream::new(receive))
}

/// Sends exactly so many bytes of a file.
fn send_file(file: File, bytes: u64, send: &Pieces) -> io::Result<()> {
    let mut left = bytes;
    let mut file = file.take(bytes);
    while left > 0 {
        let mut piece = vec![0; PIECE.min(usize::try_from(left).unwrap_or(PIECE))];
        file.read_exact(&mut piece)?;
        left -= piece.len() as u64;
        put(send, piece)?;
    }
    Ok(())
}

fn put(send: &Pieces, piece: Vec<u8>) -> io::Result<()> {
    let gone = |_| io::Error::new(io::ErrorKind::BrokenPipe, "the caller has gone");
    send.blocking_send(Ok(Bytes::from(piece))).map_err(gone)
}

fn send_archive(folder: &FilePath, job: u32, files: &[(String, u64)], send: &Pieces) -> io::Result<()> {
    for (name, _) in files {
        let (file, bytes) = open(&folder.join(name))?;
        put(send, tar::header(&format!("job-{job}/{name}"), bytes)?)?;
        send_file(file, bytes, send)?;
        put(send, tar::padding(bytes))?;
    }
    put(send, tar::end())
}

/// Which columns are wanted, by index, separated by commas.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Wanted {
    columns: Option<String>,
}

/// `GET /api/jobs/N/history`.
pub async fn history(
    State(api_state): State<ApiState>,
    Path(job): Path<u32>,
    Query(Wanted { columns }): Query<Wanted>,
) -> Result<Json<serde_json::Value>, Fault> {
    let wrong = |what: String| Fault(StatusCode::UNPROCESSABLE_ENTITY, json!({ "error": what }));
    let wanted: Vec<usize> = columns
        .iter()
        .flat_map(|list| list.split(','))
        .filter(|index| !index.is_empty())
        .map(|index| index.parse().map_err(|_| wrong(format!("columns: {index:?} is no index"))))
        .collect::<Result<_, _>>()?;
    if wanted.len() > MOST_COLUMNS {
        return Err(wrong(format!("columns: {} of them, at most {MOST_COLUMNS} at a time", wanted.len())));
    }
    let path: PathBuf = folder_of(&api_state, job).await?.join(HISTORY);
    let read = move || Table::read_columns(&path, &wanted).map_err(|e| e.to_string());
    let (columns, values) = blocking(read).await?;
    // What is not finite is a gap, as JSON has it.
    let values: Vec<Vec<f64>> = values.into_iter().map(|list| thinned(list, POINTS_LIMIT)).collect();
    Ok(Json(json!({ "columns": columns, "values": values })))
}
