#include "builtins.hpp"

#include <cmath>

namespace bf::matlab {

const Builtins& builtins() {
    static const Builtins table = [] {
        Builtins all;
        add_elementwise(all);
        add_arrays(all);
        add_reductions(all);
        add_linear_algebra(all);
        add_text(all);
        add_data(all);
        return all;
    }();
    return table;
}

Index Call::length(std::size_t i) const {
    const double x = scalar(i);
    if (!(x == std::floor(x)) || std::isinf(x))
        throw Error("a size must be a whole number, got " + number_text(x));
    return x > 0 ? static_cast<Index>(std::min(x, 1e15)) : 0;
}

} // namespace bf::matlab
