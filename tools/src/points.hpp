// The points of a sweep: every combination of values, times random samples.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace bf::tools {

/// A name and the expressions that it takes one after the other.
struct Axis {
    std::string name;
    std::vector<std::string> values;
};

/// NAME=EXPRESSION. The elements of a row or column, or of a cell array, are its values ('Kp=1:0.5:3',
/// 'q0={[1 2] [3 4]}'); a scalar, a text and an expression of the model's variables are one value. Throws
/// CommandError.
Axis parse_axis(const std::string& set);

/// A name and how its values are distributed.
struct Random {
    enum class Kind { normal, uniform, integers };
    std::string name;
    Kind kind;
    double a, b; ///< normal: mean and standard deviation; otherwise smallest and largest value

    /// Sample i: a function of the seed, the name and i alone.
    double sample(std::uint64_t seed, std::uint64_t i) const;
};

/// NAME~normal(MEAN,DEVIATION), NAME~uniform(LEAST,MOST) or NAME~integers(LEAST,MOST). Throws CommandError.
Random parse_random(const std::string& text);

/// The values of one run by name, in the order of axes and random quantities.
using Point = std::vector<std::pair<std::string, std::string>>;

/// All points: the first axis varies slowest, samples fastest, and sample i is the same at every combination.
struct Points {
    std::vector<Axis> axes;
    std::vector<Random> randoms;
    std::uint64_t samples = 1, seed = 1;

    std::size_t size() const;
    Point operator[](std::size_t i) const;
    /// Those of the names that vary.
    std::vector<std::string> names() const;
};

} // namespace bf::tools
