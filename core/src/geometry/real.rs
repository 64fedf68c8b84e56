//! The scalar type of a computation: `f32` in flight, `f64` where a test asks how much `f32` costs.

use nalgebra::RealField;

/// A real number whose transcendental functions come from [`libm`].
///
/// `nalgebra` and `std` have methods of the same purpose that may resolve to the platform's mathematics library; its
/// last bit differs between a host and a chip. The names here end in `_libm` so that generic code cannot pick the
/// wrong one by accident. Square root is correctly rounded everywhere and needs no such care.
pub trait Real: RealField + Copy {
    /// The nearest value to an `f64` constant.
    fn of(value: f64) -> Self;
    /// Widens to `f64`, exactly.
    fn to_f64(self) -> f64;
    /// Sine and cosine of an angle in rad.
    fn sin_cos_libm(self) -> (Self, Self);
    /// Tangent of an angle in rad.
    fn tan_libm(self) -> Self;
    /// Arc cosine in rad, 0..=pi; the argument is clamped to -1..=1 so that rounding cannot make a NaN.
    fn acos_libm(self) -> Self;
    /// Angle of the point (x, y) in rad, in (-pi, pi]; `self` is y.
    fn atan2_libm(self, x: Self) -> Self;
    /// Arc sine in rad, -pi/2..=pi/2; the argument is clamped to -1..=1 so that rounding cannot make a NaN.
    fn asin_libm(self) -> Self;
    /// `10^self`.
    fn exp10_libm(self) -> Self;
    /// Square root, NaN for what is under 0: the same bits as `sqrt`, by the chip's instruction in `f32`.
    fn root(self) -> Self;
}

macro_rules! real {
    ($t:ty, $sin:path, $cos:path, $tan:path, $acos:path, $atan2:path, $asin:path, $exp10:path, $root:path) => {
        impl Real for $t {
            fn of(value: f64) -> Self {
                value as $t
            }
            fn to_f64(self) -> f64 {
                f64::from(self)
            }
            fn sin_cos_libm(self) -> (Self, Self) {
                ($sin(self), $cos(self))
            }
            fn tan_libm(self) -> Self {
                $tan(self)
            }
            fn acos_libm(self) -> Self {
                $acos(self.clamp(-1.0, 1.0))
            }
            fn atan2_libm(self, x: Self) -> Self {
                $atan2(self, x)
            }
            fn asin_libm(self) -> Self {
                $asin(self.clamp(-1.0, 1.0))
            }
            fn exp10_libm(self) -> Self {
                $exp10(self)
            }
            fn root(self) -> Self {
                $root(self)
            }
        }
    };
}

real!(
    f32,
    libm::sinf,
    libm::cosf,
    libm::tanf,
    libm::acosf,
    libm::atan2f,
    libm::asinf,
    libm::exp10f,
    crate::kernels::sqrt
);
real!(
    f64,
    libm::sin,
    libm::cos,
    libm::tan,
    libm::acos,
    libm::atan2,
    libm::asin,
    libm::exp10,
    libm::sqrt
);
