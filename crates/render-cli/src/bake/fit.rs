//! The glossy material that is most like a yarn: roughness, anisotropy, reflectances.
//!
//! A class is what looks alike: the bent or the straight pieces of one type of yarn, as warp or as weft.
//! Over the points of a class, with the normals and directions of fibres that the maps have there, the
//! mean of [`Standard`] is to be the mean of the cloth, for pairs of directions wi, wo: half of them drawn
//! by the cosine, the others about the cone into which fibres along the yarn mirror light.
//!
//! ```text
//! facets:  min over r, a, F₀ of Σ (mean specular − mean facets(r, a, F₀))² cos² θi
//! ground:  min over ρ        of Σ (mean diffuse − ρ mean ground)² cos² θi
//! ```
//!
//! With the cosine, as what a bent normal reflects grows like 1/cos θi. F₀ and ρ are solved for, r and a are
//! searched for on a grid that is refined.

use std::num::NonZeroU32;

use glam::{DVec2, Vec2, Vec3};
use rayon::prelude::*;
use selvedge_normalize::{halton::Halton, warp::square_to_cosine_hemisphere};
use selvedge_yarn_brdf::{Footprint, Yarn, YarnPoint};
use serde::Serialize;

use super::{Tile, along_fibers, upward};
use crate::scene::standard::{Input, Standard, StandardPoint};

/// Pieces of yarn that look alike.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Class {
    /// Index of the type of yarn.
    pub yarn: u16,
    /// Whether as an end.
    pub is_warp: bool,
    /// Whether they do not bend.
    pub is_straight: bool,
}

impl Class {
    /// That of a point.
    pub fn of(point: &YarnPoint) -> Self {
        let (yarn, segment) = (point.yarn, &point.segment);
        Self { yarn, is_warp: segment.is_warp, is_straight: segment.is_straight() }
    }
}

/// What a class is like.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Fit {
    /// Square root of α, in [0, 1].
    pub roughness: f32,
    /// How much rougher across the fibres than along them, in [0, 1] (Burley 2012).
    pub anisotropy: f32,
    /// F₀ of the greatest component of the yarn's specular colour.
    pub reflectance: f32,
    /// Reflectance of the ground over the yarn's colour: above 1, as a normal map darkens what is flat.
    pub ground: f32,
    /// Root mean square of what is wrong with the specular lobe, over that of the lobe.
    pub specular_error: f32,
    /// Likewise of the diffuse lobe.
    pub diffuse_error: f32,
}

/// A class, its share of the tile and its fit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Fitted {
    /// The class.
    #[serde(flatten)]
    pub class: Class,
    /// Part of the tile that shows it, in [0, 1].
    pub share: f32,
    /// What it is like.
    #[serde(flatten)]
    pub fit: Fit,
}

/// The fits of all classes that a tile shows.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Fits {
    /// By share, the greatest first.
    pub classes: Vec<Fitted>,
    /// What is wrong with the material, seen from afar.
    pub far: FarError,
    /// What is added at grazing angles to make it less wrong.
    pub sheen: Sheen,
}

/// What is wrong with the mean of the material over the tile, over all pairs of directions.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct FarError {
    /// Root mean square difference to the far field of the cloth, over its root mean square.
    pub relative: f32,
    /// The same with the sheen.
    pub relative_with_sheen: f32,
    /// Mean of the material over that of the cloth.
    pub brightness: f32,
}

/// The lobe of fuzz of glTF (Estevez & Kulla 2017) that is most like what is left.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Sheen {
    /// Its colour, linear, each in [0, 1]; 0 where it would not help.
    pub color: Vec3,
    /// Square root of its α, in [0, 1].
    pub roughness: f32,
}

/// A point of the tile, as the maps have it.
#[derive(Clone, Copy, Debug)]
struct Place {
    uv: DVec2,
    normal: Vec3,
    /// Along the fibres, unit.
    along: Vec2,
}

/// Places per class over which the cloth is averaged, and the material.
const PLACES: usize = 1024;
const COARSE: usize = 96;

/// Places of the tile that are looked at for the classes, and pairs of directions.
const LOOKS: u32 = 1 << 17;
const PAIRS: usize = 192;

/// Reflectance from which on [`Standard`] mirrors all light at grazing angles.
const FULL: f32 = 0.02;

