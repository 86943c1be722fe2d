//! Calls the C interface with random sizes, strides and values. All memory that a call may touch
//! lies in buffers that are compared afterwards.
#![allow(unsafe_code, reason = "a caller in C has no other way")]

use std::ffi::CStr;
use std::ptr;

use zynq_pgs_c::{
    AcceleratorHandle, BodyArrays, Collision, CollisionArray, Impulses, Parameters, Place, Report,
    Shape, Status, Strided, StridedConst, ZPGS_NEW_COLLISION, ZPGS_NEW_POINT, zpgs_begin,
    zpgs_cancel, zpgs_close, zpgs_commit, zpgs_end, zpgs_forget, zpgs_last_error, zpgs_open,
    zpgs_prepare, zpgs_push, zpgs_read_impulses, zpgs_set_shapes, zpgs_start, zpgs_step,
    zpgs_submit, zpgs_wait, zpgs_wait_and_start,
};

use crate::input::Input;
use crate::tally::Tally;

/// Most calls of an execution.
const CALLS_MAX: u32 = 12;
/// Bytes around each structure: more than the largest size that the interface takes.
const STRUCTURE_BYTES: usize = 4104;

/// The shapes that the accelerator has at first.
static SHAPES: [Shape; 2] = [
    Shape { inverse_mass: 0.0, inverse_inertia: [0.0; 3] },
    Shape { inverse_mass: 1.0, inverse_inertia: [2.0; 3] },
];

/// Elements in memory of their own, at a stride.
struct Column {
    words: Vec<u32>,
    before: Vec<u32>,
    offset: usize,
    stride: usize,
    element: usize,
    count: usize,
    null: bool,
}

impl Column {
    /// `count` elements of these words, or of the doubles of these floats where `size` is 8; now and
    /// then where the interface takes none.
    fn any<const N: usize>(
        input: &mut Input<'_>,
        count: usize,
        size: usize,
        mut words_of: impl FnMut(&mut Input<'_>, usize) -> [u32; N],
    ) -> Self {
        let unit = if size == 8 { 8 } else { 4 };
        let element = unit * N;
        let stride = match input.below(24) {
            0 => element - 4,
            1 => element + input.index(4),
            2..=8 => element + unit * input.index(4),
            _ => element,
        };
        let offset = if input.one_in(24) { input.index(8) } else { unit * input.index(4) };
        // Room for every element, whatever the stride.
        let words = (offset + count * stride.max(element)).div_ceil(4) + 4;
        let mut words: Vec<u32> = (0..words).map(|_| 0xC5C5_C5C5).collect();
        for number in 0..count {
            let at = (offset + number * stride) / 4;
            for (word, to) in words_of(input, number).iter().zip(words[at..].chunks_mut(unit / 4)) {
                match to {
                    [low, high] => {
                        let double = f64::from(f32::from_bits(*word));
                        let [a, b, c, d, e, f, g, h] = double.to_ne_bytes();
                        *low = u32::from_ne_bytes([a, b, c, d]);
                        *high = u32::from_ne_bytes([e, f, g, h]);
                    }
                    _ => to.fill(*word),
                }
            }
        }
        let null = input.one_in(64);
        Self { before: words.clone(), words, offset, stride, element, count, null }
    }

    fn strided(&mut self) -> Strided {
        let first = self.words.as_mut_ptr().cast::<u8>().wrapping_add(self.offset);
        let data = if self.null { ptr::null_mut() } else { first.cast() };
        Strided { data, stride: self.stride }
    }

    fn constant(&mut self) -> StridedConst {
        let Strided { data, stride } = self.strided();
        StridedConst { data, stride }
    }

    /// Panics if a byte changed that belongs to no element, or any byte unless `written`.
    fn check(&self, written: bool) {
        for (at, (now, before)) in self.words.iter().zip(&self.before).enumerate() {
            let inside = (4 * at).checked_sub(self.offset).is_some_and(|at| {
                at / self.stride.max(1) < self.count && at % self.stride.max(1) < self.element
            });
            assert!(now == before || written && inside, "word {at} of {:?} changed", self.stride);
        }
    }
}

/// A structure that begins with its size, in memory of its own.
struct Sized(Vec<u64>);

impl Sized {
    /// `value` with a size that is right, or with another.
    fn any<T: Copy>(input: &mut Input<'_>, value: T) -> Self {
        let mut memory = vec![0_u64; STRUCTURE_BYTES / 8];
        assert!(size_of::<T>() <= STRUCTURE_BYTES && align_of::<T>() <= 8);
        // SAFETY: `memory` is new and this function's own. The assertion says that the alignment of
        // `u64` is enough for a `T`, and that there is room for one.
        unsafe { memory.as_mut_ptr().cast::<T>().write(value) };
        let right = size_of::<T>();
        memory[0] = match input.below(48) {
            0 => input.long(),
            1 => right as u64 + 8,
            2 => right as u64 - 8,
            3 => input.pick(&[0, 7, 8, 12, 4096, 4104]),
            _ => right as u64,
        };
        if input.one_in(48) {
            memory[right / 8] = 1;
        }
        Self(memory)
    }

