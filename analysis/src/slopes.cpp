#include "slopes.hpp"

#include "bf/kernels/lanes.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>

namespace bf::analysis {

namespace {

/// Seeds are gone through in blocks, of which a wide register holds one.
constexpr int block = 4;
using Block [[gnu::vector_size(8 * block), gnu::aligned(8), gnu::may_alias]] = double;

int begin_of(int seed) { return seed / block * block; }
int end_of(int seed) { return begin_of(seed) + block; }
bool is_zero_block(const double* values) {
    return std::all_of(values, values + block, [](double v) { return v == 0; });
}
/// Without blocks of zeros at both ends.
void cut_zeros(SlopeRow& row) {
    for (; row.first < row.end && is_zero_block(row.values); row.first += block) row.values += block;
    while (row.first < row.end && is_zero_block(row.values + (row.end - row.first) - block)) row.end -= block;
}
const double* copied(const SlopeRow& row, SlopeMemory& memory) {
    const auto count = static_cast<std::size_t>(row.end - row.first);
    double* const to = memory.take(count);
    std::copy_n(row.values, count, to);
    return to;
}
void widen(SlopeRow& row, int first, int end) {
    if (first == end) return;
    row.first = row.first == row.end ? first : std::min(row.first, first);
    row.end = std::max(row.end, end);
}

/// Of finite numbers x - x is 0.
bool are_finite(const SlopeRow* rows, std::size_t count) {
    Block differences = {};
    for (std::size_t r = 0; r < count; ++r)
        for (int c = 0; c < rows[r].end - rows[r].first; c += block) {
            const Block numbers = *reinterpret_cast<const Block*>(rows[r].values + c);
            differences += numbers - numbers;
        }
    return differences[0] + differences[1] + differences[2] + differences[3] == 0;
}

} // namespace

double* SlopeMemory::take(std::size_t count) {
    constexpr std::size_t usual = 4096;
    for (; part_ < parts_.size() && used_ + count > parts_[part_].size(); ++part_) used_ = 0;
    if (part_ == parts_.size()) parts_.emplace_back(std::max(count, usual));
    double* const taken = parts_[part_].data() + used_;
    used_ += count;
    size_ += count;
    return taken;
}

void SlopeMemory::clear() { part_ = used_ = size_ = 0; }

bool Slopes::is_finite() const {
    static const auto widest = kernels::Widest<&are_finite>::get();
    return widest(rows_.data(), rows_.size());
}

void Slopes::clear_if_still() {
    if (std::all_of(rows_.begin(), rows_.end(), [](const SlopeRow& row) { return row.first == row.end; }))
        clear();
}

void Slopes::assign(const Matrix& all, SlopeMemory& memory) {
    std::vector<int> every(static_cast<std::size_t>(all.cols()));
    std::iota(every.begin(), every.end(), 0);
    assign(all, every, memory);
}

void Slopes::assign(const Eigen::Ref<const Matrix>& some, const std::vector<int>& seeds,
                    SlopeMemory& memory) {
    rows_.clear();
    if (seeds.empty()) return;
    const int first = begin_of(seeds.front()), end = end_of(seeds.back());
    std::vector<double> all(static_cast<std::size_t>(end - first));
    for (Eigen::Index e = 0; e < some.rows(); ++e) {
        for (Eigen::Index c = 0; c < some.cols(); ++c)
            all[static_cast<std::size_t>(seeds[static_cast<std::size_t>(c)] - first)] = some(e, c);
        SlopeRow row{all.data(), first, end};
        cut_zeros(row);
        row.values = copied(row, memory);
        rows_.push_back(row);
    }
    clear_if_still();
}

void Slopes::assign(const std::vector<SlopeRow>& others, std::span<const int> which) {
    rows_.clear();
    for (const int one : which) rows_.push_back(one < 0 ? SlopeRow() : others[static_cast<std::size_t>(one)]);
    clear_if_still();
}

void Slopes::move_to(SlopeMemory& memory) {
    for (auto& row : rows_) row.values = copied(row, memory);
}

Matrix Slopes::spread(int elements, int columns) const {
    Matrix all = Matrix::Zero(elements, columns);
    for (int e = 0; e < elements; ++e) {
        const auto [values, first, end] = row(e);
        for (int c = first; c < std::min(end, columns); ++c) all(e, c) = values[c - first];
    }
    return all;
}

std::vector<int> seeds_of(const std::vector<SlopeRow>& rows) {
    int first = 0, end = 0;
    for (const auto& row : rows)
        if (row.first < row.end) {
            first = end == 0 ? row.first : std::min(first, row.first);
            end = std::max(end, row.end);
        }
    std::vector<char> moves(static_cast<std::size_t>(end - first));
    for (const auto& row : rows)
        for (int c = row.first; c < row.end; ++c)
            moves[static_cast<std::size_t>(c - first)] |= row.values[c - row.first] != 0;
    std::vector<int> seeds;
    seeds.reserve(moves.size());
    for (int c = first; c < end; ++c)
        if (moves[static_cast<std::size_t>(c - first)]) seeds.push_back(c);
    return seeds;
}

namespace {

/// Rows of results += coefficients × slopes, of one width.
struct Multiplication {
    const double* const* slopes;       ///< of each element
    const double* const* coefficients; ///< of each element, by the first result
    std::ptrdiff_t apart;              ///< coefficients of one result and the next
    int results, elements, width;
    double* const* to; ///< row of each result
};

/// Sums of one result, or of several, over some registers of `width` numbers, in which they stay.
template <int width, int count> struct Sums {
    using Register = kernels::Lanes<double, width, 8 * width>;
    typename Register::type first;
    Sums<width, count - 1> rest;
    [[gnu::always_inline]] void load(const double* from) {
        Register::load(first, from);
        rest.load(from + width);
    }
    [[gnu::always_inline]] void add(double by, const double* slopes) {
        typename Register::type its;
        Register::load(its, slopes);
        first += by * its;
        rest.add(by, slopes + width);
    }
    [[gnu::always_inline]] void store(double* to) const {
        Register::store(to, first);
        rest.store(to + width);
    }
};
template <int width> struct Sums<width, 0> {
    void load(const double*) {}
    void add(double, const double*) {}
    void store(double*) const {}
};
template <int width, int rows, int count> struct SumsOfRows {
    Sums<width, count> first;
    SumsOfRows<width, rows - 1, count> rest;
    [[gnu::always_inline]] void load(double* const* from, int offset) {
        first.load(*from + offset);
        rest.load(from + 1, offset);
    }
    [[gnu::always_inline]] void add(const double* by, std::ptrdiff_t apart, const double* slopes) {
        first.add(*by, slopes);
        rest.add(by + apart, apart, slopes);
    }
    [[gnu::always_inline]] void store(double* const* to, int offset) const {
        first.store(*to + offset);
        rest.store(to + 1, offset);
    }
};
template <int width, int count> struct SumsOfRows<width, 0, count> {
    void load(double* const*, int) {}
    void add(const double*, std::ptrdiff_t, const double*) {}
    void store(double* const*, int) const {}
};

template <int width, int rows, int count>
[[gnu::always_inline]] inline void add_tile(const Multiplication& m, int result, int offset) {
    SumsOfRows<width, rows, count> sums;
    sums.load(m.to + result, offset);
    for (int e = 0; e < m.elements; ++e)
        sums.add(m.coefficients[e] + result * m.apart, m.apart, m.slopes[e] + offset);
    sums.store(m.to + result, offset);
}
template <int width, int rows, int count>
[[gnu::always_inline]] inline void add_columns(const Multiplication& m, int offset) {
    int result = 0;
    for (; result + rows <= m.results; result += rows) add_tile<width, rows, count>(m, result, offset);
    for (; result < m.results; ++result) add_tile<width, 1, count>(m, result, offset);
}
/// Twelve sums at once, as many as wait for none another.
struct Add {
    template <int most> void run(const Multiplication& m) const noexcept {
        int offset = 0;
        if constexpr (most == 64) {
            for (; m.width - offset >= 24; offset += 24) add_columns<8, 4, 3>(m, offset);
            for (; m.width - offset >= 8; offset += 8) add_columns<8, 4, 1>(m, offset);
        } else {
            for (; m.width - offset >= 24; offset += 24) add_columns<block, 2, 6>(m, offset);
            for (; m.width - offset >= 12; offset += 12) add_columns<block, 2, 3>(m, offset);
        }
        for (; offset < m.width; offset += block) add_columns<block, 2, 1>(m, offset);
    }
};

} // namespace

void sum(std::size_t results, const std::vector<ProductOfSlopes>& products, const SlopeRow* beside,
         SlopeMemory& memory, Slopes& all) {
    const auto element = [](const ProductOfSlopes& product, int e) -> const SlopeRow& {
        return product.elements[product.from.first + e * product.from.apart];
    };
    const auto number = [](const Line& line, int i) {
        return static_cast<std::size_t>(line.first + i * line.apart);
    };
    all.rows_.assign(results, {});
    std::vector<SlopeRow> hulls(products.size());
    std::size_t most = 0, most_elements = 0, most_results = 0, size = 0;
    for (std::size_t p = 0; p < products.size(); ++p) {
        auto& hull = hulls[p];
        for (int e = 0; e < products[p].from.count; ++e) {
            const auto& row = element(products[p], e);
            widen(hull, row.first, row.end);
        }
        for (int r = 0; r < products[p].to.count; ++r)
            widen(all.rows_[number(products[p].to, r)], hull.first, hull.end);
        most = std::max(most, static_cast<std::size_t>(products[p].from.count * (hull.end - hull.first)));
        most_elements = std::max(most_elements, static_cast<std::size_t>(products[p].from.count));
        most_results = std::max(most_results, static_cast<std::size_t>(products[p].to.count));
    }
    for (std::size_t r = 0; r < results; ++r) {
        if (beside) widen(all.rows_[r], beside[r].first, beside[r].end);
        size += static_cast<std::size_t>(all.rows_[r].end - all.rows_[r].first);
    }
    double* next = memory.take(size);
    std::vector<double*> rows(results), to;
    for (std::size_t r = 0; r < results; ++r) {
        auto& its = all.rows_[r];
        its.values = rows[r] = next;
        next = std::fill_n(next, its.end - its.first, 0.0);
        if (beside)
            std::copy_n(beside[r].values, beside[r].end - beside[r].first,
                        rows[r] + (beside[r].first - its.first));
    }
    std::vector<double> padded(most);
    std::vector<const double*> slopes, coefficients;
    slopes.reserve(most_elements);
    coefficients.reserve(most_elements);
    to.reserve(most_results);
    for (std::size_t p = 0; p < products.size(); ++p) {
        const auto& product = products[p];
        const auto& hull = hulls[p];
        if (hull.first == hull.end) continue;
        slopes.clear();
        coefficients.clear();
        double* end_of_padded = padded.data();
        for (int e = 0; e < product.from.count; ++e) {
            const auto& row = element(product, e);
            if (row.first == row.end) continue;
            coefficients.push_back(product.coefficients + e * product.columns_apart);
            slopes.push_back(row.values);
            if (row.first == hull.first && row.end == hull.end) continue;
            slopes.back() = end_of_padded;
            end_of_padded = std::fill_n(end_of_padded, row.first - hull.first, 0.0);
            end_of_padded = std::copy_n(row.values, row.end - row.first, end_of_padded);
            end_of_padded = std::fill_n(end_of_padded, hull.end - row.end, 0.0);
        }
        to.clear();
        for (int r = 0; r < product.to.count; ++r) {
            const auto result = number(product.to, r);
            to.push_back(rows[result] + (hull.first - all.rows_[result].first));
        }
        kernels::run_widest(Add{}, Multiplication{slopes.data(), coefficients.data(), product.rows_apart,
                                                  product.to.count, static_cast<int>(slopes.size()),
                                                  hull.end - hull.first, to.data()});
    }
    for (auto& row : all.rows_) cut_zeros(row);
    all.clear_if_still();
}

void LocalJacobian::times(const std::vector<SlopeRow>& elements, std::size_t first, std::size_t count,
                          SlopeMemory& memory, Slopes& result) const {
    const auto of = [&](std::size_t r) {
        const std::size_t begin = first + r > 0 ? ends_[first + r - 1] : 0;
        return std::span(entries_).subspan(begin, ends_[first + r] - begin);
    };
    const auto row_of = [&](const Entry& entry) -> const SlopeRow& {
        return elements[static_cast<std::size_t>(entry.element)];
    };
    const auto is_other = [](std::span<const Entry> entries) {
        return entries.size() == 1 && entries.front().slope == 1;
    };
    result.rows_.assign(count, {});
    std::size_t size = 0;
    for (std::size_t r = 0; r < count; ++r) {
        auto& its = result.rows_[r];
        for (const auto& entry : of(r)) widen(its, row_of(entry).first, row_of(entry).end);
        if (!is_other(of(r))) size += static_cast<std::size_t>(its.end - its.first);
    }
    double* next = memory.take(size);
    for (std::size_t r = 0; r < count; ++r) {
        auto& its = result.rows_[r];
        if (is_other(of(r))) {
            its = row_of(of(r).front());
            continue;
        }
        double* const to = next;
        next += its.end - its.first;
        its.values = to;
        bool is_first = true; // nothing is there yet
        for (const auto& entry : of(r)) {
            const auto& row = row_of(entry);
            const double slope = entry.slope;
            if (is_first && (row.first != its.first || row.end != its.end || !std::isfinite(slope)))
                std::fill_n(to, its.end - its.first, 0.0);
            else if (is_first) {
                for (int c = 0; c < row.end - row.first; c += block)
                    *reinterpret_cast<Block*>(to + c) =
                        slope * *reinterpret_cast<const Block*>(row.values + c);
                is_first = false;
                continue;
            }
            is_first = false;
            double* const from = to + (row.first - its.first);
            if (std::isfinite(slope))
                for (int c = 0; c < row.end - row.first; c += block)
                    *reinterpret_cast<Block*>(from + c) +=
                        slope * *reinterpret_cast<const Block*>(row.values + c);
            else // what does not move adds nothing, however steep it is
                for (int c = 0; c < row.end - row.first; ++c)
                    if (row.values[c] != 0) from[c] += slope * row.values[c];
        }
        cut_zeros(its);
    }
    result.clear_if_still();
}

} // namespace bf::analysis
