//! The thread that draws, one picture at a time.

use std::{
    mem,
    sync::{Arc, OnceLock, atomic::Ordering},
    time::{Duration, Instant},
};

use hyper::body::Bytes;
use rayon::ThreadPool;
use selvedge_yarn_brdf::{Cloth, Preparer, Shader};
use serde_json::{Value, json};

use super::{
    cloth,
    document::Document,
    session::{Export, Session, Shown, Task},
    thumbnails,
};
use crate::{
    command::render::{develop, metadata},
    image::{self, Format},
    render::{
        View,
        accumulate::{Accumulator, Layers},
        film::{Exposed, Frame, Size},
        progressive::{self, Control, Limits, Plan, Save, Stopped},
    },
    scene::{
        Material, Scene,
        stage::{Form, Stage},
    },
    threads,
};

/// Draws what a session asks for.
#[derive(Debug)]
pub(super) struct Painter {
    session: Arc<Session>,
    pool: ThreadPool,
    /// Of each form, once it was asked for.
    stages: Vec<(Form, Stage)>,
    /// The shader that was prepared last, and of which cloth.
    prepared: Option<(Arc<Cloth>, Arc<Shader>)>,
    preparer: Preparer,
    /// Samples per second of the last first picture.
    rate: f64,
}

/// Time that the first picture may take, s, and the greatest and the least number of its pixels.
const FIRST: f64 = 0.04;
const MOST_PIXELS: f64 = 130_000.0;
const FEWEST_PIXELS: f64 = 4_000.0;

/// Samples per second of a machine that is not known.
const GUESSED_RATE: f64 = 4e5;

/// How many times as many pixels the second picture has.
const GROWTH: f64 = 5.0;

/// Samples per pixel of the full size that are shown as soon as they are there, and those before
/// anything else is done.
const FIRST_SAMPLES: u32 = 2;
const MORE_SAMPLES: u32 = 16;

/// Time between frames of the full size.
const BETWEEN: Duration = Duration::from_millis(350);

impl Painter {
    /// A painter with so many threads, or one per processor.
    ///
    /// # Errors
    ///
    /// When the system gives none.
    pub(super) fn new(session: Arc<Session>, threads: Option<u16>) -> anyhow::Result<Self> {
        let pool = threads::pool(threads)?;
        Ok(Self {
            session,
            pool,
            stages: Vec::new(),
            prepared: None,
            preparer: Preparer::default(),
            rate: GUESSED_RATE,
        })
    }

    /// Draws until the session is closed.
    pub(super) fn run(mut self) {
        loop {
            match self.session.next_task() {
                Task::Close => return,
                Task::Draw(document) => {
                    if let Err(error) = self.draw(&document) {
                        let errors = [format!("{error:#}")];
                        let revision = document.revision;
                        self.session
                            .tell("failed", &json!({ "revision": revision, "errors": errors }));
                    }
                }
                Task::Export(shown, export) => self.export(&shown, export),
                Task::Thumbnails => self.draw_thumbnails(),
            }
        }
    }

    fn draw(&mut self, document: &Arc<Document>) -> anyhow::Result<()> {
        let pixels = (self.rate * FIRST).clamp(FEWEST_PIXELS, MOST_PIXELS);
        let mut sizes = Sizes { full: document.view.size(), pixels };
        let Some(shader) = self.shader(document, &mut sizes)? else { return Ok(()) };
        let shown = self.put_up(document, shader)?;
        while let Some(size) = sizes.next() {
            self.draw_small(&shown, size)?;
            if self.is_interrupted() {
                return Ok(());
            }
        }
        self.draw_full(&shown)
    }

    /// Draws the thumbnails that are asked for and missing, until something else is asked for.
    fn draw_thumbnails(&mut self) {
        while let Some(name) = self.session.missing_thumbnail() {
            let (preparer, interrupt) = (&mut self.preparer, &self.session.interrupt);
            let bytes = self.pool.install(|| thumbnails::draw(name, preparer, interrupt));
            // One that was interrupted is drawn another time.
            let Some(bytes) = bytes else { return };
            self.session.add_thumbnail(name, bytes);
        }
    }

    /// Puts what `document` shows on the screen, in the scene that `selvedge render` or `selvedge swatch`
    /// draws.
    fn put_up(
        &mut self,
        document: &Arc<Document>,
        shader: Arc<Shader>,
    ) -> anyhow::Result<Arc<Shown>> {
        let view = &document.view;
        let is_open = shader.has_gaps();
        let material = Material::Cloth { is_open, shader: Arc::clone(&shader) };
        let mut scene = match view.kind.form() {
            None => Scene::swatch(material, &view.swatch())?,
            Some(form) => self.stage(form)?.scene(material, &view.shot()),
        };
        scene.detail = view.detail();
        let seen = OnceLock::new();
        let shown = Arc::new(Shown { document: Arc::clone(document), scene, shader, seen });
        self.session.set_shown(Arc::clone(&shown));
        Ok(shown)
    }

