//! `Shader`: the light that a cloth reflects.

use core::f64::consts::{FRAC_1_PI, PI};

use glam::{DVec2, DVec3, Vec3};
use selvedge_normalize::scale::Mode;

use crate::albedo::{Affine, Integrals, Nodes, Reflectance, cosine_mean};
use crate::cloth::{Cloth, ClothError, Combination};
use crate::frame::{Vector, to_yarn};
use crate::real::Real;
use crate::segment::{Mapping, Optics};
use crate::weave::{Segment, Weave};
use crate::yarn::Yarn;
use crate::{filament, staple};

/// A cloth ready to be shaded: immutable, and shared freely between threads.
///
/// Positions are in metres along the cloth, u along the weft and v along the warp: end 0 starts at
/// u = 0 and pick 0 at v = 0, and the weave repeats without end. Directions are in the shading frame
/// of the cloth's face (x = ∂P/∂u, y = ∂P/∂v, z = n), unit, and point away from the surface. Where
/// both have z < 0 they are on the back, which shows the other side of every crossing.
#[derive(Debug)]
pub struct Shader {
    front: Face,
    back: Face,
    /// 1/pitch, cells per metre.
    cells_per_m: DVec2,
    combination: Combination,
    mapping: Mapping,
    yarns: Vec<Yarn>,
    reflectances: Vec<Reflectance>,
    /// The yarns' constants in each precision, by type.
    single: Vec<Material<f32>>,
    double: Vec<Material<f64>>,
}

/// One side of the cloth.
#[derive(Debug)]
struct Face {
    weave: Weave,
    end_yarns: Vec<u16>,
    pick_yarns: Vec<u16>,
    /// Diameter over pitch, by type of yarn.
    sizes: Vec<f64>,
}

/// What the shading of one type of yarn needs.
#[derive(Debug)]
struct Material<R> {
    color: [R; 3],
    specular: [R; 3],
    /// k, the greatest component of `specular`.
    amount: R,
    is_filament: bool,
    bent: Piece<R>,
    straight: Piece<R>,
}

/// What the shading of one kind of segment needs.
#[derive(Clone, Copy, Debug)]
struct Piece<R> {
    optics: Optics<R>,
    /// Index into the reflectances.
    reflectance: usize,
    /// 1/a over w/l.
    divisor: Affine<R>,
    /// Ē of the unnormalised highlight over w/l.
    mean: Affine<R>,
}

impl Shader {
    /// The shader of a cloth whose parts have been checked.
    pub(crate) fn new(cloth: &Cloth) -> Result<Self, ClothError> {
        let sizes: Vec<f64> = cloth.yarns.iter().map(|yarn| yarn.size).collect();
        let front = Face {
            weave: cloth.weave.clone(),
            end_yarns: cloth.end_yarns.clone(),
            pick_yarns: cloth.pick_yarns.clone(),
            sizes,
        };
        let back = front.back();
        let straight_shows = front.weave.has_uncovered()
            || back.weave.has_uncovered()
            || front.sizes.iter().any(|&size| size < 1.0);
        let mut tables = Tables::default();
        let mut pieces = Vec::with_capacity(cloth.yarns.len());
        for (index, yarn) in cloth.yarns.iter().enumerate() {
            let mut find = |is_straight| {
                tables
                    .find(yarn, is_straight, cloth.mapping, cloth.normalization)
                    .map_err(|source| ClothError::Normalization { index, source })
            };
            let bent = find(false)?;
            pieces.push([bent, if straight_shows { find(true)? } else { bent }]);
        }
        let combination = match cloth.normalization {
            Mode::Pointwise => Combination::Lerp,
            Mode::Segment | Mode::None => cloth.combination,
        };
        let reflectances = tables.reflectances;
        Ok(Self {
            front,
            back,
            cells_per_m: cloth.pitch.recip(),
            combination,
            mapping: cloth.mapping,
            yarns: cloth.yarns.clone(),
            single: materials(cloth, &pieces, &reflectances),
            double: materials(cloth, &pieces, &reflectances),
            reflectances,
        })
    }

    /// The BRDF at `uv` (m), in sr⁻¹, without the cosine, linear RGB: finite and ≥ 0.
    ///
    /// 0 in a gap, where `wi` and `wo` are on different sides or along the surface, and where an
    /// argument is not finite (Nelson, McEvoy & Fratarcangeli 2016, equation 1).
    #[must_use]
    pub fn eval(&self, uv: DVec2, wi: Vec3, wo: Vec3) -> Vec3 {
        let vector = |w: Vec3| Vector::new(w.x, w.y, w.z);
        Vec3::from_array(self.eval_with(&self.single, uv, vector(wi), vector(wo)))
    }

