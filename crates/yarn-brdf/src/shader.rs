//! `Shader`: the light that a cloth reflects.

use core::f64::consts::FRAC_1_PI;
use core::ops::{Add, Mul};

use fearless_simd::{Level, Simd};
use glam::{DVec2, DVec3, Vec3};
use selvedge_normalize::scale::{Mode, Normalization};

use crate::cloth::{Cloth, ClothError, Combination};
use crate::far::Far;
use crate::frame::{Vector, from_yarn, to_yarn};
use crate::lanes::Wide;
use crate::material::{Lowered, Material, Materials, Piece};
use crate::parameter::ParamError;
use crate::phase::Parts;
use crate::place::Place;
use crate::real::{Real, Scalar};
use crate::segment::{Mapping, Optics, Spread, normal};
use crate::threads::Threads;
use crate::variants::Tables;
use crate::weave::{Position, Segment, Side, Weave};
use crate::{filament, rough, staple};

/// A cloth ready to be shaded: immutable, and shared freely between threads.
///
/// Positions are in metres along the cloth, u along the weft and v along the warp: end 0 starts at
/// u = 0 and pick 0 at v = 0, and the weave repeats without end. Directions are in the shading frame
/// of the cloth's face (x = ∂P/∂u, y = ∂P/∂v, z = n), unit, and point away from the surface. Where
/// both have z < 0 they are on the back, which shows the other side of every crossing.
///
/// Nothing here fails or allocates. What is not finite, in a gap, or on two sides at once reflects
/// nothing.
#[derive(Debug)]
pub struct Shader {
    pub(crate) weave: Weave,
    pub(crate) threads: Threads,
    pub(crate) frame: ClothFrame,
    pub(crate) combination: Combination,
    pub(crate) mapping: Mapping,
    pub(crate) seed: u64,
    pub(crate) materials: Materials,
    pub(crate) far: Far,
    /// The instructions for batches.
    pub(crate) level: Level,
}

/// How positions and directions of the surface lie to the threads.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ClothFrame {
    /// Cells per metre along the weft and the warp.
    pub(crate) cells_per_m: DVec2,
    /// Sine and cosine of the angle from u to the weft; `None` if it is 0.
    pub(crate) turn: Option<(f64, f64)>,
    /// Width over length of a cell along a pick and along an end.
    pub(crate) aspects: [f64; 2],
}

impl ClothFrame {
    /// Position in cells for a position in metres along u and v.
    pub(crate) fn cells(&self, uv: DVec2) -> DVec2 {
        let along = match self.turn {
            None => uv,
            Some((sin, cos)) => DVec2::new(uv.x * cos - uv.y * sin, uv.x * sin + uv.y * cos),
        };
        along * self.cells_per_m
    }

    /// [`ClothFrame::cells`] side by side.
    #[inline(always)]
    pub(crate) fn cells_lanes<S: Simd>(&self, [u, v]: [Wide<S>; 2]) -> [Wide<S>; 2] {
        let [along_weft, along_warp] = match self.turn {
            None => [u, v],
            Some((sin, cos)) => [u * cos - v * sin, u * sin + v * cos],
        };
        [along_weft * self.cells_per_m.x, along_warp * self.cells_per_m.y]
    }

    /// The inverse of [`ClothFrame::cells`].
    pub(crate) fn uv(&self, cells: DVec2) -> DVec2 {
        let along = cells / self.cells_per_m;
        match self.turn {
            None => along,
            Some((sin, cos)) => {
                DVec2::new(along.x * cos + along.y * sin, along.y * cos - along.x * sin)
            }
        }
    }

    /// A direction of the shading frame in the frame of weft and warp.
    #[inline(always)]
    pub(crate) fn turned<R: Real>(&self, w: Vector<R>) -> Vector<R> {
        match self.turn {
            None => w,
            Some((sin, cos)) => {
                let (sin, cos) = (w.x.of(sin), w.x.of(cos));
                Vector::new(w.x * cos - w.y * sin, w.x * sin + w.y * cos, w.z)
            }
        }
    }

