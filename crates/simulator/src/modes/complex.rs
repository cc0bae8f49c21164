//! What the modes need of complex numbers besides the four operations, by operations that give the same bits on every
//! machine.

pub(crate) use num_complex::Complex64 as Complex;

/// Functions of a complex number.
pub(crate) trait Functions {
    /// The magnitude.
    fn size(self) -> f64;

    /// The square root with a real part that is not negative.
    fn root(self) -> Self;

    /// Sine and cosine.
    fn sin_cos(self) -> (Complex, Complex);
}

impl Functions for Complex {
    fn size(self) -> f64 {
        let largest = self.re.abs().max(self.im.abs());
        if largest == 0.0 {
            return 0.0;
        }
        let (re, im) = (self.re / largest, self.im / largest);
        largest * (re * re + im * im).sqrt()
    }

    fn root(self) -> Complex {
        let size = self.size();
        if size == 0.0 {
            return Complex::ZERO;
        }
        let large = ((size + self.re.abs()) / 2.0).sqrt();
        let small = self.im / (2.0 * large);
        if self.re >= 0.0 {
            Complex::new(large, small)
        } else {
            Complex::new(small.abs(), large.copysign(self.im))
        }
    }

    fn sin_cos(self) -> (Complex, Complex) {
        let (sin, cos) = (libm::sin(self.re), libm::cos(self.re));
        let (sinh, cosh) = (libm::sinh(self.im), libm::cosh(self.im));
        (Complex::new(sin * cosh, cos * sinh), Complex::new(cos * cosh, -sin * sinh))
    }
}