/// The place number `k` of an even sequence over the tile (additive recurrence of the plastic number,
/// Roberts 2018).
fn uv(tile: &Tile, k: u32) -> DVec2 {
    let step = DVec2::new(0.754_877_666_246_692_7, 0.569_840_290_998_053_3);
    (step * f64::from(k) + 0.5).fract() * tile.size()
}

impl Fits {
    /// The fits of what `tile` shows.
    pub fn new(tile: &Tile) -> Self {
        let mut places: Vec<(Class, u32, Vec<Place>)> = Vec::new();
        for k in 0..LOOKS {
            let uv = uv(tile, k);
            let Some(point) = tile.shader.yarn_at(uv) else { continue };
            let class = Class::of(&point);
            let known = places.iter().position(|(known, ..)| *known == class);
            let at = known.unwrap_or_else(|| {
                places.push((class, 0, Vec::new()));
                places.len() - 1
            });
            let (_, count, list) = &mut places[at];
            *count += 1;
            if list.len() < PLACES {
                let (normal, along) = (upward(point.normal.as_vec3()), along_fibers(&point));
                list.push(Place { uv, normal, along });
            }
        }
        places.sort_by_key(|(_, count, _)| std::cmp::Reverse(*count));

        // Types that differ in colour alone are alike.
        let key = |class: &Class| {
            let yarn = &tile.cloth.yarns[usize::from(class.yarn)];
            let amount = greatest(yarn.specular.into());
            let yarn = Yarn { color: [1.0; 3], specular: [amount; 3], ..yarn.clone() };
            (yarn, class.is_warp, class.is_straight)
        };
        let mut leaders: Vec<usize> = Vec::new();
        let mut leader_of = Vec::new();
        for at in 0..places.len() {
            let key_of = key(&places[at].0);
            // A black yarn does not tell how its ground would look.
            let is_black = |at: usize| {
                let yarn = &tile.cloth.yarns[usize::from(places[at].0.yarn)];
                greatest(yarn.color.into()) <= 0.0
            };
            let same = |&&leader: &&usize| {
                key(&places[leader].0) == key_of && (!is_black(leader) || is_black(at))
            };
            let leader = leaders.iter().find(same).copied().unwrap_or(at);
            if leader == at {
                leaders.push(at);
            }
            leader_of.push(leader);
        }
        let fits: Vec<_> = leaders
            .par_iter()
            .map(|&leader| {
                let (class, _, list) = &places[leader];
                (leader, fit(tile, *class, list))
            })
            .collect();
        let classes: Vec<_> = places
            .iter()
            .zip(leader_of)
            .filter_map(|((class, count, _), leader)| {
                let (_, fit) = fits.iter().find(|(other, _)| *other == leader)?;
                Some(Fitted { class: *class, share: *count as f32 / LOOKS as f32, fit: *fit })
            })
            .collect();
        let mut fits = Self {
            classes,
            far: FarError { relative: 0.0, relative_with_sheen: 0.0, brightness: 1.0 },
            sheen: Sheen::default(),
        };
        fits.compare(tile);
        fits
    }

    /// The fit of a class; a dull one for one so rare that it was not found.
    pub fn of(&self, class: Class) -> Fit {
        let alike = |other: &&Fitted| other.class == class;
        let similar = |other: &&Fitted| other.class.yarn == class.yarn;
        let classes = &self.classes;
        let found = classes.iter().find(alike).or_else(|| classes.iter().find(similar));
        found.or(classes.first()).map_or(DULL, |fitted| fitted.fit)
    }