    /// The inverse of [`ClothFrame::turned`].
    #[inline(always)]
    pub(crate) fn turned_back<R: Real>(&self, w: Vector<R>) -> Vector<R> {
        match self.turn {
            None => w,
            Some((sin, cos)) => {
                let (sin, cos) = (w.x.of(sin), w.x.of(cos));
                Vector::new(w.x * cos + w.y * sin, w.y * cos - w.x * sin, w.z)
            }
        }
    }
}

/// The two lobes of the BRDF, whose sum it is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Lobes {
    /// The highlight: light that the fibres mirror. sr⁻¹, linear RGB.
    pub specular: Vec3,
    /// The diffuse reflection of the yarn: sr⁻¹, linear RGB.
    pub diffuse: Vec3,
}

impl Add for Lobes {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        let Self { specular, diffuse } = other;
        Self { specular: self.specular + specular, diffuse: self.diffuse + diffuse }
    }
}

impl Mul<f32> for Lobes {
    type Output = Self;

    fn mul(self, by: f32) -> Self {
        Self { specular: self.specular * by, diffuse: self.diffuse * by }
    }
}

/// What colours the lobes of a place, linear RGB, each in [0, 1] but for grains of the highlight.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct YarnColors {
    /// Of the highlight's peak, times the grain of its intensity.
    pub specular: Vec3,
    /// Of the diffuse reflection.
    pub diffuse: Vec3,
}

/// A place of the cloth as a renderer may want to show it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct YarnPoint {
    /// The piece of yarn.
    pub segment: Segment,
    /// Index of its type.
    pub yarn: u16,
    /// Inclination along the arc, rad, in [−u_max, u_max].
    pub u: f64,
    /// Angle around the section, rad, in [−π/2, π/2].
    pub v: f64,
    /// Normal of the yarn, unit, in the shading frame.
    pub normal: DVec3,
    /// Tangent of the fibres, unit, in the shading frame.
    pub tangent: DVec3,
}

impl Shader {
    /// The shader of a cloth whose parts have been checked; `None` if nobody wants the `tables` any more.
    pub(crate) fn new(cloth: &Cloth, tables: &mut Tables<'_>) -> Result<Option<Self>, ClothError> {
        let threads = Threads::new(cloth);
        let straight_shows = cloth.weave.has_uncovered() || threads.have_gaps();
        let shapes = threads.shapes(cloth);
        let materials = Materials::new(cloth, &shapes, straight_shows, tables)?;
        let Some(materials) = materials else { return Ok(None) };
        let (sin, cos) = cloth.rotation.sin_cos();
        let mut shader = Self {
            frame: ClothFrame {
                cells_per_m: cloth.pitch.recip() * cloth.scale,
                turn: (cloth.rotation != 0.0).then_some((sin, cos)),
                aspects: [cloth.pitch.y / cloth.pitch.x, cloth.pitch.x / cloth.pitch.y],
            },
            combination: match cloth.normalization {
                Mode::Pointwise => Combination::Lerp,
                Mode::Segment | Mode::None => cloth.combination,
            },
            mapping: cloth.mapping,
            seed: cloth.seed,
            materials,
            weave: cloth.weave.clone(),
            threads,
            far: Far::default(),
            level: Level::new(),
        };
        shader.far = Far::new(&shader, tables.is_sketch);
        Ok(Some(shader))
    }

    /// The BRDF at `uv` (m), in sr⁻¹, without the cosine, linear RGB: finite and ≥ 0 (Nelson, McEvoy
    /// & Fratarcangeli 2016, equation 1).
    #[must_use]
    #[inline]
    pub fn eval(&self, uv: DVec2, wi: Vec3, wo: Vec3) -> Vec3 {
        let lobes = self.eval_lobes(uv, wi, wo);
        lobes.specular + lobes.diffuse
    }

