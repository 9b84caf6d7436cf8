//! A ruler along the lower edge of a picture.

use std::convert::Infallible;

use embedded_graphics::{
    Drawable, Pixel,
    geometry::{Dimensions, Point, Size as Extent},
    mono_font::{
        MonoFont, MonoTextStyle,
        ascii::{FONT_6X13, FONT_10X20},
    },
    pixelcolor::{Gray8, GrayColor},
    prelude::DrawTarget,
    primitives::Rectangle,
    text::{Alignment, Baseline, Text, TextStyleBuilder},
};
use glam::Vec3;

use super::Picture;
use crate::render::film::{Crop, Frame};

/// A ruler with a scale in millimetres and a line of text, which lies on a picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Ruler {
    /// How large a millimetre is in the picture, in pixels, above 0.
    pub pixels_per_mm: f64,
    /// What stands below the scale, in ASCII.
    pub note: String,
}

/// Least width and height of a picture with a ruler, pixels.
pub const LEAST_SIZE: [u32; 2] = [240, 120];

/// Rows from which on a picture has the larger letters.
const LARGE: u32 = 480;

/// Rows of a picture to each pixel of its larger letters.
const ROWS_PER_PIXEL: u32 = 800;

/// Room for a number, in letters.
const LABEL_LETTERS: i32 = 7;

/// Least distance of two marks, in pixels of letters.
const LEAST_STEP: f64 = 5.0;

/// Pixels of letters around a text.
const MARGIN: i32 = 4;

const PAPER: Gray8 = Gray8::new(200);
const INK: Gray8 = Gray8::new(4);

impl Ruler {
    /// Draws it on the main layer of `picture`, which is that of the crop of `frame`: over the lower
    /// part of the whole picture, 0 at its left edge.
    ///
    /// Marks stand a power of ten of millimetres apart, longer ones at each fifth and tenth. Pictures
    /// below [`LEAST_SIZE`] have no room for it.
    pub fn draw(&self, frame: Frame, picture: &mut Picture) {
        let rows = frame.size().height();
        let font = if rows < LARGE { &FONT_6X13 } else { &FONT_10X20 };
        let mut canvas = Canvas { frame, picture, scale: (rows / ROWS_PER_PIXEL).max(1) };
        let Ok(()) = self.draw_on(&mut canvas, font);
    }

    fn draw_on(&self, canvas: &mut Canvas<'_>, font: &MonoFont<'_>) -> Result<(), Infallible> {
        let Extent { width, height } = canvas.bounding_box().size;
        let [width, height] = [width, height].map(|side| side as i32);
        let letter = font.character_size;
        let [letter_width, line] = [letter.width, letter.height].map(|side| side as i32);
        let top = height - 3 * line;
        canvas.fill_solid(&rectangle([0, top], [width, 3 * line]), PAPER)?;

        let pixels_per_mm = self.pixels_per_mm / f64::from(canvas.scale);
        let scale = Scale::new(pixels_per_mm, f64::from(LABEL_LETTERS * letter_width));
        for mark in (0..).take_while(|&mark| scale.place(mark) < width) {
            let tenths = match mark {
                _ if mark % scale.labelled == 0 => 8,
                _ if mark % 5 == 0 => 6,
                _ => 4,
            };
            let size = [1, line * tenths / 10];
            canvas.fill_solid(&rectangle([scale.place(mark), top], size), INK)?;
        }
        let style = MonoTextStyle::new(font, INK);
        let mut write = |text: &str, [x, y]: [i32; 2], alignment| {
            let layout = TextStyleBuilder::new().baseline(Baseline::Top).alignment(alignment);
            let text = Text::with_text_style(text, Point::new(x, y), style, layout.build());
            text.draw(canvas).map(|_| ())
        };
        let labels = top + line * 9 / 10;
        write("0 mm", [MARGIN, labels], Alignment::Left)?;
        for mark in (1..).map(|label| label * scale.labelled) {
            let (label, x) = (scale.label(mark), scale.place(mark));
            if x + label.len() as i32 * letter_width / 2 + MARGIN > width {
                break;
            }
            write(&label, [x, labels], Alignment::Center)?;
        }
        write(&self.note, [MARGIN, labels + line], Alignment::Left)
    }
}

fn rectangle([x, y]: [i32; 2], [width, height]: [i32; 2]) -> Rectangle {
    Rectangle::new(Point::new(x, y), Extent::new(width as u32, height as u32))
}

/// Which marks a ruler has.
struct Scale {
    /// Pixels between two marks.
    step: f64,
    /// Between two marks are 10 to this power of millimetres.
    power: i32,
    /// Each so-many-th mark has a number.
    labelled: i32,
}

impl Scale {
    /// Marks as close as can be told apart, numbers no closer than `least` pixels.
    fn new(pixels_per_mm: f64, least: f64) -> Self {
        let power = (LEAST_STEP / pixels_per_mm).log10().ceil() as i32;
        let step = pixels_per_mm * 10.0_f64.powi(power);
        let labelled = [1, 2, 5, 10, 20, 50, 100];
        let labelled = labelled.into_iter().find(|&marks| step * f64::from(marks) >= least);
        Self { step, power, labelled: labelled.unwrap_or(100) }
    }

