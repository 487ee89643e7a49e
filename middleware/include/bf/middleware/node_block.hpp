// The block Node of middlewares whose programs are nodes.
#pragma once

#include "bf/core/block.hpp"
#include "bf/middleware/names.hpp"

#include <string>
#include <vector>

namespace bf::middleware {

class NodeBlock : public Block {
  public:
    NodeBlock(const Arguments& arguments, const NameRules& rules);

    Argument<std::string> name{this, "name", {.initial = "blockfactory", .doc = "of the node"}};
    Argument<std::string> name_space{
        this, "namespace", {.initial = "/", .doc = "in which names are that do not begin with /"}};
    Argument<std::vector<std::string>> remap{
        this, "remap", {.doc = "names that stand for others, each as from:=to"}};
    Argument<bool> use_sim_time{
        this,
        "use_sim_time",
        {.initial = false, .doc = "time is what a simulator sends on /clock, 0 until it does"}};
};

} // namespace bf::middleware