    /// The lobes of [`Shader::eval`] apart.
    #[must_use]
    #[inline]
    pub fn eval_lobes(&self, uv: DVec2, wi: Vec3, wo: Vec3) -> Lobes {
        let (i, o) = (wi.to_array(), wo.to_array());
        self.lobes_of(uv.x, uv.y, i[0], i[1], i[2], o[0], o[1], o[2])
    }

    /// [`Shader::eval_lobes`] of numbers that are passed in registers: vectors would go through memory
    /// and be read back in pieces other than they were written in, which stalls.
    #[inline(never)]
    #[expect(clippy::too_many_arguments, reason = "two vectors and a position, by component")]
    fn lobes_of(
        &self,
        u: f64,
        v: f64,
        ix: f32,
        iy: f32,
        iz: f32,
        ox: f32,
        oy: f32,
        oz: f32,
    ) -> Lobes {
        let (wi, wo) = (Vector::new(ix, iy, iz), Vector::new(ox, oy, oz));
        let [specular, diffuse] = self.lobes(&self.materials.single, DVec2::new(u, v), wi, wo);
        Lobes { specular: specular.into(), diffuse: diffuse.into() }
    }

    /// [`Shader::eval`] from the same source in f64: the yardstick for its rounding errors.
    #[must_use]
    pub fn eval_reference(&self, uv: DVec2, wi: DVec3, wo: DVec3) -> DVec3 {
        let [specular, diffuse] =
            self.lobes(&self.materials.double, uv, Vector::<f64>::of(wi), Vector::<f64>::of(wo));
        DVec3::from_array(specular) + DVec3::from_array(diffuse)
    }

    /// The share of the surface at `uv` (m) that yarn covers: its opacity on a yarn and 0 in a gap.
    /// The rest of the light goes straight on.
    #[must_use]
    pub fn opacity(&self, uv: DVec2) -> f32 {
        if !uv.is_finite() {
            return 1.0;
        }
        let opacity =
            self.with_place(&self.materials.single, uv, Side::Face, |place| place.look.opacity);
        opacity.unwrap_or(0.0)
    }

    /// The colours of the yarn that the face shows at `uv` (m), with what textures and irregularities make
    /// of them there; `None` in a gap.
    #[must_use]
    pub fn colors_at(&self, uv: DVec2) -> Option<YarnColors> {
        self.with_place(&self.materials.single, uv, Side::Face, |place| YarnColors {
            specular: Vec3::from(place.look.specular[0]) * place.look.intensity,
            diffuse: place.look.color.into(),
        })
    }

    /// The memory that the cloth takes, in bytes: 4 for each crossing, 2 for each thread, and some 20 kB
    /// for each type of yarn, more where its pieces differ in shape.
    pub fn bytes(&self) -> usize {
        size_of::<Self>()
            + self.weave.bytes()
            + self.threads.bytes()
            + self.materials.bytes()
            + self.far.bytes()
    }

    /// Whether something may show between the yarns: if not, no [`Shader::opacity`] is that of a gap.
    pub fn has_gaps(&self) -> bool {
        self.threads.have_gaps()
    }

    /// The piece of yarn that the face shows at `uv` (m); `None` in a gap.
    #[must_use]
    pub fn yarn_at(&self, uv: DVec2) -> Option<YarnPoint> {
        self.yarn_on(Side::Face, uv)
    }

    /// The piece of yarn that `side` shows at `uv` (m); `None` in a gap.
    #[must_use]
    pub fn yarn_on(&self, side: Side, uv: DVec2) -> Option<YarnPoint> {
        self.with_place(&self.materials.double, uv, side, |place| self.yarn_point(side, place))
    }

