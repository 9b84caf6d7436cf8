//! The table of parameters: where in a cloth each is, and what it may be.

use std::f64::consts::TAU;

use selvedge_yarn_brdf::{
    Cloth, Combination, Diffuse, Fabric, Highlight, Mapping, Mode, Parameter as Number, Phase,
    Steep, Target, Thread, Weave, Yarn,
};

use crate::parameter::ParameterKind;
use crate::status::{Failure, Status};

/// How a parameter is found in a cloth.
#[derive(Clone, Copy)]
pub(crate) enum Entry {
    /// A colour of a yarn: its name, what it is, and where; `None` where it is as another.
    Color(
        &'static str,
        &'static str,
        fn(&mut Yarn) -> &mut [f32; 3],
        fn(&Yarn) -> Option<[f32; 3]>,
    ),
    /// One of some names.
    Choice(&'static Choice),
    /// A number of a yarn.
    Number(&'static Number),
    /// A number of the cloth: its name, what it is, unit, range, and where.
    OfCloth(&'static OfCloth),
}

/// One of some names.
pub(crate) struct Choice {
    name: &'static str,
    meaning: &'static str,
    names: &'static [&'static str],
    of: Chosen,
}

/// Where a choice is: which it is, if it is there, and how another is taken.
#[derive(Clone, Copy)]
pub(crate) enum Chosen {
    Yarn(fn(&Yarn) -> Option<usize>, fn(&mut Yarn, usize) -> bool),
    Cloth(fn(&Cloth) -> usize, fn(&mut Cloth, usize)),
}

/// A number of the cloth.
pub(crate) struct OfCloth {
    name: &'static str,
    meaning: &'static str,
    unit: &'static str,
    range: [f64; 2],
    is_whole: bool,
    of: fn(&Cloth) -> f64,
    set: fn(&mut Cloth, f64),
}

/// The greatest integer up to which a double has them all.
const LARGEST_SEED: f64 = 9_007_199_254_740_992.0;

const COLORS: [Entry; 3] = [
    Entry::Color("color", "diffuse reflectance", |y| &mut y.color, |y| Some(y.color)),
    Entry::Color(
        "specular",
        "color and amount of the highlight",
        |y| &mut y.specular,
        |y| Some(y.specular),
    ),
    Entry::Color(
        "specular_uniform",
        "color and amount of the highlight's uniform part, if it differs",
        |y| y.specular_uniform.get_or_insert(y.specular),
        |y| y.specular_uniform,
    ),
];

const CHOICES: [Choice; 4] = [
    Choice {
        name: "diffuse",
        meaning: "how the diffuse reflection follows the surface",
        names: &["flat", "yarn_normal"],
        of: Chosen::Yarn(
            |yarn| Some(usize::from(yarn.diffuse == Diffuse::YarnNormal)),
            |yarn, choice| {
                yarn.diffuse = [Diffuse::Flat, Diffuse::YarnNormal][choice];
                true
            },
        ),
    },
    Choice {
        name: "highlight",
        meaning: "what spreads the highlight over a piece of yarn",
        names: &["window", "rough"],
        of: Chosen::Yarn(
            |yarn| Some(usize::from(matches!(yarn.highlight, Highlight::Rough { .. }))),
            |yarn, choice| {
                yarn.highlight = match choice {
                    0 => Highlight::default(),
                    _ => Highlight::Rough { sigma: default_of("sigma") },
                };
                true
            },
        ),
    },
    Choice {
        name: "phase",
        meaning: "how light turns about a fibre",
        names: &["von_mises", "von_mises_3d", "wrapped_cauchy", "tabulated"],
        of: Chosen::Yarn(
            |yarn| match yarn.phase {
                Phase::VonMises { .. } => Some(0),
                Phase::VonMises3d { .. } => Some(1),
                Phase::WrappedCauchy { .. } => Some(2),
                Phase::Tabulated(_) => Some(3),
                _ => None,
            },
            |yarn, choice| {
                let [alpha, beta, rho] = ["alpha", "beta", "rho"].map(default_of);
                yarn.phase = match choice {
                    0 => Phase::VonMises { alpha, beta },
                    1 => Phase::VonMises3d { alpha, beta },
                    2 => Phase::WrappedCauchy { rho, is_backward: false },
                    // A table has no default.
                    _ => return false,
                };
                true
            },
        ),
    },
    Choice {
        name: "backward",
        meaning: "on which side of the fibre a wrapped Cauchy has its peak",
        names: &["beyond", "light"],
        of: Chosen::Yarn(
            |yarn| match yarn.phase {
                Phase::WrappedCauchy { is_backward, .. } => Some(usize::from(is_backward)),
                _ => None,
            },
            |yarn, choice| match &mut yarn.phase {
                Phase::WrappedCauchy { is_backward, .. } => {
                    *is_backward = choice == 1;
                    true
                }
                _ => false,
            },
        ),
    },
];

const MAPPINGS: [Mapping; 2] = [Mapping::Arcsine, Mapping::Linear];
const MODES: [Mode; 3] = [Mode::Pointwise, Mode::Segment, Mode::None];
const COMBINATIONS: [Combination; 2] = [Combination::Layered, Combination::Lerp];
const STEEPS: [Steep; 2] = [Steep::Lower, Steep::Reject];

const CLOTH_CHOICES: [Choice; 4] = [
    Choice {
        name: "mapping",
        meaning: "how pieces of yarn are laid on cylinders",
        names: &["arcsine", "linear"],
        of: Chosen::Cloth(|c| place_in(&MAPPINGS, &c.mapping), |c, i| c.mapping = MAPPINGS[i]),
    },
    Choice {
        name: "normalization",
        meaning: "what must not reflect more than it receives",
        names: &["pointwise", "segment", "none"],
        of: Chosen::Cloth(
            |c| place_in(&MODES, &c.normalization),
            |c, i| c.normalization = MODES[i],
        ),
    },
    Choice {
        name: "combination",
        meaning: "how highlight and diffuse add up",
        names: &["layered", "lerp"],
        of: Chosen::Cloth(
            |c| place_in(&COMBINATIONS, &c.combination),
            |c, i| c.combination = COMBINATIONS[i],
        ),
    },
    Choice {
        name: "steep",
        meaning: "what becomes of pieces too short to bend as far as their yarn",
        names: &["lower", "reject"],
        of: Chosen::Cloth(|c| place_in(&STEEPS, &c.steep), |c, i| c.steep = STEEPS[i]),
    },
];

const CLOTH_NUMBERS: [OfCloth; 3] = [
    OfCloth {
        name: "rotation",
        meaning: "angle from the u of a position to the weft",
        unit: "rad",
        range: [-TAU, TAU],
        is_whole: false,
        of: |cloth| cloth.rotation,
        set: |cloth, value| cloth.rotation = value,
    },
    OfCloth {
        name: "scale",
        meaning: "times how much smaller the weave is than its pitch tells",
        unit: "",
        range: [1e-6, 1e6],
        is_whole: false,
        of: |cloth| cloth.scale,
        set: |cloth, value| cloth.scale = value,
    },
    OfCloth {
        name: "seed",
        meaning: "chooses the irregularities; a whole number",
        unit: "",
        range: [0.0, LARGEST_SEED],
        is_whole: true,
        of: |cloth| cloth.seed as f64,
        set: |cloth, value| cloth.seed = value as u64,
    },
];

fn place_in<T: PartialEq>(choices: &[T], choice: &T) -> usize {
    choices.iter().position(|known| known == choice).expect("every choice is listed")
}

fn default_of(name: &str) -> f64 {
    Yarn::parameter(name).expect("a parameter of this name exists").default
}

pub(crate) fn entries() -> impl Iterator<Item = Entry> {
    COLORS
        .into_iter()
        .chain(const { &CHOICES }.iter().map(Entry::Choice))
        .chain(Yarn::parameters().iter().map(Entry::Number))
        .chain(const { &CLOTH_CHOICES }.iter().map(Entry::Choice))
        .chain(const { &CLOTH_NUMBERS }.iter().map(Entry::OfCloth))
}

pub(crate) fn entry(index: u32) -> Result<Entry, Failure> {
    entries().nth(index as usize).ok_or_else(|| {
        let expected = format!("less than {}", entries().count());
        Failure::argument("index", index, expected)
    })
}

/// What a texture for the parameter `index` determines.
pub(crate) fn target(index: u32) -> Result<Target, Failure> {
    match entry(index)? {
        Entry::Color("color", ..) => Ok(Target::Color),
        Entry::Color("specular", ..) => Ok(Target::Specular),
        Entry::Number(number) if number.name != "size" && !number.name.starts_with("noise.") => {
            Ok(Target::Parameter(number.name))
        }
        other => Err(Failure::argument(
            "index",
            other.name(),
            "a parameter that a texture may determine",
        )),
    }
}

impl Entry {
    pub(crate) fn name(&self) -> &'static str {
        match self {
            Self::Color(name, ..) => name,
            Self::Choice(choice) => choice.name,
            Self::Number(number) => number.name,
            Self::OfCloth(number) => number.name,
        }
    }

    /// Its kind, what it is, its unit, its range, and whether it is one of the cloth.
    pub(crate) fn facts(&self) -> (ParameterKind, &'static str, &'static str, [f64; 2], bool) {
        match *self {
            Self::Color(_, meaning, ..) => (ParameterKind::Color, meaning, "", [0.0, 1.0], false),
            Self::Choice(choice) => {
                let range = [0.0, (choice.names.len() - 1) as f64];
                let is_of_cloth = matches!(choice.of, Chosen::Cloth(..));
                (ParameterKind::Choice, choice.meaning, "", range, is_of_cloth)
            }
            Self::Number(n) => (ParameterKind::Number, n.meaning, n.unit, [n.low, n.high], false),
            Self::OfCloth(n) => (ParameterKind::Number, n.meaning, n.unit, n.range, true),
        }
    }

    /// The names of a choice's values.
    pub(crate) fn choices(&self) -> &'static [&'static str] {
        match self {
            Self::Choice(choice) => choice.names,
            _ => &[],
        }
    }

