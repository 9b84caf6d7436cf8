//! What can be asked, and who answers.

use std::{
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicUsize, Ordering},
    },
    time::{Duration, Instant},
};

use glam::Vec2;
use http_body_util::{BodyExt, Limited, channel::Channel};
use hyper::{
    Method, Request, Response, StatusCode,
    body::{Bytes, Incoming},
    header::{self, HeaderValue},
};
use serde_json::{Value, json};
use tokio::{sync::Semaphore, task, time};

use super::{
    cloth,
    document::{Posted, diagnostics},
    draft,
    guard::Guard,
    look::Wanted,
    page, parameters,
    reply::{self, Body, Refusal, value_of},
    session::Session,
    view::{Kind, View},
};
use crate::{
    draft::DraftFile,
    fabric::{self, PRESET, presets::PRESETS},
    image::Format,
    scene::{
        stage::{Form, KEY_DIRECTION},
        swatch,
    },
};

/// What answers.
#[derive(Debug)]
pub(super) struct App {
    guard: Guard,
    session: Arc<Session>,
    /// Bodies that are read at a time: each may take as much as one may have.
    bodies: Semaphore,
    /// Those who wait for events.
    watching: AtomicUsize,
    asked: Mutex<Instant>,
}

/// Most bytes of a body, and the time in which it must have come.
const MAX_BODY: usize = 16 << 20;
const BODY_TIME: Duration = Duration::from_secs(20);

/// Bodies that are read at a time.
const MAX_BODIES: usize = 2;

/// Streams of events at a time.
const MAX_WATCHING: usize = 16;

/// Time after which those who wait for events are told that there are none.
const PING: Duration = Duration::from_secs(15);

impl App {
    pub(super) fn new(guard: Guard, session: Arc<Session>) -> Self {
        Self {
            guard,
            session,
            bodies: Semaphore::new(MAX_BODIES),
            watching: AtomicUsize::new(0),
            asked: Mutex::new(Instant::now()),
        }
    }

    /// Time since somebody was last there.
    pub(super) fn idle(&self) -> Duration {
        if self.watching.load(Ordering::Relaxed) > 0 {
            return Duration::ZERO;
        }
        self.asked.lock().unwrap_or_else(PoisonError::into_inner).elapsed()
    }
}

/// The answer to `request`.
pub(super) async fn answer(app: &Arc<App>, request: Request<Incoming>) -> Response<Body> {
    let Some(path) = app.guard.admit(request.uri(), request.headers()) else {
        return Refusal::new(StatusCode::FORBIDDEN, "found no token, expected that of this studio")
            .reply();
    };
    let path = path.to_owned();
    *app.asked.lock().unwrap_or_else(PoisonError::into_inner) = Instant::now();
    route(app, &path, request).await.unwrap_or_else(Refusal::reply)
}

