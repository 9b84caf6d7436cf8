//! How a picture comes closer to another one, which is taken for the true one.

use std::{
    fmt::Write,
    sync::{Mutex, PoisonError},
    time::Duration,
};

use anyhow::bail;

use crate::{
    args::RenderOptions,
    image::{self, Picture, View, compare::Pair},
    input,
    output::{Destination, OutputError},
    render::{accumulate::Accumulator, film::Size},
};

/// Time between two rows within a pass.
pub(super) const EVERY: Duration = Duration::from_millis(250);

/// A table of errors over time.
#[derive(Debug)]
pub(super) struct ErrorLog {
    reference: Picture,
    destination: Destination,
    /// What radiance is multiplied by, and how it is shown, in the picture that is written.
    scale: f32,
    view: View,
    rows: Mutex<String>,
}

impl ErrorLog {
    /// The log that `options` ask for of a picture of `size`; `None` if they do not.
    ///
    /// # Errors
    ///
    /// When the log cannot be written, or there is no picture of that size to compare with.
    pub(super) fn new(options: &RenderOptions, size: Size) -> anyhow::Result<Option<Self>> {
        let effort = &options.effort;
        let (Some(reference), Some(log)) = (&effort.reference, &effort.error_log) else {
            return Ok(None);
        };
        let destination = Destination::new(log)?;
        let name = input::name(reference);
        let reference = image::read(reference)?;
        let found = reference.size();
        if found != size {
            bail!(
                "{name}: found {}x{} pixels, expected {}x{}",
                found.width(),
                found.height(),
                size.width(),
                size.height()
            );
        }
        let scale = options.exposure.exp2();
        let rows = Mutex::new("seconds,spp,relmse,flip\n".to_owned());
        Ok(Some(Self { reference, destination, scale, view: options.view, rows }))
    }

    /// Adds a row.
    pub(super) fn add(&self, accumulator: &Accumulator) {
        let beauty = accumulator.beauty();
        let pixels = f64::from(beauty.size().width()) * f64::from(beauty.size().height());
        let mut picture = Picture::from_film(&beauty);
        picture.scale(self.scale);
        picture.view = self.view;
        let pair = Pair::new(&picture, &self.reference).expect("sizes were compared");
        let comparison = pair.comparison();
        let seconds = accumulator.elapsed.as_secs_f64();
        let spp = accumulator.samples() as f64 / pixels;
        let mut rows = self.rows.lock().unwrap_or_else(PoisonError::into_inner);
        let row = format!("{seconds:.4},{spp:.4},{:e},{:e}", comparison.relmse, comparison.flip);
        writeln!(rows, "{row}").expect("a string takes all");
    }

    /// Writes all rows.
    pub(super) fn write(&self) -> Result<(), OutputError> {
        let rows = self.rows.lock().unwrap_or_else(PoisonError::into_inner);
        self.destination.write(|file| file.write_all(rows.as_bytes()))
    }
}
