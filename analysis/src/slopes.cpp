#include "slopes.hpp"

#include "bf/kernels/lanes.hpp"

#include <algorithm>
#include <cmath>
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

/// Whole blocks of numbers, of which x - x is 0 if they are all finite.
bool are_finite(const double* numbers, std::size_t count) {
    Block differences = {};
    for (std::size_t i = 0; i < count; i += block) {
        const Block numbers_of_it = *reinterpret_cast<const Block*>(numbers + i);
        differences += numbers_of_it - numbers_of_it;
    }
    return differences[0] + differences[1] + differences[2] + differences[3] == 0;
}

} // namespace

bool Slopes::is_finite() const {
    static const auto widest = kernels::Widest<&are_finite>::get();
    return widest(values_.data(), size_);
}

void Slopes::clear() {
    spans_.clear();
    size_ = 0;
}

void Slopes::reserve() {
    size_ = 0;
    for (auto& its : spans_) {
        its.at = size_;
        size_ += static_cast<std::size_t>(its.end - its.first);
    }
    if (values_.size() < size_) values_.resize(size_);
}

void Slopes::trim() {
    bool moves = false;
    for (auto& its : spans_) {
        while (its.first < its.end && is_zero_block(values_.data() + its.at)) {
            its.first += block;
            its.at += block;
        }
        while (its.first < its.end &&
               is_zero_block(values_.data() + its.at + static_cast<std::size_t>(its.end - its.first) - block))
            its.end -= block;
        moves |= its.first < its.end;
    }
    if (!moves) clear();
}

void Slopes::assign(const Matrix& all) {
    std::vector<int> every(static_cast<std::size_t>(all.cols()));
    for (std::size_t c = 0; c < every.size(); ++c) every[c] = static_cast<int>(c);
    assign(all, every);
}

void Slopes::assign(const Eigen::Ref<const Matrix>& some, const std::vector<int>& seeds) {
    if (seeds.empty()) return clear();
    const int first = begin_of(seeds.front()), end = end_of(seeds.back());
    spans_.assign(static_cast<std::size_t>(some.rows()), {.first = first, .end = end});
    reserve();
    std::fill_n(values_.begin(), size_, 0.0);
    for (Eigen::Index c = 0; c < some.cols(); ++c) {
        double* to = values_.data() + seeds[static_cast<std::size_t>(c)] - first;
        for (Eigen::Index e = 0; e < some.rows(); ++e, to += end - first) *to = some(e, c);
    }
    trim();
}

Matrix Slopes::spread(int elements, int columns) const {
    Matrix all = Matrix::Zero(elements, columns);
    for (int e = 0; e < elements; ++e) {
        const auto [values, first, end] = row(e);
        for (int c = first; c < std::min(end, columns); ++c) all(e, c) = values[c - first];
    }
    return all;
}

std::vector<int> Slopes::seeds() const {
    std::vector<SlopeRow> rows;
    for (int e = 0; e < static_cast<int>(spans_.size()); ++e) rows.push_back(row(e));
    return seeds_of(rows);
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
    for (int c = first; c < end; ++c)
        if (moves[static_cast<std::size_t>(c - first)]) seeds.push_back(c);
    return seeds;
}

namespace {

/// Rows of results += coefficients × slopes, of one width.
struct Multiplication {
    const double* coefficients; ///< a row for each result
    const double* slopes;       ///< a row for each element
    int results, elements, width;
    double* const* to; ///< row of each result
};

/// Sums over some blocks, which stay in registers.
template <int blocks> struct Sums {
    Block first;
    Sums<blocks - 1> rest;
    [[gnu::always_inline]] void load(const double* from) {
        first = *reinterpret_cast<const Block*>(from);
        rest.load(from + block);
    }
    [[gnu::always_inline]] void add(double by, const double* slopes) {
        first += by * *reinterpret_cast<const Block*>(slopes);
        rest.add(by, slopes + block);
    }
    [[gnu::always_inline]] void store(double* to) const {
        *reinterpret_cast<Block*>(to) = first;
        rest.store(to + block);
    }
};
template <> struct Sums<0> {
    void load(const double*) {}
    void add(double, const double*) {}
    void store(double*) const {}
};

template <int blocks> [[gnu::always_inline]] inline void add_columns(const Multiplication& m, int offset) {
    int result = 0;
    for (; result + 2 <= m.results; result += 2) {
        Sums<blocks> one, other;
        one.load(m.to[result] + offset);
        other.load(m.to[result + 1] + offset);
        const double *by = m.coefficients + result * m.elements, *slopes = m.slopes + offset;
        for (int e = 0; e < m.elements; ++e, slopes += m.width) {
            one.add(by[e], slopes);
            other.add(by[m.elements + e], slopes);
        }
        one.store(m.to[result] + offset);
        other.store(m.to[result + 1] + offset);
    }
    if (result == m.results) return;
    Sums<blocks> one;
    one.load(m.to[result] + offset);
    const double *by = m.coefficients + result * m.elements, *slopes = m.slopes + offset;
    for (int e = 0; e < m.elements; ++e, slopes += m.width) one.add(by[e], slopes);
    one.store(m.to[result] + offset);
}
void add(const Multiplication& m) {
    int offset = 0;
    for (; m.width - offset >= 6 * block; offset += 6 * block) add_columns<6>(m, offset);
    for (; m.width - offset >= 3 * block; offset += 3 * block) add_columns<3>(m, offset);
    for (; offset < m.width; offset += block) add_columns<1>(m, offset);
}

} // namespace