    fn pointer<T>(&mut self) -> *mut T {
        self.0.as_mut_ptr().cast()
    }
}

/// The bodies of a call.
struct Bodies {
    columns: [Column; 4],
    shapes: Column,
    /// They stay where they are: the structure has their address.
    _table: Vec<Shape>,
    structure: Sized,
}

impl Bodies {
    fn any(input: &mut Input<'_>, count: usize) -> Self {
        let small = |input: &mut Input<'_>| {
            if input.one_in(200) { input.word() } else { input.share().to_bits() }
        };
        let one = 1_f32.to_bits();
        let size = input.pick(&[0, 4, 8, 8, 0, 4, 8, 2]);
        let mut columns =
            [
                Column::any(input, count, size, |input, at| {
                    [(2.0 * at as f32).to_bits(), small(input), 0]
                }),
                Column::any(input, count, size, |_, _| [0, 0, 0, one]),
                Column::any(input, count, size, |input, at| {
                    if at == 0 { [0; 3] } else { [small(input), 0, 0] }
                }),
                Column::any(input, count, size, |_, _| [0; 3]),
            ];
        let mut shapes = Column::any(input, count, 4, |input, at| {
            [if input.one_in(100) { input.word() } else { u32::from(at > 0) }]
        });
        let table = table(input);
        let [positions, orientations, linear, angular] = &mut columns;
        let arrays = BodyArrays {
            size: 0,
            count,
            positions: positions.strided(),
            orientations: orientations.strided(),
            linear_velocities: linear.strided(),
            angular_velocities: angular.strided(),
            shapes: shapes.constant(),
            table: if input.one_in(64) { ptr::null() } else { table.as_ptr() },
            table_count: table.len(),
            number_size: size,
            origin: origin(input),
        };
        Self { columns, shapes, _table: table, structure: Sized::any(input, arrays) }
    }

    fn check(&self, written: bool) {
        self.columns.iter().for_each(|column| column.check(written));
        self.shapes.check(false);
    }
}

/// The shapes of a world: mostly none, or some that differ from the accelerator's.
fn table(input: &mut Input<'_>) -> Vec<Shape> {
    let count = if input.one_in(4) { 1 + input.index(3) } else { 0 };
    let mut table = SHAPES.to_vec();
    table.resize(count, SHAPES[1]);
    if let Some(last) = table.last_mut().filter(|_| input.one_in(2)) {
        let wild = input.one_in(16);
        last.inverse_mass = if wild { f32::from_bits(input.word()) } else { 2.0 };
    }
    table
}