    /// Compares the mean of the material with the far field, and finds the sheen.
    fn compare(&mut self, tile: &Tile) {
        let materials: Vec<_> = (0..2048)
            .map(|k| {
                let uv = uv(tile, k);
                let point = tile.shader.yarn_at(uv)?;
                let fit = self.of(Class::of(&point));
                let (base, specular) = colors(tile, &point, uv, &fit);
                let place = Place {
                    uv,
                    normal: upward(point.normal.as_vec3()),
                    along: along_fibers(&point),
                };
                let opacity = tile.shader.opacity(uv);
                Some((place, opacity, material(&fit, base, specular, &place)))
            })
            .collect();
        let pairs = pairs(false);
        let footprint = Footprint { uv: 0.5 * tile.size(), deviation: tile.size() };
        let both: Vec<[Vec3; 2]> = pairs
            .par_iter()
            .map(|&[wi, wo]| {
                let sum: Vec3 = materials
                    .iter()
                    .flatten()
                    .map(|(place, opacity, standard)| {
                        let [wi, wo] = [wi, wo].map(|w| turned(w, place.along));
                        *opacity * standard.eval(wi, wo)
                    })
                    .sum();
                let far = tile.shader.far_eval(&footprint, wi, wo);
                [far * wi.z, sum * (wi.z / materials.len() as f32)]
            })
            .collect();
        let squares = |f: &dyn Fn(usize) -> Vec3| -> f32 {
            (0..both.len()).map(|k| f(k).length_squared()).sum()
        };
        let all = squares(&|k| both[k][0]).max(f32::MIN_POSITIVE);
        let left = squares(&|k| both[k][0] - both[k][1]);
        let mut best = (left, Sheen { color: Vec3::ZERO, roughness: 0.5 });
        for roughness in [0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0] {
            let lobe: Vec<_> =
                pairs.iter().map(|&[wi, wo]| wi.z * fuzz(wi, wo, roughness)).collect();
            let of_lobe: f32 = lobe.iter().map(|f| f * f).sum();
            let shared: Vec3 = lobe.iter().zip(&both).map(|(f, [a, b])| *f * (*a - *b)).sum();
            let color = (shared / of_lobe.max(f32::MIN_POSITIVE)).clamp(Vec3::ZERO, Vec3::ONE);
            let rest = squares(&|k| both[k][0] - both[k][1] - color * lobe[k]);
            if rest < best.0 {
                best = (rest, Sheen { color, roughness });
            }
        }
        let sum = |which: usize| both.iter().map(|f| f[which].element_sum()).sum::<f32>();
        self.sheen = best.1;
        self.far = FarError {
            relative: (left / all).sqrt(),
            relative_with_sheen: (best.0 / all).sqrt(),
            brightness: sum(1) / sum(0).max(f32::MIN_POSITIVE),
        };
    }
}

/// What is there where nothing is known.
const DULL: Fit = Fit {
    roughness: 1.0,
    anisotropy: 0.0,
    reflectance: 0.0,
    ground: 1.0,
    specular_error: 0.0,
    diffuse_error: 0.0,
};

/// The reflectances of ground and facets at a point that has the fit `fit`.
pub(super) fn colors(tile: &Tile, point: &YarnPoint, uv: DVec2, fit: &Fit) -> (Vec3, Vec3) {
    let yarn = &tile.cloth.yarns[usize::from(point.yarn)];
    let is_even = yarn.noise.intensity == 0.0 && yarn.noise.color == 0.0;
    let (diffuse, specular) = if is_even && tile.cloth.textures.is_empty() {
        (Vec3::from(yarn.color), Vec3::from(yarn.specular))
    } else {
        let colors = tile.shader.colors_at(uv).unwrap_or_default();
        (colors.diffuse, colors.specular)
    };
    let amount = greatest(yarn.specular.into()).max(f32::MIN_POSITIVE);
    let base = (diffuse * fit.ground).clamp(Vec3::ZERO, Vec3::ONE);
    (base, (specular * (fit.reflectance / amount)).clamp(Vec3::ZERO, Vec3::ONE))
}

fn greatest(color: Vec3) -> f32 {
    color.max_element()
}

/// A direction in the frame whose x is along the fibres.
fn turned(w: Vec3, along: Vec2) -> Vec3 {
    let w2 = w.truncate();
    Vec3::new(along.dot(w2), along.perp_dot(w2), w.z)
}

/// The material of a place in the frame whose x is along the fibres.
fn material(fit: &Fit, base: Vec3, specular: Vec3, place: &Place) -> StandardPoint {
    let standard = Standard {
        base_color: Input::Constant(base),
        normal: Input::Constant(0.5 * turned(place.normal, place.along) + 0.5),
        roughness: Input::Constant(Vec3::splat(fit.roughness)),
        specular: Input::Constant(specular),
        // Positive is rougher along x, which is along the fibres.
        anisotropy: Input::Constant(Vec3::splat(-fit.anisotropy)),
    };
    standard.at(Vec2::ZERO, [Vec2::ZERO; 2])
}

