// Runs one block alone: sizes are offered as wiring would, then phases are called as an engine would.
#pragma once

#include "bf/core/instance.hpp"

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
        : instance_(std::make_shared<Instance>(block_class, arguments)) {}

    const Block& block() const { return instance_->block(); }
    const Declaration& declaration() const { return instance_->declaration(); }
    const Resolution& resolution() const { return instance_->resolution(); }
    Instance& instance() { return *instance_; }

    /// Size and type of what is wired to an input, or of a parameter, whose values are set later.
    RunBlock& wire(const std::string& name, Size size) {
        Resolution& r = instance_->block().resolution();
        offer(r, index(name), size);
        auto& initial = r.slots[static_cast<std::size_t>(index(name))].initial;
        if (static_cast<int>(initial.size()) != size.count()) initial.clear();
        return *this;
    }
    RunBlock& wire(const std::string& name, Size size, Type type) {
        offer(instance_->block().resolution(), index(name), type);
        return wire(name, size);
    }
    /// Infers and decides the rest, then allocates and resets. Throws std::runtime_error.
    RunBlock& start() {
        instance_->settle();
        instance_->open();
        return reset();
    }

    /// Writes an input or parameter, column by column; one value expands.
    RunBlock& set(const std::string& name, const std::vector<double>& values) {
        const Slot& slot = instance_->slot(index(name));
        if (values.size() != 1 && static_cast<int>(values.size()) != slot.size.count())
            throw std::runtime_error("'" + name + "' has size " + slot.size.text());
        write_values(instance_->data(index(name)), slot.type, slot.size.count(), values);
        return *this;
    }
    RunBlock& set(const std::string& name, const Matrix& value) {
        return set(name, std::vector<double>(value.data(), value.data() + value.size()));
    }
    RunBlock& reset() {
        if (const Status s = instance_->reset(); !s) throw std::runtime_error(s.text());
        instance_->clock() = {0, period, 0};
        return *this;
    }

    Status output() { return instance_->run(Phase::output); }
    Status update() { return instance_->run(Phase::update); }
    void commit() {
        instance_->commit();
        auto& clock = instance_->clock();
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
        const Slot& slot = instance_->slot(index(name));
        Matrix value(slot.size.rows, slot.size.cols);
        for (int i = 0; i < slot.size.count(); ++i)
            value.data()[i] = read_value(instance_->data(index(name)), slot.type, i);
        return value;
    }
    double scalar(const std::string& name) const { return get(name)(0, 0); }
    Size size(const std::string& name) const { return instance_->slot(index(name)).size; }
    Type type(const std::string& name) const { return instance_->slot(index(name)).type; }
    Context& context() { return instance_->context(); }
    int index(const std::string& name) const {
        // A state may bear the name of a port: ports first.
        for (const Role role : {Role::input, Role::output, Role::parameter})
            if (const int i = declaration().find(name, role); i >= 0) return i;
        const int i = declaration().find(name);
        if (i < 0) throw std::runtime_error("no quantity '" + name + "'");
        return i;
    }

  private:
    std::shared_ptr<Instance> instance_;
};

} // namespace bf::test
