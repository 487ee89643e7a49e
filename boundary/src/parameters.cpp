#include "BlockFactory/Core/Parameters.h"

#include "BlockFactory/Core/ConvertStdVector.h"
#include "BlockFactory/Core/Log.h"

#include <algorithm>
#include <variant>

namespace blockfactory::core {

namespace {

using Stored = std::variant<Parameter<int>, Parameter<bool>, Parameter<double>, Parameter<std::string>>;

const ParameterMetadata metadata_of(const Stored& stored) {
    return std::visit([](const auto& p) { return p.getMetadata(); }, stored);
}

/// The last word of the type says how the value is stored: index of the alternative of Stored.
int storage(ParameterType type) { return static_cast<int>(type) % 4; }

template <class T> Stored convert(const T& value, const ParameterMetadata& metadata) {
    switch (storage(metadata.type)) {
    case 0: return Parameter<int>(convertValue<int, T>(value), metadata);
    case 1: return Parameter<bool>(convertValue<bool, T>(value), metadata);
    case 2: return Parameter<double>(convertValue<double, T>(value), metadata);
    default: return Parameter<std::string>(convertValue<std::string, T>(value), metadata);
    }
}

template <class To, class T>
Stored converted(const std::vector<T>& values, const ParameterMetadata& metadata) {
    std::vector<To> to;
    convertStdVector(values, to);
    return Parameter<To>(to, metadata);
}
template <class T> Stored convert(const std::vector<T>& values, const ParameterMetadata& metadata) {
    switch (storage(metadata.type)) {
    case 0: return converted<int>(values, metadata);
    case 1: return converted<bool>(values, metadata);
    case 2: return converted<double>(values, metadata);
    default: return converted<std::string>(values, metadata);
    }
}

} // namespace

class Parameters::impl {
  public:
    std::vector<Stored> stored;