/// The origin of a world: mostly 0, near, or far.
fn origin(input: &mut Input<'_>) -> [f64; 3] {
    match input.below(32) {
        0..=23 => [0.0; 3],
        24..=29 => [0.0; 3].map(|_| f64::from(input.share())),
        30 => [0.0; 3].map(|_| 1e6 * f64::from(input.share())),
        _ => [0.0; 3].map(|_| f64::from_bits(input.long())),
    }
}

/// The collisions of a call; each is of body 0 with another.
struct Collisions {
    elements: Column,
    impulses: Column,
    /// They stay where they are: the structure has their address.
    _places: Vec<Place>,
    structure: Sized,
}

impl Collisions {
    fn any(input: &mut Input<'_>, count: usize, bodies: usize) -> Self {
        let mut elements = Column::any(input, count, 4, |input, _| {
            let mut words = [0; size_of::<Collision>() / 4];
            words[1] = if input.one_in(100) {
                input.word()
            } else {
                input.below(8) % u32::try_from(bodies.max(1)).expect("few")
            };
            words[2] = 1_f32.to_bits();
            words[5] = if input.one_in(100) { input.word() } else { input.below(4) };
            words
        });
        let mut impulses = Column::any(input, count, 4, |_, _| [0; size_of::<Impulses>() / 4]);
        let by_place = input.one_in(4);
        let places: Vec<Place> = (0..count).map(|_| place(input)).collect();
        let nothing = StridedConst { data: ptr::null(), stride: 0 };
        let array = CollisionArray {
            size: 0,
            count,
            collisions: elements.constant(),
            impulses: if by_place { nothing } else { impulses.constant() },
            places: if by_place || input.one_in(64) { places.as_ptr() } else { ptr::null() },
            factor: if input.one_in(64) { f32::from_bits(input.word()) } else { 0.85 },
            world: input.below(2),
        };
        Self { elements, impulses, _places: places, structure: Sized::any(input, array) }
    }

    fn check(&self) {
        self.elements.check(false);
        self.impulses.check(false);
    }
}

/// The place of a collision, mostly one that some steps have.
fn place(input: &mut Input<'_>) -> Place {
    let mut point = || if input.one_in(8) { input.byte() } else { ZPGS_NEW_POINT };
    let points = [point(), 1, point(), 3];
    let old = !input.one_in(3);
    Place { collision: if old { input.below(4) } else { ZPGS_NEW_COLLISION }, points }
}

fn parameters(input: &mut Input<'_>) -> Sized {
    let mut flag = || u32::from(input.byte().is_multiple_of(32));
    let flags = [flag(), flag(), flag(), flag(), flag(), flag()];
    let [pair_friction, kinematic, verify_order, warm_start, impulses_out, still] = flags;
    let value = Parameters {
        contact_iterations: input.below(3),
        friction_iterations: input.below(3),
        order: if input.one_in(32) { input.byte().into() } else { 0 },
        integrate: if input.one_in(64) { 2 } else { 1 - still },
        friction: if input.one_in(64) { f32::from_bits(input.word()) } else { 0.5 },
        pair_friction,
        kinematic,
        verify_order,
        warm_start,
        impulses_out,
        ..Parameters::default()
    };
    Sized::any(input, value)
}

/// One execution.
pub(super) fn run(bytes: &[u8]) -> Tally {
    let mut input = Input::new(bytes);
    let mut handle: *mut AcceleratorHandle = ptr::null_mut();
    // SAFETY: the text ends with a null byte; `handle` is a local variable, which the call may
    // write.
    let opened = unsafe { zpgs_open(c"emulated".as_ptr(), &raw mut handle) };
    assert_eq!(opened, Status::Ok);
    // SAFETY: the handle is open; `SHAPES` has `SHAPES.len()` shapes, which the call only reads.
    let loaded = unsafe { zpgs_set_shapes(handle, SHAPES.as_ptr(), SHAPES.len()) };
    assert_eq!(loaded, Status::Ok);
    let mut tally = Tally::default();
    for _ in 0..CALLS_MAX {
        if input.is_empty() {
            break;
        }
        call(&mut input, handle, &mut tally);
    }
    // SAFETY: the handle is open, and nothing uses it after this call.
    let closed = unsafe { zpgs_close(handle) };
    assert_eq!(closed, Status::Ok);
    tally
}