    /// The value in a cloth of which nothing is said; where its yarn has no such parameter, that of
    /// a yarn which has.
    pub(crate) fn default_value(&self) -> [f64; 3] {
        let weave = Weave::new(1, 1, |_, _| true).expect("one crossing is a weave");
        let thread = [Thread::default()];
        let cloth = Fabric::default().cloth(weave, &thread, &thread);
        let mut cloth = cloth.expect("the default fabric is valid");
        cloth.yarns = vec![Fabric::default_yarn()];
        self.of(&cloth, 0).unwrap_or_else(|_| match *self {
            Self::Color(..) => Fabric::default_yarn().specular.map(f64::from),
            Self::Number(number) => [number.default, 0.0, 0.0],
            Self::Choice(_) | Self::OfCloth(_) => [0.0; 3],
        })
    }

    pub(crate) fn of(&self, cloth: &Cloth, yarn: u32) -> Result<[f64; 3], Failure> {
        let one = |value: f64| [value, 0.0, 0.0];
        let of_yarn = || yarn_of(&cloth.yarns, yarn);
        let value = match *self {
            Self::Color(_, _, _, of) => of(of_yarn()?).map(|color| color.map(f64::from)),
            Self::Choice(Choice { of: Chosen::Yarn(of, _), .. }) => {
                of(of_yarn()?).map(|choice| one(choice as f64))
            }
            Self::Choice(Choice { of: Chosen::Cloth(of, _), .. }) => Some(one(of(cloth) as f64)),
            Self::Number(number) => number.of(of_yarn()?).map(one),
            Self::OfCloth(number) => Some(one((number.of)(cloth))),
        };
        value.ok_or_else(|| self.absent(yarn))
    }

