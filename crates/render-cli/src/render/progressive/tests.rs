use std::{
    f32::consts::TAU,
    sync::{Mutex, atomic::AtomicU32},
};

use glam::{DVec3, Vec2, Vec3};
use rayon::ThreadPoolBuilder;

use super::*;
use crate::render::{
    accumulate::relative_error,
    checkpoint,
    exposure::{Exposure, FirstHit, YarnSeen},
    film::{Crop, Film, Size},
    sampler::mix,
};

/// Noise of known mean and variance.
#[derive(Clone, Copy, Debug)]
enum Subject {
    /// A ramp from 0.2 to 3, with normal noise from none at the top to as much as the mean.
    Ramp,
    /// Light of mean 0.5 that one sample in ten has all of.
    Sparse,
    /// Dark but for a bright disc, with exponential noise.
    Disc,
}

const WIDTH: u32 = 70;
const HEIGHT: u32 = 50;

impl Subject {
    fn mean(self, [x, y]: [u32; 2]) -> Vec3 {
        let grey = match self {
            Self::Ramp => 0.2 + 2.8 * x as f32 / WIDTH as f32,
            Self::Sparse => 0.5,
            Self::Disc => {
                let from_middle = Vec2::new(x as f32 - 35.0, y as f32 - 25.0).length();
                if from_middle < 15.0 { 5.0 } else { 0.02 }
            }
        };
        Vec3::new(grey, 0.7 * grey, 0.5 * grey)
    }
}

impl Expose for Subject {
    fn expose(&self, pixel: [u32; 2], index: u32) -> Exposure {
        let place = u64::from(pixel[0]) << 48 | u64::from(pixel[1]) << 32 | u64::from(index);
        let bits = mix(mix(place + 1));
        let square = [bits >> 40, bits & 0xff_ffff].map(|bits| bits as f32 / (1 << 24) as f32);
        let factor = match self {
            Self::Ramp => {
                let sigma = pixel[1] as f32 / HEIGHT as f32;
                let radius = (-2.0 * (1.0 - square[0]).ln()).sqrt();
                1.0 + sigma * radius * (TAU * square[1]).cos()
            }
            Self::Sparse if square[0] < 0.1 => 10.0,
            Self::Sparse => 0.0,
            Self::Disc => -(1.0 - square[0]).ln(),
        };
        let radiance = self.mean(pixel) * factor;
        let first = FirstHit {
            albedo: Vec3::splat(0.5),
            normal: Vec3::Z,
            tangent: Vec3::X,
            distance: 1.0 + square[0],
            uv: Vec2::from_array(square),
            yarn: Some(YarnSeen { id: index + 7, kind: 3 }),
        };
        let first = (square[1] < 0.75).then_some(first);
        Exposure { radiance, diffuse: 0.25 * radiance, specular: 0.75 * radiance, first }
    }
}

fn size() -> Size {
    Size::new(WIDTH, HEIGHT).unwrap()
}

fn plan(spp: u32, noise: Option<f32>) -> Plan {
    let limits = Limits { spp, time: None, noise };
    Plan { frame: Frame::whole(size()), layers: Layers::All, limits, key: 1 }
}

static RUNNING: AtomicBool = AtomicBool::new(false);

/// Neither watched nor ended.
const ALONE: Control<'_> = Control { interrupt: &RUNNING, watch: &|_| {}, save: None, study: None };

fn on_threads<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> T {
    ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(work)
}

#[test]
fn bits_are_the_same_for_any_number_of_threads() {
    for plan in [plan(21, None), plan(200, Some(0.1))] {
        let picture =
            |threads| on_threads(threads, || expose(&Subject::Disc, &plan, &ALONE).exposed());
        let one = picture(1);
        assert!(picture(2) == one && picture(3) == one, "{plan:?}");
    }
}

#[test]
fn crops_put_together_are_the_whole() {
    for whole in [plan(5, None), plan(200, Some(0.1))] {
        let expected = expose(&Subject::Disc, &whole, &ALONE).exposed();
        let crops = ["0,0,37,50", "37,0,70,9", "37,9,69,50", "69,9,70,50"];
        let mut film = Film::black(size());
        for text in crops {
            let crop: Crop = text.parse().unwrap();
            let frame = Frame::cropped(size(), crop).unwrap();
            let part = expose(&Subject::Disc, &Plan { frame, ..whole }, &ALONE).exposed();
            assert_eq!(part.beauty.size(), frame.crop_size());
            for (&[x, y], pixel) in
                crop.pixels().collect::<Vec<_>>().iter().zip(part.beauty.pixels())
            {
                film.pixels_mut()[(y * WIDTH + x) as usize] = *pixel;
            }
        }
        assert!(film == expected.beauty, "{whole:?}");
    }
}

