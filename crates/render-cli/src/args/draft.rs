//! The command line of `selvedge draft`.

use std::{
    ffi::OsStr,
    path::{Path, PathBuf},
};

use clap::{
    ArgGroup, ArgMatches, Args, Command, FromArgMatches, Subcommand, ValueEnum,
    error::{ContextKind, ContextValue, ErrorKind},
};
use selvedge_wif::Plan;

/// What to do with a draft.
#[derive(Clone, Debug, Subcommand)]
pub enum DraftCommand {
    /// Tells what a draft is: size, loom, spacing, colors, weave, floats
    ///
    /// With --json the same as one JSON object. Lengths are in mm; null is what the draft does not
    /// say; keys are only ever added.
    ///
    /// file, title, author, program, program_version: text, or null.
    ///
    /// ends, picks, shafts, treadles: numbers. rising_shed: true or false. plan: "liftplan",
    /// "tieup" or null, what weaves.
    ///
    /// warp, weft: objects with threads_per_cm, threads_per_inch, and spacing_mm and thickness_mm,
    /// each null or an object with min, mean, max. width_mm, length_mm: of the cloth.
    ///
    /// colors: a list of the colors in use; number (in the draft's table, or null), srgb ("#rrggbb"),
    /// ends, picks (how many have it).
    ///
    /// cloth: null without a drawdown (no_drawdown then says why), else an object with weave (class:
    /// "plain", "twill" with hand "S" or "Z" and repeat, "satin" with face, repeat and step, or
    /// "other"), repeat and repeat_with_threads (ends, picks; the second with colors and lengths),
    /// balance (part of the face where the warp is on top), longest_floats (face and back, each
    /// with warp and weft, in crossings).
    ///
    /// diagnostics: an object with errors, warnings, notes (how many) and list; each has severity,
    /// code, line, column, section (these three may be null), message, count.
    Info(InfoOptions),

    /// Checks drafts and shows each finding in its line
    ///
    /// Exit codes: 0 no errors, 1 some file has errors or cannot be read, 2 wrong command line,
    /// 3 there are warnings and --strict allows none.
    Lint(LintOptions),

    /// Draws which thread lies on top at each crossing, as text or as a picture
    ///
    /// Text has a line for each pick, pick 1 first, and a character for each end, end 1 first:
    /// 1 where the warp is on top, 0 where the weft is.
    ///
    /// In a picture each crossing is a square in the color of the thread on top, end 1 at the left
    /// and pick 1 at the bottom, as in the cloth that selvedge render draws.
    Drawdown(DrawdownOptions),

    /// Rewrites a draft in the one canonical order and spelling
    ///
    /// Writes to standard output unless -o or -i is given. A draft with errors is refused, and what
    /// is not kept, such as comments, is told on standard error.
    Format(RewriteOptions),

    /// Changes a lift plan to a tie-up with treadling, or back; the cloth stays the same
    ///
    /// Writes the canonical form, as selvedge draft format does.
    Convert(ConvertOptions),
}

/// Arguments of `selvedge draft info`.
#[derive(Clone, Debug, Args)]
pub struct InfoOptions {
    /// The draft, a WIF file; - reads standard input
    #[arg(value_name = "FILE")]
    pub draft: PathBuf,

    /// One JSON object, see --help for its keys
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `selvedge draft lint`.
#[derive(Clone, Debug, Args)]
pub struct LintOptions {
    /// The drafts, WIF files; - reads standard input
    #[arg(value_name = "FILE", required = true)]
    pub drafts: Vec<PathBuf>,

    /// Exit with 3 when there are warnings
    #[arg(long)]
    pub strict: bool,
}

/// Arguments of `selvedge draft drawdown`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DrawdownOptions {
    /// The draft.
    pub draft: PathBuf,
    /// Where the drawdown goes; `None` for standard output.
    pub output: Option<PathBuf>,
    /// Whether to show the back of the cloth.
    pub back: bool,
    /// No warnings.
    pub quiet: bool,
    /// Text or picture.
    pub form: Form,
}

/// How to draw a drawdown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// A line of `1` and `0` for each pick.
    Text,
    /// A PNG.
    Picture {
        /// Pixels per crossing; `None` for what fits a screen.
        scale: Option<u32>,
        /// Whether there are lines between the crossings.
        grid: bool,
    },
}

/// Most pixels per crossing.
const MAX_SCALE: i64 = 256;

#[derive(Args)]
struct DrawdownFlags {
    /// The draft, a WIF file; - reads standard input
    #[arg(value_name = "FILE")]
    draft: PathBuf,

    /// Where the drawdown goes: .png or .txt, or any name with --format; - is standard output
    #[arg(short, long, value_name = "OUT", required_unless_present = "format")]
    output: Option<PathBuf>,

    /// Text or picture, whatever the name of the output
    #[arg(long, value_enum)]
    format: Option<FormFlag>,

    /// Pixels per crossing in a picture [default: 16, less if a side is over 1024 then]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=MAX_SCALE))]
    scale: Option<u32>,

    /// The other face: the cloth turned over like a page, so that the last end comes first
    #[arg(long)]
    back: bool,

    /// Thin lines between the crossings of a picture
    #[arg(long)]
    grid: bool,

