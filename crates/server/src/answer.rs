//! From a request to its response: checks, the page, and the site's answers.

use std::sync::Arc;
use std::time::Duration;

use axum::body::{Body, Bytes, to_bytes};
use axum::extract::State;
use axum::http::{HeaderMap, HeaderName, HeaderValue, Method, Response, StatusCode, Uri, header};
use axum::{Extension, Router};
use hyper::upgrade::OnUpgrade;
use hyper_util::rt::TokioIo;
use serde_json::{Value, json};
use tokio::sync::{Semaphore, watch};
use tower_http::set_header::SetResponseHeaderLayer;
use tower_http::timeout::TimeoutLayer;
use tracing::debug;

use super::guard::{Access, Guard};
use super::handshake;
use super::page;
use super::refusal::{Refusal, RefusalKind};
use super::reply::Reply;
use super::site::{PostRules, Query, Site};
use super::socket::{self, Opened};
use super::threads::{Threads, Work};

/// Nothing is fetched from elsewhere, and no other site shows this page in a frame of its own.
const POLICY: &str = "default-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' blob: data:; \
                      worker-src 'self' blob:; frame-ancestors 'none'; base-uri 'none'; form-action 'none'";

/// What feeds need to know of the server.
pub(super) struct FeedLimits {
    /// A place for each feed that may be open.
    pub(super) places: Arc<Semaphore>,
    /// True when all must end.
    pub(super) stopped: watch::Receiver<bool>,
}

/// What all requests share.
pub(super) struct Shared<S> {
    guard: Guard,
    site: S,
    threads: Arc<Threads>,
    feeds: FeedLimits,
}

/// The routes of the server.
pub(super) fn router<S: Site>(guard: Guard, site: S, longest: Duration, feeds: FeedLimits) -> Router {
    let shared = Arc::new(Shared { guard, site, threads: Arc::new(Threads::new()), feeds });
    let header = |name: HeaderName, value: &'static str| {
        SetResponseHeaderLayer::overriding(name, HeaderValue::from_static(value))
    };
    Router::new()
        .fallback(answer::<S>)
        .with_state(shared)
        .layer(TimeoutLayer::with_status_code(StatusCode::REQUEST_TIMEOUT, longest))
        .layer(header(header::CONTENT_SECURITY_POLICY, POLICY))
        .layer(header(header::X_CONTENT_TYPE_OPTIONS, "nosniff"))
        .layer(header(header::REFERRER_POLICY, "no-referrer"))
        .layer(SetResponseHeaderLayer::if_not_present(
            header::CACHE_CONTROL,
            HeaderValue::from_static("no-store"),
        ))
}

/// The text before a path of data.
const DATA: &str = "/api/";

async fn answer<S: Site>(
    State(shared): State<Arc<Shared<S>>>,
    upgrade: Option<Extension<OnUpgrade>>,
    method: Method,
    uri: Uri,
    headers: HeaderMap,
    body: Body,
) -> Response<Body> {
    let answered = match upgrade {
        Some(Extension(upgrade)) if method == Method::GET && handshake::is_asked(&headers) => {
            open_feed(&shared, uri.path(), &headers, upgrade).await
        }
        _ => find(&shared, &method, &uri, &headers, body).await.map(found),
    };
    answered.unwrap_or_else(|refusal| {
        debug!(%method, path = uri.path(), reason = refusal.message, "refused");
        refused(&refusal)
    })
}

async fn find<S: Site>(
    shared: &Arc<Shared<S>>,
    method: &Method,
    uri: &Uri,
    headers: &HeaderMap,
    body: Body,
) -> Result<Reply, Refusal> {
    shared.guard.check_host(headers)?;
    shared.guard.check_origin(headers)?;
    let path = uri.path().to_owned();
    let Some(data) = path.strip_prefix(DATA) else {
        let file = page::at(&path).filter(|_| *method == Method::GET).ok_or_else(|| nothing_at(&path))?;
        return Ok(Reply::of(file.media_type, file.bytes.to_vec()));
    };
    let reads = *method == Method::GET;
    let rules = if *method == Method::POST { shared.site.rules(&parts(data)) } else { PostRules::default() };
    let open = reads || rules.open_to_all;
    shared.guard.check_token(if open { Access::Look } else { Access::Change }, headers)?;
    let asked: Value = match *method {
        Method::GET => Value::Null,
        Method::POST => serde_json::from_slice(&read(body, rules.largest).await?)
            .map_err(|error| Refusal::new(RefusalKind::Wrong, format!("the request is no JSON: {error}")))?,
        _ => return Err(Refusal::new(RefusalKind::Forbidden, format!("{method} is not served"))),
    };
    let query = Query::parse(uri.query().unwrap_or_default());
    let data = data.to_owned();
    let work = if rules.urgent { Work::Urgent } else { Work::Answer };
    let site = shared.clone();
    let job = move || match reads {
        true => site.site.get(&parts(&data), &query),
        false => site.site.post(&parts(&data), &asked),
    };
    shared.threads.turn(work).await.run(job).await?
}

