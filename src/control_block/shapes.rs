//! Writes the shape table.

use pgs_interface::control::{
    SHAPE_INVERSE_INERTIA, SHAPE_INVERSE_MASS, SHAPE_STRIDE, SHAPE_TABLE,
};
use pgs_interface::profile::Inertia;

use super::Control;
use crate::scene::Shape;

impl Control {
    /// Writes shapes that were checked: the table has room for them, and they are isotropic, unless
    /// the inertia is streamed with the velocities and the table holds masses only.
    pub(crate) fn load_shapes(&mut self, shapes: &[Shape], inertia: Inertia) {
        for (entry, shape) in (SHAPE_TABLE..).step_by(SHAPE_STRIDE as usize).zip(shapes) {
            for offset in (0..SHAPE_STRIDE).step_by(4) {
                let value = match offset {
                    SHAPE_INVERSE_MASS => shape.inverse_mass.to_bits(),
                    SHAPE_INVERSE_INERTIA if inertia == Inertia::Isotropic => {
                        shape.inverse_inertia[0].to_bits()
                    }
                    _ => 0,
                };
                self.write(entry + offset, value);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::platform::RegisterMap;
    use crate::platform::fake::FakeRegisters;

    #[test]
    fn an_entry_is_mass_inertia_and_two_zeros() {
        let registers = FakeRegisters::default();
        let mut control = Control::new(registers.window(RegisterMap::Control));
        let shapes = [Shape::STATIC, Shape::isotropic(1.0, 1.5)];
        control.load_shapes(&shapes, Inertia::Isotropic);
        let second: Vec<_> = registers.with(|state| state.writes[4..].to_vec());
        assert_eq!(second, [(0x410, 0x3F80_0000), (0x414, 0x3FC0_0000), (0x418, 0), (0x41C, 0)]);
    }
    #[test]
    fn with_world_inertia_an_entry_is_the_mass_alone() {
        let registers = FakeRegisters::default();
        let mut control = Control::new(registers.window(RegisterMap::Control));
        let shape = Shape { inverse_inertia: [1.0, 2.0, 3.0], ..Shape::isotropic(1.0, 0.0) };
        control.load_shapes(&[shape], Inertia::World);
        let entry: Vec<_> = registers.with(|state| state.writes.clone());
        assert_eq!(entry, [(0x400, 0x3F80_0000), (0x404, 0), (0x408, 0), (0x40C, 0)]);
    }
}
