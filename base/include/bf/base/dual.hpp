// Numbers with derivatives: forward differentiation through what is a template over its numbers.
#pragma once

#include <cmath>
#include <cstddef>
#include <limits>

namespace bf {

/// Derivatives along some directions, a power of two, in pairs that fit into registers of all processors:
/// computed and copied one by one they would wait for one another in memory.
template <int lanes> class SlopesAlong {
  public:
    SlopesAlong() = default;
    double operator[](std::size_t i) const { return begin()[i]; }
    double& operator[](std::size_t i) { return begin()[i]; }
    const double* begin() const { return reinterpret_cast<const double*>(this); }
    double* begin() { return reinterpret_cast<double*>(this); }
    bool operator==(const SlopesAlong& b) const { return low_ == b.low_ && high_ == b.high_; }
    bool operator!=(const SlopesAlong& b) const { return !(*this == b); }
    SlopesAlong operator-() const { return {-low_, -high_}; }
    SlopesAlong operator+(const SlopesAlong& b) const { return {low_ + b.low_, high_ + b.high_}; }
    SlopesAlong operator-(const SlopesAlong& b) const { return {low_ - b.low_, high_ - b.high_}; }
    SlopesAlong operator*(double b) const { return {low_ * b, high_ * b}; }
    SlopesAlong operator/(double b) const { return {low_ / b, high_ / b}; }

  private:
    using Half = SlopesAlong<lanes / 2>;
    SlopesAlong(const Half& low, const Half& high) : low_(low), high_(high) {}
    Half low_, high_;
};
template <> class SlopesAlong<2> {
  public:
    SlopesAlong() = default;
    const double* begin() const { return reinterpret_cast<const double*>(&pair_); }
    double* begin() { return reinterpret_cast<double*>(&pair_); }
    bool operator==(const SlopesAlong& b) const { return pair_[0] == b.pair_[0] && pair_[1] == b.pair_[1]; }
#ifdef __GNUC__
    SlopesAlong operator-() const { return SlopesAlong(-pair_); }
    SlopesAlong operator+(const SlopesAlong& b) const { return SlopesAlong(pair_ + b.pair_); }
    SlopesAlong operator-(const SlopesAlong& b) const { return SlopesAlong(pair_ - b.pair_); }
    SlopesAlong operator*(double b) const { return SlopesAlong(pair_ * b); }
    SlopesAlong operator/(double b) const { return SlopesAlong(pair_ / b); }

  private:
    typedef double Pair __attribute__((vector_size(2 * sizeof(double)), aligned(sizeof(double))));
    explicit SlopesAlong(const Pair& pair) : pair_(pair) {}
    Pair pair_;
#else
    SlopesAlong operator-() const { return {-pair_[0], -pair_[1]}; }
    SlopesAlong operator+(const SlopesAlong& b) const {
        return {pair_[0] + b.pair_[0], pair_[1] + b.pair_[1]};
    }
    SlopesAlong operator-(const SlopesAlong& b) const {
        return {pair_[0] - b.pair_[0], pair_[1] - b.pair_[1]};
    }
    SlopesAlong operator*(double b) const { return {pair_[0] * b, pair_[1] * b}; }
    SlopesAlong operator/(double b) const { return {pair_[0] / b, pair_[1] / b}; }

  private:
    SlopesAlong(double first, double second) : pair_{first, second} {}
    double pair_[2];
#endif
};

/// x + x' ε with ε² = 0, so that f(x + x' ε) = f(x) + f'(x) x' ε, along `lanes` directions at once.
/// Comparisons look at x alone: at a corner the derivative is that of the side on which f is computed.
/// Source: Griewank and Walther, Evaluating Derivatives, 2nd ed., §3.1.
template <int lanes> class Dual {
  public:
    using Slopes = SlopesAlong<lanes>;
    static constexpr int directions = lanes;
    Slopes slope; // first, so that what copies memory by registers takes the same pieces
    double value;

    /// Has a comparison, or a rounding, been right where its answer changes? Then there is a jump or corner.
    static inline thread_local bool is_at_corner = false;

    Dual() = default;
    Dual(double number) : slope{}, value(number) {}
    Dual(double number, const Slopes& slopes) : slope(slopes), value(number) {}
    explicit operator bool() const { return value != 0; }
    explicit operator int() const { return static_cast<int>(value); }

    friend Dual operator-(const Dual& x) { return {-x.value, -x.slope}; }
    friend Dual operator+(const Dual& x, const Dual& y) { return {x.value + y.value, x.slope + y.slope}; }
    friend Dual operator-(const Dual& x, const Dual& y) { return {x.value - y.value, x.slope - y.slope}; }
    friend Dual operator*(const Dual& x, const Dual& y) {
        return {x.value * y.value, x.slope * y.value + y.slope * x.value};
    }
    friend Dual operator/(const Dual& x, const Dual& y) {
        const double q = x.value / y.value;
        return {q, (x.slope - y.slope * q) / y.value};
    }
    // With numbers that do not change, by half of the work of those above.
    friend Dual operator*(double a, const Dual& x) { return {a * x.value, x.slope * a}; }
    friend Dual operator*(const Dual& x, double a) { return a * x; }
    friend Dual operator+(const Dual& x, double a) { return {x.value + a, x.slope}; }
    friend Dual operator+(double a, const Dual& x) { return x + a; }
    friend Dual operator-(const Dual& x, double a) { return {x.value - a, x.slope}; }
    friend Dual operator-(double a, const Dual& x) { return -x + a; }
    friend Dual& operator+=(Dual& x, const Dual& y) { return x = x + y; }
    friend Dual& operator-=(Dual& x, const Dual& y) { return x = x - y; }
    friend Dual& operator*=(Dual& x, const Dual& y) { return x = x * y; }
    friend Dual& operator/=(Dual& x, const Dual& y) { return x = x / y; }
    friend bool operator<(const Dual& x, const Dual& y) { return x.meets(y), x.value < y.value; }
    friend bool operator>(const Dual& x, const Dual& y) { return x.meets(y), x.value > y.value; }
    friend bool operator<=(const Dual& x, const Dual& y) { return x.meets(y), x.value <= y.value; }
    friend bool operator>=(const Dual& x, const Dual& y) { return x.meets(y), x.value >= y.value; }
    friend bool operator==(const Dual& x, const Dual& y) { return x.value == y.value; }
    friend bool operator!=(const Dual& x, const Dual& y) { return x.value != y.value; }

    // What kernels call of <cmath>.
    friend Dual floor(const Dual& x) { return x.meets(std::floor(x.value)), std::floor(x.value); }
    friend Dual ceil(const Dual& x) { return x.meets(std::ceil(x.value)), std::ceil(x.value); }
    friend Dual round(const Dual& x) {
        return x.meets(std::trunc(x.value) + std::copysign(0.5, x.value)), std::round(x.value);
    }
    friend Dual trunc(const Dual& x) {
        if (x.value != 0) x.meets(std::trunc(x.value));
        return std::trunc(x.value);
    }
    friend Dual fabs(const Dual& x) { return x < 0 ? -x : x; }
    friend Dual sign(const Dual& x) { return x > 0 ? 1 : x < 0 ? -1 : x.value; }
    friend Dual sqrt(const Dual& x) { return x.through(std::sqrt(x.value), 0.5 / std::sqrt(x.value)); }
    friend Dual exp(const Dual& x) { return x.through(std::exp(x.value), std::exp(x.value)); }
    friend Dual expm1(const Dual& x) { return x.through(std::expm1(x.value), std::exp(x.value)); }
    friend Dual log(const Dual& x) { return x.through(std::log(x.value), 1 / x.value); }
    friend Dual log1p(const Dual& x) { return x.through(std::log1p(x.value), 1 / (1 + x.value)); }
    friend Dual log2(const Dual& x) { return x.through(std::log2(x.value), 1 / (x.value * std::log(2.0))); }
    friend Dual log10(const Dual& x) {
        return x.through(std::log10(x.value), 1 / (x.value * std::log(10.0)));
    }
    friend Dual sin(const Dual& x) { return x.through(std::sin(x.value), std::cos(x.value)); }
    friend Dual cos(const Dual& x) { return x.through(std::cos(x.value), -std::sin(x.value)); }
    friend Dual tan(const Dual& x) {
        const double t = std::tan(x.value);
        return x.through(t, 1 + t * t);
    }
    friend Dual asin(const Dual& x) {
        return x.through(std::asin(x.value), 1 / std::sqrt(1 - x.value * x.value));
    }
    friend Dual acos(const Dual& x) {
        return x.through(std::acos(x.value), -1 / std::sqrt(1 - x.value * x.value));
    }
    friend Dual atan(const Dual& x) { return x.through(std::atan(x.value), 1 / (1 + x.value * x.value)); }
    friend Dual sinh(const Dual& x) { return x.through(std::sinh(x.value), std::cosh(x.value)); }
    friend Dual cosh(const Dual& x) { return x.through(std::cosh(x.value), std::sinh(x.value)); }
    friend Dual tanh(const Dual& x) {
        const double t = std::tanh(x.value);
        return x.through(t, 1 - t * t);
    }
    friend Dual asinh(const Dual& x) {
        return x.through(std::asinh(x.value), 1 / std::sqrt(1 + x.value * x.value));
    }
    friend Dual acosh(const Dual& x) {
        return x.through(std::acosh(x.value), 1 / std::sqrt(x.value * x.value - 1));
    }
    friend Dual atanh(const Dual& x) { return x.through(std::atanh(x.value), 1 / (1 - x.value * x.value)); }
    friend Dual atan2(const Dual& y, const Dual& x) {
        const double square = x.value * x.value + y.value * y.value;
        return along(std::atan2(y.value, x.value),
                     [&](std::size_t i) { return (x.value * y.slope[i] - y.value * x.slope[i]) / square; });
    }
    friend Dual hypot(const Dual& a, const Dual& b) {
        const double h = std::hypot(a.value, b.value);
        return along(h, [&](std::size_t i) { return (a.value * a.slope[i] + b.value * b.slope[i]) / h; });
    }
    friend Dual fmod(const Dual& x, const Dual& y) {
        return along(std::fmod(x.value, y.value), [&](std::size_t i) {
            return y.slope[i] == 0 ? x.slope[i] : x.slope[i] - std::trunc(x.value / y.value) * y.slope[i];
        });
    }
    friend Dual pow(const Dual& x, const Dual& e) {
        const double p = std::pow(x.value, e.value);
        return along(p, [&](std::size_t i) {
            double slope = 0;
            if (x.slope[i] != 0 && e.value != 0)
                slope = e.value * std::pow(x.value, e.value - 1) * x.slope[i];
            if (e.slope[i] != 0) slope += p * std::log(x.value) * e.slope[i];
            return slope;
        });
    }

  private:
    template <class Slope> static Dual along(double f, Slope&& slope) {
        Dual result(f);
        for (std::size_t i = 0; i < static_cast<std::size_t>(lanes); ++i) result.slope[i] = slope(i);
        return result;
    }
    void meets(const Dual& other) const { is_at_corner |= value == other.value && slope != other.slope; }
    /// f(x), where f has this value and this derivative. What does not depend on anything has no derivative,
    /// even where f has none.
    Dual through(double f, double derivative) const {
        return {f, std::isfinite(derivative) ? slope * derivative : steep(derivative)};
    }
#ifdef __GNUC__
    [[gnu::noinline]]
#endif
    Slopes
    steep(double derivative) const {
        Slopes result;
        for (std::size_t i = 0; i < static_cast<std::size_t>(lanes); ++i)
            result[i] = slope[i] == 0 ? 0 : derivative * slope[i];
        return result;
    }
};

} // namespace bf

template <int lanes> struct std::numeric_limits<bf::Dual<lanes>> {
    using Number = bf::Dual<lanes>;
    static constexpr bool is_specialized = true;
    static Number epsilon() { return std::numeric_limits<double>::epsilon(); }
    static Number min() { return std::numeric_limits<double>::min(); }
    static Number max() { return std::numeric_limits<double>::max(); }
    static Number infinity() { return std::numeric_limits<double>::infinity(); }
    static Number quiet_NaN() { return std::numeric_limits<double>::quiet_NaN(); }
};