/// One call, and the checks after it.
fn call(input: &mut Input<'_>, handle: *mut AcceleratorHandle, tally: &mut Tally) {
    let count = input.index(5);
    let mut bodies = Bodies::any(input, count);
    let pairs = input.index(4);
    let mut collisions = Collisions::any(input, pairs, count);
    let mut parameters = parameters(input);
    let mut report = Sized::any(input, Report::default());
    let (given, wanted) = (bodies.structure.pointer(), collisions.structure.pointer());
    let (steps, told) = (parameters.pointer(), report.pointer::<Report>());
    let mut started = Status::Ok;
    let choice = input.below(14);
    let status = match choice {
        // `run` has opened the handle, and this thread alone uses it. A `Sized` has room for the
        // largest structure that the interface takes, and a `Column` for every element at its
        // stride; all of them live to the end of this function.
        // SAFETY: the handle is open; bodies, collisions and parameters have room.
        0 => unsafe { zpgs_submit(handle, given, wanted, steps) },
        // SAFETY: the handle is open; bodies and report have room.
        1 | 2 => unsafe { zpgs_wait(handle, given, told) },
        // SAFETY: the handle is open; bodies, collisions and parameters have room.
        3 => unsafe { zpgs_prepare(handle, given, wanted, steps) },
        // SAFETY: the handle is open; bodies and report have room, and `started` is a local
        // variable.
        4 => unsafe { zpgs_wait_and_start(handle, given, told, &raw mut started) },
        // SAFETY: the handle is open.
        5 => unsafe { zpgs_start(handle) },
        // SAFETY: the handle is open.
        6 => unsafe { zpgs_begin(handle) },
        7 => {
            let dense = vec![Collision::default(); pairs];
            // SAFETY: the handle is open; `dense` has `pairs` collisions, and no impulses are
            // given.
            unsafe { zpgs_push(handle, dense.as_ptr(), ptr::null(), pairs) }
        }
        // SAFETY: the handle is open; bodies and parameters have room.
        8 => unsafe { zpgs_end(handle, given, steps) },
        9 => {
            let into = collisions.impulses.strided();
            // SAFETY: the handle is open; the column has room for `pairs` impulses at its stride.
            let status = unsafe { zpgs_read_impulses(handle, into, pairs) };
            collisions.impulses.check(status == Status::Ok);
            collisions.impulses.before.clone_from(&collisions.impulses.words);
            status
        }
        // SAFETY: the handle is open.
        10 if input.one_in(4) => unsafe { zpgs_cancel(handle) },
        // SAFETY: the handle is open; collisions have room.
        12 => unsafe { zpgs_commit(handle, wanted) },
        // SAFETY: the handle is open.
        13 => unsafe { zpgs_forget(handle, input.below(3)) },
        // SAFETY: the handle is open; bodies, collisions, parameters and report have room.
        _ => unsafe { zpgs_step(handle, given, wanted, steps, told) },
    };
    assert_ne!(status, Status::Panic, "{}", text(handle));
    let writes = matches!(choice, 1 | 2 | 4 | 10 | 11);
    bodies.check(writes && status == Status::Ok);
    collisions.check();
    if status == Status::Ok {
        tally.steps += 1;
    } else {
        assert!(!text(handle).is_empty(), "{status:?} without a text");
        tally.refused += 1;
    }
}

fn text(handle: *mut AcceleratorHandle) -> String {
    // SAFETY: the handle is open.
    let text = unsafe { zpgs_last_error(handle) };
    // SAFETY: never null, ends with a null byte, and stays until the next call with the handle.
    unsafe { CStr::from_ptr(text) }.to_string_lossy().into_owned()
}
