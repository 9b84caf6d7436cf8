//! What the painter, the page and the server share.

use std::{
    collections::VecDeque,
    path::Path,
    sync::{
        Arc, Condvar, Mutex, MutexGuard, OnceLock, PoisonError,
        atomic::{AtomicBool, Ordering},
    },
};

use hyper::body::Bytes;
use selvedge_yarn_brdf::Shader;
use serde_json::{Value, json};
use tokio::sync::{oneshot, watch};

use super::{
    document::{Document, Posted},
    look::Seen,
    reply::Refusal,
    view::View,
};
use crate::{
    fabric::{FabricSource, presets::PRESETS},
    image::Format,
    output::Destination,
    render::film::Size,
    scene::Scene,
};

/// The state of a studio, which lasts from its start to its end.
#[derive(Debug)]
pub(super) struct Session {
    state: Mutex<State>,
    /// Tells the painter that there is something to do.
    wake: Condvar,
    /// Ends the render under way.
    pub(super) interrupt: AtomicBool,
    /// Counts events, for those who wait for them.
    events: watch::Sender<u64>,
    /// The file that it was started with, if that can be written.
    destination: Option<Destination>,
    saves_to: Option<String>,
}

#[derive(Debug)]
struct State {
    document: Arc<Document>,
    /// Whether the document has not been begun.
    is_new: bool,
    is_closed: bool,
    shown: Option<Arc<Shown>>,
    /// The last frames, oldest first.
    frames: VecDeque<(u64, Bytes)>,
    frames_made: u64,
    /// The last event of each kind, and when it came to be; of thumbnails all.
    events: Vec<(u64, Event)>,
    events_made: u64,
    /// The picture of the document as PNG, once it is done.
    done: Option<Bytes>,
    exports: Vec<Export>,
    thumbnails: Vec<(&'static str, Bytes)>,
    /// Whether somebody has asked for the presets.
    wants_thumbnails: bool,
}

/// What is on the screen: a cloth in its scene, as its camera sees it.
#[derive(Debug)]
pub(super) struct Shown {
    pub(super) document: Arc<Document>,
    pub(super) scene: Scene,
    pub(super) shader: Arc<Shader>,
    /// What each pixel of the full size shows, once somebody has asked.
    pub(super) seen: OnceLock<Vec<Option<Seen>>>,
}

/// Something that a page wants to know when it happens.
#[derive(Clone, Debug)]
pub(super) struct Event {
    pub(super) name: &'static str,
    pub(super) data: Arc<str>,
}

/// Somebody waits for the picture when it is done.
#[derive(Debug)]
pub(super) struct Export {
    pub(super) format: Format,
    pub(super) to: oneshot::Sender<Bytes>,
}

/// What the painter is to do.
#[derive(Debug)]
pub(super) enum Task {
    /// Draw this.
    Draw(Arc<Document>),
    /// Draw what is shown with all its layers, for somebody.
    Export(Arc<Shown>, Export),
    /// Draw the presets, small.
    Thumbnails,
    /// End.
    Close,
}

impl State {
    fn missing_thumbnail(&self) -> Option<&'static str> {
        let has = |name: &str| self.thumbnails.iter().any(|(found, _)| *found == name);
        let missing = PRESETS.iter().map(|preset| preset.name).find(|name| !has(name));
        missing.filter(|_| self.wants_thumbnails)
    }
}

/// Frames that are kept: a page may ask for one that has just been replaced.
const KEPT_FRAMES: usize = 4;

/// The thumbnail event, of which none replaces another.
const THUMBNAIL: &str = "thumbnail";

