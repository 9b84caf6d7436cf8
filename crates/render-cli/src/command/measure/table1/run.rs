//! One rendering in a process of its own, and what it says of itself.

use std::{
    path::{Path, PathBuf},
    process::Command,
};

use anyhow::{Context, bail};

use crate::image::{self, Picture};

/// How a scene is drawn.
#[derive(Clone, Debug)]
pub(super) struct Job<'a> {
    /// The scene's file, beside which the picture goes.
    pub(super) scene: &'a Path,
    pub(super) size: u32,
    pub(super) effort: Effort,
    pub(super) seed: u64,
    pub(super) threads: Option<u16>,
}

/// When it ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Effort {
    /// After so many samples per pixel.
    Spp(u64),
    /// When the noise is so low, or after so many samples per pixel.
    Noise(f64, u64),
}

/// What a rendering took.
#[derive(Clone, Debug)]
pub(super) struct Run {
    /// Of drawing alone, without reading the scene.
    pub(super) seconds: f64,
    /// The most that the process held, bytes.
    pub(super) memory: f64,
    /// Of the cloth or the pictures on it, bytes; 0 if there is neither.
    pub(super) shader: f64,
    /// Samples per pixel, on average.
    pub(super) spp: f64,
    pub(super) picture: Picture,
}

impl Job<'_> {
    /// Draws it with this program.
    ///
    /// # Errors
    ///
    /// When it cannot be started, fails, or does not tell what it took.
    pub(super) fn run(&self) -> anyhow::Result<Run> {
        let program = std::env::current_exe().context("this program: cannot be found")?;
        let output: PathBuf = self.scene.with_extension("png");
        let mut command = Command::new(program);
        command.arg("render").arg(self.scene).arg("-o").arg(&output);
        command.args(["--view", "raw", "--stats", "--quiet", "--progress", "none"]);
        command.args(["--size", &format!("{0}x{0}", self.size), "--seed", &self.seed.to_string()]);
        match self.effort {
            Effort::Spp(spp) => command.args(["--spp", &spp.to_string()]),
            Effort::Noise(noise, spp) => {
                command.args(["--noise", &noise.to_string(), "--spp", &spp.to_string()])
            }
        };
        if let Some(threads) = self.threads {
            command.args(["--threads", &threads.to_string()]);
        }
        let ended = command.output().context("this program: cannot be started")?;
        let told = String::from_utf8_lossy(&ended.stderr);
        if !ended.status.success() {
            bail!("{}: cannot be drawn: {}", self.scene.display(), told.trim_end());
        }
        let number = |name: &str| number(&told, name);
        let needed = |name: &str| {
            number(name).with_context(|| format!("{name}: found none, expected one in: {told}"))
        };
        Ok(Run {
            seconds: needed("seconds")?,
            memory: needed("peak memory")? * 1e6,
            shader: number("cloth").or(number("textures")).unwrap_or(0.0) * 1e3,
            spp: needed("spp mean")?,
            picture: image::read(&output)?,
        })
    }
}

/// The number that the line `name` of `told` begins with.
fn number(told: &str, name: &str) -> Option<f64> {
    let line = told.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix(' '))?;
    line.split_whitespace().next()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_found_by_the_whole_name() {
        let told = "spp min     4\nspp mean    5.25\nseconds     1.5\npeak memory 57.1 MB\ncloth       9.0 kB\n";
        assert_eq!(number(told, "spp mean"), Some(5.25));
        assert_eq!(number(told, "peak memory"), Some(57.1));
        assert_eq!(number(told, "spp"), None);
        assert_eq!(number(told, "textures"), None);
    }
}
