#include "injection.hpp"

#include <algorithm>
#include <set>

namespace bf::analysis {

Injection::Injection(Simulation& run, const Element& at, std::function<double(double)> added)
    : run_(run), added_(std::move(added)) {
    const Diagram& d = run.diagram();
    const Slot& slot = d.slot(at.end);
    if (is_state(slot.role))
        throw RunError("'" + at.name +
                       "' is a state, to which nothing is added and which nobody reads as a signal; name an "
                       "output of its block, or what it follows from");
    if (slot.type != Type::float64 && slot.type != Type::float32)
        throw RunError("'" + at.name + "' is of type " + name(slot.type) +
                       ", to which nothing is added; choose a signal of real numbers");
    data_ =
        static_cast<std::byte*>(run.context().data(at.end.node, at.end.slot)) + at.number * bytes(slot.type);
    is_double_ = slot.type == Type::float64;
    begin();
    const auto& node = d.nodes[static_cast<std::size_t>(at.end.node)];
    // No step computes an input of the root and what is constant: there it is added before each reader.
    const bool is_computed = !node.block->declaration().traits.is_root_input &&
                             !d.rates[static_cast<std::size_t>(node.rate)].is_constant;
    std::set<std::string> nodes;
    if (is_computed) nodes.insert(node.path);
    for (const auto& reader : d.nodes) {
        const bool reads = std::any_of(reader.sources.begin(), reader.sources.end(), [&](const auto& source) {
            return source.node == at.end.node && source.slot == at.end.slot;
        });
        if (is_computed || !reads) continue;
        if (d.rates[static_cast<std::size_t>(reader.rate)].is_constant)
            throw RunError("'" + at.name + "' is constant, and so is '" + reader.path +
                           "', which reads it: both are computed before the first step; name a signal that "
                           "is computed in each one");
        nodes.insert(reader.path);
    }
    if (nodes.empty()) throw RunError("nobody reads '" + at.name + "': what is added there changes nothing");
    run.visit_tasks([&](Task& task, Phase phase, const std::string& block, int rate) {
        if (!nodes.contains(block)) return;
        wrapped_.push_back(std::make_unique<Wrapped>(Wrapped{this, task, &run.context().clock(rate), phase}));
        task = {is_computed ? run_computing : run_reading, wrapped_.back().get(), 0};
    });
}

Injection::~Injection() {
    run_.visit_tasks([&](Task& task, Phase, const std::string&, int) {
        if (task.run != run_computing && task.run != run_reading) return;
        const auto& wrapped = *static_cast<const Wrapped*>(task.data);
        if (wrapped.injection == this) task = wrapped.task;
    });
    put(own_);
}

Status Injection::run_computing(const void* data, int) noexcept {
    const auto& wrapped = *static_cast<const Wrapped*>(data);
    Injection& self = *wrapped.injection;
    self.put(self.own_);
    const Status status = wrapped.task();
    if (wrapped.phase == Phase::output) {
        self.own_ = self.get();
        self.now_ = self.added_(wrapped.clock->time);
    }
    self.put(self.own_ + self.now_);
    return status;
}

Status Injection::run_reading(const void* data, int) noexcept {
    const auto& wrapped = *static_cast<const Wrapped*>(data);
    Injection& self = *wrapped.injection;
    self.put(self.own_ + self.added_(wrapped.clock->time));
    return wrapped.task();
}

double Injection::get() const {
    return is_double_ ? *static_cast<const double*>(data_) : *static_cast<const float*>(data_);
}
void Injection::put(double value) {
    if (is_double_)
        *static_cast<double*>(data_) = value;
    else
        *static_cast<float*>(data_) = static_cast<float>(value);
}

} // namespace bf::analysis
