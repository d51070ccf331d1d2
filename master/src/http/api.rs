//! API: JSON for the page and for programs.
//!
//! | request | answer |
//! |---|---|
//! | `GET /api/overview` | `{version, join, jobs, hosts, recomputes}`; a job is a status with `brief` once it runs |
//! | `GET /api/events` | the same as server-sent events, whenever it changes, at most twice a second; `alive` when 10 s have passed without |
//! | `POST /api/jobs?name=NAME&cycles=N&min_workers=N&max_workers=N`, body the deck | `{job}`; 422 `{faults: [{file, line, column, ...}]}` |
//! | `POST /api/check?name=NAME`, body the deck | `{title, parts, elements, nodes, forecast}`, or 422 as above |
//! | `POST /api/check/surface?name=NAME`, body the deck | the surface before the first cycle, binary |
//! | `POST /api/jobs/N/cancel`, `hold` or `resume` | `{done}` |
//! | `GET /api/jobs` | the jobs, as in the overview |
//! | `GET /api/jobs/N` | the job's status |
//! | `GET /api/jobs/N/sheet` | energies, imbalance, phases of workers, list of states |
//! | `GET /api/jobs/N/surface/K?cut=AXIS&at=SHARE&side=SIDE&hide=PARTS` | the surface of state K, binary, as [`surface`](super::surface) says; with a cut, of the elements on one side (`beyond` or `below`) of a plane; without the parts of these indices |
//! | `GET /api/jobs/N/sample` | a block of the newest checkpoint, binary, for the module `recompute.wasm`; the sheet says of it `proved` |
//! | `GET /api/jobs/N/history` | `{columns}` of the history; `?columns=3,7` adds `{values}`, a list for each, thinned |
//! | `GET /api/jobs/N/files` | `[{name, bytes}]` of its results |
//! | `GET /api/jobs/N/files/NAME` | the file |
//! | `GET /api/jobs/N/results.tar` | all of them in a folder |
//!
//! What cannot be done is `{error}` with 400 where a number or a query cannot be read, 404 where there is no such thing, 405 where the
//! path has another method, 409 where the state of the job forbids it, 422 where what was sent
//! is wrong, 413 where it is too long, 500 after a bug or damage here, 503 where the queue is full or the master ends, and 507 where the disk refused.

use std::{
    convert::Infallible,
    path::PathBuf,
    time::{Duration, Instant},
};

use axum::{
    Json, Router,
    body::to_bytes,
    extract::{DefaultBodyLimit, Path, Query, State},
    http::{StatusCode, header},
    middleware,
    response::{IntoResponse, Response, Sse, sse},
    routing::{get, post},
};
use protocol::{
    options::JobOptions,
    request::{DECK_LIMIT, Status},
};
use serde::{Deserialize, Serialize};
use serde_json::json;
use tokio::sync::{mpsc, oneshot};
use tokio_stream::wrappers::ReceiverStream;

use super::{
    api_state::ApiState,
    assets, board, files,
    folder::{self, At, View},
};
use crate::{
    client,
    desk::{self, Brought},
    notice::{self, Notice, ask},
    picture::camera::Slice,
    queue::{self, Wish},
};

/// The shortest time between two events of the stream.
const EVENT_EVERY: Duration = Duration::from_millis(500);
/// The longest time without one: a page that hears nothing tells a master that is stopped from one that has no news.
const WORD_EVERY: Duration = Duration::from_secs(10);
/// Most bytes of what the server says when it refuses a request.
const REFUSAL_LIMIT: usize = 4096;
/// Most characters of a deck's name.
const NAME_LIMIT: usize = 200;

