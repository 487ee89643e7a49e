// What generated code is told: the parameters of the block as an engine of the paper's API stores them.
#include "block.hpp"

#include <BlockFactory/Core/Parameters.h>
#include <bf/boundary/hosted_block.hpp>

#include <algorithm>
#include <stdexcept>
#include <type_traits>

namespace bf::simulink {

namespace {

namespace core = blockfactory::core;
using boundary::PositionalValue;
using Goal = PositionalValue::Goal;

/// What positional values an old engine sees, with the providers' behind.
std::vector<PositionalValue> positional_values(const Prototype& prototype) {
    std::vector<const BlockClass*> providers;
    for (const auto& binding : prototype.bindings) {
        if (!binding.provider->block->resolution().slots.empty())
            throw std::runtime_error("it needs the running block '" + binding.provider->path +
                                     "', which generated code cannot reach");
        providers.push_back(binding.provider->type);
    }
    return boundary::positional_values(prototype.type(), providers);
}

/// Those values by name.
Arguments stored_values(const Prototype& prototype, double period) {
    if (prototype.has(Role::continuous_state))
        throw std::runtime_error("it has continuous states, which generated code cannot integrate");
    Arguments values;
    for (const auto& wanted : positional_values(prototype)) {
        const auto put = [&](const Arguments& from) {
            const auto given =
                std::find_if(from.begin(), from.end(), [&](const auto& a) { return a.first == wanted.name; });
            Value value = given == from.end() ? wanted.initial : given->second;
            // The old interface has vectors only: matrices go column by column.
            if (value.kind == Value::Kind::number && !value.data.empty()) {
                value.rows = 1;
                value.cols = static_cast<int>(value.data.size());
            }
            values.emplace_back(boundary::argument_name(wanted.metadata.name), std::move(value));
        };
        if (wanted.goal == Goal::period) {
            values.emplace_back(wanted.name, Value(period));
        } else if (wanted.goal == Goal::parameter) {
            Arguments from;
            for (const auto& [slot, value] : prototype.parameters)
                from.emplace_back(prototype.slot(slot).name, value);
            put(from);
        } else if (wanted.owner == &prototype.type()) {
            put(prototype.arguments);
        } else {
            for (const auto& binding : prototype.bindings)
                if (binding.provider->type == wanted.owner) {
                    put(binding.provider->arguments);
                    break;
                }
        }
    }
    return values;
}

struct Record {
    core::ParameterMetadata metadata;
    const char* storage;
    bool is_scalar;
    std::vector<double> values;  // numbers, or the codes of all texts
    std::vector<double> lengths; // of the texts
};

template <class T>
void collect(std::vector<Record>& records, const std::vector<core::Parameter<T>>& list, const char* storage) {
    for (const auto& parameter : list) {
        Record record{parameter.getMetadata(), storage, parameter.isScalar(), {}, {}};
        const auto put = [&](const T& value) {
            if constexpr (std::is_same_v<T, std::string>) {
                for (const unsigned char code : value) record.values.push_back(code);
                record.lengths.push_back(static_cast<double>(value.size()));
            } else {
                record.values.push_back(static_cast<double>(value));
            }
        };
        if (parameter.isScalar())
            put(parameter.getScalarParameter());
        else
            for (const auto& value : parameter.getVectorParameter()) put(value);
        records.push_back(std::move(record));
    }
}

} // namespace

void write_record(SimStruct* S, const Prototype& prototype, double period) {
    const auto& type = prototype.type();
    const std::string library = type.library.empty() ? "standard" : type.library;
    const auto parameters = boundary::stored_parameters(library, type.name, stored_values(prototype, period));
    std::vector<Record> records;
    collect(records, parameters.getIntParameters(), "int");
    collect(records, parameters.getBoolParameters(), "bool");
    collect(records, parameters.getDoubleParameters(), "double");
    collect(records, parameters.getStringParameters(), "std::string");
    std::stable_sort(records.begin(), records.end(),
                     [](const Record& a, const Record& b) { return a.metadata.index < b.metadata.index; });

    std::vector<double> path;
    for (const unsigned char code : std::string(ssGetPath(S))) path.push_back(code);
    bool good = ssWriteRTWParamSettings(
        S, 4, SSWRITE_VALUE_NUM, "numberOfParameters", static_cast<double>(records.size()),
        SSWRITE_VALUE_VECT, "blockUniqueName", path.data(), static_cast<int>(path.size()), SSWRITE_VALUE_QSTR,
        "className", type.name.c_str(), SSWRITE_VALUE_QSTR, "libName", library.c_str());
    for (auto& record : records) {
        // An empty vector cannot be written; the counts say that it is meant.
        const double values = static_cast<double>(record.values.size());
        const double texts = static_cast<double>(record.lengths.size());
        if (record.values.empty()) record.values.push_back(0);
        if (record.lengths.empty()) record.lengths.push_back(0);
        good = good && ssWriteRTWParamSettings(
                           S, 11, SSWRITE_VALUE_NUM, "index", static_cast<double>(record.metadata.index),
                           SSWRITE_VALUE_QSTR, "name", record.metadata.name.c_str(), SSWRITE_VALUE_NUM,
                           "isScalar", record.is_scalar ? 1.0 : 0.0, SSWRITE_VALUE_NUM, "rows",
                           static_cast<double>(record.metadata.rows), SSWRITE_VALUE_NUM, "cols",
                           static_cast<double>(record.metadata.cols), SSWRITE_VALUE_NUM, "type",
                           static_cast<double>(static_cast<int>(record.metadata.type)), SSWRITE_VALUE_QSTR,
                           "storage", record.storage, SSWRITE_VALUE_NUM, "values", values, SSWRITE_VALUE_VECT,
                           "value", record.values.data(), static_cast<int>(record.values.size()),
                           SSWRITE_VALUE_NUM, "texts", texts, SSWRITE_VALUE_VECT, "lengths",
                           record.lengths.data(), static_cast<int>(record.lengths.size()));
    }
    if (!good || !ssWriteRTWWorkVect(S, "PWork", 1, "blockPWork", pointers_work))
        throw std::runtime_error("the record for generated code cannot be written");
}

} // namespace bf::simulink
