#include "formula.hpp"

#include "bf/matlab/formula.hpp"

#include <algorithm>
#include <charconv>
#include <stdexcept>

namespace bf::blocks {

namespace {

/// Input u or u1 is slot 1, u2 slot 2, and p is slot 0.
std::optional<matlab::Slot> slot_of(const std::string& name, Formula& formula) {
    if (name == "p") return matlab::Slot{0, {}};
    if (name.front() != 'u') return std::nullopt;
    int number = 1;
    if (name.size() > 1) {
        const auto result = std::from_chars(name.data() + 1, name.data() + name.size(), number);
        if (result.ec == std::errc::invalid_argument || result.ptr != name.data() + name.size())
            return std::nullopt;
        if (result.ec != std::errc() || number < 1 || number > 1000)
            throw matlab::Error("inputs are u1 to u1000");
    }
    const bool is_single = name.size() == 1;
    if (formula.inputs > 0 && formula.is_single != is_single)
        throw matlab::Error("there is one input u, or u1, u2, ...; not both");
    formula.is_single = is_single;
    formula.inputs = std::max(formula.inputs, number);
    return matlab::Slot{number, {}};
}

/// The instruction that reads a slot, which the formula then knows of.
matlab::Instruction read(const matlab::Formula& slot, Formula& formula) {
    const bool is_fixed = !slot.places.empty();
    const int index = is_fixed ? static_cast<int>(slot.places[0]) : 0;
    if (slot.slot == 0) {
        formula.parameters = std::max(formula.parameters, index + 1);
        formula.is_parameter_whole = formula.is_parameter_whole || !is_fixed;
        return {static_cast<double>(kernels::Operation::parameter), double(index), 0};
    }
    const auto input = static_cast<std::size_t>(slot.slot) - 1;
    if (is_fixed)
        formula.elements[input] = std::max(formula.elements[input], index + 1);
    else
        formula.whole[input] = true;
    return {static_cast<double>(is_fixed ? kernels::Operation::fixed : kernels::Operation::element),
            double(input), double(index)};
}

} // namespace

Formula formula(const std::string& text) {
    Formula result;
    const matlab::Workspace constants;
    const matlab::Scope scope{[&](const std::string& name) { return slot_of(name, result); }, constants, true,
                              "; inputs are u or u1, u2, ..., parameters p(1), p(2), ..."};
    try {
        const auto parsed = matlab::parse_expression(text);
        const matlab::Formula resolved = matlab::resolve(*parsed, scope);
        result.whole.resize(static_cast<std::size_t>(result.inputs));
        result.elements.resize(result.whole.size());
        result.code = matlab::scalar_program(resolved, [&](const auto& slot) { return read(slot, result); });
        for (std::size_t i = 0; i < result.code.size(); i += 3)
            result.edges +=
                kernels::detail::has_edges(static_cast<kernels::Operation>(static_cast<int>(result.code[i])));
    } catch (const matlab::Error& error) {
        throw std::invalid_argument("'" + text + "', character " + std::to_string(error.location().column) +
                                    ": " + error.message());
    }
    return result;
}

} // namespace bf::blocks