/// The routes below `/api`.
pub fn routes() -> Router<ApiState> {
    Router::new()
        .route("/overview", get(overview))
        .route("/events", get(events))
        .route("/check", post(check))
        .route("/jobs", get(jobs).post(submit))
        .route("/jobs/{job}", get(job))
        .route("/jobs/{job}/cancel", post(cancel))
        .route("/jobs/{job}/hold", post(hold))
        .route("/jobs/{job}/resume", post(resume))
        .route("/jobs/{job}/sheet", get(job_view))
        .route("/jobs/{job}/surface/{index}", get(surface))
        .route("/jobs/{job}/sample", get(sample))
        .route("/jobs/{job}/history", get(files::history))
        .route("/jobs/{job}/files", get(files::list))
        .route("/jobs/{job}/files/{name}", get(files::file))
        .route("/jobs/{job}/results.tar", get(files::archive))
        .route("/check/surface", post(drawn))
        .fallback(|| async { missing("no such path".to_owned()) })
        .layer(DefaultBodyLimit::max(DECK_LIMIT))
        .layer(middleware::map_response(in_json))
}

/// What the server itself refuses, such as a number that is none, as all that cannot be done is told.
async fn in_json(answer: Response) -> Response {
    let (status, headers) = (answer.status(), answer.headers());
    let kind = headers.get(header::CONTENT_TYPE).and_then(|kind| kind.to_str().ok()).unwrap_or_default();
    if !(status.is_client_error() || status.is_server_error()) || kind.starts_with("application/json") {
        return answer;
    }
    let bytes = to_bytes(answer.into_body(), REFUSAL_LIMIT).await.unwrap_or_default();
    let mut words = String::from_utf8_lossy(&bytes).trim().to_owned();
    if words.is_empty() {
        words = status.canonical_reason().unwrap_or("refused").to_owned();
    }
    Fault(status, json!({ "error": words })).into_response()
}

/// What cannot be done.
pub struct Fault(pub StatusCode, pub serde_json::Value);

impl IntoResponse for Fault {
    fn into_response(self) -> Response {
        (self.0, Json(self.1)).into_response()
    }
}

impl From<notice::Error> for Fault {
    fn from(error: notice::Error) -> Self {
        use notice::Error::{Deck, Disk, Ending, NoJob, NoResults, OnlyShows, Queue, Results, WritesNone};
        use queue::Error::{Full, Illegal, NotOver, Unknown};
        let status = match &error {
            NoJob | Queue(Unknown(_)) | WritesNone(_) | NoResults(..) => StatusCode::NOT_FOUND,
            Queue(NotOver(..) | Illegal(..)) | OnlyShows => StatusCode::CONFLICT,
            Queue(Full(_)) | Ending => StatusCode::SERVICE_UNAVAILABLE,
            Disk { .. } => StatusCode::INSUFFICIENT_STORAGE,
            Deck(_) | Results(_) => StatusCode::INTERNAL_SERVER_ERROR,
        };
        Self(status, json!({ "error": error.to_string() }))
    }
}

pub fn missing(what: String) -> Fault {
    Fault(StatusCode::NOT_FOUND, json!({ "error": what }))
}

/// A job as the page lists it: a finished one without the text of its summary.
fn listed(api_state: &ApiState, mut status: Status) -> serde_json::Value {
    if let Some(ended) = &mut status.ended {
        (ended.summary, ended.table) = (None, None);
    }
    let brief = api_state.board.job_view(status.job).map(|job_view| board::lock(&job_view).brief().clone());
    let mut value = json!(status);
    value["brief"] = json!(brief);
    value
}

async fn all(api_state: &ApiState) -> Result<serde_json::Value, notice::Error> {
    let jobs = ask(&api_state.notices, Notice::Jobs).await?;
    let hosts = ask(&api_state.notices, Notice::Hosts).await?;
    let jobs: Vec<_> = jobs.into_iter().map(|status| listed(api_state, status)).collect();
    let host = |row: protocol::request::HostRow| {
        let load = if row.state == "busy" { api_state.board.load(&row.name) } else { None };
        let mut value = json!(row);
        value["load"] = json!(load);
        value
    };
    let hosts: Vec<_> = hosts.into_iter().map(host).collect();
    let (version, join, shows) = (env!("CARGO_PKG_VERSION"), &api_state.join, api_state.only_shows);
    let recomputes = assets::recomputes();
    Ok(
        json!({ "version": version, "join": join, "jobs": jobs, "hosts": hosts, "only_shows": shows, "recomputes": recomputes }),
    )
}

