// Which linear system of a model a verb works on.
#pragma once

#include "bf/analysis/linearize.hpp"
#include "bf/recording/export.hpp"
#include "session.hpp"

#include <complex>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace bf::tools {

struct LinearOptions {
    ModelOptions model;
    std::vector<std::string> from, to, open;
    std::string loop;     ///< a signal; or `from` and `to`
    double at = 0;        ///< s
    std::string snapshot; ///< file to begin with
    bool all_states = false;

    /// `has_loop`: of a verb that looks at loops.
    void add_to(CLI::App& app, bool has_loop);
    void add_operating_point_to(CLI::App& app); ///< --at and --from-snapshot alone
    /// Starts the run and takes it to `snapshot` and `at`.
    void go_to_operating_point(Simulation& run) const;
    /// Where a loop is named, its gain L as of negative feedback, 1 + L = 0. Tells how exact it is. Throws
    /// RunError, CommandError, model::Errors.
    analysis::LinearSystem system() const;
    /// The same, with one input and one output.
    analysis::LinearSystem single() const;
};

/// On standard error: what was differenced and held, and where it is one-sided.
void tell_how_exact(const analysis::LinearSystem& system);

/// Is it one by its name: YAML, JSON or a MAT-file?
bool is_data(const std::string& file);
/// Throws CommandError.
[[noreturn]] void refuse_format(const std::string& file, const std::string& endings);
/// Writes a result to a file of that name, each entry a line of YAML, and prints the name.
void write_data(const nlohmann::ordered_json& all, const std::vector<recording::MatVariable>& variables,
                const std::string& output);

/// "-1.5 + 3j", "-2".
std::string root_text(std::complex<double> root);

} // namespace bf::tools
