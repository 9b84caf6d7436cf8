//! A picture in memory: layers of channels, and what is said about them.

use glam::{Vec2, Vec3};

use super::View;
pub use crate::render::film::Values as Samples;
use crate::render::film::{Exposed, Film, Size};

/// A picture of one or more layers that all have its size.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    size: Size,
    layers: Vec<Layer>,
    /// What is said about it, in order, under names that differ.
    pub metadata: Vec<(String, Value)>,
    /// How its main layer wants to be shown: [`View::Srgb`] if it is radiance, [`View::Raw`] if it
    /// comes from a file made for screens.
    pub view: View,
}

/// Channels that belong together, such as red, green and blue.
#[derive(Clone, Debug, PartialEq)]
pub struct Layer {
    /// Its name, as in `albedo`; empty for the beauty layer, the picture proper.
    pub name: String,
    /// Its channels, in the order in which they are spoken of.
    pub channels: Vec<Channel>,
}

/// A number for each pixel.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// Its name within the layer, as in `R`; empty where it is all there is of the layer.
    pub name: String,
    /// The numbers, row after row from the top, each from left to right.
    pub samples: Samples,
}

/// Something said about a picture.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// Words.
    Text(String),
    /// A whole number.
    Integer(i32),
    /// A number.
    Real(f64),
    /// Numbers.
    List(Vec<f32>),
}

/// What the beauty layer, which has no name, is called on the command line.
pub const BEAUTY: &str = "beauty";

impl Picture {
    /// A picture without layers as yet, of radiance.
    pub fn new(size: Size) -> Self {
        Self { size, layers: Vec::new(), metadata: Vec::new(), view: View::Srgb }
    }

    /// The picture whose only layer is `film`.
    pub fn from_film(film: &Film) -> Self {
        let mut picture = Self::new(film.size());
        picture.push(Layer::colors("", film.pixels()));
        picture
    }

    /// The picture of what was exposed, the part within its crop, with all its layers.
    pub fn from_exposed(exposed: &Exposed) -> Self {
        let mut picture = Self::from_film(&exposed.beauty);
        for plane in &exposed.planes {
            let samples = plane.values.clone();
            let channel = Channel { name: plane.channel.to_owned(), samples };
            match picture.layers.iter_mut().find(|layer| layer.name == plane.layer) {
                Some(layer) => layer.channels.push(channel),
                None => {
                    picture.push(Layer { name: plane.layer.to_owned(), channels: vec![channel] });
                }
            }
        }
        picture
    }

    /// Adds a layer.
    ///
    /// # Panics
    ///
    /// If a channel of it has not one number for each pixel, or a channel of this full name is
    /// there already.
    pub fn push(&mut self, layer: Layer) {
        let pixels = self.pixels();
        for channel in &layer.channels {
            let name = layer.full_name(channel);
            assert_eq!(channel.samples.len(), pixels, "channel {name:?}: one number per pixel");
            assert!(!self.has(&name), "channel {name:?} is there already");
        }
        self.layers.push(layer);
    }

    /// Whether there is a channel of this full name.
    fn has(&self, name: &str) -> bool {
        let mut channels =
            self.layers.iter().flat_map(|layer| layer.channels.iter().map(move |c| (layer, c)));
        channels.any(|(layer, channel)| layer.full_name(channel) == name)
    }

    /// Width and height.
    pub fn size(&self) -> Size {
        self.size
    }

    /// Number of pixels.
    pub fn pixels(&self) -> usize {
        self.size.width() as usize * self.size.height() as usize
    }

    /// All layers.
    pub fn layers(&self) -> &[Layer] {
        &self.layers
    }

    /// The layer of this name; the one without a name is also found as [`BEAUTY`].
    pub fn layer(&self, name: &str) -> Option<&Layer> {
        let find = |name| self.layers.iter().find(|layer| layer.name == name);
        find(name).or_else(|| (name == BEAUTY).then(|| find("")).flatten())
    }

    /// What one who opens the picture wants to see: the beauty layer, else the first with red,
    /// green and blue, else the first. `None` if there are no layers.
    pub fn main_layer(&self) -> Option<&Layer> {
        let colored = |layer: &&Layer| ["R", "G", "B"].iter().all(|name| layer.has(name));
        self.layer("").or_else(|| self.layers.iter().find(colored)).or_else(|| self.layers.first())
    }

    /// The colours of the main layer, as [`Layer::to_colors`]; empty if there are no layers.
    pub fn to_colors(&self) -> Vec<Vec3> {
        self.main_layer().map(Layer::to_colors).unwrap_or_default()
    }