void sum(std::size_t results, const std::vector<ProductOfSlopes>& products, Slopes& all) {
    all.spans_.assign(results, {});
    const auto widen = [](auto& span, int first, int end) {
        if (first == end) return;
        span.first = span.first == span.end ? first : std::min(span.first, first);
        span.end = std::max(span.end, end);
    };
    const auto element = [](const ProductOfSlopes& product, int e) -> const SlopeRow& {
        return product.elements[product.from.first + e * product.from.apart];
    };
    const auto result = [&](const ProductOfSlopes& product, int r) -> Slopes::Span& {
        return all.spans_[static_cast<std::size_t>(product.to.first + r * product.to.apart)];
    };
    std::vector<Slopes::Span> hulls(products.size());
    for (std::size_t p = 0; p < products.size(); ++p) {
        for (int e = 0; e < products[p].from.count; ++e) {
            const auto& row = element(products[p], e);
            widen(hulls[p], row.first, row.end);
        }
        for (int r = 0; r < products[p].to.count; ++r)
            widen(result(products[p], r), hulls[p].first, hulls[p].end);
    }
    all.reserve();
    std::fill_n(all.values_.begin(), all.size_, 0.0);
    std::vector<double> slopes, coefficients;
    std::vector<double*> to;
    std::vector<int> moving;
    static const auto widest = kernels::Widest<&add>::get();
    for (std::size_t p = 0; p < products.size(); ++p) {
        const auto& product = products[p];
        const auto [first, end, at] = hulls[p];
        if (first == end) continue;
        const auto width = static_cast<std::size_t>(end - first);
        moving.clear();
        for (int e = 0; e < product.from.count; ++e)
            if (element(product, e).first < element(product, e).end) moving.push_back(e);
        if (slopes.size() < moving.size() * width) slopes.resize(moving.size() * width);
        double* packed = slopes.data();
        for (const int e : moving) {
            const auto& row = element(product, e);
            packed = std::fill_n(packed, row.first - first, 0.0);
            packed = std::copy(row.values, row.values + (row.end - row.first), packed);
            packed = std::fill_n(packed, end - row.end, 0.0);
        }
        coefficients.clear();
        to.clear();
        for (int r = 0; r < product.to.count; ++r) {
            for (const int e : moving)
                coefficients.push_back(
                    product.coefficients[r * product.rows_apart + e * product.columns_apart]);
            const auto& its = result(product, r);
            to.push_back(all.values_.data() + its.at + static_cast<std::size_t>(first - its.first));
        }
        widest({coefficients.data(), slopes.data(), product.to.count, static_cast<int>(moving.size()),
                static_cast<int>(width), to.data()});
    }
    all.trim();
}

void LocalJacobian::times(const std::vector<SlopeRow>& elements, std::size_t first, std::size_t count,
                          Slopes& result) const {
    result.spans_.assign(count, {});
    const auto of = [&](std::size_t r) {
        const std::size_t begin = first + r > 0 ? ends_[first + r - 1] : 0;
        return std::span(entries_).subspan(begin, ends_[first + r] - begin);
    };
    for (std::size_t r = 0; r < count; ++r) {
        auto& its = result.spans_[r];
        for (const auto& entry : of(r)) {
            const auto& row = elements[static_cast<std::size_t>(entry.element)];
            if (row.first == row.end) continue;
            its.first = its.first == its.end ? row.first : std::min(its.first, row.first);
            its.end = std::max(its.end, row.end);
        }
    }
    result.reserve();
    for (std::size_t r = 0; r < count; ++r) {
        const auto& its = result.spans_[r];
        double* const to = result.values_.data() + its.at;
        bool is_first = true; // nothing is there yet
        for (const auto& [element, slope] : of(r)) {
            const auto& row = elements[static_cast<std::size_t>(element)];
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
    }
    result.trim();
}

} // namespace bf::analysis
