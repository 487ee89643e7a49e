// Standard blocks by name, for tests.
#pragma once

#include "bf/blocks/standard.hpp"

#include "run_block.hpp"

#include <Eigen/Dense>
#include <gtest/gtest.h>

namespace bf::test {

inline const BlockClass& standard_class(const std::string& name) {
    static const Library library = standard_library();
    for (const auto& c : library.classes())
        if (c.name == name) return c;
    throw std::runtime_error("no standard block " + name);
}

inline RunBlock make(const std::string& name, const Arguments& arguments = {}) {
    return RunBlock(standard_class(name), arguments);
}

/// The refusal of a wiring or of arguments, or "" when there is none.
template <class F> std::string refusal(F&& f) {
    try {
        f();
    } catch (const std::runtime_error& error) {
        return error.what();
    }
    return "";
}

inline Matrix column(std::initializer_list<double> values) {
    return Eigen::Map<const Vector>(values.begin(), static_cast<Eigen::Index>(values.size()));
}
inline Value row(std::initializer_list<double> values) { return Value(Matrix(column(values).transpose())); }
inline std::vector<double> list(const Matrix& m) { return {m.data(), m.data() + m.size()}; }
using Values = std::vector<double>;

} // namespace bf::test