    /// No warnings; errors are still told
    #[arg(short, long)]
    quiet: bool,
}

#[derive(Clone, Copy, ValueEnum)]
enum FormFlag {
    Text,
    Png,
}

impl DrawdownFlags {
    fn checked(self) -> Result<DrawdownOptions, clap::Error> {
        let form = match self.format.or_else(|| FormFlag::of_extension(self.output.as_deref()?)) {
            Some(FormFlag::Png) => Form::Picture { scale: self.scale, grid: self.grid },
            Some(FormFlag::Text) if self.scale.is_some() || self.grid => {
                let argument = if self.grid { "--grid" } else { "--scale <N>" };
                return Err(conflict(argument, "--format text"));
            }
            Some(FormFlag::Text) => Form::Text,
            None => return Err(no_form(self.output.as_deref().unwrap_or(Path::new("-")))),
        };
        let output = not_dash(self.output);
        Ok(DrawdownOptions { draft: self.draft, output, back: self.back, quiet: self.quiet, form })
    }
}

impl FormFlag {
    fn of_extension(path: &Path) -> Option<Self> {
        let extension = path.extension().and_then(OsStr::to_str)?;
        let is = |name| extension.eq_ignore_ascii_case(name);
        if is("png") { Some(Self::Png) } else { is("txt").then_some(Self::Text) }
    }
}

/// Arguments of `selvedge draft format`, and of all that rewrites a draft.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RewriteOptions {
    /// The draft.
    pub draft: PathBuf,
    /// Where it goes; `None` for standard output.
    pub output: Option<PathBuf>,
    /// Whether it goes where it came from.
    pub in_place: bool,
    /// No warnings.
    pub quiet: bool,
}

#[derive(Args)]
struct RewriteFlags {
    /// The draft, a WIF file; - reads standard input
    #[arg(value_name = "FILE")]
    draft: PathBuf,

    /// Where the result goes; - is standard output, the default
    #[arg(short, long, value_name = "OUT", conflicts_with = "in_place")]
    output: Option<PathBuf>,

    /// Puts the result in the place of the draft
    #[arg(short, long)]
    in_place: bool,

    /// No warnings; errors are still told
    #[arg(short, long)]
    quiet: bool,
}

impl RewriteFlags {
    fn checked(self) -> Result<RewriteOptions, clap::Error> {
        let Self { draft, output, in_place, quiet } = self;
        if in_place && draft == Path::new("-") {
            return Err(conflict("--in-place", "standard input"));
        }
        let output = if in_place { Some(draft.clone()) } else { not_dash(output) };
        Ok(RewriteOptions { draft, output, in_place, quiet })
    }
}

/// Arguments of `selvedge draft convert`.
#[derive(Clone, Debug, Args)]
#[command(group(ArgGroup::new("plan").required(true)))]
pub struct ConvertOptions {
    /// The draft and where it goes.
    #[command(flatten)]
    pub rewrite: RewriteOptions,

    /// To a lift plan: the shafts of each pick
    #[arg(long, group = "plan")]
    liftplan: bool,

    /// To a tie-up and a treadling: the smallest with one treadle to a pick
    #[arg(long, group = "plan")]
    tieup: bool,
}

impl ConvertOptions {
    /// The plan that the result weaves by.
    pub fn plan(&self) -> Plan {
        if self.tieup { Plan::TieUp } else { Plan::LiftPlan }
    }
}

fn conflict(argument: &str, other: &str) -> clap::Error {
    let mut error = clap::Error::new(ErrorKind::ArgumentConflict);
    error.insert(ContextKind::InvalidArg, ContextValue::String(argument.to_owned()));
    error.insert(ContextKind::PriorArg, ContextValue::String(other.to_owned()));
    error
}

/// The error of an output whose name does not tell what it shall be.
fn no_form(output: &Path) -> clap::Error {
    let mut error = clap::Error::new(ErrorKind::ValueValidation);
    let [argument, value] = ["--output <OUT>".to_owned(), output.display().to_string()];
    error.insert(ContextKind::InvalidArg, ContextValue::String(argument));
    error.insert(ContextKind::InvalidValue, ContextValue::String(value));
    let tip = "expected a name that ends in .png or .txt, or --format";
    error.insert(ContextKind::Suggested, ContextValue::StyledStrs(vec![tip.into()]));
    error
}

fn not_dash(path: Option<PathBuf>) -> Option<PathBuf> {
    path.filter(|path| path != Path::new("-"))
}

/// Makes a type of arguments out of flags that are checked together, which clap alone cannot.
macro_rules! checked {
    ($options:ty, $flags:ty) => {
        impl Args for $options {
            fn augment_args(command: Command) -> Command {
                <$flags>::augment_args(command)
            }

            fn augment_args_for_update(command: Command) -> Command {
                <$flags>::augment_args_for_update(command)
            }
        }

        impl FromArgMatches for $options {
            fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
                <$flags>::from_arg_matches(matches)?.checked()
            }

            fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
                *self = Self::from_arg_matches(matches)?;
                Ok(())
            }
        }
    };
}

checked!(DrawdownOptions, DrawdownFlags);
checked!(RewriteOptions, RewriteFlags);