    /// [`Shader::eval`] from the same source in f64: the yardstick for its rounding errors.
    #[must_use]
    pub fn eval_reference(&self, uv: DVec2, wi: DVec3, wo: DVec3) -> DVec3 {
        let vector = |w: DVec3| Vector::new(w.x, w.y, w.z);
        DVec3::from_array(self.eval_with(&self.double, uv, vector(wi), vector(wo)))
    }

    /// Directional albedo at `uv` (m) for `wo` on the face: `∫ f cos θi dwi`, linear RGB, by a
    /// quadrature of its own in f64, whose error is about 10⁻³.
    ///
    /// 0 in a gap and for `wo` not above the surface.
    #[must_use]
    pub fn albedo_at(&self, uv: DVec2, wo: DVec3) -> DVec3 {
        self.albedo_with(uv, wo, |integrals, segment, wo| {
            integrals.at_point(segment.x, segment.y, wo)
        })
    }

    /// Directional albedo for `wo` on the face, averaged over the segment that shows at `uv` (m);
    /// otherwise as [`Shader::albedo_at`].
    #[must_use]
    pub fn albedo_of_segment(&self, uv: DVec2, wo: DVec3) -> DVec3 {
        self.albedo_with(uv, wo, |integrals, _, wo| integrals.mean(wo))
    }

    fn albedo_with(
        &self,
        uv: DVec2,
        wo: DVec3,
        highlight: impl Fn(&Integrals, &Segment, DVec3) -> Affine<f64>,
    ) -> DVec3 {
        let is_above = uv.is_finite() && wo.is_finite() && wo.z > 0.0;
        let Some(segment) = self.yarn_at(uv).filter(|_| is_above) else {
            return DVec3::ZERO;
        };
        let index = self.front.yarn(&segment);
        let (material, yarn) = (&self.double[index], &self.yarns[index]);
        let piece = material.piece(&segment);
        let ratio = shape(&segment);
        let wo = to_yarn(Vector::new(wo.x, wo.y, wo.z), segment.is_warp);
        let integrals =
            Integrals::new(yarn, segment.is_straight, self.mapping, Nodes::resolving(yarn, 2.0));
        let albedo = highlight(&integrals, &segment, DVec3::new(wo.x, wo.y, wo.z));
        let specular = albedo.at(ratio) / piece.divisor.at(ratio);
        let diffuse = PI * cosine_mean(2, |wi| self.diffuse(material, piece, ratio, wi, wo));
        DVec3::from_array(material.specular) * specular
            + DVec3::from_array(material.color) * diffuse
    }

    /// The share of the surface at `uv` (m) that yarn covers: 1 on a yarn and 0 in a gap.
    #[must_use]
    pub fn opacity(&self, uv: DVec2) -> f32 {
        if uv.is_finite() && self.yarn_at(uv).is_none() { 0.0 } else { 1.0 }
    }

    /// The piece of yarn that the face shows at `uv` (m); `None` in a gap.
    #[must_use]
    pub fn yarn_at(&self, uv: DVec2) -> Option<Segment> {
        self.front.segment_at(uv * self.cells_per_m)
    }

    fn eval_with<R: Real + PartialOrd + Copy + Into<f64>>(
        &self,
        materials: &[Material<R>],
        uv: DVec2,
        mut wi: Vector<R>,
        mut wo: Vector<R>,
    ) -> [R; 3] {
        let black = [R::zero(); 3];
        let is_finite = |w: Vector<R>| w.dot(w).into().is_finite();
        if !(uv.is_finite() && is_finite(wi) && is_finite(wo)) {
            return black;
        }
        let mut cell = uv * self.cells_per_m;
        let face = if wi.z > R::zero() && wo.z > R::zero() {
            &self.front
        } else if wi.z < R::zero() && wo.z < R::zero() {
            // Half a turn about y, the warp.
            wi = Vector::new(-wi.x, wi.y, -wi.z);
            wo = Vector::new(-wo.x, wo.y, -wo.z);
            cell.x = -cell.x;
            &self.back
        } else {
            return black;
        };
        let Some(segment) = face.segment_at(cell) else {
            return black;
        };
        let material = &materials[face.yarn(&segment)];
        let (wi, wo) = (to_yarn(wi, segment.is_warp), to_yarn(wo, segment.is_warp));
        let place = [segment.x, segment.y, shape(&segment)].map(R::from_f64);
        self.reflect(material, material.piece(&segment), place, wi, wo)
    }

    /// f of one piece of yarn at (x, y) for a segment of width over length `ratio`; directions in
    /// the yarn frame, above the surface.
    fn reflect<R: Real>(
        &self,
        material: &Material<R>,
        piece: &Piece<R>,
        [x, y, ratio]: [R; 3],
        wi: Vector<R>,
        wo: Vector<R>,
    ) -> [R; 3] {
        let highlight = if material.is_filament { filament::highlight } else { staple::highlight };
        let specular = highlight(&piece.optics, x, y, ratio, wi, wo) / piece.divisor.at(ratio);
        let diffuse = self.diffuse(material, piece, ratio, wi, wo);
        core::array::from_fn(|c| material.specular[c] * specular + material.color[c] * diffuse)
    }

