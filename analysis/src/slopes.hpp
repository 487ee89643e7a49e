// Derivatives of quantities by the seeds of a pass, and how they go through an activity.
#pragma once

#include "bf/analysis/linear_system.hpp"

#include <cstddef>
#include <vector>

namespace bf::analysis {

/// Derivatives of one element by the seeds from `first` to before `end`, whole blocks of seeds. By all others
/// they are 0.
struct SlopeRow {
    const double* values = nullptr; ///< by `first` and on
    int first = 0, end = 0;
};
/// The seeds by which any of these rows moves, ascending.
std::vector<int> seeds_of(const std::vector<SlopeRow>& rows);

struct ProductOfSlopes;

/// Derivatives of the elements of one quantity, each over the span of seeds on which it depends: a diagram
/// has many seeds, most of it hangs on few of them, and so do single elements of a matrix.
class Slopes {
  public:
    bool is_zero() const { return values_.size() == 0; }
    bool is_finite() const;
    void clear();
    /// Elements × all columns, or those of these seeds, which ascend.
    void assign(const Matrix& all);
    void assign(const Eigen::Ref<const Matrix>& some, const std::vector<int>& seeds);
    Matrix spread(int elements, int columns) const; ///< to all columns, of which the rest is left out
    SlopeRow row(int element) const {
        if (is_zero()) return {};
        const auto& its = spans_[static_cast<std::size_t>(element)];
        return {values_.data() + its.at, its.first, its.end};
    }
    std::vector<int> seeds() const; ///< by which some element moves, ascending

  private:
    friend class LocalJacobian;
    friend Slopes sum(std::size_t results, const std::vector<ProductOfSlopes>& products);
    struct Span {
        int first = 0, end = 0;
        Eigen::Index at = 0;
    };
    void reserve(); ///< numbers of all spans
    void trim();    ///< blocks of zeros at both ends of each span

    std::vector<Span> spans_; ///< by element
    Vector values_;           ///< none: it does not move
};

/// Derivatives of results by the elements from which an activity computes them, at one operating point: of
/// each result those that are not 0.
class LocalJacobian {
  public:
    void reserve(std::size_t rows, std::size_t entries) {
        ends_.reserve(rows);
        entries_.reserve(entries);
    }
    void add(int element, double slope) {
        if (slope != 0) entries_.push_back({element, slope});
    }
    void end_row() { ends_.push_back(entries_.size()); }
    /// The chain rule: of `count` results from that one on.
    Slopes times(const std::vector<SlopeRow>& elements, std::size_t first, std::size_t count) const;

  private:
    struct Entry {
        int element;
        double slope;
    };
    std::vector<Entry> entries_;
    std::vector<std::size_t> ends_; ///< by result
};

/// Some of many elements: a row or column of a matrix.
struct Line {
    int first, apart, count;
};
/// The chain rule through a dense part of a local Jacobian: coefficients × slopes of elements, a row of it to
/// each result.
struct ProductOfSlopes {
    const double* coefficients;
    std::ptrdiff_t rows_apart, columns_apart; ///< of the coefficients
    const SlopeRow* elements;
    Line from; ///< which of them
    Line to;   ///< which results
};
Slopes sum(std::size_t results, const std::vector<ProductOfSlopes>& products);

} // namespace bf::analysis