/// Pairs of directions (wi, wo) above the surface. With `about_cones`, every other one has a wi about the
/// cone into which fibres along y or x mirror what comes from wo.
fn pairs(about_cones: bool) -> Vec<[Vec3; 2]> {
    let points = Halton::<4>::new().points_from(NonZeroU32::MIN);
    let pairs = points.take(PAIRS).enumerate().map(|(k, [a, b, c, d])| {
        let [wi, wo] =
            [[a, b], [c, d]].map(|[x, y]| square_to_cosine_hemisphere(DVec2::new(x, y)).as_vec3());
        if !about_cones || k % 2 == 0 {
            return [wi, wo];
        }
        let (jitter, place) = (0.6 * (a as f32 - 0.5), 2.0 * b as f32 - 1.0);
        let is_along_y = k % 4 == 1;
        let of_wo = if is_along_y { wo.y } else { wo.x };
        let along = (jitter - of_wo).clamp(-0.95, 0.95);
        let across = 0.95 * place * (1.0 - along * along).sqrt();
        let flat = if is_along_y { Vec2::new(across, along) } else { Vec2::new(along, across) };
        [flat.extend((1.0 - flat.length_squared()).max(0.0).sqrt()), wo]
    });
    pairs.filter(|pair| pair.iter().all(|w| w.z > 0.05)).collect()
}

/// What the places of a class have in common.
fn fit(tile: &Tile, class: Class, places: &[Place]) -> Fit {
    let yarn = &tile.cloth.yarns[usize::from(class.yarn)];
    let color = greatest(yarn.color.into());
    let opacity = (yarn.opacity as f32).max(f32::MIN_POSITIVE);
    let pairs = pairs(true);
    // Specular, diffuse.
    let means: Vec<[f32; 2]> = pairs
        .iter()
        .map(|&[wi, wo]| {
            let lobes = places.iter().map(|place| tile.shader.eval_lobes(place.uv, wi, wo));
            let sums = lobes.fold([0.0, 0.0], |[s, d], lobes| {
                [s + greatest(lobes.specular), d + greatest(lobes.diffuse)]
            });
            sums.map(|sum| sum * wi.z / (opacity * places.len() as f32))
        })
        .collect();
    let few = &places[..places.len().min(COARSE)];
    let mean = |fit: &Fit, specular: f32, lobe: usize| -> Vec<f32> {
        let at = |place: &Place| material(fit, Vec3::ONE, Vec3::splat(specular), place);
        let materials: Vec<_> = few.iter().map(at).collect();
        let mean = |&[wi, wo]: &[Vec3; 2]| {
            let all = few.iter().zip(&materials).map(|(place, material)| {
                material.eval_lobes(turned(wi, place.along), turned(wo, place.along))[lobe].x
            });
            all.sum::<f32>() * wi.z / few.len() as f32
        };
        pairs.iter().map(mean).collect()
    };
    let target: Vec<f32> = means.iter().map(|[specular, _]| *specular).collect();
    let squares = |values: &[f32]| values.iter().map(|value| value * value).sum::<f32>();
    let mut best = Fit { specular_error: 1.0, roughness: 0.7, ..DULL };
    if squares(&target) > 0.0 {
        let try_it = |best: &mut Fit, roughness: f32, anisotropy: f32| {
            let candidate = Fit { roughness, anisotropy, ..DULL };
            let (low, full) = (mean(&candidate, FULL, 1), mean(&candidate, 1.0, 1));
            let (reflectance, rest) = solve(&target, &low, &full);
            let specular_error = (rest / squares(&target)).sqrt();
            if specular_error < best.specular_error {
                *best = Fit { reflectance, specular_error, ..candidate };
            }
        };
        for r in 0..7 {
            for a in 0..4 {
                try_it(&mut best, 0.15 + 0.85 / 6.0 * r as f32, a as f32 / 3.0);
            }
        }
        let mut step = Vec2::new(0.85 / 12.0, 1.0 / 6.0);
        for _ in 0..4 {
            let centre = Vec2::new(best.roughness, best.anisotropy);
            for (x, y) in [(-1, 0), (1, 0), (0, -1), (0, 1), (-1, -1), (1, 1)] {
                let at = centre + step * Vec2::new(x as f32, y as f32);
                try_it(&mut best, at.x.clamp(0.05, 1.0), at.y.clamp(0.0, 1.0));
            }
            step *= 0.5;
        }
    } else {
        best.specular_error = 0.0;
    }
    if color > 0.0 {
        let ground = mean(&best, best.reflectance, 0);
        let target: Vec<f32> = means.iter().map(|[_, diffuse]| *diffuse / color).collect();
        let shared: f32 = ground.iter().zip(&target).map(|(a, b)| a * b).sum();
        best.ground = shared / squares(&ground).max(f32::MIN_POSITIVE);
        let rest: Vec<_> = ground.iter().zip(&target).map(|(a, b)| best.ground * a - b).collect();
        best.diffuse_error = (squares(&rest) / squares(&target).max(f32::MIN_POSITIVE)).sqrt();
    }
    best
}

