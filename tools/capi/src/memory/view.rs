//! Views of the caller's arrays that the driver takes as bodies and collisions.

use std::ptr::NonNull;

use zynq_pgs::scene::Structures;
use zynq_pgs::{Bodies, Body, Collision, Collisions, Impulses, Place, Pose, Velocity};

use super::overlap::Span;
use super::pointer::{extent, misaligned, slice};
use crate::arrays::{BodyArrays, CollisionArray, Strided, StridedConst};
use crate::failure::Failure;

/// One strided array.
///
/// Invariant: for every index below the count it was made with, `first` plus the index times the
/// stride is aligned and leads to an element in the caller's memory.
#[derive(Debug)]
struct Column<T> {
    name: &'static str,
    first: NonNull<T>,
    stride: usize,
}

impl<T: Copy> Column<T> {
    /// Checks the address, the stride and the extent of an array.
    ///
    /// # Safety
    /// `data` is null or leads to `count` elements, `stride` bytes apart, which live as long as the
    /// column is in use. Every bit pattern is a `T`.
    unsafe fn new(data: StridedConst, count: usize, name: &'static str) -> Result<Self, Failure> {
        let StridedConst { data, stride } = data;
        if count == 0 {
            return Ok(Self { name, first: NonNull::dangling(), stride: 0 });
        }
        let first = NonNull::new(data.cast_mut()).ok_or_else(|| Failure::null(name))?.cast::<T>();
        if !first.is_aligned() {
            return Err(misaligned(name, first.addr().get(), align_of::<T>()));
        }
        if stride < size_of::<T>() || !stride.is_multiple_of(align_of::<T>()) {
            return Err(Failure::argument(format!(
                "the stride of the {name} is {stride} bytes: give a multiple of {}, at least {}",
                align_of::<T>(),
                size_of::<T>()
            )));
        }
        extent(first.addr().get(), stride, size_of::<T>(), count, name)?;
        Ok(Self { name, first, stride })
    }

    /// Its bytes.
    fn span(&self, count: usize) -> Span {
        Span::new::<T>(self.name, self.first.addr().get(), self.stride, count)
    }

    /// The address of an element.
    ///
    /// # Safety
    /// `index` is below the count.
    unsafe fn at(&self, index: usize) -> NonNull<T> {
        // SAFETY: the element is in the caller's memory (the invariant), and the offset to it does
        // not overflow: `extent` has checked the last one.
        unsafe { self.first.byte_add(index * self.stride) }
    }

    /// An element.
    ///
    /// # Safety
    /// `index` is below the count, the element is initialised, and no other thread writes it.
    unsafe fn get(&self, index: usize) -> T {
        // SAFETY: the caller promises the index.
        let element = unsafe { self.at(index) };
        // SAFETY: aligned and in the caller's memory (the invariant), and initialised; nothing
        // writes it.
        unsafe { element.read() }
    }

    /// Replaces an element.
    ///
    /// # Safety
    /// `index` is below the count, and nothing else reads or writes the element.
    unsafe fn set(&mut self, index: usize, value: T) {
        // SAFETY: the caller promises the index.
        let element = unsafe { self.at(index) };
        // SAFETY: aligned and in the caller's memory (the invariant), which is writable and which
        // nothing else reads or writes.
        unsafe { element.write(value) };
    }
}

impl From<Strided> for StridedConst {
    fn from(Strided { data, stride }: Strided) -> Self {
        Self { data, stride }
    }
}

/// The caller's bodies.
#[derive(Debug)]
pub(crate) struct BodiesView {
    count: usize,
    positions: Column<[f32; 3]>,
    orientations: Column<[f32; 4]>,
    linear_velocities: Column<[f32; 3]>,
    angular_velocities: Column<[f32; 3]>,
    shapes: Column<u32>,
}

impl BodiesView {
    /// Checks the arrays.
    ///
    /// # Safety
    /// Each array is as [`BodyArrays`] describes, initialised, and lives as long as the view is in
    /// use. Nothing but the view writes the arrays meanwhile.
    pub(crate) unsafe fn new(arrays: BodyArrays) -> Result<Self, Failure> {
        let BodyArrays { count, shapes, .. } = arrays;
        let BodyArrays { positions, orientations, linear_velocities, angular_velocities, .. } =
            arrays;
        // SAFETY: the caller promises each array, here and below; floats and integers take every
        // bit pattern.
        let positions = unsafe { Column::new(positions.into(), count, "positions") }?;
        // SAFETY: as above.
        let orientations = unsafe { Column::new(orientations.into(), count, "orientations") }?;
        // SAFETY: as above.
        let linear_velocities =
            unsafe { Column::new(linear_velocities.into(), count, "linear velocities") }?;
        // SAFETY: as above.
        let angular_velocities =
            unsafe { Column::new(angular_velocities.into(), count, "angular velocities") }?;
        // SAFETY: as above.
        let shapes = unsafe { Column::new(shapes, count, "shapes of the bodies") }?;
        Ok(Self { count, positions, orientations, linear_velocities, angular_velocities, shapes })
    }

