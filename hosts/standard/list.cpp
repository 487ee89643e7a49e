// Prints the source that exports every standard block through the old factory symbols.
#include "bf/blocks/standard.hpp"

#include <cstdio>

int main() {
    std::puts("#include \"bf/boundary/as_legacy_block.hpp\"\n");
    const bf::Library library = bf::standard_library();
    for (const auto& block_class : library.classes())
        std::printf("BF_LEGACY_BLOCK(%s)\n", block_class.name.c_str());
}