async fn overview(State(api_state): State<ApiState>) -> Result<Json<serde_json::Value>, Fault> {
    Ok(Json(all(&api_state).await?))
}

async fn events(State(api_state): State<ApiState>) -> impl IntoResponse {
    let (send, receive) = mpsc::channel::<Result<sse::Event, Infallible>>(1);
    tokio::spawn(async move {
        let mut before = serde_json::Value::Null;
        let mut said = Instant::now();
        while let Ok(now) = all(&api_state).await {
            let event = match now != before {
                true => Some(sse::Event::default().event("overview").data(now.to_string())),
                // Comments, which keep a connection open, are not shown to scripts.
                false if said.elapsed() >= WORD_EVERY => {
                    Some(sse::Event::default().event("alive").data("true"))
                }
                false => None,
            };
            before = now;
            if let Some(event) = event {
                said = Instant::now();
                if send.send(Ok(event)).await.is_err() {
                    return;
                }
            }
            tokio::select! {
                () = send.closed() => return,
                () = tokio::time::sleep(EVENT_EVERY) => {}
            }
        }
    });
    Sse::new(ReceiverStream::new(receive)).keep_alive(sse::KeepAlive::default())
}

async fn jobs(State(api_state): State<ApiState>) -> Result<Json<serde_json::Value>, Fault> {
    let jobs = ask(&api_state.notices, Notice::Jobs).await?;
    Ok(Json(jobs.into_iter().map(|status| listed(&api_state, status)).collect()))
}

/// What is asked beside a deck.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Asked {
    name: Option<String>,
    cycles: Option<u64>,
    min_workers: Option<u32>,
    max_workers: Option<u32>,
}

/// A fault of a deck and its place.
#[derive(Serialize)]
struct Place {
    /// Its file, of a deck of several.
    file: String,
    line: u32,
    column: u32,
    read: String,
    expected: String,
    advice: String,
}

impl From<desk::Error> for Fault {
    fn from(error: desk::Error) -> Self {
        let status = match &error {
            desk::Error::Options(_)
            | desk::Error::Name(_)
            | desk::Error::Faults(_)
            | desk::Error::Study(_)
            | desk::Error::Start(_) => StatusCode::UNPROCESSABLE_ENTITY,
            desk::Error::Ending => StatusCode::SERVICE_UNAVAILABLE,
            desk::Error::Bug => StatusCode::INTERNAL_SERVER_ERROR,
        };
        let desk::Error::Faults(faults) = error else {
            return Self(status, json!({ "error": error.to_string() }));
        };
        let place = |fault: deck::Fault| Place {
            file: fault.file,
            line: fault.line,
            column: fault.column,
            read: fault.read,
            expected: fault.expected,
            // The page has no such flag.
            advice: match fault.advice.contains("--set ") {
                true => format!("write its number into the deck, or {} of bolide submit", fault.advice),
                false => fault.advice,
            },
        };
        let faults: Vec<Place> = faults.into_iter().map(place).collect();
        Self(status, json!({ "faults": faults }))
    }
}

fn name_of(asked: &Asked) -> String {
    let name = asked.name.clone().unwrap_or_else(|| "deck.toml".to_owned());
    name.chars().filter(|c| !c.is_control()).take(NAME_LIMIT).collect()
}

async fn check(Query(asked): Query<Asked>, text: String) -> Result<Json<serde_json::Value>, Fault> {
    let looked = desk::look(name_of(&asked), text).await?;
    let forecast = &looked.forecast;
    Ok(Json(json!({
        "title": forecast.title, "parts": forecast.parts.len(), "elements": forecast.elements, "nodes": forecast.nodes,
        "forecast": forecast, "reading": looked.warnings,
    })))
}