    fn place(&self, mark: i32) -> i32 {
        (f64::from(mark) * self.step).round() as i32
    }

    /// Millimetres at a mark, without zeros at the end of decimals.
    fn label(&self, mark: i32) -> String {
        let decimals = usize::try_from(-self.power).unwrap_or(0);
        let text = format!("{:.decimals$}", f64::from(mark) * 10.0_f64.powi(self.power));
        if decimals == 0 {
            return text;
        }
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    }
}

/// A picture as letters see it: whole, in pixels of theirs.
struct Canvas<'a> {
    frame: Frame,
    picture: &'a mut Picture,
    /// Side of such a pixel, pixels.
    scale: u32,
}

impl Dimensions for Canvas<'_> {
    fn bounding_box(&self) -> Rectangle {
        let size = self.frame.size();
        let extent = Extent::new(size.width() / self.scale, size.height() / self.scale);
        Rectangle::new(Point::zero(), extent)
    }
}

impl DrawTarget for Canvas<'_> {
    type Color = Gray8;
    type Error = Infallible;

    fn draw_iter<I: IntoIterator<Item = Pixel<Gray8>>>(
        &mut self,
        pixels: I,
    ) -> Result<(), Infallible> {
        let (whole, crop, scale) = (self.frame.size(), self.frame.crop(), self.scale);
        // The rows that the scale leaves over are at the top.
        let left_over = whole.height() % scale;
        for Pixel(Point { x, y }, color) in pixels {
            let (Ok(x), Ok(y)) = (u32::try_from(x), u32::try_from(y)) else { continue };
            let corner = [x * scale, left_over + y * scale];
            let block = Crop::new(corner, corner.map(|place| place + scale)).ok();
            let Some(block) = block.and_then(|block| block.intersection(crop)) else { continue };
            for [x, y] in block.pixels() {
                let grey = Vec3::splat(f32::from(color.luma()) / 255.0);
                self.picture.paint([x - crop.min()[0], y - crop.min()[1]], grey);
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test stops at what it does not expect")]

    use super::*;
    use crate::{image::Layer, render::film::Size};

    /// A black picture with a ruler.
    fn ruled(frame: Frame, pixels_per_mm: f64) -> Picture {
        let size = frame.crop_size();
        let mut picture = Picture::new(size);
        let pixels = size.width() as usize * size.height() as usize;
        picture.push(Layer::colors("", &vec![Vec3::ZERO; pixels]));
        let ruler = Ruler { pixels_per_mm, note: "67 ends x 53 picks per inch".to_owned() };
        ruler.draw(frame, &mut picture);
        picture
    }

    /// Columns with a mark, in the row that is this far above the lower edge.
    fn marks(picture: &Picture, above: u32) -> Vec<u32> {
        let (width, height) = (picture.size().width(), picture.size().height());
        let row = ((height - above) * width) as usize;
        let colors = picture.to_colors();
        (0..width).filter(|&x| colors[row + x as usize].x < 0.1).collect()
    }

    #[test]
    fn marks_stand_where_millimetres_are() {
        let frame = Frame::whole(Size::new(480, 320).unwrap());
        let picture = ruled(frame, 24.0);
        // Letters are 13 rows high: row 38 from below has all marks, row 30 those with numbers.
        let all: Vec<_> = (0..20).map(|mm| mm * 24).collect();
        assert_eq!(marks(&picture, 38), all);
        let numbered = marks(&picture, 30);
        assert_eq!(numbered, (0..10).map(|k| k * 48).collect::<Vec<_>>());
        assert_eq!(picture.to_colors()[..480 * 281], vec![Vec3::ZERO; 480 * 281]);
    }

    #[test]
    fn crop_has_its_part_of_the_ruler() {
        let size = Size::new(480, 320).unwrap();
        let whole = ruled(Frame::whole(size), 17.0).to_colors();
        let crop: Crop = "100,270,333,310".parse().unwrap();
        let part = ruled(Frame::cropped(size, crop).unwrap(), 17.0).to_colors();
        let expected: Vec<_> =
            crop.pixels().map(|[x, y]| whole[(y * size.width() + x) as usize]).collect();
        assert_eq!(part, expected);
    }

    #[test]
    fn large_pictures_have_large_letters() {
        let picture = ruled(Frame::whole(Size::new(2400, 1601).unwrap()), 120.0);
        // A mark for each tenth of a millimetre, two pixels wide.
        let widths = marks(&picture, 119);
        assert_eq!(widths[..4], [0, 1, 12, 13]);
    }

    #[test]
    fn numbers_are_round_and_apart() {
        for (pixels_per_mm, least, expected) in [
            (24.0, 54.0, ["0", "5", "10"]),
            (48.0, 54.0, ["0", "2", "4"]),
            (4800.0, 54.0, ["0", "0.02", "0.04"]),
            (0.96, 54.0, ["0", "100", "200"]),
            (5.0, 90.0, ["0", "20", "40"]),
        ] {
            let scale = Scale::new(pixels_per_mm, least);
            let labels = [0, 1, 2].map(|label| scale.label(label * scale.labelled));
            assert_eq!(labels, expected, "{pixels_per_mm} pixels per mm");
            assert!(scale.step >= LEAST_STEP && scale.step < 10.0 * LEAST_STEP, "{pixels_per_mm}");
        }
    }
}
