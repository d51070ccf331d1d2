//! HTTP: the page, its JSON API, `/metrics` and `/healthz`, on an address of their own.
//!
//! Loopback speaks HTTP; elsewhere it is HTTPS with the cluster's certificate, which a browser believes once `ca.pem` is
//! given to it. Every request passes the [`guard`], `/healthz` alone without a token. [`api`] asks the scheduler as
//! any client does; what runs show while they run stands on the [`board`].

use std::{
    collections::VecDeque,
    net::{IpAddr, SocketAddr},
    sync::{
        Arc, Mutex, PoisonError, Weak,
        atomic::{AtomicBool, Ordering},
    },
    time::Duration,
};

use axum::{
    Router,
    extract::{Query, Request, State},
    http::{HeaderValue, StatusCode, header},
    middleware::{self, Next},
    response::{IntoResponse, Redirect, Response},
};
use protocol::tls::{self, ServerConfig};
use tokio::{
    net::TcpListener,
    sync::{mpsc, oneshot},
};
use tokio_rustls::TlsAcceptor;
use tracing::{debug, warn};

pub mod api;
pub mod api_state;
pub mod assets;
pub mod board;
pub mod files;
pub mod folder;
pub mod guard;
pub mod metrics;
pub mod surface;
pub mod tar;
mod wire;

use api_state::ApiState;
use guard::Refusal;
use wire::{Limits, Stream, Wire};

use crate::{
    notice::{self, Notice},
    places::Places,
};

/// Most connections at a time.
pub const CONNECTIONS: usize = 256;
/// The longest that a TLS handshake may take.
const HANDSHAKE_LIMIT: Duration = Duration::from_secs(10);
/// The longest that the owner of the queue may take to say that it is well.
const HEALTH_LIMIT: Duration = Duration::from_secs(2);
/// What pages may load: their own files and nothing else, the module that computes a block again among them.
const POLICY: &str = "default-src 'self'; script-src 'self' 'wasm-unsafe-eval'; frame-ancestors 'none'; base-uri 'none'; form-action 'none'";

/// Where the page listens and by which certificate.
pub struct Place {
    listener: TcpListener,
    tls: Option<Arc<ServerConfig>>,
}

impl Place {
    /// Listens; TLS off loopback, by the certificates in `certs`.
    ///
    /// # Errors
    /// If it cannot listen there, or there are no certificates and it is not loopback.
    pub async fn open(address: SocketAddr, certs: Option<&std::path::Path>) -> Result<Self, String> {
        let tls = match certs {
            Some(folder) if !address.ip().is_loopback() => {
                let paths = tls::Paths::in_folder(folder);
                Some(tls::page_config(&paths).map_err(|e| e.to_string())?)
            }
            _ => {
                tls::loopback_only(address).map_err(|e| e.to_string())?;
                None
            }
        };
        let listener = TcpListener::bind(address).await.map_err(|e| format!("--http {address}: {e}"))?;
        Ok(Self { listener, tls })
    }

    /// Where it listens.
    ///
    /// # Errors
    /// The system's reason.
    pub fn address(&self) -> Result<SocketAddr, String> {
        self.listener.local_addr().map_err(|e| e.to_string())
    }

    /// Whether it speaks TLS.
    pub fn is_secure(&self) -> bool {
        self.tls.is_some()
    }
}

/// Serves for ever.
pub async fn serve(place: Place, api_state: ApiState) {
    serve_within(place, router(api_state), Limits::default()).await;
}

/// Serves this, to callers that keep within these limits.
async fn serve_within(place: Place, router: Router, limits: Limits) {
    let Ok(address) = place.address() else { return };
    let (send, ready) = mpsc::channel(16);
    tokio::spawn(take(place, limits, send));
    let door = Door { ready, address };
    let service = router.into_make_service_with_connect_info::<wire::Asker>();
    if let Err(error) = axum::serve(door, service).await {
        warn!("the page: {error}");
    }
}

