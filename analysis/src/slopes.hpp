// Derivatives of quantities by the seeds of a pass, and how they go through an activity.
#pragma once

#include "bf/analysis/linear_system.hpp"

#include <cstddef>
#include <span>
#include <vector>

namespace bf::analysis {

/// Numbers of slopes: what is taken stays where it is until all of it is given back.
class SlopeMemory {
  public:
    double* take(std::size_t count); ///< of any value
    void clear();                    ///< keeps the memory
    std::size_t size() const { return size_; }

  private:
    std::vector<std::vector<double>> parts_;
    std::size_t part_ = 0, used_ = 0, size_ = 0;
};

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
/// has many seeds, most of it hangs on few of them, and so do single elements of a matrix. Elements that are
/// those of another quantity share their numbers.
class Slopes {
  public:
    bool is_zero() const { return rows_.empty(); }
    bool is_finite() const;
    void clear() { rows_.clear(); }
    /// Elements × all columns, or those of these seeds, which ascend.
    void assign(const Matrix& all, SlopeMemory& memory);
    void assign(const Eigen::Ref<const Matrix>& some, const std::vector<int>& seeds, SlopeMemory& memory);
    /// Of each element those of one of the others, or none where that is -1.
    void assign(const std::vector<SlopeRow>& others, std::span<const int> which);
    void move_to(SlopeMemory& memory);
    Matrix spread(int elements, int columns) const; ///< to all columns, of which the rest is left out
    SlopeRow row(int element) const {
        return is_zero() ? SlopeRow() : rows_[static_cast<std::size_t>(element)];
    }
    std::vector<int> seeds() const { return seeds_of(rows_); } ///< by which some element moves, ascending

  private:
    friend class LocalJacobian;
    friend void sum(std::size_t results, const std::vector<ProductOfSlopes>& products, const SlopeRow* beside,
                    SlopeMemory& memory, Slopes& to);
    void clear_if_still();

    std::vector<SlopeRow> rows_; ///< by element; none: it does not move
};

/// Derivatives of results by the elements from which an activity computes them, at one operating point: of
/// each result those that are not 0.
class LocalJacobian {
  public:
    void clear() {
        ends_.clear();
        entries_.clear();
    }
    void add(int element, double slope) {
        if (slope != 0) entries_.push_back({element, slope});
    }
    void end_row() { ends_.push_back(entries_.size()); }
    /// The chain rule: of `count` results from that one on.
    void times(const std::vector<SlopeRow>& elements, std::size_t first, std::size_t count,
               SlopeMemory& memory, Slopes& to) const;

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
/// Their sum, and that of rows beside them, one for each result, if there are any.
void sum(std::size_t results, const std::vector<ProductOfSlopes>& products, const SlopeRow* beside,
         SlopeMemory& memory, Slopes& to);

} // namespace bf::analysis
