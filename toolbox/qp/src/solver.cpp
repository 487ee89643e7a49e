#include <bf/qp/solver.hpp>

#include <sstream>
#include <stdexcept>

namespace bf::qp {
namespace {

const char* name(Term term) {
    constexpr const char* names[] = {"", "H", "g", "A", "lbA", "ubA", "lb", "ub", "x"};
    return names[static_cast<int>(term)];
}

/// "H(3,4) = nan" or "lb(2) = 1".
std::string entry(Term term, int row, int column, double value) {
    std::ostringstream text;
    text << name(term) << '(' << row + 1;
    if (column >= 0) {
        text << ',' << column + 1;
    }
    text << ") = " << value;
    return text.str();
}

std::string describe_fault(const Result& r) {
    if (r.row < 0) {
        return std::string(name(r.term)) + " has not the size that the solver was made for";
    }
    const auto text = entry(r.term, r.row, r.column, r.value);
    if (r.status == Status::infeasible) {
        const auto upper = r.term == Term::lbA ? Term::ubA : Term::ub;
        return text + " and " + entry(upper, r.row, -1, r.other) + " leave no value between them";
    }
    return text + (r.term >= Term::lbA ? " is not a bound: use -inf or inf where there is none"
                                       : " is not finite: check the signals it is computed from");
}

} // namespace

std::string describe(const Result& r) {
    if (r.term != Term::none) {
        return describe_fault(r);
    }
    const auto iterations = std::to_string(r.iterations) + " iterations";
    switch (r.status) {
    case Status::solved: return "solved in " + iterations;
    case Status::iteration_limit: return "not solved within " + iterations + ": raise max_iterations";
    case Status::infeasible: return "no x satisfies all constraints: relax the bounds or drop a constraint";
    case Status::unbounded:
        return "the objective has no minimum: bound x, or add a small multiple of the identity to H";
    case Status::internal_error: break;
    }
    return "the solver broke down: make H positive semidefinite, and scale objective and constraints alike";
}

void Options::validate() const {
    if (max_iterations < 1) {
        throw std::invalid_argument("max_iterations is " + std::to_string(max_iterations) +
                                    ", but must be at least 1");
    }
    if (!(tolerance > 0.0 && tolerance < 1.0)) {
        std::ostringstream text;
        text << "tolerance is " << tolerance << ", but must lie between 0 and 1";
        throw std::invalid_argument(text.str());
    }
}

} // namespace bf::qp
