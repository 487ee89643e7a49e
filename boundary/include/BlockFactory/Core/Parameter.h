// One parameter: its value and what the block declared about it.
#ifndef BLOCKFACTORY_CORE_PARAMETER_H
#define BLOCKFACTORY_CORE_PARAMETER_H

#include <string>
#include <vector>

namespace blockfactory {
namespace core {
enum class ParameterType;
class ParameterMetadata;
template <typename T> class Parameter;
} // namespace core
} // namespace blockfactory

/// The prefix says how the engine finds the value, the last word how it is stored.
enum class blockfactory::core::ParameterType {
    INT,
    BOOL,
    DOUBLE,
    STRING,
    CELL_INT,
    CELL_BOOL,
    CELL_DOUBLE,
    CELL_STRING,
    STRUCT_INT,
    STRUCT_BOOL,
    STRUCT_DOUBLE,
    STRUCT_STRING,
    STRUCT_CELL_INT,
    STRUCT_CELL_BOOL,
    STRUCT_CELL_DOUBLE,
    STRUCT_CELL_STRING
};

/// Where a parameter is found, its name, size and type. The fields of a struct parameter share one index.
class blockfactory::core::ParameterMetadata {
  public:
    enum { DynamicSize = -1 };

    unsigned index;
    std::string name;
    int rows;
    int cols;
    ParameterType type;

    /// An empty name becomes "ParamIndex_<index>".
    ParameterMetadata(const ParameterType& t, const unsigned& i, const int& r, const int& c,
                      const std::string& n = {})
        : index(i), name(n.empty() ? "ParamIndex_" + std::to_string(i) : n), rows(r), cols(c), type(t) {}

    bool operator==(const ParameterMetadata& other) const {
        return index == other.index && name == other.name && rows == other.rows && cols == other.cols &&
               type == other.type;
    }
    bool operator!=(const ParameterMetadata& other) const { return !(*this == other); }
};

/// T: int, bool, double or std::string.
template <typename T> class blockfactory::core::Parameter {
  public:
    Parameter(const T& value, const ParameterMetadata& metadata)
        : is_scalar_(true), scalar_(value), metadata_(metadata) {}
    Parameter(const std::vector<T>& value, const ParameterMetadata& metadata)
        : is_scalar_(false), scalar_(), vector_(value), metadata_(metadata) {}

    bool isScalar() const { return is_scalar_; }
    T getScalarParameter() const { return scalar_; }
    std::vector<T> getVectorParameter() const { return vector_; }
    ParameterMetadata getMetadata() const { return metadata_; }

  private:
    bool is_scalar_;
    T scalar_;
    std::vector<T> vector_;
    ParameterMetadata metadata_;
};

#endif
