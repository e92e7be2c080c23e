//! Colours that colour-blind readers tell apart (Okabe and Ito, 2008), in an order that suits lines on white, and the
//! marker that goes with each.

/// The palette as red, green, blue.
pub const COLOURS: [(u8, u8, u8); 8] = [
    (0x00, 0x72, 0xB2),
    (0xD5, 0x5E, 0x00),
    (0x00, 0x9E, 0x73),
    (0xCC, 0x79, 0xA7),
    (0xE6, 0x9F, 0x00),
    (0x56, 0xB4, 0xE9),
    (0x00, 0x00, 0x00),
    (0xF0, 0xE4, 0x42),
];

/// Index of blue.
pub const BLUE: usize = 0;
/// Index of vermilion.
pub const VERMILION: usize = 1;
/// Index of bluish green.
pub const GREEN: usize = 2;
/// Index of reddish purple.
pub const PURPLE: usize = 3;
/// Index of orange.
pub const ORANGE: usize = 4;
/// Index of sky blue.
pub const SKY: usize = 5;
/// Index of black.
pub const BLACK: usize = 6;
/// Index of yellow; faint on white, for bands.
pub const YELLOW: usize = 7;

/// The colour of an index; beyond the palette it starts again.
pub fn colour(index: usize) -> (u8, u8, u8) {
    COLOURS[index % COLOURS.len()]
}

/// Shapes of markers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Shape {
    Circle,
    Square,
    Triangle,
    Diamond,
    TriangleDown,
    Cross,
    Plus,
    Ring,
}

/// The marker of a colour.
pub(crate) fn shape(index: usize) -> Shape {
    const SHAPES: [Shape; 8] = [
        Shape::Circle,
        Shape::Square,
        Shape::Triangle,
        Shape::Diamond,
        Shape::TriangleDown,
        Shape::Cross,
        Shape::Plus,
        Shape::Ring,
    ];
    SHAPES[index % SHAPES.len()]
}