async fn route(
    app: &Arc<App>,
    path: &str,
    request: Request<Incoming>,
) -> Result<Response<Body>, Refusal> {
    let session = &app.session;
    let query = Query::of(&request);
    let name = path.strip_prefix("/api/");
    match (request.method(), name) {
        (&Method::GET, None) if path == "/" => {
            let index = page::index(app.guard.token());
            Ok(reply::bytes(StatusCode::OK, "text/html; charset=utf-8", index))
        }
        (&Method::GET, None) => {
            let file = page::file(path.trim_start_matches('/'));
            let (kind, text) = file.ok_or_else(|| no_such(path))?;
            Ok(reply::bytes(StatusCode::OK, kind, Bytes::from_static(text.as_bytes())))
        }
        (&Method::GET, Some("events")) => events(app),
        (&Method::GET, Some("document")) => ok(&document(session)),
        (&Method::GET, Some("parameters")) => ok(&parameters::all()),
        (&Method::GET, Some("cloth")) => ok(&cloth::describe(&session.document())),
        (&Method::GET, Some("draft")) => {
            let document = session.document();
            blocking(move || Ok(draft::describe(&document))).await
        }
        (&Method::GET, Some("albedo")) => {
            let (shown, yarn) = (session.shown()?, query.number("yarn")?);
            let albedo = move || {
                let cloth = &shown.document.cloth;
                let found = cloth::albedo(cloth, &shown.shader, yarn);
                found.ok_or_else(|| {
                    Refusal::missing(format_args!("yarn {yarn}: it is nowhere seen"))
                })
            };
            blocking(albedo).await
        }
        (&Method::GET, Some("at")) => {
            let place = Vec2::new(query.number("x")?, query.number("y")?);
            ok(&session.shown()?.at(place))
        }
        (&Method::GET, Some("mask")) => {
            let wanted = Wanted {
                end: query.optional("end")?,
                pick: query.optional("pick")?,
                yarn: query.optional("yarn")?,
            };
            let shown = session.shown()?;
            let mask = task::spawn_blocking(move || shown.mask(wanted)).await;
            Ok(reply::bytes(StatusCode::OK, "image/png", mask.map_err(stopped)??))
        }
        (&Method::GET, Some("presets")) => blocking_in(session, presets).await,
        (&Method::GET, Some("command")) => {
            let view = session.document().view;
            ok(&json!({ "command": view.command("fabric.json", "out.png") }))
        }
        (&Method::GET, Some("export")) => export(session, &query).await,
        (&Method::GET, Some(name)) => file(session, name).ok_or_else(|| no_such(path)),
        (&Method::POST, Some("document")) => {
            let accepted = Instant::now();
            let body = body(app, request).await?;
            let show = move |session: &Session| session.show(Posted::read(&body)?, accepted);
            blocking_in(session, show).await
        }
        (&Method::POST, Some("save")) => {
            let body = body(app, request).await?;
            let save = move |session: &Session| {
                let document = session.document().changed(Posted::read(&body)?, Instant::now())?;
                session.save(&document.source).map(|name| json!({ "saved": name }))
            };
            blocking_in(session, save).await
        }
        (&Method::POST, Some("fabric-text")) => {
            let body = body(app, request).await?;
            let text = move |session: &Session| {
                let document = session.document().changed(Posted::read(&body)?, Instant::now())?;
                Ok(json!({ "text": document.source.to_json(true) + "\n" }))
            };
            blocking_in(session, text).await
        }
        (&Method::POST, Some("wif")) => {
            let body = body(app, request).await?;
            let name = query.text("name").unwrap_or_else(|| "draft".to_owned());
            blocking(move || wif(&name, &body)).await
        }
        (&Method::POST, _) => Err(no_such(path)),
        (method, _) => Err(Refusal::new(
            StatusCode::METHOD_NOT_ALLOWED,
            format_args!("{path}: found {method}, expected GET or POST"),
        )),
    }
}

fn ok(value: &Value) -> Result<Response<Body>, Refusal> {
    Ok(reply::json(StatusCode::OK, value))
}

fn no_such(path: &str) -> Refusal {
    Refusal::missing(format_args!("{path}: found no such address"))
}

/// What is answered where what should have answered has panicked.
fn stopped(_: task::JoinError) -> Refusal {
    Refusal::new(StatusCode::INTERNAL_SERVER_ERROR, "found a fault of this program")
}

/// Lets `work` answer, which may take a while.
async fn blocking(
    work: impl FnOnce() -> Result<Value, Refusal> + Send + 'static,
) -> Result<Response<Body>, Refusal> {
    let value = task::spawn_blocking(work).await.map_err(stopped)??;
    ok(&value)
}

async fn blocking_in(
    session: &Arc<Session>,
    work: impl FnOnce(&Session) -> Result<Value, Refusal> + Send + 'static,
) -> Result<Response<Body>, Refusal> {
    let session = Arc::clone(session);
    blocking(move || work(&session)).await
}

