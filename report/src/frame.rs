//! From values to places in a picture.

/// A point: of data on the drawn scale, or of the picture.
pub(crate) type Point = (f64, f64);

/// What a panel shows, on the drawn scale.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Window {
    pub x: (f64, f64),
    pub y: (f64, f64),
}

impl Window {
    /// Whether a point is within.
    pub fn holds(&self, (x, y): Point) -> bool {
        (self.x.0..=self.x.1).contains(&x) && (self.y.0..=self.y.1).contains(&y)
    }

    /// In which of so many columns a place on the x axis lies.
    pub fn column(&self, x: f64, columns: f64) -> i64 {
        ((x - self.x.0) / (self.x.1 - self.x.0) * columns) as i64
    }
}

/// A panel's window and its place in the picture.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Frame {
    pub window: Window,
    pub left: f64,
    pub right: f64,
    pub top: f64,
    pub bottom: f64,
}

impl Frame {
    /// The place of a value of the x axis.
    pub fn x(&self, value: f64) -> f64 {
        let (low, high) = self.window.x;
        px(self.left + (value - low) / (high - low) * (self.right - self.left))
    }

    /// The place of a value of the y axis.
    pub fn y(&self, value: f64) -> f64 {
        let (low, high) = self.window.y;
        px(self.bottom - (value - low) / (high - low) * (self.bottom - self.top))
    }

    /// The place of a point.
    pub fn at(&self, (x, y): Point) -> Point {
        (self.x(x), self.y(y))
    }

    /// Its middle.
    pub fn middle(&self) -> Point {
        (
            px(f64::midpoint(self.left, self.right)),
            px(f64::midpoint(self.top, self.bottom)),
        )
    }
}

/// A place to a tenth of a unit, finer than any screen shows.
pub(crate) fn px(place: f64) -> f64 {
    // Not −0, which would be written so.
    (place * 10.0).round() / 10.0 + 0.0
}