async fn drawn(Query(asked): Query<Asked>, text: String) -> Result<impl IntoResponse, Fault> {
    let bytes = desk::draw(name_of(&asked), text).await?;
    Ok(([(header::CONTENT_TYPE, "application/octet-stream")], bytes))
}

async fn submit(
    State(api_state): State<ApiState>,
    Query(asked): Query<Asked>,
    text: String,
) -> Result<Json<serde_json::Value>, Fault> {
    let name = name_of(&asked);
    let brought = desk::read(name.clone(), text).await?;
    let options = JobOptions {
        cycles: asked.cycles,
        min_workers: asked.min_workers.unwrap_or(1),
        max_workers: asked.max_workers.unwrap_or_default(),
        keep_every: Some(10.0),
        ..JobOptions::default()
    };
    if options.min_workers == 0 {
        let why = "min_workers 0: expected a number from 1 to 10000; leave it out for 1";
        return Err(Fault(StatusCode::UNPROCESSABLE_ENTITY, json!({ "error": why })));
    }
    options.check().map_err(desk::Error::Options)?;
    let size = brought.size(&options);
    let Brought { text, title, .. } = brought;
    let owner = String::new();
    let submit = |answer| Notice::Submit { name, title, text, size, options, owner, answer };
    let job = ask(&api_state.notices, submit).await??;
    Ok(Json(json!({ "job": job })))
}

async fn job(
    State(api_state): State<ApiState>,
    Path(job): Path<u32>,
) -> Result<Json<serde_json::Value>, Fault> {
    let watch = ask(&api_state.notices, |answer| Notice::Watch(Some(job), answer)).await??;
    let status = watch.borrow().clone();
    Ok(Json(client::as_json(&status)))
}

/// What came of a change of a job.
type Done = Result<Json<serde_json::Value>, Fault>;

async fn cancel(State(api_state): State<ApiState>, Path(job): Path<u32>) -> Done {
    act(&api_state, |answer| Notice::Wish(job, Wish::Cancel, answer)).await
}

async fn hold(State(api_state): State<ApiState>, Path(job): Path<u32>) -> Done {
    act(&api_state, |answer| Notice::Wish(job, Wish::Hold, answer)).await
}

async fn resume(State(api_state): State<ApiState>, Path(job): Path<u32>) -> Done {
    act(&api_state, |answer| Notice::Resume(job, answer)).await
}

async fn act(
    api_state: &ApiState,
    change: impl FnOnce(oneshot::Sender<Result<String, notice::Error>>) -> Notice,
) -> Done {
    Ok(Json(json!({ "done": ask(&api_state.notices, change).await?? })))
}

async fn job_view(
    State(api_state): State<ApiState>,
    Path(job): Path<u32>,
) -> Result<Json<serde_json::Value>, Fault> {
    if let Some(job_view) = api_state.board.job_view(job) {
        let value = board::lock(&job_view).json();
        return Ok(Json(value));
    }
    let folder = folder_of(&api_state, job).await?;
    files::blocking(move || folder::sheet(&folder)).await.map(Json)
}

/// `GET /api/jobs/N/sample`.
async fn sample(State(api_state): State<ApiState>, Path(job): Path<u32>) -> Result<impl IntoResponse, Fault> {
    let proved = api_state.board.job_view(job).and_then(|job_view| board::lock(&job_view).newest_proved());
    let none = || {
        format!("job {job} has no block to compute again: it has not begun, or this master has forgotten it")
    };
    let proved = proved.ok_or_else(|| missing(none()))?;
    let bytes = files::blocking(move || recompute::write(&proved.sample)).await?;
    Ok(([(header::CONTENT_TYPE, "application/octet-stream")], bytes))
}

/// Where the results of a job are.
///
/// # Errors
/// If it has none.
pub async fn folder_of(api_state: &ApiState, job: u32) -> Result<PathBuf, Fault> {
    Ok(ask(&api_state.notices, |answer| Notice::Folder(job, answer)).await??)
}

