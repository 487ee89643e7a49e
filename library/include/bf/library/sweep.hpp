// Running a model for many values of its variables and settings.
#pragma once

#include "bf/library/load.hpp"

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace bf {

/// A name and the expressions that it takes one after the other.
struct Axis {
    std::string name;
    std::vector<std::string> values;
};

/// A name and how its values are distributed.
struct Random {
    enum class Kind { normal, uniform, integers };
    std::string name;
    Kind kind;
    double a, b; ///< normal: mean and standard deviation; otherwise smallest and largest value

    /// Sample i: a function of the seed, the name and i alone.
    double sample(std::uint64_t seed, std::uint64_t i) const;
};

/// The values of one run by name, in the order of axes and random quantities.
using Point = std::vector<std::pair<std::string, std::string>>;

/// Every combination of values, times random samples: the first axis varies slowest, samples fastest, and
/// sample i is the same at every combination.
struct Points {
    std::vector<Axis> axes = {};
    std::vector<Random> randoms = {};
    std::uint64_t samples = 1, seed = 1;

    /// Throws RunError when there are more than a million.
    std::size_t size() const;
    Point operator[](std::size_t i) const;
    /// Those of the names that vary.
    std::vector<std::string> names() const;
};

/// What one run of a sweep came to.
struct SweepRow {
    /// The model's checks, its outputs and the signals asked for, element by element, by name.
    std::vector<std::pair<std::string, double>> results = {};
    std::string error = {}; ///< why it failed; empty when it did not
    double failed_at = -1;  ///< s; below 0: before its first step
};

struct Sweep {
    std::filesystem::path file = {};
    Points points = {};
    std::vector<Override> overrides = {}; ///< in all runs; those of a point win
    std::vector<std::string> finals = {}; ///< paths of signals whose last values are results, too
    int jobs = 0;                         ///< processes; 0: one per processor
    /// Of the model and of files that it refers to, by their absolute path; others are read from the disk.
    std::map<std::filesystem::path, std::string> texts = {};
};

/// The rows in the order of the points. Runs go on in other processes, so that one that crashes is a row with
/// an error; the program must have one thread, since a fork copies no other. `go_on`, when given, is asked a
/// few times a second with the number of finished runs; where it says no the sweep ends, and rows are
/// missing. Throws RunError.
std::vector<std::optional<SweepRow>> sweep(const Sweep& sweep,
                                           const std::function<bool(std::size_t done)>& go_on = {});

} // namespace bf
