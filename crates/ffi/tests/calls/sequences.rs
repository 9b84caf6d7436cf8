//! Random calls in any order, with arguments good and bad: none crashes, none changes an output when it
//! fails, and all that is made is freed. Under ASan, `RUSTFLAGS=-Zsanitizer=address cargo +nightly test
//! --target x86_64-unknown-linux-gnu -p selvedge-ffi --test calls` finds what leaks or is misread.

use std::ffi::c_char;
use std::ptr;

use proptest::collection::vec;
use proptest::prelude::*;
use proptest::test_runner::TestRunner;
use selvedge::*;

use crate::common;

/// One call, with what it is made of; indices wrap around what there is.
#[derive(Debug, Clone)]
enum Call {
    LoadDraft { bytes: Vec<u8> },
    MakePattern { ends: u32, picks: u32, size: usize, pitch: f64, color: f32 },
    MakeFabric { draft: usize, json: String },
    Value { fabric: usize, yarn: u32, index: u32 },
    SetValue { fabric: usize, yarn: u32, index: u32, value: [f64; 3] },
    SetTexture { fabric: usize, yarn: u32, index: u32, range: [f32; 2] },
    Describe { fabric: usize, size: usize },
    MakeShader { fabric: usize },
    ShareShader { shader: usize },
    Point { shader: usize, uv: [f64; 2], footprint: f32, w: [[f32; 3]; 3] },
    Batch { shader: usize, batch: Batch },
    FreeDraft { draft: usize },
    FreeFabric { fabric: usize },
    FreeShader { shader: usize },
}

#[derive(Debug, Clone)]
struct Batch {
    function: u8,
    size: usize,
    count: usize,
    lobes: u32,
    sides: u32,
    nulls: u8,
    is_masked: bool,
    stride: usize,
    numbers: Vec<f32>,
}

fn number() -> impl Strategy<Value = f64> {
    prop_oneof![
        4 => -2.0..2.0,
        1 => any::<f64>(),
        1 => prop::sample::select(vec![0.0, -0.0, 1.0, f64::NAN, f64::INFINITY, f64::MIN_POSITIVE]),
    ]
}

fn single() -> impl Strategy<Value = f32> {
    number().prop_map(|number| number as f32)
}

fn three() -> impl Strategy<Value = [f32; 3]> {
    [single(), single(), single()]
}

fn struct_size(right: usize) -> impl Strategy<Value = usize> {
    prop_oneof![6 => Just(right), 1 => any::<usize>(), 1 => Just(right + 8), 1 => Just(0)]
}

fn batch() -> impl Strategy<Value = Batch> {
    let head = (0_u8..9, struct_size(size_of::<Points>()), 0_usize..300, 0_u32..4, 0_u32..3);
    let tail = (0_u8..64, any::<bool>(), 0_usize..24, vec(single(), 64));
    (head, tail).prop_map(|((function, size, count, lobes, sides), tail)| {
        let (nulls, is_masked, stride, numbers) = tail;
        Batch { function, size, count, lobes, sides, nulls, is_masked, stride, numbers }
    })
}

fn call() -> impl Strategy<Value = Call> {
    let wif = prop::sample::select(vec!["drafts/plain.wif", "invalid/no-weave.wif"]);
    let json = prop::sample::select(vec![
        "",
        "{}",
        "[]",
        "{\"yarn\": {\"psi\": 0.1}}",
        "{\"yarn\": {\"psi\": 99}}",
        "{\"scale\": 0}",
        "{\"yarn\": {\"size\": 0.5}, \"normalization\": \"none\"}",
        "{\"yarn\": {\"sigma\":",
    ]);
    let (i, yarn, index) = (0_usize..4, 0_u32..4, 0_u32..36);
    prop_oneof![
        (wif, any::<bool>(), any::<prop::sample::Index>(), any::<u8>()).prop_map(
            |(name, is_mutated, at, byte)| {
                let mut bytes = common::read(name);
                let at = at.index(bytes.len());
                bytes[at] = if is_mutated { byte } else { bytes[at] };
                Call::LoadDraft { bytes }
            }
        ),
        (0_u32..5, 0_u32..5, struct_size(size_of::<Pattern>()), number(), single()).prop_map(
            |(ends, picks, size, pitch, color)| Call::MakePattern {
                ends,
                picks,
                size,
                pitch,
                color
            }
        ),
        (i.clone(), json).prop_map(|(draft, json)| Call::MakeFabric { draft, json: json.into() }),
        (i.clone(), yarn.clone(), index.clone()).prop_map(|(fabric, yarn, index)| Call::Value {
            fabric,
            yarn,
            index
        }),
        (i.clone(), yarn.clone(), index.clone(), [number(), number(), number()])
            .prop_map(|(fabric, yarn, index, value)| Call::SetValue { fabric, yarn, index, value }),
        (i.clone(), yarn, index, [single(), single()]).prop_map(|(fabric, yarn, index, range)| {
            Call::SetTexture { fabric, yarn, index, range }
        }),
        (i.clone(), struct_size(size_of::<FabricInfo>()))
            .prop_map(|(fabric, size)| Call::Describe { fabric, size }),
        i.clone().prop_map(|fabric| Call::MakeShader { fabric }),
        i.clone().prop_map(|shader| Call::ShareShader { shader }),
        (i.clone(), [number(), number()], single(), [three(), three(), three()])
            .prop_map(|(shader, uv, footprint, w)| Call::Point { shader, uv, footprint, w }),
        (i.clone(), batch()).prop_map(|(shader, batch)| Call::Batch { shader, batch }),
        i.clone().prop_map(|draft| Call::FreeDraft { draft }),
        i.clone().prop_map(|fabric| Call::FreeFabric { fabric }),
        i.prop_map(|shader| Call::FreeShader { shader }),
    ]
}

