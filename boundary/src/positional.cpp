#include "bf/boundary/positional.hpp"

#include "BlockFactory/Core/Block.h"
#include "bf/boundary/hosted_block.hpp"

#include <algorithm>

namespace bf::boundary {

namespace core = blockfactory::core;

namespace {

core::ParameterMetadata metadata_of(const std::string& name, const Value& initial, unsigned index) {
    using core::ParameterType;
    constexpr int open = core::ParameterMetadata::DynamicSize;
    if (initial.kind == Value::Kind::text) return {ParameterType::STRING, index, 1, 1, name};
    if (initial.kind == Value::Kind::texts) return {ParameterType::CELL_STRING, index, 1, open, name};
    const bool is_scalar = initial.data.size() == 1;
    const auto type = initial.type == Type::boolean ? ParameterType::BOOL : ParameterType::DOUBLE;
    return {type, index, 1, is_scalar ? 1 : open, name};
}

/// The default of a parameter: zeros where nothing is declared.
Value initial_of(const SlotDeclaration& slot) {
    const bool is_open = slot.shape.symbol >= 0 || slot.shape.rows.dim >= 0 || slot.shape.cols.dim >= 0;
    const int rows = is_open ? 1 : slot.shape.rows.plus, cols = is_open ? 1 : slot.shape.cols.plus;
    Matrix matrix = Matrix::Zero(rows, cols);
    const auto count = static_cast<Eigen::Index>(slot.initial.size());
    if (count == 1)
        matrix.setConstant(slot.initial[0]);
    else if (count > 1)
        matrix = Eigen::Map<const Matrix>(slot.initial.data(), count == matrix.size() ? rows : 1,
                                          count == matrix.size() ? cols : count);
    Value value(matrix);
    value.type = slot.type_symbol < 0 ? slot.type : Type::float64;
    return value;
}

/// Does the argument take more than one number, although its default is one? The block itself says.
bool takes_vector(const BlockClass& block_class, const ArgumentDeclaration& argument) {
    if (argument.initial.kind != Value::Kind::number || argument.initial.type == Type::boolean) return false;
    Arguments arguments;
    arguments.emplace_back(argument.name, Value(Matrix(Matrix::Constant(1, 2, argument.initial.data[0]))));
    try {
        const auto block = block_class.make(arguments);
        const auto& problems = block->declaration().problems;
        return std::none_of(problems.begin(), problems.end(), [&](const std::string& problem) {
            return problem.starts_with("argument '" + argument.name + "' must be ");
        });
    } catch (const std::exception&) {
        return false;
    }
}

/// The other values of an argument that may bring or take away parameters.
std::vector<Value> other_values(const ArgumentDeclaration& argument) {
    const Value& initial = argument.initial;
    if (initial.kind == Value::Kind::number && initial.type == Type::boolean && initial.data.size() == 1)
        return {Value(initial.data[0] == 0)};
    std::vector<Value> others;
    for (const auto& choice : argument.choices)
        if (choice != initial.text) others.emplace_back(choice);
    return others;
}

/// Parameters of the class, in order of declaration; behind them those that other arguments bring.
std::vector<SlotDeclaration> parameters_of(const BlockClass& block_class, const Declaration& declaration) {
    std::vector<SlotDeclaration> all;
    const auto take = [&](const Declaration& d) {
        for (const auto& slot : d.slots)
            if (slot.role == Role::parameter &&
                std::none_of(all.begin(), all.end(), [&](const auto& s) { return s.name == slot.name; }))
                all.push_back(slot);
    };
    take(declaration);
    for (const auto& argument : declaration.arguments)
        for (const auto& value : other_values(argument)) {
            Arguments arguments;
            arguments.emplace_back(argument.name, value);
            try {
                take(block_class.make(arguments)->declaration());
            } catch (const std::exception&) { // not on its own
            }
        }
    return all;
}

} // namespace

std::vector<PositionalValue> positional_values(const BlockClass& block_class,
                                               const std::vector<const BlockClass*>& providers) {
    using Goal = PositionalValue::Goal;
    std::vector<PositionalValue> list;
    const auto add = [&](Goal goal, const BlockClass& owner, const std::string& name, const std::string& doc,
                         const Value& initial, const std::vector<std::string>& choices, const Limits& limits,
                         bool is_open) {
        const bool taken =
            std::any_of(list.begin(), list.end(), [&](const auto& v) { return v.metadata.name == name; });
        auto metadata = metadata_of(taken ? owner.name + "." + name : name, initial,
                                    core::Block::NumberOfParameters + static_cast<unsigned>(list.size()));
        if (is_open) metadata.cols = core::ParameterMetadata::DynamicSize;
        list.push_back({goal, &owner, name, doc, initial, choices, limits, metadata});
    };
    const auto block = block_class.make({});
    if (const auto* hosted = dynamic_cast<const HostedBlock*>(block.get())) {
        const auto& arguments = block->declaration().arguments;
        for (const auto& metadata : hosted->parameters()) {
            const auto argument = std::find_if(arguments.begin(), arguments.end(), [&](const auto& a) {
                return a.name == argument_name(metadata.name);
            });
            if (argument == arguments.end()) continue;
            list.push_back({Goal::argument, &block_class, argument->name, argument->doc, argument->initial,
                            argument->choices, argument->limits, metadata});
        }
        return list;
    }
    const auto add_arguments = [&](const BlockClass& owner, const Declaration& d) {
        for (const auto& argument : d.arguments)
            add(Goal::argument, owner, argument.name, argument.doc, argument.initial, argument.choices,
                argument.limits, argument.initial.data.size() == 1 && takes_vector(owner, argument));
    };
    add_arguments(block_class, block->declaration());
    for (const auto& slot : parameters_of(block_class, block->declaration())) {
        const bool is_scalar = slot.shape.symbol < 0 && slot.shape.rows.dim < 0 && slot.shape.cols.dim < 0 &&
                               slot.shape.rows.plus * slot.shape.cols.plus == 1;
        add(Goal::parameter, block_class, slot.name, slot.doc, initial_of(slot), {}, slot.limits, !is_scalar);
    }
    for (const auto* provider : providers) add_arguments(*provider, provider->make({})->declaration());
    add(Goal::period, block_class, "sample_time", "period of the step, s", Value(0.0), {}, {}, false);
    return list;
}

std::string argument_name(const std::string& legacy_name) {
    for (const char* kept : {"block", "blocks", "connections", "doc", "file", "offset", "period", "with"})
        if (legacy_name == kept) return legacy_name + "_";
    return legacy_name;
}

} // namespace bf::boundary
