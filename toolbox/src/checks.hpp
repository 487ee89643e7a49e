// What blocks ask of their inputs in a step.
#pragma once

#include "bf/core/block.hpp"

#include <Eigen/LU>

#include <cmath>

namespace bf::toolbox {

/// Greatest value of a parameter that is no limit: what is multiplied with it stays finite.
inline constexpr double largest = 1e100;

/// The first element that is not finite ends the step.
template <class Key> Status all_finite(Now at, const Key& key) {
    const auto value = at[key];
    if (std::isfinite(value.sum())) return ok; // only if every element is
    for (Eigen::Index i = 0; i < value.size(); ++i)
        if (!std::isfinite(value.data()[i]))
            return Status::failure("{element} is not finite; look at what computes it", key,
                                   static_cast<std::int32_t>(i));
    return ok; // the sum alone is too large
}
template <class Key, class... Keys> Status all_finite(Now at, const Key& key, const Keys&... keys) {
    const Status status = all_finite(at, key);
    return status ? all_finite(at, keys...) : status;
}

template <class Key> Status is_rotation(Now at, const Key& key) {
    const Eigen::Matrix3d R = at[key].template topLeftCorner<3, 3>();
    if ((R * R.transpose()).isIdentity(1e-3) && R.determinant() > 0) return ok;
    return Status::failure(
        "{element} holds no rotation; its first three columns must be orthonormal and right-handed", key, -1);
}

} // namespace bf::toolbox