    fn is_interrupted(&self) -> bool {
        self.session.interrupt.load(Ordering::Relaxed)
    }

    /// The shader of the cloth of `document`; `None` if something else is asked for meanwhile.
    ///
    /// Where that takes its time, the first pictures are drawn with a sketch of it.
    fn shader(
        &mut self,
        document: &Arc<Document>,
        sizes: &mut Sizes,
    ) -> anyhow::Result<Option<Arc<Shader>>> {
        let started = Instant::now();
        let cloth = &document.cloth;
        let known = self.prepared.take().filter(|(known, _)| Arc::ptr_eq(known, cloth));
        let shader = match known {
            Some((_, shader)) => shader,
            None => {
                let mut preparer = mem::take(&mut self.preparer);
                let shader = self.prepare(document, &mut preparer, sizes);
                self.preparer = preparer;
                let Some(shader) = shader? else { return Ok(None) };
                Arc::new(shader)
            }
        };
        self.prepared = Some((Arc::clone(cloth), Arc::clone(&shader)));
        let mut energy = cloth::energy(cloth, &shader);
        energy["revision"] = document.revision.into();
        energy["seconds"] = started.elapsed().as_secs_f64().into();
        self.session.tell("prepared", &energy);
        Ok(Some(shader))
    }

    fn prepare(
        &mut self,
        document: &Arc<Document>,
        preparer: &mut Preparer,
        sizes: &mut Sizes,
    ) -> anyhow::Result<Option<Shader>> {
        let session = Arc::clone(&self.session);
        let goes_on = || !session.interrupt.load(Ordering::Relaxed);
        let failed = |source| document.source.no_cloth(source);
        let sketch = preparer.sketch(&document.cloth, &goes_on).map_err(failed)?;
        let Some(sketch) = sketch else { return Ok(None) };
        let shown = self.put_up(document, Arc::new(sketch))?;
        if let Some(size) = sizes.next() {
            let seconds = self.draw_small(&shown, size)?;
            if !self.is_interrupted() {
                let pixels = f64::from(size.width()) * f64::from(size.height());
                self.rate = pixels / seconds.max(1e-4);
            }
        }
        let (painter, second) = (&*self, sizes.next());
        // Preparing takes one thread.
        let (shader, drawn) = self.pool.install(|| {
            rayon::join(
                || preparer.prepare(&document.cloth, &goes_on).map_err(failed),
                || second.map_or(Ok(0.0), |size| painter.draw_small(&shown, size)),
            )
        });
        drawn?;
        Ok(shader?)
    }

    fn stage(&mut self, form: Form) -> anyhow::Result<&Stage> {
        let index = match self.stages.iter().position(|(known, _)| *known == form) {
            Some(index) => index,
            None => {
                self.stages.push((form, Stage::new(form)?));
                self.stages.len() - 1
            }
        };
        Ok(&self.stages[index].1)
    }

    /// Draws a picture of fewer pixels, and returns the seconds that it took.
    fn draw_small(&self, shown: &Shown, size: Size) -> anyhow::Result<f64> {
        let started = Instant::now();
        let limits = Limits { spp: 1, time: None, noise: None };
        let plan = Plan { frame: Frame::whole(size), layers: Layers::None, limits, key: 0 };
        let view = View::new(&shown.scene, size, shown.document.view.seed, false);
        let control = Control::until(&self.session.interrupt);
        let outcome = self.pool.install(|| progressive::expose(&view, &plan, &control));
        let seconds = started.elapsed().as_secs_f64();
        if outcome.stopped != Stopped::Interrupted {
            let about = json!({ "spp": 1, "noise": null, "full": false });
            self.show(shown, &outcome.exposed(), about, None)?;
        }
        Ok(seconds)
    }