    /// The diffuse lobe for a white yarn, sr⁻¹, with its share of the light.
    fn diffuse<R: Real>(
        &self,
        material: &Material<R>,
        piece: &Piece<R>,
        ratio: R,
        wi: Vector<R>,
        wo: Vector<R>,
    ) -> R {
        let one = R::one();
        let share = match self.combination {
            Combination::Lerp => one - material.amount,
            Combination::Layered => {
                let scale = material.amount / piece.divisor.at(ratio);
                let left = |albedo: Affine<R>| (one - scale * albedo.at(ratio)).max(R::zero());
                // Away from 0 where an unnormalised highlight reflects more than it receives.
                let left_mean = left(piece.mean).max(R::from_f64(1e-3));
                let table = &self.reflectances[piece.reflectance];
                left(table.at(wi)) * left(table.at(wo)) / left_mean
            }
        };
        share * R::from_f64(FRAC_1_PI)
    }
}

/// Width over length of a segment; 0 for a straight piece, which has no curvature to change.
fn shape(segment: &Segment) -> f64 {
    if segment.is_straight { 0.0 } else { segment.width / segment.length }
}

impl<R> Material<R> {
    fn piece(&self, segment: &Segment) -> &Piece<R> {
        if segment.is_straight { &self.straight } else { &self.bent }
    }
}

impl Face {
    /// The other side, turned over about a warp line.
    fn back(&self) -> Self {
        Self {
            weave: self.weave.back(),
            end_yarns: self.end_yarns.iter().rev().copied().collect(),
            pick_yarns: self.pick_yarns.clone(),
            sizes: self.sizes.clone(),
        }
    }

    /// The piece of yarn at `position`, in cells.
    fn segment_at(&self, position: DVec2) -> Option<Segment> {
        let corner = position.floor();
        let size = |yarns: &[u16], thread: u32| self.sizes[usize::from(yarns[thread as usize])];
        self.weave.segment_at(
            [corner.x as i64, corner.y as i64],
            (position - corner).to_array(),
            |end| size(&self.end_yarns, end),
            |pick| size(&self.pick_yarns, pick),
        )
    }

    /// The type of yarn of a segment.
    fn yarn(&self, segment: &Segment) -> usize {
        let yarns = if segment.is_warp { &self.end_yarns } else { &self.pick_yarns };
        yarns[segment.thread as usize].into()
    }
}

/// The reflectances found so far, so that yarns that differ in colour alone share one.
#[derive(Default)]
struct Tables {
    keys: Vec<(Yarn, bool)>,
    reflectances: Vec<Reflectance>,
}

impl Tables {
    fn find(
        &mut self,
        yarn: &Yarn,
        is_straight: bool,
        mapping: Mapping,
        mode: Mode,
    ) -> Result<usize, selvedge_normalize::scale::ScaleError> {
        let neutral = Yarn::default();
        let key = Yarn {
            color: neutral.color,
            specular: neutral.specular,
            size: neutral.size,
            u_max: if is_straight { 0.0 } else { yarn.u_max },
            ..*yarn
        };
        if let Some(index) = self.keys.iter().position(|known| *known == (key, is_straight)) {
            return Ok(index);
        }
        self.reflectances.push(Reflectance::new(yarn, is_straight, mapping, mode)?);
        self.keys.push((key, is_straight));
        Ok(self.keys.len() - 1)
    }
}

fn materials<R: Real>(
    cloth: &Cloth,
    pieces: &[[usize; 2]],
    reflectances: &[Reflectance],
) -> Vec<Material<R>> {
    let precise =
        |a: Affine<f64>| Affine { base: R::from_f64(a.base), slope: R::from_f64(a.slope) };
    let color = |c: [f32; 3]| c.map(|component| R::from_f64(component.into()));
    cloth
        .yarns
        .iter()
        .zip(pieces)
        .map(|(yarn, pieces)| {
            let piece = |is_straight: bool| {
                let reflectance = pieces[usize::from(is_straight)];
                Piece {
                    optics: Optics::new(yarn, is_straight, cloth.mapping),
                    reflectance,
                    divisor: precise(reflectances[reflectance].divisor),
                    mean: precise(reflectances[reflectance].mean),
                }
            };
            Material {
                color: color(yarn.color),
                specular: color(yarn.specular),
                amount: R::from_f64(yarn.specular_amount().into()),
                is_filament: yarn.is_filament(),
                bent: piece(false),
                straight: piece(true),
            }
        })
        .collect()
}
