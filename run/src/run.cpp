#include "bf/run/run.hpp"

#include "bf/base/names.hpp"
#include "bf/kernels/steps.hpp"

namespace bf {

std::vector<double> Quantity::values() const {
    std::vector<double> all(info.elements());
    for (std::size_t i = 0; i < all.size(); ++i) all[i] = (*this)[static_cast<int>(i)];
    return all;
}

const Quantity& find(const std::vector<Quantity>& quantities, const std::string& path) {
    const Quantity* of_block = nullptr;
    int count = 0;
    std::vector<std::string> names;
    for (const auto& quantity : quantities) {
        if (quantity.path == path) return quantity;
        const auto dot = quantity.path.rfind('.');
        if (dot == path.size() && quantity.path.starts_with(path)) {
            // What comes from a device is among the signals, too.
            count += of_block == nullptr || of_block->data != quantity.data;
            of_block = &quantity;
        }
        names.push_back(quantity.path);
    }
    if (count == 1) return *of_block;
    throw RunError("the run has no '" + path + "'" + did_you_mean(path, names));
}

void Run::set_parameter(const std::string& path, const std::vector<double>& values) {
    ParameterChange change = prepare({{path, values}});
    if (const Status status = apply(change); !status) throw RunError(change.why_refused(status));
}

std::int64_t Run::steps_before(double time) const { return kernels::steps_before(time, period()); }

bool Run::run_until(double time) {
    const std::int64_t last = steps_before(time);
    while (steps() < last)
        if (!step()) return false;
    return true;
}

recording::ElementType element_type(Type type) {
    using recording::ElementType;
    switch (type) {
    case Type::float64: return ElementType::Double;
    case Type::float32: return ElementType::Single;
    case Type::int8: return ElementType::Int8;
    case Type::uint8: return ElementType::Uint8;
    case Type::int16: return ElementType::Int16;
    case Type::uint16: return ElementType::Uint16;
    case Type::int32: return ElementType::Int32;
    case Type::uint32: return ElementType::Uint32;
    case Type::boolean: return ElementType::Boolean;
    }
    return ElementType::Double;
}

} // namespace bf
