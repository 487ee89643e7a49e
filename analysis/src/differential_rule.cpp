#include "differential.hpp"

#include "named.hpp"

#include <algorithm>
#include <cmath>
#include <span>

namespace bf::analysis {

void Differential::rule(int node, Phase phase, const Call& call, const DualKernel& kernel) {
    const Frame& frame = context_.frame(node);
    const auto& slots = d_.nodes[static_cast<std::size_t>(node)].block->resolution().slots;
    struct Operand {
        Size size;
        Type type = Type::float64;
        const void* data = nullptr;
        std::size_t same; ///< as which it is one memory
        int from = -1;    ///< first of its elements among all that move; -1: it does not
        std::span<Dual> numbers = {};
    };
    std::vector<Part> read, written;
    std::vector<Operand> operands(call.operands.size());
    std::vector<std::size_t> results;
    int inputs = 0;
    for (std::size_t k = 0; k < call.operands.size(); ++k) {
        const auto& reference = call.operands[k];
        auto& operand = operands[k];
        operand.same = k;
        const auto slot = static_cast<std::size_t>(std::max(reference.slot, 0));
        switch (reference.source) {
        case Call::Source::slot: operand.data = frame.now[slot]; break;
        case Call::Source::next: operand.data = frame.next[slot]; break;
        case Call::Source::rate: operand.data = frame.rate[slot]; break;
        case Call::Source::time: operand.data = &frame.clock->time; break;
        case Call::Source::period: operand.data = &frame.clock->period; break;
        case Call::Source::trigger: operand.data = &frame.clock->trigger; break;
        case Call::Source::constants:
            operand.data = reference.constants->data();
            operand.size.rows = static_cast<int>(reference.constants->size());
            break;
        }
        if (reference.slot >= 0) {
            operand.size = slots[slot].size;
            operand.type = slots[slot].type;
        }
        const bool is_target = is_written(d_, node, phase, reference);
        // A workspace that a rule reads and writes is one memory.
        for (std::size_t before = 0; is_target && before < k; ++before)
            if (call.operands[before].slot == reference.slot &&
                call.operands[before].source == reference.source && call.operands[before].is_written)
                operand.same = before;
        if (operand.same != k) continue;
        if (is_target) {
            const auto& its = places_[static_cast<std::size_t>(node)][slot];
            const int of = reference.source == Call::Source::next   ? its.next
                           : reference.source == Call::Source::rate ? its.rate
                                                                    : its.own;
            if (of >= 0) {
                written.push_back({of, nullptr, operand.type, its.count});
                results.push_back(k);
            }
        }
        if (reference.source != Call::Source::slot) continue;
        const auto& its = place({node, reference.slot});
        const int of = read_by(node, reference.slot);
        if (of < 0 || !its.is_real || slopes(of).is_zero()) continue;
        // What a rule writes it reads only where rules share a workspace.
        if (is_target && slots[slot].role != Role::workspace) continue;
        operand.from = inputs;
        inputs += its.count;
        read.push_back({of, nullptr, operand.type, its.count});
    }

    std::size_t size = 0;
    for (std::size_t k = 0; k < operands.size(); ++k)
        if (operands[k].same == k) size += static_cast<std::size_t>(operands[k].size.count());
    if (numbers_.size() < size) numbers_.resize(size);
    views_.clear();
    list_.clear();
    size = 0;
    for (std::size_t k = 0; k < operands.size(); ++k) {
        auto& operand = operands[k];
        if (operand.same == k) {
            const auto count = static_cast<std::size_t>(operand.size.count());
            operand.numbers = {numbers_.data() + size, count};
            size += count;
        }
        const bool is_listed = call.list_from >= 0 && static_cast<int>(k) >= call.list_from &&
                               static_cast<int>(k) < call.list_from + call.list_size;
        (is_listed ? list_ : views_)
            .emplace_back(operands[operand.same].numbers.data(), operand.size.rows, operand.size.cols);
    }
    const auto set_values = [&] {
        for (const auto& operand : operands)
            for (std::size_t e = 0; e < operand.numbers.size(); ++e)
                operand.numbers[e] = operand.type == Type::float64
                                         ? static_cast<const double*>(operand.data)[e]
                                         : read_value(operand.data, operand.type, static_cast<int>(e));
    };
    const auto run = [&] {
        Dual::is_at_corner = false;
        if (!kernel.kernel->run(views_.data(), {list_.data(), static_cast<int>(list_.size())}))
            fail(node,
                 "it fails at this operating point, so that it has no derivative there; choose another one");
        if (Dual::is_at_corner) kinks_.insert(node);
    };
    const auto slope_of = [](const Dual& number, std::size_t direction) {
        const double slope = number.slope[direction];
        return slope != 0 && std::isnan(number.value) ? number.value : slope;
    };
    /// f(its numbers, where they begin among all) of what is written.
    const auto for_each_result = [&](auto&& f) {
        Eigen::Index row = 0;
        for (const std::size_t k : results) {
            f(operands[k].numbers, row);
            row += static_cast<Eigen::Index>(operands[k].numbers.size());
        }
    };
    const auto multiply = [&](const LocalJacobian& local, const std::vector<SlopeRow>& elements,
                              std::vector<Slopes>& made) {
        std::size_t row = 0;
        for (std::size_t p = 0; p < written.size(); ++p) {
            const auto count = static_cast<std::size_t>(written[p].count);
            local.times(elements, row, count, made[p]);
            row += count;
        }
        return true;
    };
    const auto structured = [&](const std::vector<SlopeRow>& elements, std::vector<Slopes>& made) {
        std::vector<RuleOperand> whole;
        for (const auto& operand : operands)
            if (call.list_from < 0 && operand.type == Type::float64)
                whole.push_back({static_cast<const double*>(operand.data), operand.size.rows,
                                 operand.size.cols, operand.from});
        if (whole.size() == operands.size() && by_formula(call.kernel, whole, elements, made[0]))
            return true; // beside it may stand a workspace
        local_.clear();
        LocalJacobian& local = local_;
        if (kernel.structure == Structure::move) { // the kernel itself tells from where each result is
            set_values();
            for (auto& operand : operands)
                for (std::size_t e = 0; operand.from >= 0 && e < operand.numbers.size(); ++e)
                    operand.numbers[e].slope[0] =
                        static_cast<double>(operand.from) + static_cast<double>(e) + 1;
            run();
            for_each_result([&](std::span<const Dual> numbers, Eigen::Index) {
                for (const auto& number : numbers) {
                    if (number.slope[0] != 0) local.add(static_cast<int>(number.slope[0]) - 1, 1);
                    local.end_row();
                }
            });
            return multiply(local, elements, made);
        }
        if (kernel.structure != Structure::elementwise) return false;
        for (const std::size_t k : results) // each of them by those beside it
            for (const auto& operand : operands)
                if (operand.from >= 0 && operand.size.count() != 1 &&
                    operand.size.count() != operands[k].size.count())
                    return false;
        std::vector<std::size_t> moving;
        for (std::size_t k = 0; k < operands.size(); ++k)
            if (operands[k].from >= 0) moving.push_back(k);
        std::size_t rows = 0;
        for (const auto& part : written) rows += static_cast<std::size_t>(part.count);
        Matrix own(rows, moving.size()); // of each result by each of them
        constexpr auto width = static_cast<std::size_t>(Dual::directions);
        for (std::size_t first = 0; first < moving.size(); first += width) {
            const std::size_t count = std::min(width, moving.size() - first);
            set_values();
            for (std::size_t lane = 0; lane < count; ++lane)
                for (auto& number : operands[moving[first + lane]].numbers) number.slope[lane] = 1;
            run();
            for_each_result([&](std::span<const Dual> numbers, Eigen::Index row) {
                for (std::size_t lane = 0; lane < count; ++lane)
                    for (std::size_t e = 0; e < numbers.size(); ++e)
                        own(row + static_cast<Eigen::Index>(e), static_cast<Eigen::Index>(first + lane)) =
                            slope_of(numbers[e], lane);
            });
        }
        for_each_result([&](std::span<const Dual> numbers, Eigen::Index row) {
            for (int e = 0; e < static_cast<int>(numbers.size()); ++e) {
                for (std::size_t i = 0; i < moving.size(); ++i) {
                    const auto& operand = operands[moving[i]];
                    local.add(operand.from + (operand.size.count() == 1 ? 0 : e),
                              own(row + e, static_cast<Eigen::Index>(i)));
                }
                local.end_row();
            }
        });
        return multiply(local, elements, made);
    };
    const auto differentiate = [&](const Matrix& directions, Matrix& slopes) {
        for (Eigen::Index first = 0; first < directions.cols(); first += Dual::directions) {
            const auto count = std::min<Eigen::Index>(Dual::directions, directions.cols() - first);
            set_values();
            for (auto& operand : operands)
                for (std::size_t e = 0; operand.from >= 0 && e < operand.numbers.size(); ++e)
                    for (Eigen::Index c = 0; c < count; ++c)
                        operand.numbers[e].slope[static_cast<std::size_t>(c)] =
                            directions(operand.from + static_cast<Eigen::Index>(e), first + c);
            run();
            for_each_result([&](std::span<const Dual> numbers, Eigen::Index row) {
                for (const auto& number : numbers) {
                    for (Eigen::Index c = 0; c < count; ++c)
                        slopes(row, first + c) = slope_of(number, static_cast<std::size_t>(c));
                    ++row;
                }
            });
        }
        return true;
    };
    write(node, read, written, differentiate, structured);
}

} // namespace bf::analysis
