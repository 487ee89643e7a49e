#include "dual_kernels.hpp"

#include "dual.hpp"

namespace bf::analysis {

const NamedKernel<Dual>* dual_kernel(std::string_view name) { return find_kernel<Dual>(name); }

} // namespace bf::analysis
