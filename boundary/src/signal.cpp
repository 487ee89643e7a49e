#include "BlockFactory/Core/Signal.h"

#include "BlockFactory/Core/Log.h"
#include "data_type.hpp"

#include <cstring>
#include <utility>

namespace blockfactory::core {

Port::~Port() = default;

using bf::boundary::bytes;
using bf::boundary::name;

Signal::Signal(const Signal& other)
    : data_(other.data_), width_(other.width_), type_(other.type_), format_(other.format_) {
    if (format_ != DataFormat::CONTIGUOUS_ZEROCOPY && data_) own(other.data_, width_);
}

Signal::Signal(Signal&& other) noexcept
    : data_(std::exchange(other.data_, nullptr)), width_(std::exchange(other.width_, 0)), type_(other.type_),
      format_(other.format_), owned_(std::move(other.owned_)) {}

void Signal::own(const void* buffer, std::size_t length) {
    auto memory = std::make_unique<double[]>((length * bytes(type_) + sizeof(double) - 1) / sizeof(double));
    if (buffer) std::memcpy(memory.get(), buffer, length * bytes(type_));
    owned_ = std::move(memory);
    data_ = owned_.get();
    width_ = length;
}

bool Signal::start(DataFormat format, const void* buffer, std::size_t length) {
    if (format_ != format) {
        bfError << "The signal was made for another data format.";
        return false;
    }
    if (!buffer || length == 0) {
        bfError << "The signal's buffer is " << (buffer ? "empty." : "null.");
        return false;
    }
    return true;
}

bool Signal::initializeBufferFromContiguous(const void* buffer, const std::size_t length) {
    if (!start(DataFormat::CONTIGUOUS, buffer, length)) return false;
    own(buffer, length);
    return true;
}

bool Signal::initializeBufferFromContiguousZeroCopy(const void* buffer, const std::size_t length) {
    if (!start(DataFormat::CONTIGUOUS_ZEROCOPY, buffer, length)) return false;
    data_ = const_cast<void*>(buffer);
    width_ = length;
    return true;
}

bool Signal::initializeBufferFromNonContiguous(const void* const* buffer, const std::size_t length) {
    if (!start(DataFormat::NONCONTIGUOUS, buffer, length)) return false;
    for (std::size_t i = 0; i < length; ++i)
        if (!buffer[i]) {
            bfError << "Element " << i << " of the signal has no address.";
            return false;
        }
    own(nullptr, length);
    const std::size_t size = bytes(type_);
    for (std::size_t i = 0; i < length; ++i)
        std::memcpy(static_cast<char*>(data_) + i * size, buffer[i], size);
    return true;
}

void Signal::reportGet(std::size_t i, Port::DataType wanted) const {
    if (wanted != type_)
        bfError << "The signal has elements of type " << name(type_) << ", not " << name(wanted) << ".";
    else if (!data_)
        bfError << "The signal has no memory yet.";
    else
        bfError << "Element " << i << " was asked of a signal that has " << width_ << ".";
}

bool Signal::set(const std::size_t index, const double& data) {
    if (!data_ || index >= width_) {
        reportGet(index, type_);
        return false;
    }
    if (type_ == Port::DataType::DOUBLE)
        static_cast<double*>(data_)[index] = data;
    else if (type_ == Port::DataType::SINGLE)
        static_cast<float*>(data_)[index] = static_cast<float>(data);
    else {
        bfError << "set() writes signals of type double and single, not " << name(type_) << ".";
        return false;
    }
    return true;
}

bool Signal::setElements(const void* data, std::size_t length, Port::DataType type) {
    if (type != type_) {
        bfError << "The signal has elements of type " << name(type_) << ", not " << name(type) << ".";
        return false;
    }
    if (format_ == DataFormat::NONCONTIGUOUS || (length && !data)) {
        bfError << (data ? "The elements of a non-contiguous signal cannot be set at once."
                         : "The data to set are null.");
        return false;
    }
    if (!data_) {
        bfError << "The signal has no memory yet.";
        return false;
    }
    if (format_ == DataFormat::CONTIGUOUS) {
        own(data, length);
        return true;
    }
    if (length > width_) {
        bfError << length << " elements were set in a signal that has " << width_ << ".";
        return false;
    }
    if (length) std::memcpy(data_, data, length * bytes(type_));
    if (length < width_)
        bfWarning << "Only " << length << " of the " << width_
                  << " elements of the signal were set; the others keep their values.";
    return true;
}

} // namespace blockfactory::core