/// What has been made and not been freed.
#[derive(Default)]
struct World {
    drafts: Vec<*mut Draft>,
    fabrics: Vec<*mut Fabric>,
    /// As often as there are owners.
    shaders: Vec<*const Shader>,
}

/// The handle of this index, or NULL where there is none.
fn pick<T: Copy>(handles: &[T], index: usize, null: T) -> T {
    handles.get(index).copied().unwrap_or(null)
}

unsafe extern "C" fn texture(
    _user: *mut std::ffi::c_void,
    uv: *const f64,
    _footprint: f64,
    rgb: *mut f32,
) {
    // SAFETY: the library hands over two numbers and takes three.
    unsafe { rgb.cast::<[f32; 3]>().write([uv.read() as f32, f32::NAN, f32::INFINITY]) };
}

/// A status that a caller expects from somebody who passes wrong arguments.
fn check(status: Status) {
    assert_ne!(status, Status::Panic);
}

impl World {
    /// Makes the call: every argument is what the header asks for, or wrong in a way that it answers.
    fn run(&mut self, call: &Call) {
        let mut message: [c_char; 64] = [0x7f; 64];
        let (text, size) = (message.as_mut_ptr(), message.len());
        // SAFETY: handles are live or NULL, sizes are those of the arrays.
        unsafe {
            match call {
                Call::LoadDraft { bytes } => {
                    let mut draft = ptr::dangling_mut();
                    let (start, length) = (bytes.as_ptr(), bytes.len());
                    let status = selvedge_draft_new(start, length, text, size, &raw mut draft);
                    keep(status, draft, ptr::dangling_mut(), &mut self.drafts);
                }
                Call::MakePattern { ends, picks, size: struct_size, pitch, color } => {
                    let (up, colors) = ([1_u8, 0, 0, 1, 1].repeat(5), [*color; 15]);
                    let pattern = Pattern {
                        struct_size: *struct_size,
                        ends: *ends,
                        picks: *picks,
                        warp_up: up.as_ptr(),
                        end_types: ptr::null(),
                        pick_types: ptr::null(),
                        end_colors: colors.as_ptr(),
                        pick_colors: ptr::null(),
                        end_pitch: *pitch,
                        pick_pitch: 5e-4,
                        end_diameters: ptr::null(),
                        pick_diameters: ptr::null(),
                    };
                    let mut draft = ptr::dangling_mut();
                    let status =
                        selvedge_draft_from_pattern(&raw const pattern, text, size, &raw mut draft);
                    keep(status, draft, ptr::dangling_mut(), &mut self.drafts);
                }
                Call::MakeFabric { draft, json } => {
                    let draft = pick(&self.drafts, *draft, ptr::null_mut());
                    let mut fabric = ptr::dangling_mut();
                    let (start, length) = (json.as_ptr().cast(), json.len());
                    let status =
                        selvedge_fabric_new(draft, start, length, text, size, &raw mut fabric);
                    keep(status, fabric, ptr::dangling_mut(), &mut self.fabrics);
                }
                Call::Value { fabric, yarn, index } => {
                    let fabric = pick(&self.fabrics, *fabric, ptr::null_mut());
                    let mut value = [7.0; 3];
                    let to = value.as_mut_ptr();
                    let status = selvedge_fabric_value(fabric, *yarn, *index, text, size, to);
                    check(status);
                    assert!(status == Status::Ok || value == [7.0; 3]);
                }
                Call::SetValue { fabric, yarn, index, value } => {
                    let fabric = pick(&self.fabrics, *fabric, ptr::null_mut());
                    let value = value.as_ptr();
                    check(selvedge_fabric_set_value(fabric, *yarn, *index, value, text, size));
                }
                Call::SetTexture { fabric, yarn, index, range: [low, high] } => {
                    let fabric = pick(&self.fabrics, *fabric, ptr::null_mut());
                    let (value, user): (TextureValue, _) = (Some(texture), ptr::null_mut());
                    check(selvedge_fabric_set_texture(
                        fabric, *yarn, *index, value, user, *low, *high, text, size,
                    ));
                }
                Call::Describe { fabric, size: struct_size } => {
                    let fabric = pick(&self.fabrics, *fabric, ptr::null_mut());
                    let mut info = FabricInfo {
                        struct_size: *struct_size,
                        ends: 7,
                        picks: 7,
                        yarns: 7,
                        reserved: 7,
                        width: 7.0,
                        height: 7.0,
                    };
                    let status = selvedge_fabric_describe(fabric, text, size, &raw mut info);
                    check(status);
                    assert!(status == Status::Ok || (info.reserved, info.width) == (7, 7.0));
                }
                Call::MakeShader { fabric } => {
                    let fabric = pick(&self.fabrics, *fabric, ptr::null_mut());
                    let mut shader = ptr::dangling();
                    let status = selvedge_shader_new(fabric, text, size, &raw mut shader);
                    keep(status, shader, ptr::dangling(), &mut self.shaders);
                }
                Call::ShareShader { shader } => {
                    let shader = pick(&self.shaders, *shader, ptr::null());
                    if selvedge_shader_share(shader) == Status::Ok {
                        self.shaders.push(shader);
                    }
                }
                Call::Point { shader, uv, footprint, w } => self.point(*shader, uv, *footprint, w),
                Call::Batch { shader, batch } => self.batch(*shader, batch),
                Call::FreeDraft { draft } => {
                    selvedge_draft_free(take(&mut self.drafts, *draft, ptr::null_mut()));
                }
                Call::FreeFabric { fabric } => {
                    selvedge_fabric_free(take(&mut self.fabrics, *fabric, ptr::null_mut()));
                }
                Call::FreeShader { shader } => {
                    selvedge_shader_free(take(&mut self.shaders, *shader, ptr::null()));
                }
            }
        }
        assert!(message.contains(&0) || message == [0x7f; 64], "no NUL in {message:?}");
    }