    /// The arrays that a step writes.
    pub(crate) fn outputs(&self) -> [Span; 4] {
        let Self { count, positions, orientations, linear_velocities, angular_velocities, .. } =
            self;
        [
            positions.span(*count),
            orientations.span(*count),
            linear_velocities.span(*count),
            angular_velocities.span(*count),
        ]
    }

    /// The array that a step only reads.
    pub(crate) fn input(&self) -> Span {
        self.shapes.span(self.count)
    }

    /// Makes sure that an index is below the count, as the driver promises.
    fn check(&self, index: usize) {
        assert!(index < self.count, "body {index} of {}", self.count);
    }
}

// SAFETY: a shared view only reads, and nothing else writes the arrays while it is in use (`new`).
unsafe impl Sync for BodiesView {}

impl Bodies for BodiesView {
    fn len(&self) -> usize {
        self.count
    }

    fn body(&self, index: usize) -> Body {
        self.check(index);
        // SAFETY: the index is below the count, and a shared view has no writer; both hold below.
        let position = unsafe { self.positions.get(index) };
        // SAFETY: as above.
        let orientation = unsafe { self.orientations.get(index) };
        // SAFETY: as above.
        let linear = unsafe { self.linear_velocities.get(index) };
        // SAFETY: as above.
        let angular = unsafe { self.angular_velocities.get(index) };
        // SAFETY: as above.
        let shape = unsafe { self.shapes.get(index) };
        let pose = Pose { position, orientation };
        Body { pose, velocity: Velocity { linear, angular }, shape }
    }

    fn commit(&mut self, index: usize, pose: Pose, velocity: Velocity) {
        self.check(index);
        // SAFETY: the index is below the count, and the view is borrowed by this call alone; both
        // hold below.
        unsafe { self.positions.set(index, pose.position) };
        // SAFETY: as above.
        unsafe { self.orientations.set(index, pose.orientation) };
        // SAFETY: as above.
        unsafe { self.linear_velocities.set(index, velocity.linear) };
        // SAFETY: as above.
        unsafe { self.angular_velocities.set(index, velocity.angular) };
    }
}

/// The caller's collisions.
#[derive(Debug)]
pub(crate) struct CollisionsView<'a> {
    count: usize,
    column: Column<Collision>,
    /// All of them, where they lie without gaps.
    dense: Option<&'a [Collision]>,
    impulses: Option<Column<Impulses>>,
    pub(crate) places: Option<&'a [Place]>,
    pub(crate) factor: f32,
    pub(crate) world: u32,
}

impl CollisionsView<'_> {
    /// Checks the arrays.
    ///
    /// # Safety
    /// The arrays are as [`CollisionArray`] describes, initialised, and live as long as the view is
    /// in use. Nothing writes them meanwhile.
    pub(crate) unsafe fn new(array: CollisionArray) -> Result<Self, Failure> {
        let CollisionArray { count, collisions, impulses, places, factor, world, .. } = array;
        // SAFETY: the caller promises the array; a `Collision` takes every bit pattern.
        let column = unsafe { Column::new(collisions, count, "collisions") }?;
        let dense = if column.stride == size_of::<Collision>() || count == 0 {
            // SAFETY: `count` elements without gaps, aligned and within the address space (the
            // invariant of the column), which nothing writes.
            Some(unsafe { std::slice::from_raw_parts(column.first.as_ptr(), count) })
        } else {
            None
        };
        let impulses = match impulses.data.is_null() {
            true => None,
            // SAFETY: the caller promises the array; floats take every bit pattern.
            false => Some(unsafe { Column::new(impulses, count, "impulses") }?),
        };
        let places = match places.is_null() {
            true => None,
            // SAFETY: the caller promises the array; integers take every bit pattern.
            false => Some(unsafe { slice(places.cast::<Place>(), count, "places") }?),
        };
        if impulses.is_some() && places.is_some() {
            return Err(Failure::argument(
                "zpgs_collisions has impulses and places: set one of them to null".to_owned(),
            ));
        }
        Ok(Self { count, column, dense, impulses, places, factor, world })
    }

    /// The arrays.
    pub(crate) fn inputs(&self) -> [Span; 3] {
        let none = || Span::of::<Impulses>("impulses", std::ptr::null());
        let impulses = self.impulses.as_ref().map_or_else(none, |column| column.span(self.count));
        let places = self.places.unwrap_or_default();
        let places =
            Span::new::<Place>("places", places.as_ptr().addr(), size_of::<Place>(), places.len());
        [self.column.span(self.count), impulses, places]
    }

    /// Whether a step can begin with the impulses of every collision.
    pub(crate) fn has_impulses(&self) -> bool {
        self.impulses.is_some() || self.places.is_some() || self.count == 0
    }
}

