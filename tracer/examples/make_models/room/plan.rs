//! Measures that several parts of the room share, metres. X runs east, Z south, the origin is in the middle of the
//! floor; the windows look west.

use crate::generator::shape::Shape;

/// Half the room, west to east.
pub(crate) const HALF_X: f64 = 4.0;
/// Half the room, north to south.
pub(crate) const HALF_Z: f64 = 3.9;
/// Floor to ceiling.
pub(crate) const HEIGHT: f64 = 3.0;
/// Thickness of the walls.
pub(crate) const THICKNESS: f64 = 0.28;
/// Top of the chair rail.
pub(crate) const RAIL: f64 = 0.92;

/// A wall. Things on it are made in its own frame: X to the right seen from inside the room, Y up from the floor,
/// Z from its inner face into the room, the origin below the wall's middle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Wall {
    /// Bookcase.
    North,
    /// Sideboard.
    East,
    /// Door.
    South,
    /// Windows.
    West,
}

impl Wall {
    /// All four.
    pub(crate) const ALL: [Wall; 4] = [Wall::North, Wall::East, Wall::South, Wall::West];

    /// Half the wall's length inside the room.
    pub(crate) fn half_length(self) -> f64 {
        match self {
            Wall::North | Wall::South => HALF_X,
            Wall::East | Wall::West => HALF_Z,
        }
    }

    /// Degrees about +Y from the wall's frame to the room's, and the distance from the middle of the room.
    fn placement(self) -> (f64, f64) {
        match self {
            Wall::North => (0.0, HALF_Z),
            Wall::West => (90.0, HALF_X),
            Wall::South => (180.0, HALF_Z),
            Wall::East => (-90.0, HALF_X),
        }
    }

    /// A shape from the wall's frame into the room.
    pub(crate) fn place(self, shape: Shape) -> Shape {
        let (degrees, distance) = self.placement();
        shape.at(0.0, 0.0, -distance).turned_y(degrees)
    }

    /// What interrupts the wall.
    pub(crate) fn openings(self) -> &'static [Opening] {
        match self {
            Wall::West => &WINDOWS,
            Wall::South => &DOORS,
            Wall::North | Wall::East => &[],
        }
    }
}

/// A hole in a wall, in the wall's frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Opening {
    /// X of its middle.
    pub(crate) middle: f64,
    /// Full width.
    pub(crate) width: f64,
    /// Lower edge.
    pub(crate) sill: f64,
    /// Upper edge.
    pub(crate) head: f64,
}

impl Opening {
    /// Left edge.
    pub(crate) fn left(&self) -> f64 {
        self.middle - self.width / 2.0
    }

    /// Right edge.
    pub(crate) fn right(&self) -> f64 {
        self.middle + self.width / 2.0
    }
}

/// Two tall windows.
pub(crate) static WINDOWS: [Opening; 2] = [
    Opening { middle: -1.25, width: 1.35, sill: 0.48, head: 2.55 },
    Opening { middle: 1.25, width: 1.35, sill: 0.48, head: 2.55 },
];
/// One door.
pub(crate) static DOORS: [Opening; 1] = [Opening { middle: -1.3, width: 0.98, sill: 0.0, head: 2.12 }];