/// How a state is to be shown.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Shown {
    cut: Option<String>,
    at: Option<f64>,
    side: Option<String>,
    hide: Option<String>,
}

impl Shown {
    fn view(&self) -> Result<View, Fault> {
        let wrong = |what: String| Fault(StatusCode::UNPROCESSABLE_ENTITY, json!({ "error": what }));
        let slice = match &self.cut {
            None => None,
            Some(axis) => {
                let axis = ["x", "y", "z"].iter().position(|name| name == axis);
                let axis = axis.ok_or_else(|| wrong("cut: expected x, y or z".to_owned()))?;
                let at = self.at.unwrap_or(0.5);
                if !(0.0..=1.0).contains(&at) {
                    return Err(wrong(format!("at: expected a share from 0 to 1, found {at}")));
                }
                Some(Slice { axis, at, is_beyond: self.side.as_deref() != Some("below") })
            }
        };
        let hidden = self.hide.iter().flat_map(|list| list.split(',')).filter(|part| !part.is_empty());
        let hidden =
            hidden.map(|part| part.parse().map_err(|_| wrong(format!("hide: {part:?} is no index"))));
        Ok(View { slice, hidden: hidden.collect::<Result<_, _>>()? })
    }
}

async fn surface(
    State(api_state): State<ApiState>,
    Path((job, index)): Path<(u32, usize)>,
    Query(shown): Query<Shown>,
) -> Result<impl IntoResponse, Fault> {
    let view = shown.view()?;
    let content = [(header::CONTENT_TYPE, "application/octet-stream")];
    let mut at = At::Index(index);
    if let Some(job_view) = api_state.board.job_view(job) {
        let job_view = board::lock(&job_view);
        if view == View::default() {
            let bytes = job_view.surface(index);
            let bytes = bytes.ok_or_else(|| missing(format!("job {job} has no state {index}")))?;
            return Ok((content, bytes.as_ref().clone()));
        }
        // Kept surfaces are thinned out, files are not.
        let time = job_view.time_of(index);
        at = At::Time(time.ok_or_else(|| missing(format!("job {job} has no state {index}")))?);
    }
    let folder = folder_of(&api_state, job).await?;
    let bytes = files::blocking(move || folder::state(&folder, at, &view).map(|drawn| drawn.pack())).await?;
    Ok((content, bytes))
}

#[cfg(test)]
mod tests {
    use protocol::request::State as JobState;

    use super::*;
    use crate::{queue::Change, spool};

    #[test]
    fn a_refusal_has_the_status_of_its_kind() {
        let disk = || spool::Fault::Io("job-1.json".into(), std::io::ErrorKind::StorageFull.into());
        for (error, status) in [
            (notice::Error::NoJob, 404),
            (notice::Error::Queue(queue::Error::Unknown(7)), 404),
            (notice::Error::WritesNone(7), 404),
            (notice::Error::NoResults(7, JobState::Queued), 404),
            (notice::Error::Queue(queue::Error::NotOver(7, JobState::Running)), 409),
            (notice::Error::Queue(queue::Error::Illegal(JobState::Done, Change::Cancel)), 409),
            (notice::Error::Queue(queue::Error::Full(1000)), 503),
            (notice::Error::OnlyShows, 409),
            (notice::Error::Ending, 503),
            (notice::Error::Disk { asked: "the job is not queued".to_owned(), why: disk() }, 507),
            (notice::Error::Deck(disk()), 500),
        ] {
            let words = error.to_string();
            let Fault(found, body) = error.into();
            assert_eq!((found.as_u16(), &body["error"]), (status, &json!(words)));
        }
        for (error, status) in
            [(desk::Error::Name(300), 422), (desk::Error::Ending, 503), (desk::Error::Bug, 500)]
        {
            assert_eq!(Fault::from(error).0.as_u16(), status);
        }
    }
}