/// Stores impulses in the caller's array.
///
/// # Safety
/// `array` is null or leads to as many `zpgs_impulses` as there are impulses, as [`Strided`]
/// describes, and nothing else reads or writes them meanwhile.
pub(crate) unsafe fn store_impulses(array: Strided, impulses: &[Impulses]) -> Result<(), Failure> {
    // SAFETY: the caller promises the array; floats take every bit pattern.
    let mut column = unsafe { Column::new(array.into(), impulses.len(), "impulses") }?;
    for (index, of) in impulses.iter().enumerate() {
        // SAFETY: the index is below the count, and this call alone uses the array.
        unsafe { column.set(index, *of) };
    }
    Ok(())
}

// SAFETY: the view only reads, and nothing writes the array while it is in use (`new`).
unsafe impl Sync for CollisionsView<'_> {}

impl Collisions for CollisionsView<'_> {
    fn len(&self) -> usize {
        self.count
    }

    fn collision(&self, index: usize) -> Collision {
        assert!(index < self.count, "collision {index} of {}", self.count);
        // SAFETY: the index is below the count, and nothing writes the array.
        unsafe { self.column.get(index) }
    }

    fn structures(&self) -> Option<Structures<'_>> {
        self.dense.map(Structures::Array)
    }

    fn impulses(&self, index: usize, _: [f32; 3], _: u32) -> Impulses {
        assert!(index < self.count, "collision {index} of {}", self.count);
        // SAFETY: the index is below the count, and nothing writes the array.
        self.impulses.as_ref().map_or(Impulses::ZERO, |column| unsafe { column.get(index) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use zynq_pgs::Contact;

    /// Three bodies of 16 words: position, orientation, both velocities, shape, two words between.
    fn words() -> [[f32; 16]; 3] {
        [0, 1, 2].map(|body| std::array::from_fn(|word| (100 * body + word) as f32))
    }

    fn arrays(words: &mut [[f32; 16]; 3], shapes: &[u32; 3]) -> BodyArrays {
        let first = words.as_mut_ptr().cast::<f32>();
        let column = |word| Strided { data: first.wrapping_add(word).cast(), stride: 64 };
        BodyArrays {
            size: size_of::<BodyArrays>(),
            count: 3,
            positions: column(0),
            orientations: column(3),
            linear_velocities: column(8),
            angular_velocities: column(11),
            shapes: StridedConst { data: shapes.as_ptr().cast(), stride: 4 },
        }
    }

    #[test]
    fn each_element_is_read_and_written_at_its_stride_and_nothing_between() {
        let (mut words, shapes) = (words(), [5, 6, 7]);
        let arrays = arrays(&mut words, &shapes);
        // SAFETY: the arrays are in `words` and `shapes`, which nothing uses until the view ends.
        let mut view = unsafe { BodiesView::new(arrays) }.expect("arrays");
        let Body { pose, velocity, shape } = view.body(2);
        let found =
            [pose.position[0], pose.orientation[3], velocity.linear[2], velocity.angular[1]];
        assert_eq!(
            (found.map(f32::to_bits), shape),
            ([200.0, 206.0, 210.0, 212.0].map(f32::to_bits), 7)
        );
        let pose = Pose { position: [-1.0; 3], orientation: [-2.0; 4] };
        view.commit(1, pose, Velocity { linear: [-3.0; 3], angular: [-4.0; 3] });
        let mut expected = self::words();
        expected[1][..3].fill(-1.0);
        expected[1][3..7].fill(-2.0);
        expected[1][8..11].fill(-3.0);
        expected[1][11..14].fill(-4.0);
        assert_eq!(
            words.map(|body| body.map(f32::to_bits)),
            expected.map(|body| body.map(f32::to_bits))
        );
    }

    #[test]
    fn dense_collisions_are_structures_and_others_are_read_one_by_one() {
        let contacts = [Contact::default(); 4];
        let all = [0, 1, 2, 3].map(|body_a| Collision {
            body_a,
            body_b: 9,
            normal: [0.0; 3],
            count: 1,
            contacts,
        });
        let array = |count, times| CollisionArray {
            size: size_of::<CollisionArray>(),
            count,
            collisions: StridedConst {
                data: all.as_ptr().cast(),
                stride: times * size_of::<Collision>(),
            },
            impulses: StridedConst { data: std::ptr::null(), stride: 0 },
            places: std::ptr::null(),
            factor: 0.0,
            world: 0,
        };
        // SAFETY: four elements.
        let dense = unsafe { CollisionsView::new(array(4, 1)) }.expect("an array");
        let Some(Structures::Array(structures)) = dense.structures() else { panic!("dense") };
        assert_eq!((structures, dense.collision(3).body_a), (&all[..], 3));
        // SAFETY: every second of four elements.
        let apart = unsafe { CollisionsView::new(array(2, 2)) }.expect("an array");
        assert!(apart.structures().is_none());
        assert_eq!((apart.len(), apart.collision(1).body_a), (2, 2));
        // SAFETY: no element.
        let none = unsafe { CollisionsView::new(array(0, 0)) }.expect("an array");
        assert!(none.structures().is_some_and(|all| all.is_empty()));
    }
}