    /// What `place` on `side` is of the yarn.
    pub(crate) fn yarn_point(&self, side: Side, place: &Place<'_, f64>) -> YarnPoint {
        let Segment { is_warp, x, y, .. } = place.segment;
        let optics = &place.piece.optics;
        let (sin_u, cos_u, _) = optics.along(y);
        let (sin_v, cos_v, _) = optics.across(x);
        let to_shading = |w: Vector<f64>| {
            let w = from_yarn(w, is_warp);
            let w = self.frame.turned_back(match side {
                Side::Face => w,
                Side::Back => w.turned_over(),
            });
            DVec3::new(w.x, w.y, w.z)
        };
        YarnPoint {
            segment: place.segment,
            yarn: place.yarn as u16,
            u: optics.u_of_y(y),
            v: optics.v_of_x(x),
            normal: to_shading(normal(sin_u, cos_u, sin_v, cos_v)),
            tangent: to_shading(optics.tangent(sin_u, cos_u, sin_v, cos_v)),
        }
    }

    /// The end and the pick, from 0 within the repeat, that cross at `uv` (m); `None` where that is not
    /// finite.
    #[must_use]
    pub fn crossing_at(&self, uv: DVec2) -> Option<[u32; 2]> {
        if !uv.is_finite() {
            return None;
        }
        let [end, pick] = Position::new(self.frame.cells(uv)).cell;
        let within = |cell: i64, count: u32| cell.rem_euclid(count.into()) as u32;
        Some([within(end, self.weave.ends()), within(pick, self.weave.picks())])
    }

    /// The factors of equation 2 by which the highlight of a type of yarn is scaled, and what they rest
    /// on: for segments of endless length, w/l → 0, and for the shortest that bend as far as their
    /// yarn. Between them 1/factor is at most what lies between theirs, in proportion to w/l. `None` if
    /// there is no such type.
    ///
    /// The albedos are those of a white highlight, its directions are in the yarn frame (x across, y
    /// along, z the normal), and its points are places across and along the segment, in [0, 1]².
    pub fn normalization(&self, yarn: u16) -> Option<[Normalization; 2]> {
        let material = self.materials.double.get(usize::from(yarn))?;
        Some(material.piece(false, 0.0).reflectance.normalizations)
    }

    /// What the highlight of a type of yarn is divided by, 1 over the factors of equation 2, for each of
    /// its kinds of segment and each shape in turn; `None` if there is no such type.
    ///
    /// They are the result of a search. A shader of the same cloth to which another's divisors are
    /// [given](Shader::set_divisors) is scaled as the other, wherever it was prepared.
    pub fn divisors(&self, yarn: u16) -> Option<Vec<f32>> {
        self.materials.divisors(usize::from(yarn))
    }

    /// Sets what [`Shader::divisors`] tells of a type of yarn. It is the caller's choice then what the
    /// cloth reflects.
    ///
    /// # Errors
    ///
    /// If there are not as many, or one is not a positive finite number.
    pub fn set_divisors(&mut self, yarn: u16, divisors: &[f32]) -> Result<(), ParamError> {
        let expected = self.divisors(yarn).map_or(0, |known| known.len()) as f64;
        if divisors.is_empty() || divisors.len() as f64 != expected {
            let found = divisors.len() as f64;
            return Err(ParamError::new("divisors", found, expected, expected));
        }
        let range = f32::MIN_POSITIVE..=f32::MAX;
        if let Some(&wrong) = divisors.iter().find(|divisor| !range.contains(divisor)) {
            let [low, high] = [f32::MIN_POSITIVE, f32::MAX].map(f64::from);
            return Err(ParamError::new("divisor", wrong.into(), low, high));
        }
        self.materials.set_divisors(usize::from(yarn), divisors);
        Ok(())
    }

    /// The types of yarn whose shortest segments are too short for their u_max, and what it became.
    pub fn lowered(&self) -> &[Lowered] {
        &self.materials.lowered
    }