/// The whole body, which is read after the token was checked.
async fn read(body: Body, most: usize) -> Result<Bytes, Refusal> {
    to_bytes(body, most).await.map_err(|_| {
        let words = format!("the request does not end, or is larger than {} KiB; send less", most >> 10);
        Refusal::new(RefusalKind::TooLarge, words)
    })
}

/// Opens a feed and agrees to the WebSocket. What is refused is refused before that.
async fn open_feed<S: Site>(
    shared: &Arc<Shared<S>>,
    path: &str,
    headers: &HeaderMap,
    upgrade: OnUpgrade,
) -> Result<Response<Body>, Refusal> {
    shared.guard.check_host(headers)?;
    shared.guard.check_origin(headers)?;
    let data = path.strip_prefix(DATA).ok_or_else(|| nothing_at(path))?.to_owned();
    shared.guard.check_token(Access::Look, headers)?;
    let response = handshake::agree(headers)?;
    let place = shared.feeds.places.clone().try_acquire_owned().map_err(|_| {
        Refusal::new(RefusalKind::Busy, "too many feeds are open; close other windows with this page")
    })?;
    let site = shared.clone();
    let opening = move || site.site.feed(&parts(&data)).map(|feed| (Opened::new(feed), place));
    let (opened, place) = shared.threads.turn(Work::Feed).await.run(opening).await??;
    let (threads, stopped) = (shared.threads.clone(), shared.feeds.stopped.clone());
    tokio::spawn(async move {
        let _place = place;
        match upgrade.await {
            Ok(stream) => socket::serve(TokioIo::new(stream), opened, threads, stopped).await,
            Err(error) => {
                debug!(%error, "a client was gone before its feed began");
                opened.drop_on(&threads).await;
            }
        }
    });
    Ok(response)
}

/// The parts of a path of data.
fn parts(data: &str) -> Vec<&str> {
    data.split('/').collect()
}

fn nothing_at(path: &str) -> Refusal {
    Refusal::new(RefusalKind::NotFound, format!("there is no {path} here"))
}

fn refused(refusal: &Refusal) -> Response<Body> {
    let status = match refusal.kind {
        RefusalKind::Wrong => StatusCode::BAD_REQUEST,
        RefusalKind::NoToken => StatusCode::UNAUTHORIZED,
        RefusalKind::TooLarge => StatusCode::PAYLOAD_TOO_LARGE,
        RefusalKind::Forbidden => StatusCode::FORBIDDEN,
        RefusalKind::NotFound => StatusCode::NOT_FOUND,
        RefusalKind::Outdated => StatusCode::CONFLICT,
        RefusalKind::Busy => StatusCode::SERVICE_UNAVAILABLE,
        RefusalKind::Failed => StatusCode::INTERNAL_SERVER_ERROR,
    };
    let json = json!({ "error": { "message": refusal.message } });
    respond(status, "application/json", json.to_string().into_bytes())
}

/// The answer, which a browser keeps if it lasts. Only this browser may: the token is not a part of the address.
fn found(reply: Reply) -> Response<Body> {
    let mut response = respond(StatusCode::OK, reply.media_type, reply.bytes);
    if reply.is_lasting {
        let kept = HeaderValue::from_static("private, max-age=31536000, immutable");
        response.headers_mut().insert(header::CACHE_CONTROL, kept);
    }
    response
}

fn respond(status: StatusCode, media_type: &'static str, bytes: Vec<u8>) -> Response<Body> {
    let mut response = Response::new(Body::from(bytes));
    *response.status_mut() = status;
    response.headers_mut().insert(header::CONTENT_TYPE, HeaderValue::from_static(media_type));
    response
}
