//! Vectors over any [`Real`], and the way to and from the yarn frame.

use glam::{DVec3, Vec3};

use crate::real::Real;

/// A vector with components in any [`Real`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Vector<R> {
    /// Along x.
    pub(crate) x: R,
    /// Along y.
    pub(crate) y: R,
    /// Along z.
    pub(crate) z: R,
}

impl<R: Real> Vector<R> {
    /// The vector (x, y, z).
    #[inline(always)]
    pub(crate) fn new(x: R, y: R, z: R) -> Self {
        Self { x, y, z }
    }

    /// The same directions turned over about y, the warp: half a turn.
    #[inline(always)]
    pub(crate) fn turned_over(self) -> Self {
        Self::new(-self.x, self.y, -self.z)
    }

    /// The scalar product.
    #[inline(always)]
    pub(crate) fn dot(self, other: Self) -> R {
        self.x * other.x + self.y * other.y + self.z * other.z
    }

    /// The sum.
    #[inline(always)]
    pub(crate) fn plus(self, other: Self) -> Self {
        Self::new(self.x + other.x, self.y + other.y, self.z + other.z)
    }

    /// The difference.
    #[inline(always)]
    pub(crate) fn minus(self, other: Self) -> Self {
        Self::new(self.x - other.x, self.y - other.y, self.z - other.z)
    }

    /// The vector product.
    #[inline(always)]
    pub(crate) fn cross(self, other: Self) -> Self {
        Self::new(
            self.y * other.z - self.z * other.y,
            self.z * other.x - self.x * other.z,
            self.x * other.y - self.y * other.x,
        )
    }

    /// `self` times `factor`.
    #[inline(always)]
    pub(crate) fn times(self, factor: R) -> Self {
        Self::new(self.x * factor, self.y * factor, self.z * factor)
    }
}

impl Vector<f32> {
    #[inline(always)]
    pub(crate) fn of(w: Vec3) -> Self {
        Self::new(w.x, w.y, w.z)
    }
}

impl Vector<f64> {
    #[inline(always)]
    pub(crate) fn of(w: DVec3) -> Self {
        Self::new(w.x, w.y, w.z)
    }
}

/// A direction of the shading frame (x along the weft, y along the warp, z the normal) in the frame
/// of a yarn: x across it, y along it, z the normal.
///
/// For a warp yarn the two frames are one; for a weft yarn the map is the rotation by +90° about z,
/// `(x, y, z) → (−y, x, z)`, which keeps the handedness of the twist.
#[inline(always)]
pub(crate) fn to_yarn<R: Real>(w: Vector<R>, is_warp: bool) -> Vector<R> {
    if is_warp { w } else { Vector::new(-w.y, w.x, w.z) }
}

/// The inverse of [`to_yarn`].
#[inline(always)]
pub(crate) fn from_yarn<R: Real>(w: Vector<R>, is_warp: bool) -> Vector<R> {
    if is_warp { w } else { Vector::new(w.y, -w.x, w.z) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn to_yarn_of_a_weft_is_a_rotation_that_puts_u_along_the_yarn() {
        let u = to_yarn(Vector::new(1.0, 0.0, 0.0), false);
        let v = to_yarn(Vector::new(0.0, 1.0, 0.0), false);
        assert_eq!(u, Vector::new(-0.0, 1.0, 0.0));
        assert_eq!(v, Vector::new(-1.0, 0.0, 0.0));
        // The z of u × v: right-handed.
        assert_eq!(u.x * v.y - u.y * v.x, 1.0);
        for w in [Vector::new(1.0, 2.0, 3.0), Vector::new(-0.5, 0.25, 1.0)] {
            for is_warp in [true, false] {
                assert_eq!(from_yarn(to_yarn(w, is_warp), is_warp), w);
            }
        }
    }
}