    fn point(&self, shader: usize, uv: &[f64; 2], footprint: f32, [wi, wo, xi]: &[[f32; 3]; 3]) {
        let shader = pick(&self.shaders, shader, ptr::null());
        let (uv, wi, wo, xi) = (uv.as_ptr(), wi.as_ptr(), wo.as_ptr(), xi.as_ptr());
        let (mut f, mut g, mut number) = ([7.0_f32; 3], [7.0_f32; 3], 7.0_f32);
        let (to_f, to_g, to) = (f.as_mut_ptr(), g.as_mut_ptr(), &raw mut number);
        // SAFETY: the handle is live or NULL, the arrays have the lengths asked for.
        let statuses = unsafe {
            [
                selvedge_shader_eval(shader, uv, footprint, wi, wo, to_f),
                selvedge_shader_eval_lobes(shader, uv, footprint, wi, wo, to_f, to_g),
                selvedge_shader_pdf(shader, uv, footprint, wi, wo, to),
                selvedge_shader_reverse_pdf(shader, uv, footprint, wi, wo, to),
                selvedge_shader_eval_pdf(shader, uv, footprint, wi, wo, to_f, to),
                selvedge_shader_albedo(shader, uv, footprint, wo, to_f),
                selvedge_shader_opacity(shader, uv, footprint, to),
                selvedge_shader_sample(shader, uv, footprint, wo, xi, to_f, to_g, to),
            ]
        };
        let expected = if shader.is_null() { Status::NullPointer } else { Status::Ok };
        assert_eq!(statuses, [expected; 8]);
        let values = f.into_iter().chain(g).chain([number]);
        if shader.is_null() {
            assert!(values.into_iter().all(|value| value == 7.0));
        } else {
            assert!(values.into_iter().all(f32::is_finite), "{f:?} {g:?} {number}");
        }
    }