fn router(api_state: ApiState) -> Router {
    // Programs use the plain paths, with the token in a header; browsers those below the page's own.
    let page = || Router::new().merge(assets::routes()).nest("/api", api::routes());
    let path = api_state.guard.path();
    page()
        .nest(path.trim_end_matches('/'), page())
        .route(path, axum::routing::get(assets::page))
        .route(&format!("{path}jobs/{{job}}"), axum::routing::get(assets::page_of_a_job))
        .route("/metrics", axum::routing::get(metrics::text))
        .fallback(|| async { (StatusCode::NOT_FOUND, "no such page\n") })
        .layer(middleware::from_fn(wire::note_work))
        .layer(middleware::from_fn_with_state(api_state.clone(), check_request))
        .with_state(api_state)
}

/// Every request passes here.
async fn check_request(State(api_state): State<ApiState>, request: Request, next: Next) -> Response {
    let guard = &api_state.guard;
    let answer = match guard.names(request.headers()) {
        Err(refusal) => refuse(refusal),
        Ok(()) if request.uri().path() == "/healthz" => health(&api_state).await.into_response(),
        Ok(()) => match (token_in_address(&request), guard.pass(request.headers())) {
            (Some(guess), _) if guard.is_token(&guess) => {
                // The token leaves the address bar, and the history with it.
                let mut answer = Redirect::to(guard.path()).into_response();
                if let Ok(cookie) = HeaderValue::from_str(&guard.set_cookie()) {
                    answer.headers_mut().insert(header::SET_COOKIE, cookie);
                }
                answer
            }
            (_, Ok(())) => next.run(request).await,
            (_, Err(refusal)) => refuse(refusal),
        },
    };
    with_headers(answer)
}

/// Asks the owner of the queue, which has to answer in time.
async fn health(api_state: &ApiState) -> (StatusCode, &'static str) {
    if api_state.notices.is_closed() {
        return (StatusCode::SERVICE_UNAVAILABLE, "ending\n");
    }
    match tokio::time::timeout(HEALTH_LIMIT, notice::ask(&api_state.notices, Notice::Alive)).await {
        Ok(Ok(())) => (StatusCode::OK, "ok\n"),
        Ok(Err(_)) => (StatusCode::SERVICE_UNAVAILABLE, "ending\n"),
        Err(_) => (StatusCode::SERVICE_UNAVAILABLE, "the owner of the queue does not answer\n"),
    }
}

fn token_in_address(request: &Request) -> Option<String> {
    let query = Query::<std::collections::BTreeMap<String, String>>::try_from_uri(request.uri());
    query.ok().filter(|_| request.uri().path() == "/").and_then(|Query(mut map)| map.remove("token"))
}

fn refuse(refusal: Refusal) -> Response {
    let code = if refusal == Refusal::Token { StatusCode::UNAUTHORIZED } else { StatusCode::FORBIDDEN };
    (code, format!("{}\n", refusal.sentence())).into_response()
}

fn with_headers(mut answer: Response) -> Response {
    let headers = answer.headers_mut();
    headers.entry(header::CONTENT_SECURITY_POLICY).or_insert(HeaderValue::from_static(POLICY));
    headers.insert(header::X_CONTENT_TYPE_OPTIONS, HeaderValue::from_static("nosniff"));
    headers.insert(header::REFERRER_POLICY, HeaderValue::from_static("no-referrer"));
    headers.entry(header::CACHE_CONTROL).or_insert(HeaderValue::from_static("no-store"));
    answer
}

