#include "differential.hpp"

#include "named.hpp"

#include <algorithm>
#include <cmath>

namespace bf::analysis {

void Differential::rule(int node, Phase phase, const Call& call, const DualKernel& kernel) {
    const Frame& frame = context_.frame(node);
    const auto& slots = d_.nodes[static_cast<std::size_t>(node)].block->resolution().slots;
    struct Operand {
        Size size;
        Type type = Type::float64;
        const void* data = nullptr;
        std::size_t same;      ///< as which it is one memory
        int part = -1;         ///< of what is read and moves
        Eigen::Index from = 0; ///< where that begins
        std::vector<Dual> numbers = {};
    };
    std::vector<Part> read, written;
    std::vector<Operand> operands(call.operands.size());
    std::vector<std::size_t> results;
    Eigen::Index inputs = 0;
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
        operand.part = static_cast<int>(read.size());
        operand.from = inputs;
        inputs += its.count;
        read.push_back({of, nullptr, operand.type, its.count});
    }
    if (read.empty()) {
        for (const auto& part : written) slopes(part.slopes).clear();
        return;
    }

    std::vector<kernels::View<Dual>> views, list;
    const auto set_values = [&] {
        views.clear(), list.clear();
        for (std::size_t k = 0; k < operands.size(); ++k) {
            auto& operand = operands[k];
            if (operand.same == k) {
                operand.numbers.resize(static_cast<std::size_t>(operand.size.count()));
                for (int e = 0; e < operand.size.count(); ++e)
                    operand.numbers[static_cast<std::size_t>(e)] = read_value(operand.data, operand.type, e);
            }
            const bool is_listed = call.list_from >= 0 && static_cast<int>(k) >= call.list_from &&
                                   static_cast<int>(k) < call.list_from + call.list_size;
            (is_listed ? list : views)
                .emplace_back(operands[operand.same].numbers.data(), operand.size.rows, operand.size.cols);
        }
    };
    const auto run = [&] {
        Dual::is_at_corner = false;
        if (!kernel.kernel->run(views.data(), {list.data(), static_cast<int>(list.size())}))
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
    const auto structured = [&](const std::vector<Moving>& moving, Matrix& slopes) {
        std::vector<RuleOperand> whole;
        for (const auto& operand : operands)
            if (call.list_from < 0 && operand.type == Type::float64)
                whole.push_back(
                    {static_cast<const double*>(operand.data), operand.size.rows, operand.size.cols,
                     operand.part < 0 ? nullptr : &moving[static_cast<std::size_t>(operand.part)]});
        if (whole.size() == operands.size() && by_formula(call.kernel, whole, slopes)) return true;
        if (kernel.structure == Structure::move) { // the kernel itself tells from where each result is
            set_values();
            for (auto& operand : operands)
                for (std::size_t e = 0; operand.part >= 0 && e < operand.numbers.size(); ++e)
                    operand.numbers[e].slope = {static_cast<double>(operand.part + 1),
                                                static_cast<double>(e)};
            run();
            std::vector<std::vector<std::pair<Eigen::Index, Eigen::Index>>> moved(moving.size()); // to, from
            for_each_result([&](const std::vector<Dual>& numbers, Eigen::Index row) {
                for (const auto& [value, slope] : numbers) {
                    if (slope[0] != 0)
                        moved[static_cast<std::size_t>(slope[0]) - 1].emplace_back(
                            row, static_cast<Eigen::Index>(slope[1]));
                    ++row;
                }
            });
            for (std::size_t p = 0; p < moving.size(); ++p)
                for (std::size_t c = 0; c < moving[p].columns.size(); ++c) {
                    const double* const of = moving[p].slopes->col(static_cast<Eigen::Index>(c)).data();
                    double* const to = slopes.col(moving[p].columns[c]).data();
                    for (const auto& [row, element] : moved[p]) to[row] = of[element];
                }
            return true;
        }
        if (kernel.structure != Structure::elementwise) return false;
        for (const std::size_t k : results) // each of them by those beside it
            for (const auto& operand : operands)
                if (operand.part >= 0 && operand.size.count() != 1 &&
                    operand.size.count() != operands[k].size.count())
                    return false;
        std::vector<const Operand*> lanes;
        for (const auto& operand : operands)
            if (operand.part >= 0) lanes.push_back(&operand);
        constexpr auto width = static_cast<std::size_t>(Dual::directions);
        for (std::size_t first = 0; first < lanes.size(); first += width) {
            const std::size_t count = std::min(width, lanes.size() - first);
            set_values();
            for (std::size_t lane = 0; lane < count; ++lane)
                for (auto& number :
                     operands[static_cast<std::size_t>(lanes[first + lane] - operands.data())].numbers)
                    number.slope[lane] = 1;
            run();
            for_each_result([&](const std::vector<Dual>& numbers, Eigen::Index row) {
                Vector own(static_cast<Eigen::Index>(numbers.size()));
                for (std::size_t lane = 0; lane < count; ++lane) {
                    for (std::size_t e = 0; e < numbers.size(); ++e)
                        own[static_cast<Eigen::Index>(e)] = slope_of(numbers[e], lane);
                    add_elements(own, moving[static_cast<std::size_t>(lanes[first + lane]->part)], row,
                                 slopes);
                }
            });
        }
        return true;
    };
    const auto differentiate = [&](const Matrix& directions, Matrix& slopes) {
        for (Eigen::Index first = 0; first < directions.cols(); first += Dual::directions) {
            const auto count = std::min<Eigen::Index>(Dual::directions, directions.cols() - first);
            set_values();
            for (auto& operand : operands)
                for (std::size_t e = 0; operand.part >= 0 && e < operand.numbers.size(); ++e)
                    for (Eigen::Index c = 0; c < count; ++c)
                        operand.numbers[e].slope[static_cast<std::size_t>(c)] =
                            directions(operand.from + static_cast<Eigen::Index>(e), first + c);
            run();
            for_each_result([&](const std::vector<Dual>& numbers, Eigen::Index row) {
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
