//! Complex numbers, with the few operations that the modes of a chain need.

/// A complex number.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Complex {
    pub(crate) re: f64,
    pub(crate) im: f64,
}

impl Complex {
    pub(crate) const ZERO: Complex = Complex { re: 0.0, im: 0.0 };
    pub(crate) const ONE: Complex = Complex { re: 1.0, im: 0.0 };

    /// The magnitude, by operations that give the same bits on every machine.
    pub(crate) fn size(self) -> f64 {
        let largest = self.re.abs().max(self.im.abs());
        if largest == 0.0 {
            return 0.0;
        }
        let (re, im) = (self.re / largest, self.im / largest);
        largest * (re * re + im * im).sqrt()
    }

    pub(crate) fn scaled(self, factor: f64) -> Complex {
        Complex { re: self.re * factor, im: self.im * factor }
    }

    /// The square root with a real part that is not negative.
    pub(crate) fn sqrt(self) -> Complex {
        let size = self.size();
        if size == 0.0 {
            return Complex::ZERO;
        }
        let large = ((size + self.re.abs()) / 2.0).sqrt();
        let small = self.im / (2.0 * large);
        if self.re >= 0.0 {
            Complex { re: large, im: small }
        } else {
            Complex { re: small.abs(), im: large.copysign(self.im) }
        }
    }

    /// Sine and cosine.
    pub(crate) fn sin_cos(self) -> (Complex, Complex) {
        let (sin, cos) = (libm::sin(self.re), libm::cos(self.re));
        let (sinh, cosh) = (libm::sinh(self.im), libm::cosh(self.im));
        (Complex { re: sin * cosh, im: cos * sinh }, Complex { re: cos * cosh, im: -sin * sinh })
    }
}

impl From<f64> for Complex {
    fn from(re: f64) -> Complex {
        Complex { re, im: 0.0 }
    }
}

impl std::ops::Add for Complex {
    type Output = Complex;
    fn add(self, other: Complex) -> Complex {
        Complex { re: self.re + other.re, im: self.im + other.im }
    }
}

impl std::ops::Sub for Complex {
    type Output = Complex;
    fn sub(self, other: Complex) -> Complex {
        Complex { re: self.re - other.re, im: self.im - other.im }
    }
}

impl std::ops::Mul for Complex {
    type Output = Complex;
    fn mul(self, other: Complex) -> Complex {
        Complex { re: self.re * other.re - self.im * other.im, im: self.re * other.im + self.im * other.re }
    }
}

impl std::ops::Mul<f64> for Complex {
    type Output = Complex;
    fn mul(self, factor: f64) -> Complex {
        self.scaled(factor)
    }
}

impl std::ops::Div for Complex {
    type Output = Complex;
    fn div(self, other: Complex) -> Complex {
        // The numbers here are far from overflow: no scaling is needed.
        let square = other.re * other.re + other.im * other.im;
        Complex {
            re: (self.re * other.re + self.im * other.im) / square,
            im: (self.im * other.re - self.re * other.im) / square,
        }
    }
}
