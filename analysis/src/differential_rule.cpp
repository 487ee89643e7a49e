#include "differential.hpp"

#include "named.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <span>

namespace bf::analysis {

namespace {

double slope_of(const Dual& number, std::size_t direction) {
    const double slope = number.slope[direction];
    return slope != 0 && std::isnan(number.value) ? number.value : slope;
}

} // namespace

void Differential::plan_rule(Plan& plan) const {
    const Frame& frame = context_.frame(plan.node);
    const auto& slots = d_.nodes[static_cast<std::size_t>(plan.node)].block->resolution().slots;
    plan.operands.resize(plan.rule->operands.size());
    for (std::size_t k = 0; k < plan.operands.size(); ++k) {
        const auto& reference = plan.rule->operands[k];
        auto& operand = plan.operands[k];
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
        const bool is_target = is_written(d_, plan.node, plan.phase, reference);
        // A workspace that a rule reads and writes is one memory.
        for (std::size_t before = 0; is_target && before < k; ++before)
            if (plan.rule->operands[before].slot == reference.slot &&
                plan.rule->operands[before].source == reference.source &&
                plan.rule->operands[before].is_written)
                operand.same = before;
        if (operand.same != k) continue;
        operand.first = plan.numbers;
        plan.numbers += operand.count();
        if (is_target) {
            const auto& its = places_[static_cast<std::size_t>(plan.node)][slot];
            const int of = reference.source == Call::Source::next   ? its.next
                           : reference.source == Call::Source::rate ? its.rate
                                                                    : its.own;
            operand.is_result = of >= 0;
            if (of >= 0) plan.writes.push_back({of, reference.slot, nullptr, operand.type, its.count});
        }
        // What a rule writes it reads only where rules share a workspace.
        operand.is_read = !is_target || slots[slot].role == Role::workspace;
        if (reference.source != Call::Source::slot || !operand.is_read) continue;
        const int of = read_by(plan.node, reference.slot);
        const auto& its = place({plan.node, reference.slot});
        if (of < 0 || !its.is_real) continue;
        operand.slopes = of;
        plan.reads.push_back({of, reference.slot, nullptr, operand.type, its.count});
    }
}

void Differential::set_numbers(const Plan& plan) {
    for (const auto& operand : plan.operands) {
        Dual* const its = numbers(plan, operand);
        for (std::size_t e = 0; e < operand.count(); ++e)
            its[e] = operand.type == Type::float64
                         ? static_cast<const double*>(operand.data)[e]
                         : read_value(operand.data, operand.type, static_cast<int>(e));
    }
}

void Differential::run_kernel(const Plan& plan) {
    Dual::is_at_corner = false;
    if (!plan.kernel.kernel->run(views_.data(), {list_.data(), static_cast<int>(list_.size())}))
        fail(plan.node,
             "it fails at this operating point, so that it has no derivative there; choose another one");
    if (Dual::is_at_corner) kinks_.insert(plan.node);
}

void Differential::rule(Plan& plan) {
    if (plan.writes.empty()) return;
    int inputs = 0;
    for (auto& operand : plan.operands) {
        operand.from = -1;
        if (operand.slopes < 0 || slopes(operand.slopes).is_zero()) continue;
        operand.from = inputs;
        inputs += static_cast<int>(operand.count());
    }
    rows(read_, elements_);
    if (numbers_.size() < plan.numbers) numbers_.resize(plan.numbers);
    views_.clear();
    list_.clear();
    for (std::size_t k = 0; k < plan.operands.size(); ++k) {
        const auto& operand = plan.operands[k];
        const int in_list = static_cast<int>(k) - plan.rule->list_from;
        const bool is_listed = plan.rule->list_from >= 0 && in_list >= 0 && in_list < plan.rule->list_size;
        (is_listed ? list_ : views_)
            .emplace_back(numbers(plan, operand), operand.size.rows, operand.size.cols);
    }
    switch (plan.kernel.structure) {
    case Structure::move: return move(plan);
    case Structure::elementwise:
        if (elementwise(plan)) return;
        break;
    case Structure::any:
        if (formula(plan)) return;
        break;
    }
    write(plan, [&](const Matrix& directions, Matrix& slopes) {
        for (Eigen::Index first = 0; first < directions.cols(); first += Dual::directions) {
            const auto count = std::min<Eigen::Index>(Dual::directions, directions.cols() - first);
            set_numbers(plan);
            for (const auto& operand : plan.operands)
                for (std::size_t e = 0; operand.from >= 0 && e < operand.count(); ++e)
                    for (Eigen::Index c = 0; c < count; ++c)
                        numbers(plan, operand)[e].slope[static_cast<std::size_t>(c)] =
                            directions(operand.from + static_cast<Eigen::Index>(e), first + c);
            run_kernel(plan);
            Eigen::Index row = 0;
            for (const auto& operand : plan.operands)
                for (std::size_t e = 0; operand.is_result && e < operand.count(); ++e, ++row)
                    for (Eigen::Index c = 0; c < count; ++c)
                        slopes(row, first + c) =
                            slope_of(numbers(plan, operand)[e], static_cast<std::size_t>(c));
        }
    });
}

bool Differential::is_moved_as_before(const Plan& plan) const {
    if (plan.moved.from.size() != plan.operands.size()) return false;
    const std::byte* before = plan.moved.deciding.data();
    for (std::size_t k = 0; k < plan.operands.size(); ++k) {
        const auto& operand = plan.operands[k];
        if (plan.moved.from[k] != operand.from) return false;
        if (!operand.decides) continue;
        const std::size_t size = operand.count() * static_cast<std::size_t>(bytes(operand.type));
        if (std::memcmp(before, operand.data, size) != 0) return false;
        before += size;
    }
    return true;
}

/// The kernel itself tells from where each result is, by numbers of elements in place of derivatives. They
/// are the same until something else that it reads changes.
void Differential::move(Plan& plan) {
    auto& moved = plan.moved;
    if (!is_moved_as_before(plan)) {
        moved = {};
        set_numbers(plan);
        for (auto& operand : plan.operands) {
            operand.decides = operand.is_read;
            moved.from.push_back(operand.from);
            for (std::size_t e = 0; operand.from >= 0 && e < operand.count(); ++e)
                numbers(plan, operand)[e].slope[0] =
                    static_cast<double>(operand.from) + static_cast<double>(e) + 1;
        }
        run_kernel(plan);
        moved.is_at_corner = Dual::is_at_corner;
        for (const auto& result : plan.operands)
            for (std::size_t e = 0; result.is_result && e < result.count(); ++e) {
                const int element = static_cast<int>(numbers(plan, result)[e].slope[0]) - 1;
                moved.elements.push_back(element);
                for (auto& operand : plan.operands)
                    if (operand.from >= 0 && element >= operand.from &&
                        element < operand.from + static_cast<int>(operand.count()))
                        operand.decides = false;
            }
        for (const auto& operand : plan.operands) {
            const auto* values = static_cast<const std::byte*>(operand.data);
            if (operand.decides)
                moved.deciding.insert(moved.deciding.end(), values,
                                      values +
                                          operand.count() * static_cast<std::size_t>(bytes(operand.type)));
        }
    }
    if (moved.is_at_corner) kinks_.insert(plan.node);
    std::size_t first = 0;
    for (const auto& part : plan.writes) {
        const auto count = static_cast<std::size_t>(part.count);
        slopes(part.slopes).assign(elements_, std::span(moved.elements).subspan(first, count));
        if (!is_real(part.type)) slopes(part.slopes).clear();
        first += count;
    }
}

/// Where each result depends on the elements beside it, they may all be moved at once. False: an operand has
/// another size.
bool Differential::elementwise(const Plan& plan) {
    std::size_t results = 0, moving = 0;
    for (const auto& result : plan.operands) {
        if (!result.is_result) continue;
        results += result.count();
        for (const auto& operand : plan.operands)
            if (operand.from >= 0 && operand.count() != 1 && operand.count() != result.count()) return false;
    }
    for (const auto& operand : plan.operands) moving += operand.from >= 0;
    own_.resize(results * moving);
    constexpr auto width = static_cast<std::size_t>(Dual::directions);
    for (std::size_t first = 0; first < moving; first += width) {
        const std::size_t count = std::min(width, moving - first);
        set_numbers(plan);
        std::size_t i = 0;
        for (const auto& operand : plan.operands) {
            if (operand.from < 0) continue;
            if (i >= first && i < first + count)
                for (std::size_t e = 0; e < operand.count(); ++e)
                    numbers(plan, operand)[e].slope[i - first] = 1;
            ++i;
        }
        run_kernel(plan);
        double* own = own_.data() + first;
        for (const auto& operand : plan.operands)
            for (std::size_t e = 0; operand.is_result && e < operand.count(); ++e, own += moving)
                for (std::size_t lane = 0; lane < count; ++lane)
                    own[lane] = slope_of(numbers(plan, operand)[e], lane);
    }
    local_.clear();
    const double* own = own_.data();
    for (const auto& result : plan.operands)
        for (int e = 0; result.is_result && e < static_cast<int>(result.count()); ++e) {
            for (const auto& operand : plan.operands)
                if (operand.from >= 0) local_.add(operand.from + (operand.count() == 1 ? 0 : e), *own++);
            local_.end_row();
        }
    std::size_t first = 0;
    for (const auto& part : plan.writes) {
        const auto count = static_cast<std::size_t>(part.count);
        Slopes& its = slopes(part.slopes);
        local_.times(elements_, first, count, memory_, its);
        if (!is_real(part.type)) its.clear();
        check_finite(plan, its.is_finite());
        first += count;
    }
    return true;
}

/// By what is known of whole matrices. False: nothing is.
bool Differential::formula(const Plan& plan) {
    if (plan.rule->list_from >= 0) return false;
    std::vector<RuleOperand> whole;
    whole.reserve(plan.operands.size());
    for (const auto& operand : plan.operands) {
        if (operand.type != Type::float64) return false;
        whole.push_back(
            {static_cast<const double*>(operand.data), operand.size.rows, operand.size.cols, operand.from});
    }
    Slopes& its = slopes(plan.writes.front().slopes); // beside it may stand a workspace
    if (!by_formula(plan.rule->kernel, whole, elements_, memory_, its)) return false;
    check_finite(plan, its.is_finite());
    for (std::size_t p = 1; p < plan.writes.size(); ++p) slopes(plan.writes[p].slopes).clear();
    return true;
}

} // namespace bf::analysis