/// The picture after as many breaks as it takes with one after `tiles` tiles, each written and read.
fn in_pieces(subject: Subject, plan: &Plan, tiles: u32) -> (Exposed, u32) {
    let mut bytes = Vec::new();
    checkpoint::write(&plan.start(), plan, &mut bytes).unwrap();
    for breaks in 0.. {
        let (interrupt, count) = (AtomicBool::new(false), AtomicU32::new(0));
        let watch = |_: &Progress| {
            if count.fetch_add(1, Ordering::Relaxed) + 1 == tiles {
                interrupt.store(true, Ordering::Relaxed);
            }
        };
        let control = Control { interrupt: &interrupt, watch: &watch, save: None, study: None };
        let start = checkpoint::read(plan, &mut &bytes[..]).unwrap();
        let outcome = resume(&subject, plan, start, &control);
        if outcome.stopped != Stopped::Interrupted {
            return (outcome.exposed(), breaks);
        }
        bytes.clear();
        checkpoint::write(&outcome.accumulator, plan, &mut bytes).unwrap();
    }
    unreachable!("the loop has no end");
}

#[test]
fn resumed_is_straight() {
    for plan in [plan(21, None), plan(300, Some(0.1))] {
        let straight = expose(&Subject::Disc, &plan, &ALONE).exposed();
        for tiles in [5, 17] {
            let (resumed, breaks) = in_pieces(Subject::Disc, &plan, tiles);
            assert!(breaks > 2, "{breaks} breaks");
            assert!(resumed == straight, "{plan:?}, a break every {tiles} tiles");
        }
    }
}

#[test]
fn more_samples_later_are_as_many_at_once() {
    let short = expose(&Subject::Ramp, &plan(5, None), &ALONE);
    let long = resume(&Subject::Ramp, &plan(21, None), short.accumulator, &ALONE);
    assert!(long.exposed() == expose(&Subject::Ramp, &plan(21, None), &ALONE).exposed());
    assert_eq!((long.stopped, long.spp_min, long.spp_max), (Stopped::Spp, 21, 21));
    assert_eq!((long.samples, long.new_samples), (21 * 3500, 16 * 3500));
}

/// Root mean square of the relative error, and the mean error relative to the mean.
fn errors(subject: Subject, film: &Film) -> (f64, f64) {
    let crop = Frame::whole(film.size()).crop();
    let (mut squares, mut sum, mut truths) = (0.0, DVec3::ZERO, DVec3::ZERO);
    for (place, pixel) in crop.pixels().zip(film.pixels()) {
        let truth = subject.mean(place).as_dvec3();
        let error = pixel.as_dvec3() - truth;
        squares += relative_error(truth, error).length_squared() / 3.0;
        sum += error;
        truths += truth;
    }
    ((squares / film.pixels().len() as f64).sqrt(), sum.element_sum() / truths.element_sum())
}

#[test]
fn noise_is_what_was_asked_for() {
    for (subject, noise) in [
        (Subject::Ramp, 0.02),
        (Subject::Ramp, 0.05),
        (Subject::Sparse, 0.1),
        (Subject::Sparse, 0.2),
        (Subject::Disc, 0.03),
    ] {
        let outcome = expose(&subject, &plan(MAX_SAMPLES, Some(noise)), &ALONE);
        let (found, _) = errors(subject, &outcome.exposed().beauty);
        let Outcome { spp_min, spp_mean, spp_max, stopped, .. } = outcome;
        eprintln!(
            "{subject:?}: {found:.4} for {noise}, {spp_min} to {spp_max} spp, mean {spp_mean:.1}"
        );
        assert_eq!(stopped, Stopped::Noise);
        assert!((found / f64::from(noise) - 1.0).abs() < 0.2, "{subject:?}: {found}, {noise}");
    }
}

#[test]
fn adaptive_and_fixed_converge_to_the_same() {
    // 3500 pixels with an error of 0.1 each have a mean error of 0.0017, by chance.
    let (subject, noise) = (Subject::Sparse, 0.1);
    let adaptive = expose(&subject, &plan(MAX_SAMPLES, Some(noise)), &ALONE);
    let fixed = expose(&subject, &plan(adaptive.spp_mean as u32, None), &ALONE);
    let (_, adaptive_bias) = errors(subject, &adaptive.exposed().beauty);
    let (_, fixed_bias) = errors(subject, &fixed.exposed().beauty);
    eprintln!("mean error {adaptive_bias:.5} adaptive, {fixed_bias:.5} fixed");
    assert!(adaptive_bias.abs() < 0.005, "{adaptive_bias}");
    assert!(fixed_bias.abs() < 0.005, "{fixed_bias}");
}

