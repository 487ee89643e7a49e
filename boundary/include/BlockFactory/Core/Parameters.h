// The parameters of one block, by name.
#ifndef BLOCKFACTORY_CORE_PARAMETERS_H
#define BLOCKFACTORY_CORE_PARAMETERS_H

#include "BlockFactory/Core/Parameter.h"

#include <memory>
#include <string>
#include <vector>

namespace blockfactory {
namespace core {
class Parameters;

const int PARAM_INVALID_INDEX = -1;
const std::string PARAM_INVALID_NAME = {};
} // namespace core
} // namespace blockfactory

/// A container of named values with metadata; lists come in the order in which they were stored.
///
/// Values are converted on the way in (to the metadata's type) and out (to the asked one): double → int
/// truncates, any number → bool is != 0, text ↔ number as written (for int and bool a whole one). What cannot
/// be converted is an error: false, and a message in the Log. T: int, bool, double, std::string.
class blockfactory::core::Parameters {
  public:
    using ParamIndex = int;
    using ParamName = std::string;

    Parameters();
    ~Parameters();
    Parameters(const Parameters& other);
    Parameters& operator=(const Parameters& other);
    Parameters(Parameters&& other) noexcept;
    Parameters& operator=(Parameters&& other) noexcept;

    /// The last stored name of that index; PARAM_INVALID_NAME and an error when there is none.
    ParamName getParamName(const ParamIndex& index) const;
    /// PARAM_INVALID_INDEX and an error when there is none.
    ParamIndex getParamIndex(const ParamName& name) const;
    unsigned getNumberOfParameters() const;
    bool existName(const ParamName& name) const;

    /// A name can be stored once.
    template <typename T> bool storeParameter(const T& value, const ParameterMetadata& metadata);
    template <typename T> bool storeParameter(const std::vector<T>& value, const ParameterMetadata& metadata);
    template <typename T> bool storeParameter(const Parameter<T>& parameter) {
        return parameter.isScalar() ? storeParameter(parameter.getScalarParameter(), parameter.getMetadata())
                                    : storeParameter(parameter.getVectorParameter(), parameter.getMetadata());
    }

    /// Asking a scalar of a vector parameter, or the other way round, is an error.
    template <typename T> bool getParameter(const ParamName& name, T& value) const;
    template <typename T> bool getParameter(const ParamName& name, std::vector<T>& value) const;

    std::vector<Parameter<int>> getIntParameters() const;
    std::vector<Parameter<bool>> getBoolParameters() const;
    std::vector<Parameter<double>> getDoubleParameters() const;
    std::vector<Parameter<std::string>> getStringParameters() const;

    /// On a miss: an error and (INT, 0, 0, 0, "dummy").
    ParameterMetadata getParameterMetadata(const ParamName& name);

  private:
    class impl;
    std::unique_ptr<impl> pImpl;
};

#define BLOCKFACTORY_PARAMETERS_OF(T)                                                                        \
    extern template bool blockfactory::core::Parameters::storeParameter<T>(                                  \
        const T&, const blockfactory::core::ParameterMetadata&);                                             \
    extern template bool blockfactory::core::Parameters::storeParameter<T>(                                  \
        const std::vector<T>&, const blockfactory::core::ParameterMetadata&);                                \
    extern template bool blockfactory::core::Parameters::getParameter<T>(const std::string&, T&) const;      \
    extern template bool blockfactory::core::Parameters::getParameter<T>(const std::string&,                 \
                                                                         std::vector<T>&) const;
BLOCKFACTORY_PARAMETERS_OF(int)
BLOCKFACTORY_PARAMETERS_OF(bool)
BLOCKFACTORY_PARAMETERS_OF(double)
BLOCKFACTORY_PARAMETERS_OF(std::string)
#undef BLOCKFACTORY_PARAMETERS_OF

#endif