/// The F₀ whose facets are most like `target`, and the sum of the squares of what is left, of facets
/// that are `low` at [`FULL`] and `full` at 1: linear below and above.
fn solve(target: &[f32], low: &[f32], full: &[f32]) -> (f32, f32) {
    let at = |k: usize, reflectance: f32| {
        if reflectance < FULL {
            low[k] * (reflectance / FULL)
        } else {
            low[k] + (full[k] - low[k]) * ((reflectance - FULL) / (1.0 - FULL))
        }
    };
    let rest = |reflectance: f32| -> f32 {
        (0..target.len()).map(|k| (target[k] - at(k, reflectance)).powi(2)).sum()
    };
    let sum = |f: &dyn Fn(usize) -> f32| (0..target.len()).map(f).sum::<f32>();
    let below =
        FULL * sum(&|k| target[k] * low[k]) / sum(&|k| low[k] * low[k]).max(f32::MIN_POSITIVE);
    let slope = |k: usize| full[k] - low[k];
    let above = FULL
        + (1.0 - FULL) * sum(&|k| (target[k] - low[k]) * slope(k))
            / sum(&|k| slope(k) * slope(k)).max(f32::MIN_POSITIVE);
    let candidates = [below.clamp(0.0, FULL), above.clamp(FULL, 1.0)];
    let rests = candidates.map(rest);
    let which = usize::from(rests[1] < rests[0]);
    (candidates[which], rests[which])
}

/// f of fuzz of the colour 1 without the cosine, sr⁻¹: D of Estevez & Kulla 2017 and the visibility of
/// Neubelt & Pettineo 2013, as in `KHR_materials_sheen`.
fn fuzz(wi: Vec3, wo: Vec3, roughness: f32) -> f32 {
    let inverse = 1.0 / (roughness * roughness);
    let cos = (wi + wo).normalize_or(Vec3::Z).z;
    let sine = (1.0 - cos * cos).max(0.0).sqrt();
    let density = (2.0 + inverse) * sine.powf(inverse) / std::f32::consts::TAU;
    density / (4.0 * (wi.z + wo.z - wi.z * wo.z))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reflectance_of_facets_is_found_again() {
        let fit = Fit { roughness: 0.4, anisotropy: 0.5, ..DULL };
        let normal = Vec3::new(0.3, -0.2, 1.0).normalize();
        let place = Place { uv: DVec2::ZERO, normal, along: Vec2::from_angle(0.7) };
        let pairs = pairs(true);
        let facets = |specular: f32| -> Vec<f32> {
            let material = material(&fit, Vec3::ONE, Vec3::splat(specular), &place);
            let at = |&[wi, wo]: &[Vec3; 2]| {
                material.eval_lobes(turned(wi, place.along), turned(wo, place.along))[1].x
            };
            pairs.iter().map(at).collect()
        };
        for expected in [0.005, 0.02, 0.04, 0.3, 0.9] {
            let (found, rest) = solve(&facets(expected), &facets(FULL), &facets(1.0));
            assert!((found - expected).abs() < 1e-3 * (0.1 + expected), "{expected}: {found}");
            assert!(rest < 1e-4, "{expected}: {rest}");
        }
    }

    #[test]
    fn pairs_are_above_the_surface_and_unit() {
        for about_cones in [false, true] {
            let pairs = pairs(about_cones);
            assert!(pairs.len() > PAIRS / 2, "{}", pairs.len());
            for w in pairs.into_iter().flatten() {
                assert!(w.z > 0.0 && (w.length() - 1.0).abs() < 1e-5, "{w}");
            }
        }
    }
}