    pub(crate) fn set(&self, cloth: &mut Cloth, yarn: u32, value: [f64; 3]) -> Result<(), Failure> {
        let in_range = |value: f64, [low, high]: [f64; 2]| {
            if (low..=high).contains(&value) {
                return Ok(value);
            }
            Err(Failure::argument(self.name(), value, format_args!("{low} to {high}")))
        };
        let whole = |value: f64| match value.fract() {
            0.0 => Ok(value),
            _ => Err(Failure::argument(self.name(), value, "a whole number")),
        };
        let chosen = |choice: &Choice| {
            let index = in_range(value[0], [0.0, (choice.names.len() - 1) as f64])?;
            whole(index).map(|index| index as usize)
        };
        let is_set = match *self {
            Self::Color(_, _, place, _) => {
                let yarn = yarn_mut(&mut cloth.yarns, yarn)?;
                for component in value {
                    in_range(component, [0.0, 1.0])?;
                }
                *place(yarn) = value.map(|component| component as f32);
                true
            }
            Self::Choice(choice @ Choice { of: Chosen::Yarn(of, set), .. }) => {
                let yarn = yarn_mut(&mut cloth.yarns, yarn)?;
                let chosen = chosen(choice)?;
                // What is chosen already keeps its numbers.
                of(yarn) == Some(chosen) || set(yarn, chosen)
            }
            Self::Choice(choice @ Choice { of: Chosen::Cloth(_, set), .. }) => {
                set(cloth, chosen(choice)?);
                true
            }
            Self::Number(number) => {
                let yarn = yarn_mut(&mut cloth.yarns, yarn)?;
                in_range(value[0], [number.low, number.high])?;
                number.set(yarn, value[0])
            }
            Self::OfCloth(number) => {
                let value = in_range(value[0], number.range)?;
                (number.set)(cloth, if number.is_whole { whole(value)? } else { value });
                true
            }
        };
        if is_set { Ok(()) } else { Err(self.absent(yarn)) }
    }

    fn absent(&self, yarn: u32) -> Failure {
        let text = format!("{}: absent from yarn {yarn}, expected one that it has", self.name());
        Failure::new(Status::Absent, text)
    }
}

fn yarn_of(yarns: &[Yarn], index: u32) -> Result<&Yarn, Failure> {
    yarns.get(index as usize).ok_or_else(|| no_yarn(index, yarns.len()))
}

fn yarn_mut(yarns: &mut [Yarn], index: u32) -> Result<&mut Yarn, Failure> {
    let count = yarns.len();
    yarns.get_mut(index as usize).ok_or_else(|| no_yarn(index, count))
}

/// There are only `count` types of yarn.
pub(crate) fn no_yarn(yarn: u32, count: usize) -> Failure {
    Failure::argument("yarn", yarn, format_args!("less than {count}"))
}