/// The body of `request`.
async fn body(app: &App, request: Request<Incoming>) -> Result<Bytes, Refusal> {
    let too_large = || {
        let what = format_args!("body: found more, expected at most {MAX_BODY} bytes");
        Refusal::new(StatusCode::PAYLOAD_TOO_LARGE, what)
    };
    let claimed = request.headers().get(header::CONTENT_LENGTH);
    let claimed = claimed.and_then(|length| length.to_str().ok()?.parse::<u64>().ok());
    if claimed.is_some_and(|bytes| bytes > MAX_BODY as u64) {
        return Err(too_large());
    }
    let reading = async {
        let _place = app.bodies.acquire().await;
        Limited::new(request.into_body(), MAX_BODY).collect().await
    };
    match time::timeout(BODY_TIME, reading).await {
        Ok(Ok(body)) => Ok(body.to_bytes()),
        Ok(Err(_)) => Err(too_large()),
        Err(_) => {
            Err(Refusal::new(StatusCode::REQUEST_TIMEOUT, "body: found no end, expected one"))
        }
    }
}

/// The document with all that a page needs to show it.
fn document(session: &Session) -> Value {
    let document = session.document();
    let orbits = [Kind::Drape, Kind::Sphere].map(|kind| {
        let camera = kind.form().map(Form::orbit);
        json!({ "camera": value_of(&camera), "light": value_of(&KEY_DIRECTION) })
    });
    let [drape, sphere] = orbits;
    let mut value = document.summary();
    let fabric = document.source.to_json(true);
    value["fabric"] = serde_json::from_str(&fabric).unwrap_or_default();
    value["view"] = value_of(&document.view);
    value["saves_to"] = json!(session.saves_to());
    value["defaults"] = json!({
        "drape": drape,
        "sphere": sphere,
        "swatch": { "light": value_of(&swatch::Light::Raking.direction()) },
        "view": value_of(&View::default()),
    });
    value
}

/// The fabric of a draft that is dropped on the page.
fn wif(name: &str, bytes: &[u8]) -> Result<Value, Refusal> {
    let file = DraftFile::new(name.to_owned(), bytes);
    let diagnostics = diagnostics(&file);
    if let Err(error) = file.drawdown() {
        let error = super::document::chain(&error);
        return Err(Refusal::wrong(error).with_diagnostics(diagnostics));
    }
    let fabric = fabric::of_draft(name.to_owned(), bytes).to_json(true);
    let fabric: Value = serde_json::from_str(&fabric).unwrap_or_default();
    Ok(json!({ "name": name, "fabric": fabric, "diagnostics": diagnostics }))
}

/// The fabrics that are compiled in.
fn presets(session: &Session) -> Result<Value, Refusal> {
    session.want_thumbnails();
    let describe = |name: &str| -> anyhow::Result<Value> {
        let source = fabric::read(format!("{PRESET}{name}").as_ref())?;
        let drawdown = source.draft().drawdown()?;
        let size = source.cloth(&drawdown)?.size() * 1e3;
        Ok(json!({
            "name": name,
            "title": source.draft().draft()?.text.title,
            "ends": drawdown.ends(),
            "picks": drawdown.picks(),
            "size_mm": [size.x, size.y],
            "has_thumbnail": session.thumbnail(name).is_some(),
        }))
    };
    let all = PRESETS.iter().map(|preset| describe(preset.name));
    let all: anyhow::Result<Vec<_>> = all.collect();
    Ok(all.map_err(|error| Refusal::conflict(format_args!("{error:#}")))?.into())
}

