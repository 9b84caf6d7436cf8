//! `selvedge draft drawdown`: which thread lies on top, as text or as a picture.

use std::io::{self, IsTerminal, Write};

use anyhow::{Context, bail};
use selvedge_wif::Drawdown;

use crate::{
    args::{DrawdownOptions, Form},
    draft, image,
    output::{Sink, tell},
    render::film::{Size, SizeError},
};

/// Draws the drawdown of `options.draft`. Warnings about the draft go to stderr unless
/// `options.quiet`.
///
/// # Errors
///
/// When the draft cannot be read or woven, the picture is too large, or the output cannot be
/// written.
pub fn run(options: &DrawdownOptions) -> anyhow::Result<()> {
    let sink = Sink::new(options.output.as_deref())?;
    if sink == Sink::Stdout && options.form != Form::Text && io::stdout().is_terminal() {
        bail!("standard output: found a terminal, expected a file or a pipe for a picture");
    }
    let source = draft::read(&options.draft)?;
    source.draft()?;
    if !options.quiet {
        source.warnings().for_each(tell);
    }
    let face = source.drawdown()?;
    let drawdown = if options.back { face.back() } else { face };
    match options.form {
        Form::Text => sink.write(|out| write_text(&drawdown, out))?,
        Form::Picture { scale, grid } => {
            let cells = Cells::new(&drawdown, scale, grid);
            let size = cells.size(&drawdown).context(source.name().to_owned())?;
            let picture = image::encode_pixels(size, &cells.draw(&drawdown, size))?;
            sink.write(|out| out.write_all(&picture))?;
        }
    }
    Ok(())
}

/// A line for each pick, from the first; `1` where the warp is on top, `0` elsewhere.
fn write_text(drawdown: &Drawdown, out: &mut dyn Write) -> io::Result<()> {
    let ends = drawdown.ends();
    let mut line = vec![b'\n'; ends + 1];
    for pick in 0..drawdown.picks() {
        let row = drawdown.row(pick);
        for (end, character) in line[..ends].iter_mut().enumerate() {
            *character = b'0' + (row[end / 64] >> (end % 64) & 1) as u8;
        }
        out.write_all(&line)?;
    }
    Ok(())
}

/// The squares that stand for crossings, in pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Cells {
    /// Side of the square.
    scale: usize,
    /// Width of the lines before, between and after the squares; 0 for none.
    line: usize,
}

/// Pixels per crossing of a small drawdown.
const LARGEST_DEFAULT_SCALE: usize = 16;

/// Pixels that the longer side of a drawdown takes by default where one pixel per crossing is less.
const DEFAULT_SIDE: usize = 1024;

/// The grey of the grid, in sRGB: away from the default colours of warp and weft.
const LINE: [u8; 3] = [128; 3];

impl Cells {
    fn new(drawdown: &Drawdown, scale: Option<u32>, grid: bool) -> Self {
        let longest = drawdown.ends().max(drawdown.picks());
        let line = usize::from(grid);
        let fitting = || {
            let cell = (DEFAULT_SIDE - line) / longest;
            cell.saturating_sub(line).clamp(1, LARGEST_DEFAULT_SCALE)
        };
        Self { scale: scale.map_or_else(fitting, |scale| scale as usize), line }
    }

    fn size(self, drawdown: &Drawdown) -> Result<Size, SizeError> {
        let side = |threads| {
            let pixels = threads * (self.scale + self.line) + self.line;
            u32::try_from(pixels).unwrap_or(u32::MAX)
        };
        Size::new(side(drawdown.ends()), side(drawdown.picks()))
    }

    /// Red, green and blue of each pixel, top row first: end 0 at the left, pick 0 at the bottom.
    fn draw(self, drawdown: &Drawdown, size: Size) -> Vec<u8> {
        let width = size.width() as usize;
        let mut pixels = Vec::with_capacity(3 * width * size.height() as usize);
        let line = LINE.repeat(width * self.line);
        let mut row = Vec::with_capacity(3 * width);
        for pick in (0..drawdown.picks()).rev() {
            row.clear();
            for end in 0..drawdown.ends() {
                let warp_on_top = drawdown.warp_on_top(end, pick);
                let color =
                    if warp_on_top { drawdown.end_color(end) } else { drawdown.pick_color(pick) };
                row.extend(LINE.repeat(self.line));
                row.extend(color.0.repeat(self.scale));
            }
            row.extend(LINE.repeat(self.line));
            pixels.extend_from_slice(&line);
            pixels.extend(row.repeat(self.scale));
        }
        pixels.extend_from_slice(&line);
        pixels
    }
}
