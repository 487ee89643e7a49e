#pragma once

#include "bf/kernels/view.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <initializer_list>
#include <limits>
#include <vector>

namespace bf::kernels {

inline constexpr double inf = std::numeric_limits<double>::infinity();
inline constexpr double nan = std::numeric_limits<double>::quiet_NaN();

/// View of an Eigen matrix or vector.
template <class D> View<typename D::Scalar> view(Eigen::PlainObjectBase<D>& m) {
    return {m.data(), static_cast<int>(m.rows()), static_cast<int>(m.cols())};
}
template <class D> View<const typename D::Scalar> view(const Eigen::PlainObjectBase<D>& m) {
    return {m.data(), static_cast<int>(m.rows()), static_cast<int>(m.cols())};
}

/// A vector operand that owns its elements.
template <class T> struct Vector {
    Eigen::Matrix<T, Eigen::Dynamic, 1> elements;
    Vector(std::initializer_list<T> list) : elements(static_cast<int>(list.size())) {
        std::copy(list.begin(), list.end(), elements.data());
    }
    View<const T> operator*() const { return view(elements); }
    operator View<const T>() const { return **this; }
};

/// K{}(y, operands...) for vectors written as lists; returns the n elements of y.
template <class Y = double, class K, class... A>
std::vector<Y> elements(K kernel, int n, const A&... operands) {
    Eigen::Matrix<Y, Eigen::Dynamic, 1> y(n);
    kernel(view(y), *operands...);
    return {y.data(), y.data() + n};
}

} // namespace bf::kernels
