// Runs one block alone: sizes are offered as wiring would, then phases are called as an engine would.
#pragma once

#include "bf/core/context.hpp"
#include "bf/core/registry.hpp"
#include "bf/core/resolve.hpp"

#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

namespace bf::test {

/// Size of a scalar, [n] or n x m.
inline Size scalar_size() { return {}; }
inline Size vector_size(int n) { return {n, 1, false}; }
inline Size matrix_size(int rows, int cols) { return {rows, cols, true}; }

/// A handle: copies share one block and its data.
class RunBlock {
  public:
    double period = 0.01;

    /// Throws std::runtime_error with the problems of the arguments.
    explicit RunBlock(const BlockClass& block_class, const Arguments& arguments = {})
        : methods_(block_class.methods), block_(block_class.make(arguments)) {
        std::string problems;
        for (const auto& problem : declaration().problems) problems += problem + "\n";
        if (!problems.empty()) throw std::runtime_error(problems);
    }

    const Block& block() const { return *block_; }
    const Declaration& declaration() const { return block_->declaration(); }

    /// Size and type of what is wired to an input or given for a parameter.
    RunBlock& wire(const std::string& name, Size size) {
        offer(block_->declaration(), index(name), size);
        return *this;
    }
    RunBlock& wire(const std::string& name, Size size, Type type) {
        offer(block_->declaration(), index(name), type);
        return wire(name, size);
    }
    /// Infers the rest (what nothing decides has its declared initial value's size and type double), then
    /// allocates and resets. Throws ResolutionError.
    RunBlock& start() {
        auto& d = block_->declaration();
        propagate(*block_);
        for (std::size_t i = 0; i < d.slots.size(); ++i) {
            const auto& slot = d.slots[i];
            const bool has_value =
                slot.role == Role::parameter || (slot.role == Role::input && slot.optional);
            if (has_value && !slot.size_known)
                offer(d, static_cast<int>(i),
                      vector_size(std::max(1, static_cast<int>(slot.initial.size()))));
            propagate(*block_);
        }
        for (std::size_t i = 0; i < d.slots.size(); ++i)
            if (!d.slots[i].type_known) {
                offer(d, static_cast<int>(i), Type::float64);
                propagate(*block_);
            }
        if (const auto open = unresolved(d); !open.empty())
            throw ResolutionError("size of '" + d.slots[static_cast<std::size_t>(open[0])].name +
                                  "' is unknown");
        context_ = std::make_shared<Context>(std::vector<Node>{{block_.get(), methods_, {}, {}, 0}});
        for (const Phase phase : {Phase::output, Phase::update})
            for (int i = 0; i < context_->activities(0, phase); ++i)
                tasks(phase).push_back(context_->task(0, phase, i));
        return reset();
    }

    /// Writes an input or parameter, column by column; one value expands.
    RunBlock& set(const std::string& name, const std::vector<double>& values) {
        const Slot& slot = declaration().slots[static_cast<std::size_t>(index(name))];
        if (values.size() != 1 && static_cast<int>(values.size()) != slot.size.count())
            throw std::runtime_error("'" + name + "' has size " + slot.size.text());
        write_values(context_->data(0, index(name)), slot.type, slot.size.count(), values);
        return *this;
    }
    RunBlock& set(const std::string& name, const Matrix& value) {
        return set(name, std::vector<double>(value.data(), value.data() + value.size()));
    }
    RunBlock& reset() {
        if (const Status s = context_->reset(0); !s) throw std::runtime_error(s.text());
        context_->clock(0) = {0, period, 0};
        return *this;
    }

    Status output() { return run(output_tasks_); }
    Status update() { return run(update_tasks_); }
    void commit() {
        context_->commit(0);
        auto& clock = context_->clock(0);
        ++clock.step;
        clock.time = static_cast<double>(clock.step) * period;
    }
    /// One whole step; stops at the first failure.
    Status step() {
        if (Status s = output(); !s) return s;
        if (Status s = update(); !s) return s;
        commit();
        return ok;
    }
    /// Sets `input` to each value in turn and returns the output `name` of each step, read before the update.
    std::vector<double> respond(const std::string& input, const std::vector<double>& values,
                                const std::string& name = "y") {
        std::vector<double> result;
        for (const double value : values) {
            set(input, {value});
            if (!output()) throw std::runtime_error("a step failed");
            result.push_back(scalar(name));
            if (!update()) throw std::runtime_error("a step failed");
            commit();
        }
        return result;
    }

    Matrix get(const std::string& name) const {
        const Slot& slot = declaration().slots[static_cast<std::size_t>(index(name))];
        Matrix value(slot.size.rows, slot.size.cols);
        for (int i = 0; i < slot.size.count(); ++i)
            value.data()[i] = read_value(context_->data(0, index(name)), slot.type, i);
        return value;
    }
    double scalar(const std::string& name) const { return get(name)(0, 0); }
    Size size(const std::string& name) const {
        return declaration().slots[static_cast<std::size_t>(index(name))].size;
    }
    Type type(const std::string& name) const {
        return declaration().slots[static_cast<std::size_t>(index(name))].type;
    }
    Context& context() { return *context_; }
    int index(const std::string& name) const {
        // A state may bear the name of a port: ports first.
        for (const Role role : {Role::input, Role::output, Role::parameter})
            if (const int i = declaration().find(name, role); i >= 0) return i;
        const int i = declaration().find(name);
        if (i < 0) throw std::runtime_error("no quantity '" + name + "'");
        return i;
    }

  private:
    std::vector<Task>& tasks(Phase phase) { return phase == Phase::output ? output_tasks_ : update_tasks_; }
    static Status run(const std::vector<Task>& tasks) {
        for (const Task& task : tasks)
            if (Status s = task(); !s) return s;
        return ok;
    }

    Block::Methods methods_;
    std::shared_ptr<Block> block_;
    std::shared_ptr<Context> context_;
    std::vector<Task> output_tasks_, update_tasks_;
};

} // namespace bf::test