    const Stored* find(const std::string& name) const {
        const auto found = std::find_if(stored.begin(), stored.end(),
                                        [&](const Stored& s) { return metadata_of(s).name == name; });
        return found == stored.end() ? nullptr : &*found;
    }
    const Stored* find_or_log(const std::string& name) const {
        const Stored* found = find(name);
        if (!found) bfError << "There is no parameter '" << name << "'.";
        return found;
    }
    template <class V> bool store(const V& value, const ParameterMetadata& metadata) {
        if (find(metadata.name)) {
            bfError << "The parameter '" << metadata.name << "' is stored already.";
            return false;
        }
        try {
            stored.push_back(convert(value, metadata));
        } catch (const std::exception& error) {
            bfError << "The parameter '" << metadata.name << "' cannot be stored: " << error.what() << ".";
            return false;
        }
        return true;
    }
    template <class V> std::vector<Parameter<V>> all() const {
        std::vector<Parameter<V>> list;
        for (const Stored& s : stored)
            if (const auto* p = std::get_if<Parameter<V>>(&s)) list.push_back(*p);
        return list;
    }
};

Parameters::Parameters() : pImpl(std::make_unique<impl>()) {}
Parameters::~Parameters() = default;
Parameters::Parameters(const Parameters& other) : pImpl(std::make_unique<impl>(*other.pImpl)) {}
Parameters& Parameters::operator=(const Parameters& other) {
    *pImpl = *other.pImpl;
    return *this;
}
Parameters::Parameters(Parameters&& other) noexcept : Parameters() { std::swap(pImpl, other.pImpl); }
Parameters& Parameters::operator=(Parameters&& other) noexcept {
    std::swap(pImpl, other.pImpl);
    return *this;
}

Parameters::ParamName Parameters::getParamName(const ParamIndex& index) const {
    for (auto s = pImpl->stored.rbegin(); s != pImpl->stored.rend(); ++s)
        if (static_cast<ParamIndex>(metadata_of(*s).index) == index) return metadata_of(*s).name;
    bfError << "There is no parameter of index " << index << ".";
    return PARAM_INVALID_NAME;
}
Parameters::ParamIndex Parameters::getParamIndex(const ParamName& name) const {
    const Stored* found = pImpl->find_or_log(name);
    return found ? static_cast<ParamIndex>(metadata_of(*found).index) : PARAM_INVALID_INDEX;
}
unsigned Parameters::getNumberOfParameters() const { return static_cast<unsigned>(pImpl->stored.size()); }
bool Parameters::existName(const ParamName& name) const { return pImpl->find(name) != nullptr; }

template <typename T> bool Parameters::storeParameter(const T& value, const ParameterMetadata& metadata) {
    if (metadata.rows != 1 && metadata.cols != 1) {
        bfError << "The parameter '" << metadata.name << "' is a scalar, but declared " << metadata.rows
                << "x" << metadata.cols << ".";
        return false;
    }
    return pImpl->store(value, metadata);
}

template <typename T>
bool Parameters::storeParameter(const std::vector<T>& value, const ParameterMetadata& metadata) {
    if (metadata.rows != 1 && metadata.cols != static_cast<int>(value.size())) {
        bfError << "The parameter '" << metadata.name << "' is declared " << metadata.rows << "x"
                << metadata.cols << ": 2D parameters are not supported.";
        return false;
    }
    return pImpl->store(value, metadata);
}

template <typename T> bool Parameters::getParameter(const ParamName& name, T& value) const {
    const Stored* found = pImpl->find_or_log(name);
    return found && std::visit(
                        [&](const auto& p) {
                            if (!p.isScalar()) {
                                bfError << "The parameter '" << name << "' is a vector, not a scalar.";
                                return false;
                            }
                            try {
                                value = convertValue<T>(p.getScalarParameter());
                            } catch (const std::exception& error) {
                                bfError << "The parameter '" << name
                                        << "' is of another type: " << error.what() << ".";
                                return false;
                            }
                            return true;
                        },
                        *found);
}

template <typename T> bool Parameters::getParameter(const ParamName& name, std::vector<T>& value) const {
    const Stored* found = pImpl->find_or_log(name);
    return found && std::visit(
                        [&](const auto& p) {
                            if (p.isScalar()) {
                                bfError << "The parameter '" << name << "' is a scalar, not a vector.";
                                return false;
                            }
                            try {
                                convertStdVector(p.getVectorParameter(), value);
                            } catch (const std::exception& error) {
                                bfError << "The parameter '" << name
                                        << "' is of another type: " << error.what() << ".";
                                return false;
                            }
                            return true;
                        },
                        *found);
}

std::vector<Parameter<int>> Parameters::getIntParameters() const { return pImpl->all<int>(); }
std::vector<Parameter<bool>> Parameters::getBoolParameters() const { return pImpl->all<bool>(); }
std::vector<Parameter<double>> Parameters::getDoubleParameters() const { return pImpl->all<double>(); }
std::vector<Parameter<std::string>> Parameters::getStringParameters() const {
    return pImpl->all<std::string>();
}

ParameterMetadata Parameters::getParameterMetadata(const ParamName& name) {
    const Stored* found = pImpl->find_or_log(name);
    return found ? metadata_of(*found) : ParameterMetadata(ParameterType::INT, 0, 0, 0, "dummy");
}

#define BLOCKFACTORY_PARAMETERS_OF(T)                                                                        \
    template bool Parameters::storeParameter<T>(const T&, const ParameterMetadata&);                         \
    template bool Parameters::storeParameter<T>(const std::vector<T>&, const ParameterMetadata&);            \
    template bool Parameters::getParameter<T>(const std::string&, T&) const;                                 \
    template bool Parameters::getParameter<T>(const std::string&, std::vector<T>&) const;
BLOCKFACTORY_PARAMETERS_OF(int)
BLOCKFACTORY_PARAMETERS_OF(bool)
BLOCKFACTORY_PARAMETERS_OF(double)
BLOCKFACTORY_PARAMETERS_OF(std::string)

} // namespace blockfactory::core
