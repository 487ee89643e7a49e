// The memory behind one port, as a block reads and writes it.
#ifndef BLOCKFACTORY_CORE_SIGNAL_H
#define BLOCKFACTORY_CORE_SIGNAL_H

#include "BlockFactory/Core/Port.h"

#include <cstdint>
#include <memory>

namespace blockfactory {
namespace core {
class Signal;

namespace detail {
/// The DataType of a C++ type; no member for types that no port can have.
template <typename T> struct DataTypeOf {};
template <Port::DataType type> struct DataTypeIs { static constexpr Port::DataType value = type; };
template <> struct DataTypeOf<double> : DataTypeIs<Port::DataType::DOUBLE> {};
template <> struct DataTypeOf<float> : DataTypeIs<Port::DataType::SINGLE> {};
template <> struct DataTypeOf<std::int8_t> : DataTypeIs<Port::DataType::INT8> {};
template <> struct DataTypeOf<std::uint8_t> : DataTypeIs<Port::DataType::UINT8> {};
template <> struct DataTypeOf<std::int16_t> : DataTypeIs<Port::DataType::INT16> {};
template <> struct DataTypeOf<std::uint16_t> : DataTypeIs<Port::DataType::UINT16> {};
template <> struct DataTypeOf<std::int32_t> : DataTypeIs<Port::DataType::INT32> {};
template <> struct DataTypeOf<std::uint32_t> : DataTypeIs<Port::DataType::UINT32> {};
template <> struct DataTypeOf<bool> : DataTypeIs<Port::DataType::BOOLEAN> {};
} // namespace detail
} // namespace core
} // namespace blockfactory

/// A row of elements of one type. A zero-copy signal refers to memory of the engine, and a copy of it to the
/// same memory; the other formats own their elements.
class blockfactory::core::Signal {
  public:
    enum class DataFormat { NONCONTIGUOUS = 0, CONTIGUOUS = 1, CONTIGUOUS_ZEROCOPY = 2 };

    Signal(const DataFormat& format = DataFormat::CONTIGUOUS_ZEROCOPY,
           const Port::DataType& type = Port::DataType::DOUBLE)
        : type_(type), format_(format) {}
    Signal(const Signal& other);
    Signal(Signal&& other) noexcept;
    Signal& operator=(const Signal&) = delete;
    Signal& operator=(Signal&&) = delete;
    ~Signal() = default;

    /// Copies `length` elements; the format must be CONTIGUOUS.
    bool initializeBufferFromContiguous(const void* buffer, const std::size_t length);
    /// Refers to `length` elements; the format must be CONTIGUOUS_ZEROCOPY.
    bool initializeBufferFromContiguousZeroCopy(const void* buffer, const std::size_t length);
    /// Copies one element from each of `length` pointers; the format must be NONCONTIGUOUS.
    bool initializeBufferFromNonContiguous(const void* const* buffer, const std::size_t length);

    bool isValid() const { return data_ && width_ > 0; }
    std::size_t getWidth() const { return width_; }
    Port::DataType getPortDataType() const { return type_; }
    DataFormat getDataFormat() const { return format_; }

    /// The first element, or null when the elements are of another type or there are none.
    template <typename T> T* getBuffer() {
        return detail::DataTypeOf<T>::value == type_ ? static_cast<T*>(data_) : nullptr;
    }
    template <typename T> const T* getBuffer() const {
        return detail::DataTypeOf<T>::value == type_ ? static_cast<const T*>(data_) : nullptr;
    }
    /// Element i; 0 and a logged error when there is none of that index and type.
    template <typename T> T get(const std::size_t i) const {
        const T* buffer = getBuffer<T>();
        if (buffer && i < width_) return buffer[i];
        reportGet(i, detail::DataTypeOf<T>::value);
        return T(0);
    }
    /// Writes element i of a DOUBLE or SINGLE signal.
    bool set(const std::size_t index, const double& data);
    /// Copies `length` elements to the front. The width of a zero-copy signal stays what it is, and more than
    /// it are refused; a CONTIGUOUS one takes the new length; a NONCONTIGUOUS one refuses.
    template <typename T> bool setBuffer(const T* data, const std::size_t length) {
        return setElements(data, length, detail::DataTypeOf<T>::value);
    }

  private:
    void reportGet(std::size_t i, Port::DataType wanted) const;
    bool setElements(const void* data, std::size_t length, Port::DataType type);
    bool start(DataFormat format, const void* buffer, std::size_t length);
    void own(const void* buffer, std::size_t length);

    void* data_ = nullptr;
    std::size_t width_ = 0;
    Port::DataType type_;
    DataFormat format_;
    std::unique_ptr<double[]> owned_; // doubles, for their alignment
};

#endif