    /// Both directions in the frame of weft and warp, as seen from the side they are on.
    #[inline(always)]
    pub(crate) fn oriented<R: Scalar + PartialOrd + Into<f64>>(
        &self,
        wi: Vector<R>,
        wo: Vector<R>,
    ) -> Option<(Side, Vector<R>, Vector<R>)> {
        // A sum of squares is finite only if every term is.
        let sum: f64 = (wi.dot(wi) + wo.dot(wo)).into();
        if !sum.is_finite() {
            return None;
        }
        let (wi, wo) = (self.frame.turned(wi), self.frame.turned(wo));
        if wi.z > R::from_f64(0.0) && wo.z > R::from_f64(0.0) {
            Some((Side::Face, wi, wo))
        } else if wi.z < R::from_f64(0.0) && wo.z < R::from_f64(0.0) {
            Some((Side::Back, wi.turned_over(), wo.turned_over()))
        } else {
            None
        }
    }

    #[inline(always)]
    fn lobes<R: Scalar + PartialOrd + Into<f64>>(
        &self,
        materials: &[Material<R>],
        uv: DVec2,
        wi: Vector<R>,
        wo: Vector<R>,
    ) -> [[R; 3]; 2] {
        let black = [[R::from_f64(0.0); 3]; 2];
        let Some((side, wi, wo)) = self.oriented(wi, wo) else { return black };
        let lobes = self.with_place(materials, uv, side, |place| {
            let is_warp = place.segment.is_warp;
            self.lobes_at(place, to_yarn(wi, is_warp), to_yarn(wo, is_warp))
        });
        lobes.unwrap_or(black)
    }

    /// f of one place; directions in the yarn frame, above the surface.
    #[inline(always)]
    pub(crate) fn lobes_at<R: Scalar>(
        &self,
        place: &Place<'_, R>,
        wi: Vector<R>,
        wo: Vector<R>,
    ) -> [[R; 3]; 2] {
        place.look.lobes(&self.white(place.piece, place.at, wi, wo))
    }

    /// f of places at `at` = (x, y, w/l) on `piece`, if it were white and opaque; directions in the
    /// yarn frame, above the surface.
    #[inline(always)]
    pub(crate) fn white<R: Real>(
        &self,
        piece: &Piece<R::Scalar>,
        at: [R; 3],
        wi: Vector<R>,
        wo: Vector<R>,
    ) -> White<R> {
        let inv_divisor = piece.inv_divisor(at[2]);
        // First what every place has, so that it is under way where the highlight's branch goes wrong.
        let diffuse = self.diffuse(piece, at, inv_divisor, wi, wo);
        White { highlight: piece.highlight(at, inv_divisor, wi, wo), diffuse }
    }

    /// The diffuse lobe of an opaque white yarn, sr⁻¹, with its share of the light.
    #[inline(always)]
    pub(crate) fn diffuse<R: Real>(
        &self,
        piece: &Piece<R::Scalar>,
        at: [R; 3],
        inv_divisor: R,
        wi: Vector<R>,
        wo: Vector<R>,
    ) -> R {
        self.diffuse_and_facing(piece, at, inv_divisor, [wi, wo]).0
    }

    /// The diffuse lobe of an opaque white yarn, and where it faces in the yarn frame, sr⁻¹: see
    /// [`Guide`](crate::guide::Guide).
    #[inline(always)]
    pub(crate) fn diffuse_and_facing<R: Real>(
        &self,
        piece: &Piece<R::Scalar>,
        [x, y, ratio]: [R; 3],
        inv_divisor: R,
        [wi, wo]: [Vector<R>; 2],
    ) -> (R, Vector<R>) {
        let (zero, inv_pi) = (x.zero(), x.of(FRAC_1_PI));
        let Left { of_wi, of_wo, of_all } = self.left_over(piece, ratio, inv_divisor, [wi, wo]);
        let Some(scale) = piece.diffuse_scale else {
            return (of_wi * of_wo / of_all * inv_pi, Vector::new(zero, zero, of_wo * inv_pi));
        };
        let (sin_u, cos_u, _) = piece.optics.along(y);
        let (sin_v, cos_v, _) = piece.optics.across(x);
        let n = normal(sin_u, cos_u, sin_v, cos_v);
        // What a yarn's normal prefers may be what the highlight leaves.
        let facing = n.dot(wo).max(zero) * scale * of_wo * inv_pi;
        (n.dot(wi).max(zero) * facing * of_wi, n.times(facing * of_all))
    }

