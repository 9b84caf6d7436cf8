//! What is answered.

use std::fmt;

use http_body_util::{Either, Full, channel::Channel};
use hyper::{
    Response, StatusCode,
    body::Bytes,
    header::{self, HeaderValue},
};
use serde::Serialize;
use serde_json::{Value, json};

/// What goes back: bytes, or events as they happen.
pub(super) type Body = Either<Full<Bytes>, Channel<Bytes>>;

/// What a page may load: what this program serves, and pictures that it made itself.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; \
    connect-src 'self'; base-uri 'self'; form-action 'none'; frame-ancestors 'none'";

/// Why a request is not done.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Refusal {
    status: StatusCode,
    errors: Vec<String>,
    diagnostics: Vec<Value>,
}

impl Refusal {
    /// What was sent is wrong: *where: what was found, expected what*.
    pub(super) fn wrong(error: impl fmt::Display) -> Self {
        Self::new(StatusCode::UNPROCESSABLE_ENTITY, error)
    }

    /// There is nothing of that name.
    pub(super) fn missing(error: impl fmt::Display) -> Self {
        Self::new(StatusCode::NOT_FOUND, error)
    }

    /// It cannot be done as things are.
    pub(super) fn conflict(error: impl fmt::Display) -> Self {
        Self::new(StatusCode::CONFLICT, error)
    }

    /// Any other.
    pub(super) fn new(status: StatusCode, error: impl fmt::Display) -> Self {
        Self { status, errors: vec![error.to_string()], diagnostics: Vec::new() }
    }

    /// With what is wrong with a draft.
    pub(super) fn with_diagnostics(self, diagnostics: Vec<Value>) -> Self {
        Self { diagnostics, ..self }
    }

    /// As an answer.
    pub(super) fn reply(self) -> Response<Body> {
        let Self { status, errors, diagnostics } = self;
        json(status, &json!({ "errors": errors, "diagnostics": diagnostics }))
    }
}

/// `value` in JSON, numbers of 32 bits with the digits that they need and no more.
///
/// # Panics
///
/// If it has keys other than text.
pub(super) fn value_of(value: &impl Serialize) -> Value {
    let text = serde_json::to_string(value).expect("what is told has text for keys");
    serde_json::from_str(&text).expect("what was written can be read")
}

/// An answer in JSON.
pub(super) fn json(status: StatusCode, value: &Value) -> Response<Body> {
    bytes(status, "application/json", value.to_string().into())
}

/// An answer of these bytes.
pub(super) fn bytes(status: StatusCode, kind: &'static str, bytes: Bytes) -> Response<Body> {
    with_headers(status, kind, Either::Left(Full::new(bytes)))
}

/// An answer that goes on.
pub(super) fn events(channel: Channel<Bytes>) -> Response<Body> {
    with_headers(StatusCode::OK, "text/event-stream", Either::Right(channel))
}

fn with_headers(status: StatusCode, kind: &'static str, body: Body) -> Response<Body> {
    let mut response = Response::new(body);
    *response.status_mut() = status;
    let headers = response.headers_mut();
    for (name, value) in [
        (header::CONTENT_TYPE, kind),
        (header::CACHE_CONTROL, "no-store"),
        (header::CONTENT_SECURITY_POLICY, POLICY),
        (header::REFERRER_POLICY, "no-referrer"),
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
    ] {
        headers.insert(name, HeaderValue::from_static(value));
    }
    headers.insert("cross-origin-resource-policy", HeaderValue::from_static("same-origin"));
    response
}
