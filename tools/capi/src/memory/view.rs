//! Views of the caller's arrays that the driver takes as bodies and collisions.

use zynq_pgs::scene::Structures;
use zynq_pgs::{Bodies, Body, Collision, Collisions, Impulses, Place, Pose, Velocity};

use super::column::{Column, Numbers};
use super::overlap::Span;
use super::pointer::slice;
use crate::arrays::{BodyArrays, CollisionArray, Strided};
use crate::failure::Failure;
use crate::shape::Shape;

/// The caller's bodies.
#[derive(Debug)]
pub(crate) struct BodiesView<'a> {
    count: usize,
    positions: Numbers<3>,
    orientations: Numbers<4>,
    linear_velocities: Numbers<3>,
    angular_velocities: Numbers<3>,
    shapes: Column<u32>,
    /// The shapes of the world, if it brings them.
    pub(crate) table: Option<&'a [Shape]>,
    origin: [f64; 3],
}

impl BodiesView<'_> {
    /// Checks the arrays.
    ///
    /// # Safety
    /// Each array is as [`BodyArrays`] describes, initialised, and lives as long as the view is in
    /// use. Nothing but the view writes the arrays meanwhile.
    pub(crate) unsafe fn new(arrays: BodyArrays) -> Result<Self, Failure> {
        let BodyArrays { count, shapes, table, table_count, number_size: size, origin, .. } =
            arrays;
        let BodyArrays { positions, orientations, linear_velocities, angular_velocities, .. } =
            arrays;
        // SAFETY: the caller promises the array of positions; floats take every bit pattern.
        let positions = unsafe { Numbers::new(positions, count, size, "positions") }?;
        // SAFETY: the caller promises the array of orientations; floats take every bit pattern.
        let orientations = unsafe { Numbers::new(orientations, count, size, "orientations") }?;
        // SAFETY: the caller promises the array of linear velocities; floats take every bit
        // pattern.
        let linear_velocities =
            unsafe { Numbers::new(linear_velocities, count, size, "linear velocities") }?;
        // SAFETY: the caller promises the array of angular velocities; floats take every bit
        // pattern.
        let angular_velocities =
            unsafe { Numbers::new(angular_velocities, count, size, "angular velocities") }?;
        // SAFETY: the caller promises the array of shapes; integers take every bit pattern.
        let shapes = unsafe { Column::new(shapes, count, "shapes of the bodies") }?;
        let table = match table_count {
            0 => None,
            // SAFETY: the caller promises `table_count` shapes; a shape takes every bit pattern.
            _ => Some(unsafe { slice(table, table_count, "shapes of the world") }?),
        };
        Ok(Self {
            count,
            positions,
            orientations,
            linear_velocities,
            angular_velocities,
            shapes,
            table,
            origin,
        })
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

    /// The arrays that a step only reads.
    pub(crate) fn inputs(&self) -> [Span; 2] {
        let table = self.table.unwrap_or_default();
        let (first, stride) = (table.as_ptr().addr(), size_of::<Shape>());
        let table = Span::new::<Shape>("shapes of the world", first, stride, table.len());
        [self.shapes.span(self.count), table]
    }

    /// Makes sure that an index is below the count, as the driver promises.
    fn check(&self, index: usize) {
        assert!(index < self.count, "body {index} of {}", self.count);
    }
}

// SAFETY: a shared view only reads, and nothing else writes the arrays while it is in use (`new`).
unsafe impl Sync for BodiesView<'_> {}

impl Bodies for BodiesView<'_> {
    fn len(&self) -> usize {
        self.count
    }

    fn body(&self, index: usize) -> Body {
        self.check(index);
        // SAFETY: the index is below the count, and a shared view has no writer.
        let position = unsafe { self.positions.get(index, self.origin) };
        // SAFETY: the index is below the count (`check`), and a shared view has no writer.
        let orientation = unsafe { self.orientations.get(index, [0.0; 4]) };
        // SAFETY: the index is below the count (`check`), and a shared view has no writer.
        let linear = unsafe { self.linear_velocities.get(index, [0.0; 3]) };
        // SAFETY: the index is below the count (`check`), and a shared view has no writer.
        let angular = unsafe { self.angular_velocities.get(index, [0.0; 3]) };
        // SAFETY: the index is below the count (`check`), and a shared view has no writer.
        let shape = unsafe { self.shapes.get(index) };
        let pose = Pose { position, orientation };
        Body { pose, velocity: Velocity { linear, angular }, shape }
    }

    fn commit(&mut self, index: usize, pose: Pose, velocity: Velocity) {
        self.check(index);
        // SAFETY: the index is below the count, and this call alone has the view.
        unsafe { self.positions.set(index, pose.position, self.origin) };
        // SAFETY: the index is below the count (`check`), and a view that is borrowed for writing
        // is the only one.
        unsafe { self.orientations.set(index, pose.orientation, [0.0; 4]) };
        // SAFETY: the index is below the count (`check`), and a view that is borrowed for writing
        // is the only one.
        unsafe { self.linear_velocities.set(index, velocity.linear, [0.0; 3]) };
        // SAFETY: the index is below the count (`check`), and a view that is borrowed for writing
        // is the only one.
        unsafe { self.angular_velocities.set(index, velocity.angular, [0.0; 3]) };
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
    use crate::arrays::StridedConst;
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
            ..BodyArrays::default()
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