    fn batch(&self, shader: usize, batch: &Batch) {
        let shader = pick(&self.shaders, shader, ptr::null());
        // Room for all points at the greatest stride, and what must stay behind it.
        let bytes = batch.count * batch.stride + 64;
        let numbers: Vec<f32> = batch.numbers.iter().copied().cycle().take(bytes).collect();
        let positions: Vec<f64> = numbers.iter().map(|&number| f64::from(number) * 1e-3).collect();
        let flags: Vec<u8> = numbers.iter().map(|number| number.to_bits() as u8 & 1).collect();
        let stride = batch.stride as isize;
        let start = |bit: u8| if batch.nulls & bit == 0 { numbers.as_ptr() } else { ptr::null() };
        let vectors = |bit| Vectors {
            component: [start(bit), numbers[1..].as_ptr(), numbers[2..].as_ptr()],
            stride,
        };
        let points = Points {
            struct_size: batch.size,
            count: batch.count,
            uv: Positions { component: [positions.as_ptr(); 2], stride },
            wi: vectors(1),
            wo: vectors(2),
            xi: vectors(4),
            footprint: Numbers { values: start(8), stride },
            active: Flags {
                values: if batch.is_masked { flags.as_ptr() } else { ptr::null() },
                stride: 1,
            },
            lobes: batch.lobes,
            sides: batch.sides,
        };
        let mut outputs = [vec![7.0_f32; bytes], vec![7.0; bytes], vec![7.0; bytes]];
        let [f, g, number] = outputs.each_mut().map(Vec::as_mut_ptr);
        let to_vectors = |to: *mut f32| VectorsOut {
            component: [to, to.wrapping_add(1), to.wrapping_add(2)],
            stride: (batch.stride * 4) as isize,
        };
        let (to_f, to_g) = (to_vectors(f), to_vectors(g));
        let to = NumbersOut { values: number, stride };
        let (points, to_f, to_g, to) =
            (&raw const points, &raw const to_f, &raw const to_g, &raw const to);
        let (text, size) = (ptr::null_mut(), 0);
        // SAFETY: the handle is live or NULL, the arrays have room for all points.
        let status = unsafe {
            match batch.function {
                0 => selvedge_shader_eval_batch(shader, points, text, size, to_f),
                1 => selvedge_shader_eval_lobes_batch(shader, points, text, size, to_f, to_g),
                2 => selvedge_shader_pdf_batch(shader, points, text, size, to),
                3 => selvedge_shader_reverse_pdf_batch(shader, points, text, size, to),
                4 => selvedge_shader_eval_pdf_batch(shader, points, text, size, to_f, to),
                5 => selvedge_shader_albedo_batch(shader, points, text, size, to_f),
                6 => selvedge_shader_opacity_batch(shader, points, text, size, to),
                7 => selvedge_shader_sample_batch(shader, points, text, size, to_f, to_g, to),
                _ => selvedge_shader_eval_batch(shader, points, text, size, ptr::null()),
            }
        };
        check(status);
        let untouched = status != Status::Ok || batch.count == 0;
        if untouched {
            assert!(outputs.iter().flatten().all(|&value| value == 7.0), "{status:?}");
        }
    }
}

impl Drop for World {
    fn drop(&mut self) {
        // SAFETY: what is listed is live, a shader as often as it has owners.
        unsafe {
            self.drafts.drain(..).for_each(|draft| selvedge_draft_free(draft));
            self.fabrics.drain(..).for_each(|fabric| selvedge_fabric_free(fabric));
            self.shaders.drain(..).for_each(|shader| selvedge_shader_free(shader));
        }
    }
}

/// Keeps what was made, if it was; else `found` is what stood there before.
fn keep<T: Copy + PartialEq + std::fmt::Debug>(
    status: Status,
    found: T,
    before: T,
    handles: &mut Vec<T>,
) {
    check(status);
    if status == Status::Ok {
        handles.push(found);
    } else {
        assert_eq!(found, before);
    }
}

fn take<T: Copy>(handles: &mut Vec<T>, index: usize, null: T) -> T {
    if index < handles.len() { handles.remove(index) } else { null }
}

#[test]
fn random_calls_never_crash_nor_change_an_output_on_failure() {
    let mut first = World::default();
    for call in [
        Call::LoadDraft { bytes: common::read("drafts/plain.wif") },
        Call::MakeFabric { draft: 0, json: "{\"yarn\": {\"size\": 0.8}}".into() },
        Call::MakeShader { fabric: 0 },
    ] {
        first.run(&call);
    }
    let config = ProptestConfig { failure_persistence: None, ..ProptestConfig::default() };
    let result = TestRunner::new(config).run(&vec(call(), 1..40), |calls| {
        // Every sequence has a shader to begin with, and may free what it owns of it.
        let mut world = World::default();
        world.shaders.push(first.shaders[0]);
        // SAFETY: the shader is live; the world frees it once.
        unsafe { selvedge_shader_share(first.shaders[0]) };
        for call in &calls {
            world.run(call);
        }
        Ok(())
    });
    result.unwrap();
}