    /// What the highlight of segments of the shape `ratio` leaves to the diffuse.
    #[inline(always)]
    fn left_over<R: Real>(
        &self,
        piece: &Piece<R::Scalar>,
        ratio: R,
        inv_divisor: R,
        w: [Vector<R>; 2],
    ) -> Left<R> {
        let one = ratio.one();
        if !piece.has_highlight {
            return Left { of_wi: one, of_wo: one, of_all: one };
        }
        if self.combination == Combination::Lerp {
            return Left { of_wi: one - piece.amount, of_wo: one, of_all: one };
        }
        let scale = inv_divisor * piece.amount;
        let [of_wi, of_wo] = piece.reflectance.of_both(w);
        let (of_wi, of_wo) = (left(scale * of_wi.at(ratio)), left(scale * of_wo.at(ratio)));
        // Away from 0 where an unnormalised highlight reflects more than it receives.
        let of_all = left(scale * piece.mean.splat(ratio).at(ratio)).max(ratio.of(1e-3));
        Left { of_wi, of_wo, of_all }
    }
}

/// What the highlight leaves of light.
struct Left<R> {
    of_wi: R,
    of_wo: R,
    /// Of the light from everywhere.
    of_all: R,
}

impl<T: Scalar> Piece<T> {
    /// The factor of equation 2 for segments whose width over length is `ratio`.
    #[inline(always)]
    pub(crate) fn inv_divisor<R: Real<Scalar = T>>(&self, ratio: R) -> R {
        ratio.one() / self.reflectance.divisor(ratio)
    }

    /// f of the highlight of places at `at` = (x, y, w/l), if it were white, scaled by `inv_divisor`.
    #[inline(always)]
    pub(crate) fn highlight<R: Real<Scalar = T>>(
        &self,
        at: [R; 3],
        inv_divisor: R,
        wi: Vector<R>,
        wo: Vector<R>,
    ) -> Parts<R> {
        if !self.has_highlight {
            return Parts::none(inv_divisor);
        }
        let Parts { peak, uniform } = highlight(&self.optics, at, wi, wo);
        Parts { peak: peak * inv_divisor, uniform: uniform * inv_divisor }
    }
}

/// What a reflected share leaves of the light.
#[inline(always)]
pub(crate) fn left<R: Real>(reflected: R) -> R {
    (reflected.one() - reflected).max(reflected.zero())
}

/// f of places, if they were white and opaque, sr⁻¹.
#[derive(Clone, Copy, Debug)]
pub(crate) struct White<R> {
    pub(crate) highlight: Parts<R>,
    pub(crate) diffuse: R,
}

/// f of the highlight at (x, y) and w/l, before colour and factor, sr⁻¹.
#[inline(always)]
pub(crate) fn highlight<R: Real>(
    optics: &Optics<R::Scalar>,
    at: [R; 3],
    wi: Vector<R>,
    wo: Vector<R>,
) -> Parts<R> {
    match optics.spread {
        Spread::Staple { delta, strength } => {
            staple::highlight(optics, [delta, strength], at, wi, wo)
        }
        Spread::Filament { delta, strength, .. } => {
            filament::highlight(optics, [delta, strength], at, wi, wo)
        }
        Spread::Rough { inv_variance, scale } => {
            rough::highlight(optics, [inv_variance, scale], at, wi, wo)
        }
    }
}
