//! The number of cubes along each axis of a scene.

use std::fmt;
use std::str::FromStr;

use crate::SceneError;

/// The number of cubes along each axis; y is up.
///
/// The limits keep the pile on the ground and every position within 2 mm of its exact value: at
/// most 180 x 1000 x 180.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Grid {
    x: u16,
    y: u16,
    z: u16,
}

impl Grid {
    /// Largest side along x and along z: 180 cubes, 2.2 m apart, end at 396.8 m; the ground ends at
    /// 400 m.
    pub const SIDE_MAX: u16 = 180;
    /// Most layers: beyond 2,000 m an f32 carries a height in steps of 0.1 mm only.
    pub const LAYERS_MAX: u16 = 1000;

    /// A grid of `x` by `y` by `z` cubes.
    ///
    /// # Errors
    /// [`SceneError::GridSide`] if a side is empty or above its limit.
    pub fn new(x: u16, y: u16, z: u16) -> Result<Self, SceneError> {
        Self::checked(x.into(), y.into(), z.into())
    }

    /// Cubes along x.
    #[must_use]
    pub const fn x(self) -> u16 {
        self.x
    }

    /// Layers of cubes.
    #[must_use]
    pub const fn y(self) -> u16 {
        self.y
    }

    /// Cubes along z.
    #[must_use]
    pub const fn z(self) -> u16 {
        self.z
    }

    /// Number of cubes.
    #[must_use]
    pub fn cubes(self) -> u32 {
        // At most 180 x 1000 x 180 = 32,400,000.
        u32::from(self.x) * u32::from(self.y) * u32::from(self.z)
    }

    fn checked(x: u64, y: u64, z: u64) -> Result<Self, SceneError> {
        let side = |axis, found: u64, most: u16, reason| match u16::try_from(found) {
            Ok(side) if (1..=most).contains(&side) => Ok(side),
            _ => Err(SceneError::GridSide { axis, found, most, reason }),
        };
        const GROUND: &str = "the ground is 800 m wide";
        const HEIGHT: &str = "an f32 carries no finer heights";
        Ok(Self {
            x: side('x', x, Self::SIDE_MAX, GROUND)?,
            y: side('y', y, Self::LAYERS_MAX, HEIGHT)?,
            z: side('z', z, Self::SIDE_MAX, GROUND)?,
        })
    }
}

impl Default for Grid {
    /// The thesis' 36 x 30 x 36 cubes.
    fn default() -> Self {
        Self { x: 36, y: 30, z: 36 }
    }
}

impl fmt::Display for Grid {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}x{}x{}", self.x, self.y, self.z)
    }
}

impl FromStr for Grid {
    type Err = SceneError;

    fn from_str(text: &str) -> Result<Self, SceneError> {
        let syntax = || SceneError::GridSyntax { found: text.to_owned() };
        // `parse` alone would accept a plus sign.
        let side = |part: &str| match part.bytes().all(|byte| byte.is_ascii_digit()) {
            true => part.parse::<u64>().map_err(|_| syntax()),
            false => Err(syntax()),
        };
        let parts: Vec<&str> = text.split('x').collect();
        let [x, y, z] = parts[..] else { return Err(syntax()) };
        Self::checked(side(x)?, side(y)?, side(z)?)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn a_grid_is_written_as_it_is_read() {
        let grid: Grid = "36x30x36".parse().expect("a grid");
        assert_eq!(grid, Grid::default());
        assert_eq!(grid.to_string(), "36x30x36");
        assert_eq!(grid.cubes(), 38_880);
    }

    #[test]
    fn what_is_not_a_grid_is_refused() {
        for text in ["", "3", "3x3", "3x3x3x3", "3x3x", "ax1x1", "-1x1x1", "+1x1x1", "3 x3x3"] {
            assert_eq!(
                text.parse::<Grid>(),
                Err(SceneError::GridSyntax { found: text.to_owned() }),
                "{text}"
            );
        }
    }

    #[test]
    fn a_side_outside_its_limits_is_named() {
        for (text, axis, found) in [
            ("0x1x1", 'x', 0),
            ("181x1x1", 'x', 181),
            ("1x1001x1", 'y', 1001),
            ("1x1x99999999999", 'z', 99_999_999_999),
        ] {
            match text.parse::<Grid>() {
                Err(SceneError::GridSide { axis: a, found: f, .. }) => {
                    assert_eq!((a, f), (axis, found));
                }
                other => panic!("{text}: {other:?}"),
            }
        }
        assert!("180x1000x180".parse::<Grid>().is_ok());
    }

    proptest! {
        #[test]
        fn no_text_makes_the_parser_panic(text in ".{0,20}") {
            let _ = text.parse::<Grid>();
        }
    }
}
