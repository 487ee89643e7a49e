// Linear systems of models that are written as YAML text.
#pragma once

#include "bf/analysis/linearize.hpp"

#include "../../engine/test/support.hpp"

#include <gtest/gtest.h>
#include <initializer_list>
#include <string>

namespace bf::analysis::test {

using bf::test::Session;

inline LinearSystem linear(const std::string& text, const LinearizeOptions& options = {}, double time = 0) {
    const Session session(text);
    return linearize(session.diagram, options, time);
}

inline std::string refusal(const std::string& text, const LinearizeOptions& options = {}, double time = 0) {
    try {
        linear(text, options, time);
    } catch (const RunError& error) {
        return error.what();
    }
    return "";
}

inline Matrix matrix_of(std::initializer_list<std::initializer_list<double>> rows) {
    Matrix m(static_cast<Eigen::Index>(rows.size()), static_cast<Eigen::Index>(rows.begin()->size()));
    Eigen::Index i = 0;
    for (const auto& row : rows) {
        Eigen::Index j = 0;
        for (const double x : row) m(i, j++) = x;
        ++i;
    }
    return m;
}

inline void expect_near(const Matrix& a, const Matrix& b, double tolerance = 1e-14) {
    ASSERT_EQ(a.rows(), b.rows());
    ASSERT_EQ(a.cols(), b.cols());
    EXPECT_LT((a - b).cwiseAbs().maxCoeff(), tolerance) << a << "\n\n" << b;
}

} // namespace bf::analysis::test
