#include "bf/middleware/node_block.hpp"

#include <utility>

namespace bf::middleware {

NodeBlock::NodeBlock(const Arguments& arguments, const NameRules& rules) : Block(arguments) {
    std::vector<std::string> problems;
    check_node(rules, "name", name, name_space, remap, problems);
    for (auto& text : problems) problem(std::move(text));
}

} // namespace bf::middleware
