// Which linear system of a model a verb works on.
#pragma once

#include "bf/analysis/linearize.hpp"
#include "session.hpp"

#include <complex>
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
    /// Where a loop is named, its gain L as of negative feedback, 1 + L = 0. Tells on standard error what was
    /// held and where it is one-sided. Throws RunError, CommandError, model::Errors.
    analysis::LinearSystem system() const;
    /// The same, with one input and one output.
    analysis::LinearSystem single() const;
};

/// "-1.5 + 3j", "-2".
std::string root_text(std::complex<double> root);

} // namespace bf::tools