impl Session {
    /// The session that shows `source`, which was read from `input`.
    ///
    /// # Errors
    ///
    /// When it makes no cloth.
    pub(super) fn new(source: FabricSource, input: &Path) -> anyhow::Result<Self> {
        let is_json = input.extension().is_some_and(|e| e.eq_ignore_ascii_case("json"));
        let destination = (is_json && input.is_file()).then(|| Destination::new(input).ok());
        let destination = destination.flatten();
        let saves_to = destination.as_ref().map(|_| input.display().to_string());
        let document = Arc::new(Document::new(source, View::default(), 1)?);
        let state = State {
            document,
            is_new: true,
            is_closed: false,
            shown: None,
            frames: VecDeque::new(),
            frames_made: 0,
            events: Vec::new(),
            events_made: 0,
            done: None,
            exports: Vec::new(),
            thumbnails: Vec::new(),
            wants_thumbnails: false,
        };
        Ok(Self {
            state: Mutex::new(state),
            wake: Condvar::new(),
            interrupt: AtomicBool::new(false),
            events: watch::Sender::new(0),
            destination,
            saves_to,
        })
    }

    fn state(&self) -> MutexGuard<'_, State> {
        // No change of the state can fail halfway.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The document.
    pub(super) fn document(&self) -> Arc<Document> {
        Arc::clone(&self.state().document)
    }

    /// The file that [`Session::save`] writes.
    pub(super) fn saves_to(&self) -> Option<&str> {
        self.saves_to.as_deref()
    }

    /// Shows what `posted` makes of the document, and returns what is told of that at once.
    ///
    /// # Errors
    ///
    /// When it makes no cloth; then nothing changes.
    pub(super) fn show(
        &self,
        posted: Posted,
        accepted: std::time::Instant,
    ) -> Result<Value, Refusal> {
        let is_aside = posted.aside;
        let mut document = self.document().changed(posted, accepted)?;
        let mut state = self.state();
        document.revision = state.document.revision + 1;
        let document = Arc::new(document);
        state.document = Arc::clone(&document);
        state.is_new = true;
        state.done = None;
        // Whoever waits for the old picture learns that there is none to come.
        state.exports.clear();
        self.interrupt.store(true, Ordering::Relaxed);
        drop(state);
        self.wake.notify_all();
        if !is_aside {
            self.tell("document", &json!({ "revision": document.revision }));
        }
        Ok(document.summary())
    }

    /// Writes the fabric of `posted` to the file that the studio was started with, and returns its name.
    ///
    /// # Errors
    ///
    /// When there is no such file, or it cannot be written.
    pub(super) fn save(&self, source: &FabricSource) -> Result<String, Refusal> {
        let (Some(destination), Some(name)) = (&self.destination, &self.saves_to) else {
            return Err(Refusal::conflict(
                "save: found no fabric that the studio was started with, expected one",
            ));
        };
        let text = source.to_json(false) + "\n";
        let written = destination.write(|file| file.write_all(text.as_bytes()));
        written.map_err(|error| Refusal::conflict(super::document::chain(&error)))?;
        Ok(name.clone())
    }

    /// The picture of the document, as soon as it is done.
    pub(super) fn export(&self, format: Format) -> oneshot::Receiver<Bytes> {
        let (to, from) = oneshot::channel();
        let mut state = self.state();
        match (&state.done, format) {
            (Some(done), Format::Png) => {
                // Nobody can have stopped waiting as yet.
                let _ = to.send(done.clone());
            }
            _ => state.exports.push(Export { format, to }),
        }
        drop(state);
        self.wake.notify_all();
        from
    }

    /// What is on the screen.
    ///
    /// # Errors
    ///
    /// When there is nothing as yet.
    pub(super) fn shown(&self) -> Result<Arc<Shown>, Refusal> {
        let shown = self.state().shown.clone();
        shown.ok_or_else(|| {
            Refusal::conflict("picture: found none as yet, expected to be asked later")
        })
    }

    /// The bytes of a frame; `None` if it is not kept.
    pub(super) fn frame(&self, id: u64) -> Option<Bytes> {
        let state = self.state();
        let frame = state.frames.iter().find(|(found, _)| *found == id);
        frame.map(|(_, bytes)| bytes.clone())
    }

