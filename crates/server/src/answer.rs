//! From a request to its response: checks, the page, and the site's answers.

use std::sync::Arc;
use std::time::Duration;

use axum::Router;
use axum::body::{Body, Bytes};
use axum::extract::State;
use axum::http::{HeaderMap, HeaderName, HeaderValue, Method, Response, StatusCode, Uri, header};
use serde::Serialize;
use serde_json::Value;
use tokio::sync::Semaphore;
use tower_http::limit::RequestBodyLimitLayer;
use tower_http::set_header::SetResponseHeaderLayer;
use tower_http::timeout::TimeoutLayer;
use tracing::debug;

use super::guard::Guard;
use super::page;
use super::refusal::{Refusal, RefusalKind};
use super::reply::Reply;
use super::site::{Query, Site};

/// Largest body of a request, in bytes: orders are short.
const LARGEST_BODY: usize = 64 << 10;
/// Answers that are worked on at once; others wait.
const AT_ONCE: usize = 4;

/// Nothing is fetched from elsewhere, and no other site shows this page in a frame of its own.
const POLICY: &str = "default-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' blob: data:; \
                      worker-src 'self' blob:; frame-ancestors 'none'; base-uri 'none'; form-action 'none'";

/// What all requests share.
pub(super) struct Shared<S> {
    guard: Guard,
    site: S,
    work: Semaphore,
}

/// The routes of the server.
pub(super) fn router<S: Site>(guard: Guard, site: S, longest: Duration) -> Router {
    let shared = Arc::new(Shared { guard, site, work: Semaphore::new(AT_ONCE) });
    let header = |name: HeaderName, value: &'static str| {
        SetResponseHeaderLayer::overriding(name, HeaderValue::from_static(value))
    };
    Router::new()
        .fallback(answer::<S>)
        .with_state(shared)
        .layer(RequestBodyLimitLayer::new(LARGEST_BODY))
        .layer(TimeoutLayer::with_status_code(StatusCode::REQUEST_TIMEOUT, longest))
        .layer(header(header::CONTENT_SECURITY_POLICY, POLICY))
        .layer(header(header::X_CONTENT_TYPE_OPTIONS, "nosniff"))
        .layer(header(header::REFERRER_POLICY, "no-referrer"))
        .layer(header(header::CACHE_CONTROL, "no-store"))
}

/// The text before a path of data.
const DATA: &str = "/api/";

async fn answer<S: Site>(
    State(shared): State<Arc<Shared<S>>>,
    method: Method,
    uri: Uri,
    headers: HeaderMap,
    body: Bytes,
) -> Response<Body> {
    match find(&shared, &method, &uri, &headers, &body).await {
        Ok(reply) => respond(StatusCode::OK, reply.media_type, reply.bytes),
        Err(refusal) => {
            debug!(%method, path = uri.path(), reason = refusal.message, "refused");
            refused(&refusal)
        }
    }
}

async fn find<S: Site>(
    shared: &Arc<Shared<S>>,
    method: &Method,
    uri: &Uri,
    headers: &HeaderMap,
    body: &Bytes,
) -> Result<Reply, Refusal> {
    shared.guard.check_host(headers)?;
    shared.guard.check_origin(headers)?;
    let path = uri.path().to_owned();
    let Some(data) = path.strip_prefix(DATA) else {
        let file = page::at(&path).filter(|_| *method == Method::GET);
        let file =
            file.ok_or_else(|| Refusal::new(RefusalKind::NotFound, format!("there is no {path} here")))?;
        return Ok(Reply::file(file.media_type, file.bytes.to_vec()));
    };
    shared.guard.check_token(method, headers)?;
    let asked: Value = match *method {
        Method::GET => Value::Null,
        Method::POST => serde_json::from_slice(body)
            .map_err(|error| Refusal::new(RefusalKind::Wrong, format!("the request is no JSON: {error}")))?,
        _ => return Err(Refusal::new(RefusalKind::Forbidden, format!("{method} is not served"))),
    };
    let query = Query::parse(uri.query().unwrap_or_default());
    let (data, reads) = (data.to_owned(), *method == Method::GET);
    // Work beyond this waits here and not in threads.
    let _turn = shared.work.acquire().await;
    let site = shared.clone();
    let work = tokio::task::spawn_blocking(move || {
        let parts: Vec<&str> = data.split('/').collect();
        if reads { site.site.get(&parts, &query) } else { site.site.post(&parts, &asked) }
    });
    work.await.map_err(|error| {
        Refusal::new(RefusalKind::Failed, format!("the answer broke off; this is a fault of epirig: {error}"))
    })?
}

fn refused(refusal: &Refusal) -> Response<Body> {
    #[derive(Serialize)]
    struct Failure<'a> {
        error: Message<'a>,
    }
    #[derive(Serialize)]
    struct Message<'a> {
        message: &'a str,
    }
    let status = match refusal.kind {
        RefusalKind::Wrong => StatusCode::BAD_REQUEST,
        RefusalKind::NoToken => StatusCode::UNAUTHORIZED,
        RefusalKind::Forbidden => StatusCode::FORBIDDEN,
        RefusalKind::NotFound => StatusCode::NOT_FOUND,
        RefusalKind::Busy => StatusCode::SERVICE_UNAVAILABLE,
        RefusalKind::Failed => StatusCode::INTERNAL_SERVER_ERROR,
    };
    // Text always serialises as JSON.
    let json =
        serde_json::to_vec(&Failure { error: Message { message: &refusal.message } }).unwrap_or_default();
    respond(status, "application/json", json)
}

fn respond(status: StatusCode, media_type: &'static str, bytes: Vec<u8>) -> Response<Body> {
    let mut response = Response::new(Body::from(bytes));
    *response.status_mut() = status;
    response.headers_mut().insert(header::CONTENT_TYPE, HeaderValue::from_static(media_type));
    response
}
