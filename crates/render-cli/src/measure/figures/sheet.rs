//! Pictures on one sheet.

use glam::Vec3;

use crate::{
    image::{Layer, Picture},
    render::film::{Film, Size, SizeError},
};

/// Pixels between pictures, and what is there.
const GAP: u32 = 6;
const PAPER: Vec3 = Vec3::ONE;

/// The pictures of `rows` below each other, each row's beside each other from the left, at their own size.
///
/// # Errors
///
/// When the sheet is empty or too large for a picture.
pub fn sheet(rows: &[Vec<&Film>]) -> Result<Picture, SizeError> {
    let width = |row: &[&Film]| row.iter().map(|film| film.size().width() + GAP).sum::<u32>();
    let height = |row: &[&Film]| row.iter().map(|film| film.size().height()).max().unwrap_or(0);
    let all_width = rows.iter().map(|row| width(row)).max().unwrap_or(0).saturating_sub(GAP);
    let all_height = rows.iter().map(|row| height(row) + GAP).sum::<u32>().saturating_sub(GAP);
    let size = Size::new(all_width, all_height)?;
    let mut colors = vec![PAPER; all_width as usize * all_height as usize];
    let mut top = 0;
    for row in rows {
        let mut left = 0;
        for film in row {
            let own_width = film.size().width() as usize;
            for (y, pixels) in film.pixels().chunks(own_width).enumerate() {
                let start = (top as usize + y) * all_width as usize + left as usize;
                colors[start..start + own_width].copy_from_slice(pixels);
            }
            left += film.size().width() + GAP;
        }
        top += height(row) + GAP;
    }
    let mut picture = Picture::new(size);
    picture.push(Layer::colors("", &colors));
    Ok(picture)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_lie_where_their_rows_have_them() {
        let film = |width, height, grey: f32| {
            let mut film = Film::black(Size::new(width, height).unwrap());
            film.pixels_mut().fill(Vec3::splat(grey));
            film
        };
        let (a, b, c) = (film(3, 2, 0.1), film(2, 4, 0.2), film(4, 1, 0.3));
        let picture = sheet(&[vec![&a, &b], vec![&c]]).unwrap();
        let size = picture.size();
        assert_eq!([size.width(), size.height()], [5 + GAP, 5 + GAP]);
        let colors = picture.to_colors();
        let at = |x: u32, y: u32| colors[(y * size.width() + x) as usize].x;
        assert_eq!([at(0, 0), at(2, 2), at(3 + GAP, 3), at(0, 4 + GAP)], [0.1, 1.0, 0.2, 0.3]);
        assert!(sheet(&[]).is_err());
    }
}