    /// The bytes of the thumbnail of a preset, once there is one.
    pub(super) fn thumbnail(&self, name: &str) -> Option<Bytes> {
        let state = self.state();
        let found = state.thumbnails.iter().find(|(found, _)| *found == name);
        found.map(|(_, bytes)| bytes.clone())
    }

    /// Has thumbnails of the presets drawn when there is nothing else to do.
    pub(super) fn want_thumbnails(&self) {
        self.state().wants_thumbnails = true;
        self.wake.notify_all();
    }

    /// Events as they happen.
    pub(super) fn watch(&self) -> watch::Receiver<u64> {
        self.events.subscribe()
    }

    /// Events after the one with this number, and the number of the last.
    pub(super) fn events_after(&self, last: u64) -> (u64, Vec<Event>) {
        let state = self.state();
        let new = state.events.iter().filter(|(number, _)| *number > last);
        (state.events_made, new.map(|(_, event)| event.clone()).collect())
    }

    /// Ends the painter.
    pub(super) fn close(&self) {
        let mut state = self.state();
        state.is_closed = true;
        self.interrupt.store(true, Ordering::Relaxed);
        drop(state);
        self.wake.notify_all();
    }

    /// Waits for what the painter is to do next.
    pub(super) fn next_task(&self) -> Task {
        let mut state = self.state();
        loop {
            if state.is_closed {
                return Task::Close;
            }
            self.interrupt.store(false, Ordering::Relaxed);
            if state.is_new {
                state.is_new = false;
                return Task::Draw(Arc::clone(&state.document));
            }
            state.exports.retain(|export| !export.to.is_closed());
            if let (Some(_), Some(shown)) = (&state.done, state.shown.clone())
                && let Some(export) = state.exports.pop()
            {
                return Task::Export(shown, export);
            }
            if state.missing_thumbnail().is_some() {
                return Task::Thumbnails;
            }
            state = self.wake.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// The name of a preset whose thumbnail is asked for and missing.
    pub(super) fn missing_thumbnail(&self) -> Option<&'static str> {
        self.state().missing_thumbnail()
    }

    /// Puts what is drawn on the screen, unless it has been replaced.
    pub(super) fn set_shown(&self, shown: Arc<Shown>) {
        self.state().shown = Some(shown);
    }

    /// Tells of a frame of `size`, with what is known of it; `picture` if it is the picture when done.
    pub(super) fn add_frame(&self, size: Size, bytes: Bytes, mut about: Value, is_done: bool) {
        let mut state = self.state();
        state.frames_made += 1;
        let id = state.frames_made;
        about["id"] = id.into();
        about["size"] = json!([size.width(), size.height()]);
        about["done"] = is_done.into();
        if is_done && about["revision"] == state.document.revision {
            state.done = Some(bytes.clone());
            let (now, later): (Vec<_>, Vec<_>) = std::mem::take(&mut state.exports)
                .into_iter()
                .partition(|export| export.format == Format::Png);
            state.exports = later;
            for export in now {
                // Whoever asked may have gone.
                let _ = export.to.send(bytes.clone());
            }
        }
        state.frames.push_back((id, bytes));
        while state.frames.len() > KEPT_FRAMES {
            state.frames.pop_front();
        }
        drop(state);
        self.tell("frame", &about);
    }

    /// Keeps the thumbnail of a preset.
    pub(super) fn add_thumbnail(&self, name: &'static str, bytes: Bytes) {
        self.state().thumbnails.push((name, bytes));
        self.tell(THUMBNAIL, &json!({ "name": name }));
    }

    /// Tells those who watch.
    pub(super) fn tell(&self, name: &'static str, data: &Value) {
        let mut state = self.state();
        state.events_made += 1;
        let number = state.events_made;
        if name != THUMBNAIL {
            state.events.retain(|(_, event)| event.name != name);
        }
        state.events.push((number, Event { name, data: data.to_string().into() }));
        drop(state);
        self.events.send_replace(number);
    }
}