#[test]
fn adaptive_saves_samples_where_there_is_little_noise() {
    let subject = Subject::Ramp;
    let adaptive = expose(&subject, &plan(MAX_SAMPLES, Some(0.05)), &ALONE);
    let fixed = expose(&subject, &plan(adaptive.spp_max, None), &ALONE);
    assert!(adaptive.spp_mean < 0.6 * f64::from(fixed.spp_max), "{}", adaptive.spp_mean);
    assert_eq!(adaptive.spp_min, FEWEST_SAMPLES);
}

#[test]
fn first_limit_that_is_met_is_told() {
    let stopped = |limits: Limits| {
        let plan = Plan { limits, ..plan(1, None) };
        let outcome = expose(&Subject::Ramp, &plan, &ALONE);
        (outcome.stopped, outcome.spp_max)
    };
    let time = Some(Duration::from_secs(3600));
    let tiny = Some(Duration::from_nanos(1));
    assert_eq!(stopped(Limits { spp: 3, time, noise: None }), (Stopped::Spp, 3));
    assert_eq!(stopped(Limits { spp: 0, time: None, noise: None }), (Stopped::Spp, 1));
    assert_eq!(stopped(Limits { spp: 9, time, noise: Some(1e-4) }), (Stopped::Spp, 9));
    assert_eq!(stopped(Limits { spp: 64, time, noise: Some(1.0) }), (Stopped::Noise, 8));
    // Each pixel has something to show.
    assert_eq!(stopped(Limits { spp: 64, time: tiny, noise: None }), (Stopped::Time, 1));
    assert_eq!(stopped(Limits { spp: 64, time: tiny, noise: Some(1.0) }), (Stopped::Time, 2));
}

#[test]
fn time_is_used_and_not_exceeded_by_far() {
    struct Slow;
    impl Expose for Slow {
        fn expose(&self, pixel: [u32; 2], index: u32) -> Exposure {
            std::thread::sleep(Duration::from_micros(20));
            Subject::Ramp.expose(pixel, index)
        }
    }
    let time = Duration::from_millis(600);
    let limits = Limits { spp: MAX_SAMPLES, time: Some(time), noise: None };
    let frame = Frame::whole(Size::new(32, 16).unwrap());
    let plan = Plan { frame, limits, ..plan(1, None) };
    let outcome = expose(&Slow, &plan, &ALONE);
    let elapsed = outcome.accumulator.elapsed.as_secs_f64();
    assert_eq!(outcome.stopped, Stopped::Time);
    assert!((0.3..1.5).contains(&elapsed), "{elapsed} s, {} spp", outcome.spp_max);
    assert_eq!(outcome.spp_min, outcome.spp_max);
}

#[test]
fn what_is_saved_meanwhile_can_be_gone_on_with() {
    let saved = Mutex::new(Vec::new());
    let save = |accumulator: &Accumulator| saved.lock().unwrap().push(accumulator.clone());
    // Saving is always due.
    let control = Control { save: Some(Save { every: Duration::ZERO, save: &save }), ..ALONE };
    let plan = plan(3, None);
    let straight = expose(&Subject::Ramp, &plan, &control).exposed();
    assert!(straight == expose(&Subject::Ramp, &plan, &ALONE).exposed());
    let saved = saved.into_inner().unwrap();
    assert!(saved.len() > 10, "{}", saved.len());
    for accumulator in saved {
        assert!(resume(&Subject::Ramp, &plan, accumulator, &ALONE).exposed() == straight);
    }
}

#[test]
fn progress_grows_to_its_end() {
    let told = Mutex::new(Vec::new());
    let watch = |progress: &Progress| told.lock().unwrap().push(*progress);
    let control = Control { watch: &watch, ..ALONE };
    on_threads(1, || expose(&Subject::Ramp, &plan(8, None), &control));
    let told = told.into_inner().unwrap();
    assert!(told.is_sorted_by_key(|progress| progress.samples));
    assert!(told.iter().all(|progress| (0.0..=1.0).contains(&progress.done)), "{told:?}");
    let last = told.last().unwrap();
    assert_eq!((last.samples, last.spp, last.done), (8 * 3500, 8.0, 1.0));
    assert_eq!(last.left, Some(Duration::ZERO));
}
