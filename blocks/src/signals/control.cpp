// Blocks that control when subsystems run.
#include "../groups.hpp"
#include "../shapes.hpp"
#include "bf/kernels/guards.hpp"
#include "bf/kernels/standard.hpp"

#include <vector>

namespace bf::blocks {

namespace {

/// The output of the subsystem that ran last.
class Merge final : public Block {
  public:
    explicit Merge(const Arguments& arguments) : Block(arguments) { declare({.merges = true}); }
    Argument<int> inputs{this,
                         "inputs",
                         {.initial = 2,
                          .minimum = 1,
                          .maximum = most_ports,
                          .doc = "number of conditional subsystems that it merges"}};
    AnyShape s{this};
    InputList<> u{this, "u", *inputs, {.shape = s, .unit = any_unit}};
    Output<> y{
        this, "y", {.shape = s, .unit = any_unit, .doc = "of the subsystem that ran last; 0 before any ran"}};
    std::vector<OutputRule> rules = [this] {
        std::vector<OutputRule> made;
        for (const auto& input : u) made.emplace_back(this, kernels::Copy{}, y, input);
        return made;
    }();
};

/// The number of the iteration of the loop around it, which resets it in each step.
class Iteration final : public Block {
  public:
    explicit Iteration(const Arguments& arguments) : Block(arguments) { declare({.counts = true}); }
    Output<double> y{this, "y", {.doc = "1 in the first iteration of a step"}};
    DiscreteState<double> number{this, "number", {.initial = {1}, .doc = "of the iteration"}};
    OutputRule output_rule{this, kernels::Copy{}, y, number};
    UpdateRule update_rule{this, kernels::Add{}, next(number), number, Constants({1})};
};

/// Decides whether the while subsystem around it runs again.
class While final : public Block {
  public:
    explicit While(const Arguments& arguments) : Block(arguments) {
        declare({.again = condition.index(), .begin = initial.index(), .most = most.index()});
    }
    Input<> condition{
        this, "condition", {.unit = any_unit, .doc = "above 0: another iteration", .feedthrough = false}};
    Input<Other> initial{this,
                         "initial",
                         {.initial = {1},
                          .unit = any_unit,
                          .doc = "from outside, above 0: there is a first iteration",
                          .feedthrough = false,
                          .optional = true}};
    Parameter<double> most{
        this, "most", {.initial = {1000}, .minimum = 1, .doc = "iterations after which the step fails"}};
};

/// Exactly one output is true: that of the first true condition, else the last one.
class If final : public Block {
  public:
    using Block::Block;
    Argument<int> conditions{this,
                             "conditions",
                             {.initial = 1,
                              .minimum = 1,
                              .maximum = most_ports,
                              .doc = "number of conditions: if, then each elseif"}};
    InputList<bool> u{this, "u", *conditions, {.doc = "condition"}};
    OutputList<bool> y{this, "y", u.size() + 1, {.doc = "enables the action; the last one is else"}};
    std::vector<OutputRule> rules = [this] {
        std::vector<OutputRule> made;
        for (int i = 0; i < y.size(); ++i)
            made.emplace_back(this, kernels::IsFirst{}, y[i], Constants({static_cast<double>(i)}), u);
        return made;
    }();
};

/// Exactly one output is true: that of the case which the selector equals, else the last one.
class SwitchCase final : public Block {
  public:
    using Block::Block;
    Argument<std::vector<int>> cases{this, "cases", {.initial = {1}, .doc = "whole number of each case"}};
    Input<> u{this, "u", any(scalar, "selector, cut to a whole number")};
    OutputList<bool> y{this,
                       "y",
                       static_cast<int>(cases->size()) + 1,
                       {.doc = "enables the action; the last one is the default"}};
    GuardOf<std::int32_t> at_change{this, "at_change", {.doc = "number of the case wanted"}};
    GuardRule guard{this, kernels::WholeNumber{}, at_change, u};
    std::vector<OutputRule> rules = [this] {
        const Constants numbers(std::vector<double>(cases->begin(), cases->end()));
        std::vector<OutputRule> made;
        for (int i = 0; i < y.size(); ++i)
            made.emplace_back(this, kernels::IsCase{}, y[i], Constants({static_cast<double>(i)}), numbers, u);
        return made;
    }();
};

/// Calls function-call subsystems once in each of its periods.
class FunctionCallGenerator final : public Block {
  public:
    using Block::Block;
    Output<bool> y{this, "y", {.doc = "drives `trigger` of a subsystem with `trigger: function_call`"}};
    // It reads the time, so that it is no constant.
    OutputRule rule{this, kernels::AlwaysTrue{}, y, at_time};
};

} // namespace

void add_control(Library& library) {
    library.group("control")
        .add<Merge>("Merge", "The output of the conditional subsystem that ran last.")
        .add<Iteration>("Iteration", "The number of the iteration of the loop around it.")
        .add<While>("While", "Decides whether the while subsystem around it runs again.")
        .add<If>("If", "Enables one of several subsystems: the first whose condition is true.")
        .add<SwitchCase>("SwitchCase", "Enables one of several subsystems by a number.")
        .add<FunctionCallGenerator>("FunctionCallGenerator",
                                    "Calls subsystems with `trigger: function_call`.");
}

} // namespace bf::blocks