    /// The picture of nothing but the layer `name`, with all that is said about it; `None` if there
    /// is no such layer.
    pub fn into_layer(mut self, name: &str) -> Option<Self> {
        let name = self.layer(name)?.name.clone();
        self.layers.retain(|layer| layer.name == name);
        Some(self)
    }

    /// The picture of nothing but its main layer.
    pub fn into_main_layer(self) -> Self {
        match self.main_layer().map(|layer| layer.name.clone()) {
            Some(name) => Self {
                layers: self.layers.into_iter().filter(|layer| layer.name == name).collect(),
                ..self
            },
            None => self,
        }
    }

    /// Sets the colour of a pixel of the main layer: where it has red, green and blue.
    ///
    /// # Panics
    ///
    /// If column and row `place` are outside of the picture.
    pub fn paint(&mut self, place: [u32; 2], color: Vec3) {
        let index = place[1] as usize * self.size.width() as usize + place[0] as usize;
        let Some(name) = self.main_layer().map(|layer| layer.name.clone()) else { return };
        let layer = self.layers.iter_mut().find(|layer| layer.name == name);
        for channel in layer.into_iter().flat_map(|layer| &mut layer.channels) {
            let component = ["R", "G", "B"].iter().position(|name| *name == channel.name);
            if let (Some(component), Samples::F32(samples)) = (component, &mut channel.samples) {
                samples[index] = color[component];
            }
        }
    }

    /// Multiplies each quantity by `factor`; numbers of things stay.
    pub fn scale(&mut self, factor: f32) {
        for channel in self.layers.iter_mut().flat_map(|layer| &mut layer.channels) {
            if let Samples::F32(samples) = &mut channel.samples {
                samples.iter_mut().for_each(|x| *x *= factor);
            }
        }
    }
}

impl Layer {
    /// A layer of colours or radiance: `R`, `G` and `B`.
    pub fn colors(name: &str, colors: &[Vec3]) -> Self {
        Self::of_components(name, ["R", "G", "B"], |k| colors.iter().map(|c| c[k]).collect())
    }

    /// A layer of directions or places: `X`, `Y` and `Z`.
    pub fn vectors(name: &str, vectors: &[Vec3]) -> Self {
        Self::of_components(name, ["X", "Y", "Z"], |k| vectors.iter().map(|v| v[k]).collect())
    }

    /// A layer of places on a surface: `U` and `V`.
    pub fn places(name: &str, places: &[Vec2]) -> Self {
        Self::of_components(name, ["U", "V"], |k| places.iter().map(|p| p[k]).collect())
    }

    /// A layer of one quantity, such as `Z`.
    pub fn quantity(name: &str, samples: Vec<f32>) -> Self {
        Self::single(name, Samples::F32(samples))
    }

    /// A layer of numbers of things, such as `yarn_id`.
    pub fn numbers(name: &str, samples: Vec<u32>) -> Self {
        Self::single(name, Samples::U32(samples))
    }

    fn single(name: &str, samples: Samples) -> Self {
        let channels = vec![Channel { name: String::new(), samples }];
        Self { name: name.to_owned(), channels }
    }

    fn of_components<const N: usize>(
        name: &str,
        names: [&str; N],
        component: impl Fn(usize) -> Vec<f32>,
    ) -> Self {
        let channel = |(k, name): (usize, &str)| Channel {
            name: name.to_owned(),
            samples: Samples::F32(component(k)),
        };
        let channels = names.into_iter().enumerate().map(channel).collect();
        Self { name: name.to_owned(), channels }
    }

    /// The name of a channel of this layer within the picture: `albedo.R`, or `R` in the beauty
    /// layer, or `Z` where the layer is that channel alone.
    pub fn full_name(&self, channel: &Channel) -> String {
        match (self.name.as_str(), channel.name.as_str()) {
            ("", name) | (name, "") => name.to_owned(),
            (layer, channel) => format!("{layer}.{channel}"),
        }
    }

    /// The layer's name for people: [`BEAUTY`] if it has none.
    pub fn title(&self) -> &str {
        if self.name.is_empty() { BEAUTY } else { &self.name }
    }

    fn has(&self, name: &str) -> bool {
        self.channels.iter().any(|channel| channel.name == name)
    }