    /// Draws the picture itself and, once it looks as it will, what thumbnails are missing: it may be
    /// long until it is done.
    fn draw_full(&mut self, shown: &Shown) -> anyhow::Result<()> {
        let document = &shown.document;
        let size = document.view.size();
        let plan = plan(document, Layers::None);
        let view = View::new(&shown.scene, size, document.view.seed, false);
        let show = |painter: &Self, accumulator: &Accumulator, stopped: Option<Stopped>| {
            if accumulator.fewest() == 0 {
                return Ok(());
            }
            let pixels = f64::from(size.width()) * f64::from(size.height());
            let noise = accumulator.noise();
            let about = json!({
                "spp": accumulator.samples() as f64 / pixels,
                "noise": noise.map(|[all, _]| all),
                "noise_worst": noise.map(|[_, worst]| worst),
                "full": true,
            });
            painter.show(shown, &accumulator.exposed(), about, stopped)
        };
        let draw = |painter: &Self, limits: Limits, start: Accumulator| {
            let save = |accumulator: &Accumulator| {
                // A frame that cannot be encoded is told when the picture is done.
                let _ = show(painter, accumulator, None);
            };
            let save = Some(Save { every: BETWEEN, save: &save });
            let control = Control { save, ..Control::until(&painter.session.interrupt) };
            let plan = Plan { limits, ..plan };
            painter.pool.install(|| progressive::resume(&view, &plan, start, &control))
        };
        // A break changes no bit.
        let mut accumulator = plan.start();
        for spp in [FIRST_SAMPLES, MORE_SAMPLES] {
            if spp < plan.limits.spp {
                let outcome = draw(self, Limits { spp, ..plan.limits }, accumulator);
                if outcome.stopped == Stopped::Interrupted {
                    return Ok(());
                }
                accumulator = outcome.accumulator;
                show(self, &accumulator, None)?;
                if spp == MORE_SAMPLES && outcome.stopped != Stopped::Noise {
                    self.draw_thumbnails();
                }
            }
        }
        let outcome = draw(self, plan.limits, accumulator);
        match outcome.stopped {
            Stopped::Interrupted => Ok(()),
            stopped => show(self, &outcome.accumulator, Some(stopped)),
        }
    }

    /// Tells of what was exposed; `stopped` if it is the picture when done.
    fn show(
        &self,
        shown: &Shown,
        exposed: &Exposed,
        mut about: Value,
        stopped: Option<Stopped>,
    ) -> anyhow::Result<()> {
        let document = &shown.document;
        let picture = develop(exposed, document.view.exposure, image::View::Srgb);
        let bytes = Bytes::from(picture.encode(Format::Png)?);
        about["revision"] = document.revision.into();
        about["far"] = shown.scene.shades.far_share().into();
        about["seconds"] = document.accepted.elapsed().as_secs_f64().into();
        about["stopped"] =
            stopped.map(|stopped| if stopped == Stopped::Noise { "noise" } else { "spp" }).into();
        let size = exposed.frame.size();
        self.session.add_frame(size, bytes, about, stopped.is_some());
        Ok(())
    }

    /// Draws what is shown with its layers, unless something else is asked for meanwhile: then nobody
    /// hears of it.
    fn export(&self, shown: &Shown, export: Export) {
        let document = &shown.document;
        let view = &document.view;
        let plan = plan(document, Layers::All);
        let subject = View::new(&shown.scene, view.size(), view.seed, true);
        let control = Control::until(&self.session.interrupt);
        let outcome = self.pool.install(|| progressive::expose(&subject, &plan, &control));
        if outcome.stopped == Stopped::Interrupted {
            return;
        }
        let Ok(hash) = document.source.hash() else { return };
        let mut picture = develop(&outcome.exposed(), view.exposure, image::View::Srgb);
        picture.metadata = metadata(&shown.scene, &[hash], view.seed, outcome.spp_mean);
        if let Ok(bytes) = picture.encode(export.format) {
            // Whoever asked may have gone.
            let _ = export.to.send(bytes.into());
        }
    }
}

/// The picture of `document` as `selvedge render` draws it.
fn plan(document: &Document, layers: Layers) -> Plan {
    let view = &document.view;
    Plan { frame: Frame::whole(view.size()), layers, limits: view.limits(), key: 0 }
}

/// The sizes of the pictures that are drawn before the picture itself.
#[derive(Clone, Copy, Debug)]
struct Sizes {
    full: Size,
    /// Of the next.
    pixels: f64,
}

impl Sizes {
    /// The next, with the sides of the full one; `None` if it would be large.
    fn next(&mut self) -> Option<Size> {
        let pixels = self.pixels;
        self.pixels *= GROWTH;
        let [width, height] = [self.full.width(), self.full.height()].map(f64::from);
        let factor = (width * height / pixels).sqrt();
        if factor < 1.5 || pixels > MOST_PIXELS {
            return None;
        }
        let side = |length: f64| (length / factor).round().max(1.0) as u32;
        Size::new(side(width), side(height)).ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_pictures_have_the_sides_of_the_large_one() {
        let mut sizes = Sizes { full: Size::new(640, 480).unwrap(), pixels: 19_200.0 };
        assert_eq!(sizes.next(), Size::new(160, 120).ok());
        assert_eq!(sizes.next(), Size::new(358, 268).ok());
        assert_eq!(sizes.next(), None);
        let mut long = Sizes { full: Size::new(4096, 16).unwrap(), pixels: 4000.0 };
        assert_eq!(long.next(), Size::new(1012, 4).ok());
        assert_eq!(long.next(), Size::new(2263, 9).ok());
        assert_eq!(long.next(), None);
        let mut large = Sizes { full: Size::new(1448, 1448).unwrap(), pixels: MOST_PIXELS };
        assert!(large.next().is_some() && large.next().is_none());
    }
}
