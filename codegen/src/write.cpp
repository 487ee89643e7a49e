#include "bf/base/files.hpp"
#include "bf/codegen/generate.hpp"

namespace bf::codegen {

void write(const Files& files, const std::filesystem::path& folder) {
    OutputFolder output(folder);
    for (const auto& [name, text] : files) output.write(name, text);
    output.commit();
}

} // namespace bf::codegen