    /// What it looks like: `R`, `G` and `B` where it has any of them (black where one is missing),
    /// else its one channel as a grey, else its first two or three as red, green and blue.
    pub fn to_colors(&self) -> Vec<Vec3> {
        let named = |name| self.channels.iter().find(|channel| channel.name == name);
        let first = |k: usize| self.channels.get(k);
        let channels = match self.channels.as_slice() {
            _ if ["R", "G", "B"].iter().any(|name| self.has(name)) => ["R", "G", "B"].map(named),
            [grey] => [Some(grey); 3],
            _ => [0, 1, 2].map(first),
        };
        let count = first(0).map_or(0, |channel| channel.samples.len());
        let value = |channel: Option<&Channel>, k| channel.map_or(0.0, |c| c.samples.get(k));
        (0..count).map(|k| Vec3::from_array(channels.map(|channel| value(channel, k)))).collect()
    }
}

impl Samples {
    /// How many there are.
    pub fn len(&self) -> usize {
        match self {
            Self::F32(samples) => samples.len(),
            Self::U32(samples) => samples.len(),
        }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// That of the pixel `index`, rounded to 24 bits if it is a whole number.
    ///
    /// # Panics
    ///
    /// If there is no such pixel.
    pub fn get(&self, index: usize) -> f32 {
        match self {
            Self::F32(samples) => samples[index],
            Self::U32(samples) => samples[index] as f32,
        }
    }
}

impl From<&str> for Value {
    fn from(text: &str) -> Self {
        Self::Text(text.to_owned())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn size() -> Size {
        Size::new(2, 1).expect("it has pixels")
    }

    #[test]
    fn layers_are_found_by_name_and_the_beauty_by_its_own() {
        let mut picture = Picture::new(size());
        assert_eq!((picture.main_layer(), picture.to_colors()), (None, vec![]));
        picture.push(Layer::quantity("Z", vec![1.0, 2.0]));
        assert_eq!(picture.main_layer().map(Layer::title), Some("Z"));
        picture.push(Layer::colors("albedo", &[Vec3::X, Vec3::Y]));
        assert_eq!(picture.main_layer().map(Layer::title), Some("albedo"));
        picture.push(Layer::colors("", &[Vec3::Z, Vec3::Y]));
        assert_eq!(picture.main_layer().map(Layer::title), Some(BEAUTY));
        assert_eq!(picture.layer(BEAUTY), picture.layer(""));
        assert_eq!(picture.layer("N"), None);
        assert_eq!(picture.to_colors(), [Vec3::Z, Vec3::Y]);
        let albedo = picture.clone().into_layer("albedo").expect("it is there");
        assert_eq!(albedo.to_colors(), [Vec3::X, Vec3::Y]);
        assert_eq!(picture.into_main_layer().layers().len(), 1);
    }

    #[test]
    fn any_channels_have_colors() {
        let two = [Vec2::new(0.25, 0.5), Vec2::ONE];
        let expected = [Vec3::new(0.25, 0.5, 0.0), Vec3::new(1.0, 1.0, 0.0)];
        assert_eq!(Layer::places("uv", &two).to_colors(), expected);
        let grey = Layer::numbers("yarn_id", vec![7, 0]);
        assert_eq!(grey.to_colors(), [Vec3::splat(7.0), Vec3::ZERO]);
        let mut colors = Layer::colors("", &[Vec3::ONE; 2]);
        colors.channels.remove(1);
        assert_eq!(colors.to_colors(), [Vec3::new(1.0, 0.0, 1.0); 2]);
        assert_eq!(Layer { name: String::new(), channels: vec![] }.to_colors(), []);
    }

    #[test]
    fn only_quantities_are_scaled() {
        let mut picture = Picture::new(size());
        picture.push(Layer::quantity("Z", vec![1.0, 2.0]));
        picture.push(Layer::numbers("yarn_id", vec![1, 2]));
        picture.scale(4.0);
        assert_eq!(picture.layer("Z"), Some(&Layer::quantity("Z", vec![4.0, 8.0])));
        assert_eq!(picture.layer("yarn_id"), Some(&Layer::numbers("yarn_id", vec![1, 2])));
    }

    #[test]
    #[should_panic(expected = "is there already")]
    fn channels_have_names_of_their_own() {
        let mut picture = Picture::new(size());
        picture.push(Layer::quantity("Z", vec![1.0, 2.0]));
        picture.push(Layer::quantity("Z", vec![1.0, 2.0]));
    }

    #[test]
    #[should_panic(expected = "one number per pixel")]
    fn channels_have_the_size_of_the_picture() {
        Picture::new(size()).push(Layer::quantity("Z", vec![1.0]));
    }
}