/// Takes connections; handshakes go on beside each other, so that a silent caller holds up nobody.
async fn take(place: Place, limits: Limits, send: mpsc::Sender<Wire>) {
    let places = Arc::new(Places::new(CONNECTIONS));
    let mut waiting = Waiting::default();
    loop {
        let (stream, from) = match place.listener.accept().await {
            Ok(taken) => taken,
            Err(error) => {
                warn!("the page, taking a connection: {error}");
                tokio::time::sleep(Duration::from_millis(100)).await;
                continue;
            }
        };
        let permit = match places.take(from.ip()) {
            Some(permit) => Some(permit),
            // Whoever has said nothing for longest makes room for who comes.
            None if waiting.end_oldest(from.ip(), &places) => None,
            None => {
                debug!("the page, {from}: not taken, {CONNECTIONS} are served at most");
                continue;
            }
        };
        let (caller, ended) = waiting.add(from.ip());
        // What is said at once is not kept waiting for more; without it answers are a little later.
        let _ = stream.set_nodelay(true);
        let (send, tls, places) = (send.clone(), place.tls.clone(), Arc::clone(&places));
        tokio::spawn(async move {
            let permit = match permit {
                Some(permit) => permit,
                None => match tokio::time::timeout(limits.header, places.wait(from.ip())).await {
                    Ok(Some(permit)) => permit,
                    _ => return debug!("the page, {from}: no place within {:?}", limits.header),
                },
            };
            let stream = match tls {
                None => Stream::Plain(stream),
                Some(config) => {
                    let shaken = TlsAcceptor::from(config).accept(stream);
                    match tokio::time::timeout(HANDSHAKE_LIMIT, shaken).await {
                        Ok(Ok(stream)) => Stream::Tls(Box::new(stream)),
                        Ok(Err(error)) => return debug!("the page, {from}: {error}"),
                        Err(_) => return debug!("the page, {from}: no TLS within {HANDSHAKE_LIMIT:?}"),
                    }
                }
            };
            // The server is gone only when the daemon ends.
            let _ = send.send(Wire::new(stream, from, limits, (caller, ended), permit)).await;
        });
    }
}

/// A caller that may have to make room for another.
struct Caller {
    address: IpAddr,
    /// It has not said what it asks for.
    silent: AtomicBool,
    /// It has said all, and its answer has not begun.
    waits: AtomicBool,
    /// Ends it.
    end: Mutex<Option<oneshot::Sender<()>>>,
}

/// Callers by age, the oldest first.
#[derive(Default)]
struct Waiting(VecDeque<Weak<Caller>>);

impl Waiting {
    /// With what tells it to end.
    fn add(&mut self, address: IpAddr) -> (Arc<Caller>, oneshot::Receiver<()>) {
        let (end, ended) = oneshot::channel();
        let caller = Caller {
            address,
            silent: AtomicBool::new(true),
            waits: AtomicBool::new(false),
            end: Mutex::new(Some(end)),
        };
        let caller = Arc::new(caller);
        if self.0.len() > 2 * CONNECTIONS {
            self.0.retain(|caller| caller.strong_count() > 0);
        }
        self.0.push_back(Arc::downgrade(&caller));
        (caller, ended)
    }

    /// Ends the oldest that is silent, of the same address where that has all its places; gives whether there was one.
    fn end_oldest(&mut self, address: IpAddr, places: &Places) -> bool {
        self.0.retain(|caller| caller.strong_count() > 0);
        let living = self.0.iter().filter_map(Weak::upgrade);
        let of_address = living.filter(|caller| caller.address == address).count();
        let same = of_address >= places.most_of_an_address();
        let found = self.0.iter().position(|caller| {
            let caller = caller.upgrade();
            caller.is_some_and(|c| (!same || c.address == address) && c.silent.load(Ordering::Relaxed))
        });
        let oldest = found.and_then(|at| self.0.remove(at)).and_then(|caller| caller.upgrade());
        let end = oldest.and_then(|caller| caller.end.lock().unwrap_or_else(PoisonError::into_inner).take());
        end.is_some_and(|end| end.send(()).is_ok())
    }
}

/// Connections that are ready to be served.
struct Door {
    ready: mpsc::Receiver<Wire>,
    address: SocketAddr,
}

impl axum::serve::Listener for Door {
    type Io = Wire;
    type Addr = SocketAddr;

    async fn accept(&mut self) -> (Wire, SocketAddr) {
        match self.ready.recv().await {
            Some(wire) => {
                let from = wire.from;
                (wire, from)
            }
            None => std::future::pending().await,
        }
    }

    fn local_addr(&self) -> std::io::Result<SocketAddr> {
        Ok(self.address)
    }
}