/// What is named by a part of its address: a frame, a thumbnail or a preset.
fn file(session: &Session, name: &str) -> Option<Response<Body>> {
    let png = |bytes| reply::bytes(StatusCode::OK, "image/png", bytes);
    let (folder, name) = name.split_once('/')?;
    match (folder, name.strip_suffix(".png")) {
        ("frame", Some(id)) => session.frame(id.parse().ok()?).map(png),
        ("preset", Some(name)) => session.thumbnail(name).map(png),
        ("preset", None) => {
            PRESETS.iter().find(|preset| preset.name == name)?;
            let source = fabric::read(format!("{PRESET}{name}").as_ref()).ok()?;
            let fabric: Value = serde_json::from_str(&source.to_json(true)).ok()?;
            Some(reply::json(StatusCode::OK, &json!({ "name": name, "fabric": fabric })))
        }
        _ => None,
    }
}

/// The picture when it is done.
async fn export(session: &Session, query: &Query) -> Result<Response<Body>, Refusal> {
    let (format, kind, disposition) = match query.text("format").as_deref() {
        Some("png") => (Format::Png, "image/png", "attachment; filename=\"cloth.png\""),
        Some("exr") => (Format::Exr, "image/x-exr", "attachment; filename=\"cloth.exr\""),
        _ => return Err(Refusal::wrong("format: expected png or exr")),
    };
    let bytes = session.export(format).await;
    let bytes = bytes.map_err(|_| Refusal::conflict("picture: found another one asked for"))?;
    let mut response = reply::bytes(StatusCode::OK, kind, bytes);
    let headers = response.headers_mut();
    headers.insert(header::CONTENT_DISPOSITION, HeaderValue::from_static(disposition));
    Ok(response)
}

/// Events as they happen, until the other side goes.
fn events(app: &Arc<App>) -> Result<Response<Body>, Refusal> {
    /// Counts who waits as long as it lives.
    struct Watching(Arc<App>);
    impl Drop for Watching {
        fn drop(&mut self) {
            self.0.watching.fetch_sub(1, Ordering::Relaxed);
            *self.0.asked.lock().unwrap_or_else(PoisonError::into_inner) = Instant::now();
        }
    }
    let before = app.watching.fetch_add(1, Ordering::Relaxed);
    let watching = Watching(Arc::clone(app));
    if before >= MAX_WATCHING {
        let what = format_args!("events: found {before} listeners, expected fewer");
        return Err(Refusal::new(StatusCode::SERVICE_UNAVAILABLE, what));
    }
    let (mut to, from) = Channel::new(1);
    task::spawn(async move {
        let session = &watching.0.session;
        let mut changes = session.watch();
        let mut last = 0;
        loop {
            changes.mark_unchanged();
            let (newest, events) = session.events_after(last);
            last = newest;
            let mut text = String::new();
            for event in &events {
                text += &format!("event: {}\ndata: {}\n\n", event.name, event.data);
            }
            if !text.is_empty() && to.send_data(text.into()).await.is_err() {
                return;
            }
            let ping = "event: ping\ndata: {}\n\n";
            if time::timeout(PING, changes.changed()).await.is_err()
                && to.send_data(Bytes::from_static(ping.as_bytes())).await.is_err()
            {
                return;
            }
        }
    });
    Ok(reply::events(from))
}

/// What stands behind the question mark.
struct Query(Vec<(String, String)>);

impl Query {
    fn of(request: &Request<Incoming>) -> Self {
        let query = request.uri().query().unwrap_or_default();
        Self(form_urlencoded::parse(query.as_bytes()).into_owned().collect())
    }

    fn text(&self, name: &str) -> Option<String> {
        self.0.iter().find(|(found, _)| found == name).map(|(_, value)| value.clone())
    }

    fn optional<T: std::str::FromStr>(&self, name: &str) -> Result<Option<T>, Refusal> {
        let Some(text) = self.text(name) else { return Ok(None) };
        let wrong = |_| Refusal::wrong(format_args!("{name}: found {text:?}, expected a number"));
        text.parse().map(Some).map_err(wrong)
    }

    fn number<T: std::str::FromStr>(&self, name: &str) -> Result<T, Refusal> {
        self.optional(name)?
            .ok_or_else(|| Refusal::wrong(format_args!("{name}: found none, expected a number")))
    }
}
