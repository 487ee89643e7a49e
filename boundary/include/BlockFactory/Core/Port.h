// Ports as blocks declare them: a scope for the types of indices, dimensions and elements.
#ifndef BLOCKFACTORY_CORE_PORT_H
#define BLOCKFACTORY_CORE_PORT_H

#include <cstddef>
#include <vector>

namespace blockfactory {
namespace core {
class Port;
} // namespace core
} // namespace blockfactory

/// Never instantiated. Matrices lie in memory column by column.
class blockfactory::core::Port {
  public:
    using Index = std::size_t;
    /// One element: a vector of that length. Two: a matrix, rows and columns.
    using Dimensions = std::vector<int>;
    /// In any place of Dimensions: the length is decided by what is wired.
    static const int DynamicSize = -1;

    enum class DataType { DOUBLE, SINGLE, INT8, UINT8, INT16, UINT16, INT32, UINT32, BOOLEAN };

    struct Info {
        Index index;
        Dimensions dimension;
        DataType dataType;
    };

    struct Size {
        using Vector = int;
        using Rows = int;
        using Cols = int;
        struct Matrix {
            Rows rows;
            Cols cols;
        };
    };

    virtual ~Port() = 0;
};

#endif
